"""Excitation by design: the usual signals and the D-optimal multisine, each as large as the same limits allow.

| method | what it is |
|---|---|
| `random_multisine` | the best of 32 multisines with random phases, by the merit that is being asked for |
| `schroeder` | multisine with Schroeder's phases |
| `crest_multisine` | multisine with phases optimised for a small crest factor |
| `log_sweep` | logarithmic sine sweep over the band |
| `prbs` | maximal-length binary sequence with its useful band below the band's upper edge |
| `d_optimal` | multisine whose amplitudes and phases maximise the merit under the prior (CMA-ES) |

All share force peak, energy, stroke, velocity and duration: each is scaled up to its actuators' limits,
then down until every drawn rig keeps stroke and velocity. `d_optimal` starts from the best of the others,
as far as its lines hold it, and returns no less than that one.

References:
    Hansen 2016, "The CMA evolution strategy: a tutorial", arXiv:1604.00772.
    Goodwin, Payne 1977, "Dynamic System Identification: Experiment Design and Data Analysis", chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.excitation.experiment import Experiment
from bench.excitation.information import noise_vector
from bench.excitation.limits import Limits, Peaks, feasible, peaks
from bench.excitation.rivals import Rivals
from bench.signals import PRBS, Excitation, Multisine, Signal, Sweep
from bench.signals.record import Record


@dataclass(frozen=True)
class MethodsSettings:
    """Numbers of `bench.excitation.methods`."""

    candidates: int = 32
    lines: int = 20
    """Spectral lines a designed multisine has at most, spread evenly over the logarithm of frequency."""
    population: int = 16
    start_spread: float = 0.3
    rounds: int = 2
    """Searches of half the evaluations each, from the best so far; a second one from a random start never came as far."""


SETTINGS = MethodsSettings()


@dataclass(frozen=True)
class Design:
    """An excitation and what it is expected to tell.

    Attributes:
        method: How it was made.
        excitation: Commands of the driven actuators, to be taken to a shaker.
        merit: `Experiment.merit` of it [nat].
        peaks: What it reaches on the drawn rigs, as fractions of the limits.
        evaluations: Signals that were weighed.
    """

    method: str
    excitation: Excitation
    merit: float
    peaks: Peaks
    evaluations: int


def design(
    method: str,
    experiment: Experiment,
    *,
    duration: float,
    band: tuple[float, float],
    rng: np.random.Generator,
    evaluations: int = 1600,
    progress: Callable[[int, float], None] | None = None,
) -> Design:
    """Design an excitation from rest.

    Args:
        method: One of `METHODS`.
        experiment: What is asked, measured and allowed.
        duration: Duration [s].
        band: Lowest and highest frequency [Hz].
        rng: Source of randomness.
        evaluations: Signals that "d_optimal" may weigh.
        progress: Called by "d_optimal" with (signals weighed, best merit) after each generation.

    Raises:
        UnknownNameError: No such method.
        ParameterError: Band and duration leave no spectral line, or the band lies above half the step rate.
    """
    if method not in METHODS:
        raise UnknownNameError("excitation method", method, METHODS)
    if not 0.0 < band[0] < band[1] < 0.5 / experiment.timestep:
        raise ParameterError(
            f"the band is {band} Hz; 0 < lowest < highest < {0.5 / experiment.timestep:g} Hz (half the step rate) is expected"
        )
    n = round(duration / experiment.timestep)
    if method == "d_optimal":
        controls, count = _d_optimal(experiment, n, band, rng, evaluations, progress)
    elif method == "random_multisine":
        controls, count = _best_random(experiment, n, band, rng), SETTINGS.candidates
    else:
        controls, count = _signals(partial(_SIMPLE[method], band), experiment, n, rng), 1
    controls = feasible(experiment.watched, experiment.limits, controls[None])
    merit = float(experiment.merit(controls)[0])
    rate = 1.0 / experiment.timestep
    signals = {name: Record(controls[0, :, i], rate) for i, name in enumerate(experiment.actuators)}
    reached = peaks(experiment.watched, experiment.limits, controls[0])
    return Design(method, Excitation(signals, n / rate, rate), merit, reached, count)


def controls_from(design: Design) -> NDArray[np.float64]:
    """Commands ``(n, n_actuators)`` of a design."""
    return design.excitation.sample()


def paired_experiment(
    rivals: Rivals,
    noise: Mapping[str, float],
    limits: Limits,
    *,
    pairs: int,
    duration: float,
    band: tuple[float, float],
    rng: np.random.Generator,
) -> Experiment:
    """A question on pairs of draws that imitate each other under a middling test, a Schroeder multisine.

    Args:
        rivals: The question.
        noise: Standard deviation of each measured channel's noise, in the channel's unit.
        limits: The limits; the actuators with a force limit are driven.
        pairs: Pairs of draws.
        duration: Of that test [s].
        band: Its frequencies [Hz].
        rng: Source of the draws.
    """
    pilot = Experiment(rivals.prior, noise, limits, rivals.prior.draws(2, rng))
    draws = rivals.draws(
        pairs,
        rng,
        reference=controls_from(design("schroeder", pilot, duration=duration, band=band, rng=rng)),
        channels=pilot.channels,
        actuators=pilot.actuators,
        noise=noise_vector(noise, pilot.channels),
    )
    return Experiment(rivals, noise, limits, draws)


def _signals(
    make: Callable[[], Signal], experiment: Experiment, n: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The same kind of signal on every actuator ``(n, n_actuators)``, each with randomness of its own.

    A signal without randomness of its own is turned backwards on every second actuator: alike, two loads would be one.
    """
    rate = 1.0 / experiment.timestep
    columns = [make().sample(n, rate, rng) for _ in experiment.actuators]
    alike = len(columns) > 1 and np.array_equal(columns[0], columns[1])
    return np.stack([c[::-1] if alike and i % 2 else c for i, c in enumerate(columns)], axis=1)


def _multisine(phases: str, band: tuple[float, float]) -> Signal:
    return Multisine(band=band, phases=phases)  # type: ignore[arg-type]


def _sweep(band: tuple[float, float]) -> Signal:
    return Sweep(band[0], band[1])


def _prbs(band: tuple[float, float]) -> Signal:
    # Half the power is reached at 0.44 of the clock; 2^10 bits do not repeat within the tests this is meant for.
    return PRBS(clock=band[1] / 0.44, order=10, amplitude=1.0)


_SIMPLE: dict[str, Callable[[tuple[float, float]], Signal]] = {
    "schroeder": partial(_multisine, "schroeder"),
    "crest_multisine": partial(_multisine, "optimised"),
    "log_sweep": _sweep,
    "prbs": _prbs,
}

METHODS = ("random_multisine", *_SIMPLE, "d_optimal")
"""Methods that `design` knows."""


def _best_random(
    experiment: Experiment, n: int, band: tuple[float, float], rng: np.random.Generator
) -> NDArray[np.float64]:
    make = partial(_multisine, "random", band)
    candidates = np.stack([_signals(make, experiment, n, rng) for _ in range(SETTINGS.candidates)])
    candidates = feasible(experiment.watched, experiment.limits, candidates, exact=False)
    return candidates[int(np.argmax(experiment.merit(candidates)))]


def spectral_lines(band: tuple[float, float], duration: float) -> NDArray[np.float64]:
    """Frequencies of a designed multisine [Hz]: harmonics of one over the duration, at most `lines`, evenly over the octaves.

    Raises:
        ParameterError: The band holds no harmonic.
    """
    first, last = int(np.ceil(band[0] * duration - 1e-9)), int(np.floor(band[1] * duration + 1e-9))
    if last < max(first, 1):
        raise ParameterError(
            f"no harmonic of {1.0 / duration:g} Hz lies in the band {band} Hz; widen it or test longer"
        )
    numbers = np.unique(np.round(np.geomspace(max(first, 1), last, SETTINGS.lines)).astype(int))
    return numbers / duration


def _d_optimal(
    experiment: Experiment,
    n: int,
    band: tuple[float, float],
    rng: np.random.Generator,
    evaluations: int,
    progress: Callable[[int, float], None] | None,
) -> tuple[NDArray[np.float64], int]:
    """Search over the cosine and sine coefficients of the lines of all actuators."""
    from cmaes import CMA  # noqa: PLC0415  (for this method alone)

    lines = spectral_lines(band, n * experiment.timestep)
    angle = 2.0 * np.pi * np.outer(np.arange(n) * experiment.timestep, lines)
    basis = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)  # (n, 2 n_lines)
    shape = (basis.shape[1], len(experiment.actuators))
    others = [_signals(partial(make, band), experiment, n, rng) for make in _SIMPLE.values()]
    others = np.stack([*others, _best_random(experiment, n, band, rng)])
    others = feasible(experiment.watched, experiment.limits, others, exact=False)
    merits = experiment.merit(others)
    best, best_merit = others[int(np.argmax(merits))], float(merits.max())
    count = SETTINGS.candidates + len(_SIMPLE)
    for _ in range(SETTINGS.rounds):
        near = np.linalg.lstsq(basis, best, rcond=None)[0]  # the best so far, as far as these lines hold it
        start = near / max(float(np.std(near)), 1e-12)
        search = CMA(
            mean=start.ravel(),
            sigma=SETTINGS.start_spread,
            population_size=SETTINGS.population,
            seed=int(rng.integers(2**31)),
        )
        for _ in range(max(1, (evaluations // SETTINGS.rounds) // SETTINGS.population)):
            asked = [search.ask() for _ in range(SETTINGS.population)]
            controls = np.stack([basis @ x.reshape(shape) for x in asked])
            controls = feasible(experiment.watched, experiment.limits, controls, exact=False)
            merits = experiment.merit(controls)
            search.tell([(x, -float(merit)) for x, merit in zip(asked, merits, strict=True)])
            count += SETTINGS.population
            top = int(np.argmax(merits))
            if merits[top] > best_merit:
                best, best_merit = controls[top], float(merits[top])
            if progress is not None:
                progress(count, best_merit)
            if search.should_stop():
                break
    return best, count
