"""Whether what an explanation leaves is noise at every frequency, or a motion that something unnamed makes.

Encoders are noisy at all frequencies, and a robot moves at the lowest few. What a wrong law leaves there may be twice the noise and yet
hardly raise its mean square. So the power of the whitened innovations below a frequency, octave by octave, is held against that of white
noise. With m ordinates of the periodogram and their mean x, in units of what noise and the uncertainty of the parameters leave, the log
likelihood grows by ``m (x - 1 - ln x)`` if their scale may be another: ordinates of white noise are exponential, each on its own.

Asked of the judging records, and of joints that a servo holds, whose noise is that of their encoder. Where a torque drives a joint, what
smoothing loses of the others' motion acts on it as well: draws of the noise leave up to four times less there, on a six-axis arm without
fault, than that does.

Innovations are corrected at every sample. A noisy torque, or a damping that lets the joint creep, may explain each of them where none
explains where the joint ends, so that free runs are asked as well (`astray`).

References:
    M. S. Bartlett, *An Introduction to Stochastic Processes*, 1955, section 9.2 (whiteness by the cumulated periodogram);
    A. Gelman, X.-L. Meng, H. Stern, Statistica Sinica 6 (1996) 733-807 (checks by what the posterior predicts).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.articulated_judgement.predicted_errors import PredictedErrors, runs_of
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings


class Coloured(NamedTuple):
    """What is left of a joint's motion in a record where noise would leave less.

    Attributes:
        joint: Its index.
        record: Name of the record.
        below: Frequency below which it lies [Hz].
        power: Its power over that of noise there.
        odds: Log odds for it against noise alone.
    """

    joint: int
    record: str
    below: float
    power: float
    odds: float


def coloured(
    problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings
) -> Coloured | None:
    """What a fit leaves beyond noise in the records of a problem, the surest; None where it is noise."""
    settled = problem.settled(found.hypothesis, found.vector)
    sure = [one for one in _beyond(settled, found, settings) if one.odds > settings.certain]
    return max(sure, key=lambda one: one.odds, default=None)


class Astray(NamedTuple):
    """A joint whose free runs end where neither noise nor the uncertainty of the parameters brings it.

    Attributes:
        joint: Its index.
        error: NRMSE of its free runs.
        times: That over what noise and uncertainty leave.
    """

    joint: int
    error: float
    times: float


def astray(
    problem: ArticulatedProblem,
    found: ArticulatedFit,
    predicted: PredictedErrors,
    settings: JudgementSettings,
) -> Astray | None:
    """The joint whose free runs in the records of a problem go astray most; None where none does.

    Args:
        problem: Records for judging.
        found: An explanation.
        predicted: What it predicts of them.
        settings: Thresholds.
    """
    error = predicted.discrepancy
    if not np.any(error > settings.astray * predicted.floor):
        return None
    runs, joints = runs_of(problem), range(len(problem.joints))

    def errors(vector: Array) -> list[Array]:
        motions = problem.motions(found.hypothesis, vector)
        return in_threads(
            lambda j: np.concatenate([runs.errors(j, found.hypothesis, vector, m) for m in motions]), joints
        )

    best, spread = errors(found.vector), np.zeros(len(problem.joints))
    draws = _draws(problem, found, settings)
    for vector in draws:
        moved = zip(errors(vector), best, runs.sizes, strict=True)
        spread += [float(np.mean(((a - b) / size) ** 2)) / len(draws) for a, b, size in moved]
    times = error / np.sqrt(predicted.floor**2 + spread)
    j = int(np.argmax(times))
    return Astray(j, float(error[j]), float(times[j])) if times[j] > settings.astray else None


def _beyond(
    problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings
) -> Iterator[Coloured]:
    """The power left of every joint that a servo holds in every record, below every frequency that is looked at."""
    lefts = _spectra(problem, found, found.vector)
    others = [_spectra(problem, found, vector) for vector in _draws(problem, found, settings)]
    for (r, j), left in lefts.items():
        prepared, drive = problem.records[r], problem.joints[j].drive
        if drive is None or not drive.servo:
            continue
        noise = np.sum(prepared.joints[j].weight ** 2, axis=0)
        spread = np.mean([np.abs(other[r, j] - left) ** 2 for other in others], axis=0)
        over = np.abs(left) ** 2 / (noise + spread)
        length = len(prepared.record) * prepared.record.step
        for k in _octaves(len(left), settings.ordinates):
            power = float(np.mean(over[:k]))
            x = power / (1.0 + settings.noise_known) ** 2
            odds = over[:k].size * (x - 1.0 - np.log(x)) if x > 1.0 else 0.0
            yield Coloured(j, prepared.record.name, k / length, power, float(odds))


def _octaves(ordinates: int, least: int) -> list[int]:
    """Numbers of the lowest ordinates that are looked at: all, and half as many again and again."""
    out = []
    while ordinates >= least:
        out.append(ordinates)
        ordinates //= 2
    return out


def _spectra(
    problem: ArticulatedProblem, found: ArticulatedFit, vector: Array
) -> dict[tuple[int, int], NDArray[np.complex128]]:
    """By record and joint: Fourier transforms (n_ordinates, n_measured) of the weighted innovations, without their mean."""
    joints = range(len(problem.joints))
    residuals = in_threads(lambda j: problem.residuals(j, found.hypothesis, vector), joints)
    return {
        (r, j): np.fft.rfft(residuals[j][r], axis=0)[1:] for r in range(len(problem.records)) for j in joints
    }


def _draws(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> list[Array]:
    """Vectors as the fit is uncertain of them, within their bounds."""
    rng = np.random.default_rng(problem.settings.seed)
    values, axes = np.linalg.eigh(found.covariance)
    root = axes * np.sqrt(np.maximum(values, 0.0))
    _, _, low, high = problem.prior(found.hypothesis)
    return [
        np.clip(found.vector + root @ rng.standard_normal(len(values)), low, high)
        for _ in range(settings.draws)
    ]
