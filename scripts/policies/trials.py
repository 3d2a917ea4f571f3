"""Tests of drawn rigs under many excitations, each measured several times, and what identification leaves of each.

Rigs come with or without a background. The excitations are those of the evaluation and, for each rig, the one that is D-optimal for
that very rig: the largest information that a search finds, which is where a reward that is no identification error shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.excitation import (
    METHODS,
    Experiment,
    Family,
    Planner,
    RigHypothesis,
    RigPrior,
    controls_from,
    design,
    estimate,
    find_policy,
    policy_names,
)
from bench.excitation.background import BackgroundTerm, with_background
from bench.excitation.closed_loop import Runs, disturbances, finish, run_policy
from bench.excitation.estimation import Estimates, Records
from bench.excitation.stepping import integrate_cases
from envs.background import background_of
from envs.setups import Setup

DESIGN_DRAWS = 24
"""Rigs that open-loop designs are made for, as in the evaluation."""
EVALUATIONS = 480
REPEATS = 4
"""Measurements of the same test: the expected error of an identification is told from so many."""


class Kind(NamedTuple):
    """Rigs of one hypothesis, with what they have besides."""

    family: Family
    real: Family  # with the background's coordinates
    coordinates: Array  # (n, p)
    background: Array  # (n, b) standardised


class Trial(NamedTuple):
    """The rigs of a kind under one excitation each."""

    kind: Kind
    method: str
    real: bool  # whether the rigs have their background
    controls: Array  # (n, n_samples, n_actuators)
    runs: list[Runs]  # of each repeat
    found: list[Estimates]

    @property
    def errors(self) -> Array:
        """Root mean square over a rig's parameters of each repeat ``(repeats, n)`` [prior standard deviations]."""
        off = np.stack([fit.coordinates for fit in self.found]) - self.kind.coordinates
        return np.sqrt(np.mean(off**2, axis=2))


def kinds_of(setup: Setup, rigs: int, rng: np.random.Generator) -> list[Kind]:
    """Rigs of each hypothesis of a setup, as many of each but for one."""
    prior = setup.questions[0]
    assert isinstance(prior, RigPrior)
    terms: tuple[BackgroundTerm, ...] = background_of(setup)
    station, bound = setup.station(), np.sqrt(3.0)
    kinds = []
    for k, hypothesis in enumerate(prior.hypotheses):
        n = rigs // len(prior.hypotheses) + (k < rigs % len(prior.hypotheses))
        alone, real = (
            Family(h, station.channels, station.actuators)
            for h in (hypothesis, with_background(hypothesis, terms))
        )
        x = rng.uniform(-bound, bound, (n, alone.n_parameters))
        kinds.append(Kind(alone, real, x, rng.uniform(-bound, bound, (n, len(terms)))))
    return kinds


def excitations(
    setup: Setup, task: str, kind: Kind, opened: dict[str, Array], rng: np.random.Generator
) -> Iterator[tuple[str, Array]]:
    """Commands of each excitation on each rig of a kind ``(n, n_samples, n_actuators)``."""
    station, n = setup.station(), len(kind.coordinates)
    packed, noise = kind.family.packed(kind.coordinates), disturbances(setup.station(), n, rng)
    for method, commands in opened.items():
        yield method, np.broadcast_to(commands, (n, *commands.shape)).copy()
    if task in policy_names():
        yield "policy", run_policy(find_policy(task), packed, noise).records.controls
    prior = setup.questions[0]
    assert isinstance(prior, RigPrior)
    yield "planner", Planner(prior, station, opened["d_optimal"]).run(packed, noise).records.controls
    own = [_greedy(setup, kind.family.hypothesis, row, rng) for row in kind.coordinates]
    yield "D-optimal for the rig", np.stack(own)


def _greedy(setup: Setup, hypothesis: RigHypothesis, coordinates: Array, rng: np.random.Generator) -> Array:
    one = Experiment(RigPrior((hypothesis,)), setup.noise, setup.limits, (hypothesis.at(coordinates),))
    made = design(
        "d_optimal", one, duration=setup.duration, band=setup.band, rng=rng, evaluations=EVALUATIONS
    )
    return controls_from(made)


def open_loop(setup: Setup, rng: np.random.Generator) -> dict[str, Array]:
    """Commands ``(n_samples, n_actuators)`` of each method for the prior."""
    prior = setup.questions[0]
    assert isinstance(prior, RigPrior)
    wide = Experiment(prior, setup.noise, setup.limits, prior.draws(DESIGN_DRAWS, rng))
    return {
        method: controls_from(
            design(method, wide, duration=setup.duration, band=setup.band, rng=rng, evaluations=EVALUATIONS)
        )
        for method in METHODS
    }


def trials_of(
    setup: Setup, task: str, records: int, seed: int, tell: Callable[[str], None] = lambda text: None
) -> Iterator[Trial]:
    """At least so many records each of rigs without and with their background."""
    rng = np.random.default_rng(seed)
    tell("designing")
    opened = open_loop(setup, rng)
    methods = len(opened) + 2 + (task in policy_names())
    for kind in kinds_of(setup, -(-records // methods), rng):
        for method, controls in excitations(setup, task, kind, opened, rng):
            tell(f"{kind.family.hypothesis.name}, {method}")
            for real in (False, True):
                yield _trial(setup, kind, method, controls, real, rng)


def _trial(
    setup: Setup, kind: Kind, method: str, controls: Array, real: bool, rng: np.random.Generator
) -> Trial:
    station, n = setup.station(), len(kind.coordinates)
    packed = kind.real.packed(np.concatenate([kind.coordinates, real * kind.background], axis=1))
    ideal = integrate_cases(
        packed, controls, packed.start[:, None].copy(), members=np.arange(n)[:, None],
        counts=np.ones(n, dtype=np.int64), timestep=station.timestep,
    )[:, 0]  # fmt: skip
    runs = [finish(station, controls, ideal, disturbances(station, n, rng)) for _ in range(REPEATS)]
    noise = np.array([station.noise[name] for name in station.channels])
    stacked = Records(
        *(
            np.concatenate([getattr(run.records, name) for run in runs])
            for name in ("controls", "measured", "lengths")
        )
    )
    found = estimate(kind.family, stacked, noise)
    parts = [Estimates(*(values[i * n : (i + 1) * n] for values in found)) for i in range(REPEATS)]
    return Trial(kind, method, real, controls, runs, parts)
