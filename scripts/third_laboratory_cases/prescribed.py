"""A component whose motion a machine prescribes; its force follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.case import Case, Signals, Simulated, Sizes, Specimen, of_validation
from third_laboratory_cases.signals import TURN, RecordSignal
from third_laboratory_cases.sizing import left_after_fit, rms


class Stroke(NamedTuple):
    """A prescribed motion on the fine clock, in units of a translation."""

    t: Array
    """Times [s] (n,)."""
    x: Array
    """Displacement [m] (n,)."""
    v: Array
    """Velocity [m/s] (n,)."""
    schedule: Array
    """Scheduling signal (n,); zero where there is none."""


@dataclass(frozen=True, kw_only=True)
class SmallForces:
    """Small forces that no nominal model has, in proportion.

    Attributes:
        period: Of a friction that varies along the stroke [m].
        swing: Weight of a slow swing of the stiffness.
        swing_frequency: Its frequency [Hz].
        ageing: Weight of a damping that grows with time [1/s].
    """

    period: float
    swing: float = 1.0
    swing_frequency: float = 0.07
    ageing: float = 0.0

    def force(self, stroke: Stroke) -> Array:
        """Their sum (n,), the friction with an amplitude of one."""
        t, x, v, _ = stroke
        friction = np.cos(TURN * x / self.period) * np.sign(v)
        swinging = self.swing * np.sin(TURN * self.swing_frequency * t) * x / np.max(np.abs(x))
        return friction + swinging + self.ageing * t * v / np.max(np.abs(v))


@dataclass(frozen=True, kw_only=True)
class Component(Specimen):
    """A component on a testing machine.

    Attributes:
        stiffness: Of the nominal model [N/m].
        damping: Of the nominal model [N s/m].
        coulomb: Coulomb friction of the nominal model [N].
        missing: Force [N] that it misses (n,).
        background: Small forces besides, whose size is sought.
        schedule: The scheduling signal.
    """

    stiffness: float
    damping: float
    coulomb: float
    missing: Callable[[Stroke], Array]
    background: SmallForces
    schedule: RecordSignal | None = None

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        return {"stiffness": self.stiffness, "damping": self.damping, "coulomb": self.coulomb}

    def strokes(self, case: Case, rng: np.random.Generator) -> dict[str, Stroke]:
        """Prescribed motions of the records."""
        found = {}
        for record in case.records:
            t = record.times(case.rate * case.substeps)
            y = record.excitation(rng, t)
            x = y / np.max(np.abs(y)) * record.peak
            schedule = np.zeros(len(t)) if self.schedule is None else self.schedule(rng, t, record.stem)
            found[record.stem] = Stroke(t, x, np.gradient(x, t[1]), schedule)
        return found

    def simulated(self, case: Case, rng: np.random.Generator) -> Simulated:
        """As of `Specimen.simulated`."""
        signals: dict[str, Signals] = {}
        for stem, stroke in self.strokes(case, rng).items():
            missing = self.missing(stroke)
            fine = {
                "displacement": stroke.x,
                "velocity": stroke.v,
                "schedule": stroke.schedule,
                "missing": missing,
                "background": self.background.force(stroke),
                "force": nominal_force(self.stated_values(), stroke.x, stroke.v) + missing,
            }
            signals[stem] = {name: values[:: case.substeps] for name, values in fine.items()}
        size = float(np.std(of_validation(case, signals, "force")))
        effect = rms(of_validation(case, signals, "missing")) / size
        factor = case.background_share * size / rms(of_validation(case, signals, "background"))
        for each in signals.values():
            each["force"] = each["force"] + factor * each["background"]

        def errors(values: Mapping[str, float], validating: bool) -> Array:
            judged = [signals[r.stem] for r in case.records if r.validates() == validating]
            parts = [
                each["force"] - nominal_force(values, each["displacement"], each["velocity"])
                for each in judged
            ]
            return np.concatenate(parts) / size

        return Simulated(signals, Sizes(effect, case.background_share, left_after_fit(case, errors)))


def nominal_force(values: Mapping[str, float], x: Array, v: Array) -> Array:
    """Force [N] of the nominal model along a motion (n,)."""
    return values["stiffness"] * x + values["damping"] * v + values["coulomb"] * np.sign(v)
