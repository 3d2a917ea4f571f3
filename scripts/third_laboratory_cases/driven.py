"""An oscillator that a load drives, or a table that shakes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.case import Case, Record, Signals, Simulated, Sizes, Specimen, of_validation
from third_laboratory_cases.linear import oscillator_response
from third_laboratory_cases.oscillator import Background, Motion, Oscillator, march, scaled
from third_laboratory_cases.signals import RecordSignal
from third_laboratory_cases.sizing import background_factor, left_after_fit, rms


class Excited(NamedTuple):
    """A record as it is excited, on the fine clock."""

    record: Record
    t: Array
    """Times [s] (n,)."""
    load: Array
    """Load [N] that is measured (n,)."""
    schedule: Array
    """Scheduling signal (n,); zero where there is none."""
    hidden: Array
    """Load [N] that no channel tells (n,)."""


@dataclass(frozen=True, kw_only=True)
class Driven(Specimen):
    """An oscillator that a load drives.

    A table that shakes it with an acceleration drives it with minus its inertia times that, which is the signal "base".

    Attributes:
        nominal: Its properties as a nominal model has them, with true values.
        missing: Properties that it has besides, by name.
        background: Small physics besides, whose size is sought.
        schedule: The scheduling signal.
        hidden: A load that no channel tells, which is missing as well.
    """

    nominal: Oscillator
    missing: Mapping[str, float] = field(default_factory=dict)
    background: Background
    schedule: RecordSignal | None = None
    hidden: RecordSignal | None = None

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        mass, damping, stiffness, *_ = self.nominal
        return {"mass": mass, "damping": damping, "stiffness": stiffness}

    def moved(self, excited: Excited, factor: float, stride: int = 1, *, complete: bool = True) -> Motion:
        """Motion in a record, with its background times a factor, integrated at each `stride`-th step."""
        p = self.nominal._replace(**self.missing) if complete else self.nominal
        load = excited.load + excited.hidden if complete else excited.load
        h = stride * excited.t[1]
        b = scaled(self.background, factor)
        return march(p, b, load[::stride], excited.schedule[::stride], h, excited.record.start)

    def excited(self, case: Case, record: Record, rng: np.random.Generator) -> Excited:
        """A record whose load is so large that the motion without hidden load and background nears the wanted peak."""
        t = record.times(case.rate * case.substeps)
        shape, zero = record.excitation(rng, t), np.zeros(len(t))
        schedule, hidden = (
            zero if each is None else each(rng, t, record.stem) for each in (self.schedule, self.hidden)
        )
        if not shape.any():
            return Excited(record, t, shape, schedule, hidden)
        shape /= np.max(np.abs(shape))
        load = 0.2 * self.nominal.stiffness * record.peak
        for _ in range(7):
            tried = Excited(record, t, shape * load, schedule, zero)
            largest = np.max(np.abs(self.moved(tried, 0.0, max(1, case.substeps // 4)).displacement))
            load *= float(np.clip((record.peak / max(largest, 1e-6)) ** 0.75, 0.25, 4.0))
        return Excited(record, t, shape * load, schedule, hidden)

    def sized(self, case: Case, excited: list[Excited], size: float) -> float:
        """Factor of the background with which it has the wanted size, as a fraction of the response."""
        judged = [each for each in excited if each.record.validates()]
        stride = max(1, case.substeps // 5)

        def response(factor: float) -> Array:
            return np.concatenate([self.moved(each, factor, stride).displacement for each in judged])

        alone = response(0.0)
        return background_factor(
            lambda factor: rms(response(factor) - alone) / size,
            case.background_share,
            tries=5,
            tolerance=0.12,
        )

    def simulated(self, case: Case, rng: np.random.Generator) -> Simulated:
        """As of `Specimen.simulated`."""
        excited = [self.excited(case, record, rng) for record in case.records]
        every = slice(None, None, case.substeps)

        def response(*, complete: bool) -> Array:
            judged = [each for each in excited if each.record.validates()]
            motions = [self.moved(each, 0.0, complete=complete).displacement for each in judged]
            return np.concatenate([x[every] for x in motions])

        full = response(complete=True)
        size = float(np.std(full))
        effect = rms(full - response(complete=False)) / size
        factor = self.sized(case, excited, size)
        signals: dict[str, Signals] = {}
        for each in excited:
            x, v = self.moved(each, factor)
            a = np.gradient(v, each.t[1])
            load = each.load[every]
            measured = {"load": load, "base": load / -self.nominal.mass, "schedule": each.schedule[every]}
            moved = {"displacement": x[every], "velocity": v[every], "acceleration": a[every]}
            signals[each.record.stem] = case.transmitted({**measured, **moved})
        background = rms(of_validation(case, signals, "displacement") - full) / size
        left = left_by_nominal(case, signals, size)
        return Simulated(signals, Sizes(effect, background, left))


def left_by_nominal(case: Case, signals: Mapping[str, Signals], size: float) -> float | None:
    """NRMSE that the fitted nominal model leaves; None where a record does not begin at rest."""
    if any(record.start != 0.0 for record in case.records):
        return None

    def errors(values: Mapping[str, float], validating: bool) -> Array:
        judged = [signals[r.stem] for r in case.records if r.validates() == validating]
        parts = [
            each["displacement"] - oscillator_response(**values, load=each["load"], rate=case.rate)
            for each in judged
        ]
        return np.concatenate(parts) / size

    return left_after_fit(case, errors)
