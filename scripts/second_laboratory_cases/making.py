"""How a case is made: loads and background are sized, nominal values drawn, and what the nominal model leaves is found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from bench.arrays import Array
from second_laboratory_cases.case import Case, Record
from second_laboratory_cases.setups import Excited, Signals, System


@dataclass(frozen=True)
class Sizes:
    """Sizes of what a case holds, as fractions of the response.

    Attributes:
        effect: RMS of what the missing effect makes of it.
        background: RMS of what the background makes of it.
        unfitted: NRMSE that the nominal model leaves on the validation record.
        fitted: The same after its parameters were fitted within their uncertainty.
    """

    effect: float
    background: float
    unfitted: float
    fitted: float


@dataclass(frozen=True)
class Made:
    """A case as it was made.

    Attributes:
        case: What describes it.
        system: What was simulated.
        nominal: Nominal values of the parameters.
        signals: Of each record, without noise.
        sizes: Of what it holds.
    """

    case: Case
    system: System
    nominal: Mapping[str, float]
    signals: Sequence[Signals]
    sizes: Sizes


@dataclass(frozen=True)
class Test:
    """The records of a case as they are excited.

    Attributes:
        case: What describes it.
        excited: Excitation of each record.
        fine: Steps of the integration a sample.
        coarse: The same where only sizes are sought.
    """

    __test__ = False
    case: Case
    excited: Sequence[Excited]
    fine: int
    coarse: int

    def signals(self, system: System, substeps: int) -> list[Signals]:
        """What is measured of a system in each record."""
        return [
            simulated(self.case, record, system, excited, substeps)
            for record, excited in zip(self.case.records, self.excited, strict=True)
        ]

    def response(self, system: System, substeps: int) -> Array:
        """Response of all records, one after another."""
        return joined(self.case, self.signals(system, substeps))


def simulated(case: Case, record: Record, system: System, excited: Excited, substeps: int) -> Signals:
    """What is measured of a system in one record."""
    properties = system.properties._replace(harmonic_phase=record.phase)
    return case.setup.signals(system._replace(properties=properties), excited, substeps)


def joined(case: Case, signals: Sequence[Signals]) -> Array:
    """Response of some records, one after another."""
    return np.concatenate([each[case.setup.response] for each in signals])


def rms(x: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def corrected(value: float, wanted: float, found: float, exponent: float) -> float:
    """A factor, multiplied by a power of the wanted size over the one that was found with it, at least 0.2 and at most 5."""
    return value * float(np.clip((wanted / found) ** exponent, 0.2, 5.0))


def amplitude(case: Case, record: Record, samples: Array, substeps: int) -> float:
    """Size of an excitation (n,) of unit size under which the motion of the complete system has the wanted peak."""
    if not (case.setup.scaled and samples.any()):
        return record.peak
    load = record.peak * case.truth.stiffness if case.first_load is None else case.first_load
    for _ in range(9):
        excited = Excited(samples * load, case.rate, record.start)
        moved = simulated(case, record, case.complete(), excited, substeps)[case.setup.motion]
        load = corrected(load, record.peak, max(float(np.max(np.abs(moved))), 1e-12), 0.7)
    return load


def tested(case: Case, rng: np.random.Generator) -> Test:
    """The records of a case, excited so that they have the wanted size."""
    fine = max(10, math.ceil(15_000 / case.rate))
    coarse = 8 if case.rate > 200 else math.ceil(4_000 / case.rate)
    excited = []
    for record in case.records:
        rate = case.rate * case.setup.excitation_steps(case.rate)
        samples = case.setup.excitation(rng, record.excitation.sample(rng, record.seconds, rate), record.peak)
        load = amplitude(case, record, samples, coarse)
        excited.append(Excited(samples * load, case.rate, record.start))
    return Test(case, excited, fine, coarse)


def background_factor(test: Test, effect: float, size: float) -> float:
    """Factor of the background with which it has the wanted size, within a tenth where five tries suffice."""
    case = test.case
    steps = max(10, test.coarse)
    alone = test.response(case.complete(), steps)
    wanted = case.background_share * (effect if case.misses_something() else 1.0)
    factor = 1.0
    for _ in range(5):
        found = rms(test.response(case.complete(factor), steps) - alone) / size
        if abs(found / wanted - 1.0) < 0.1:
            break
        factor = corrected(factor, wanted, max(found, 1e-9), 0.8)
    return factor


def drawn(case: Case, rng: np.random.Generator) -> dict[str, float]:
    """Nominal values of the parameters: off by their stated uncertainty, and by at most 1.3 of it."""
    values = {}
    for key, p in case.parameters.items():
        off = float(np.clip(rng.standard_normal(), -1.3, 1.3))
        values[key] = float(f"{p.true_value(case.truth) * (1.0 + off * p.relative):.6g}")
    return values


def left_by_nominal(
    test: Test, nominal: Mapping[str, float], signals: Sequence[Signals], size: float
) -> tuple[float, float]:
    """NRMSE of the nominal model on the validation record, as it is and with its parameters fitted to the other records.

    Args:
        test: The records as they are excited.
        nominal: Nominal values of the parameters.
        signals: What was measured of each record.
        size: By which errors are divided.
    """
    case = test.case
    fitted = {key: p for key, p in case.parameters.items() if p.of and p.fitted}
    validation = [record.stem.startswith("validation") for record in case.records]

    def residuals(off: Array, *, validating: bool) -> Array:
        """Errors of the response over the size with parameters that are off by multiples of their uncertainty."""
        values = {
            p.of: nominal[key] * (1.0 + each * p.relative) + p.beside
            for (key, p), each in zip(fitted.items(), off.tolist(), strict=True)
        }
        system = System(case.truth._replace(**values))
        parts = zip(case.records, test.excited, signals, validation, strict=True)
        errors = [
            simulated(case, record, system, excited, test.coarse)[case.setup.response]
            - seen[case.setup.response]
            for record, excited, seen, validates in parts
            if validates == validating
        ]
        return np.concatenate(errors) / size

    def penalised(off: Array) -> Array:
        """The residuals, as ten thousand samples with an error of half their size each, and the prior of the parameters."""
        errors = residuals(off, validating=False)
        return np.concatenate([errors * math.sqrt(1e4 / len(errors)) / 0.5, off])

    start = np.zeros(len(fitted))
    judged = joined(case, [seen for seen, validates in zip(signals, validation, strict=True) if validates])
    of_response = float(np.std(judged)) / size
    best = least_squares(penalised, start, max_nfev=4, bounds=(-3.0, 3.0), diff_step=0.05).x
    unfitted, after = (rms(residuals(off, validating=True)) / of_response for off in (start, best))
    return unfitted, after


def made(case: Case, rng: np.random.Generator) -> Made:
    """A case, its random numbers drawn in a fixed order: excitations, then nominal values."""
    test = tested(case, rng)
    with_effect = test.response(case.complete(), test.fine)
    size = float(np.std(with_effect))
    effect = rms(with_effect - test.response(case.nominal(), test.fine)) / size
    system = case.complete(background_factor(test, effect, size))
    signals = test.signals(system, test.fine)
    background = rms(joined(case, signals) - with_effect) / size
    nominal = drawn(case, rng)
    left = left_by_nominal(test, nominal, signals, size)
    return Made(case, system, nominal, signals, Sizes(effect, background, *left))
