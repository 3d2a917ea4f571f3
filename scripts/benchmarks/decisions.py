"""How long a decision takes of what shapes an excitation while it measures: trained policies and the planner at the pace of the test."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from bench.excitation import Family, PacedPlanner, find_policy
from bench.excitation.acting import ActingPolicy
from bench.excitation.closed_loop import disturbances, run_policy
from bench.excitation.stepping import Packed
from benchmarks.timing import Row
from envs.background import background_of
from envs.setups import Setup, discrimination_setup, joint_setup, sdof_setup

LIMIT = "≤ 1"


class Timed:
    """A policy whose decisions are timed.

    Attributes:
        seconds: Of each decision so far.
    """

    def __init__(self, policy: ActingPolicy) -> None:
        """Time a policy."""
        self.name, self.station, self.about, self.memory = (
            policy.name,
            policy.station,
            policy.about,
            policy.memory,
        )
        self._policy, self.seconds = policy, []

    def act(self, observation, memory=None):
        """What the policy does."""
        start = time.perf_counter()
        action = self._policy.act(observation, memory)
        self.seconds.append(time.perf_counter() - start)
        return action


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group."""
    return [_row(name, policy, rigs, repeats) for name, policy, rigs in _contestants(repeats)]


def _contestants(repeats: int) -> Iterator[tuple[str, ActingPolicy, Packed]]:
    """Names, policies, and as many rigs as tests, with one more to begin with."""
    for task, setup in (
        ("sdof", sdof_setup()),
        ("joint", joint_setup()),
        ("rivals", discrimination_setup("sdof", ("gap_cubic", "presliding_bouc_wen", "coulomb_stribeck"))),
    ):
        yield f"policy {task}", find_policy(task), _rigs(setup, 0, repeats + 1)
    setup = sdof_setup()
    station, prior = setup.station(), setup.questions[0]
    opening = 0.8 * np.sin(2.0 * np.pi * 1.9 * station.timestep * np.arange(station.n_samples))[:, None]
    for background, words in (((), ""), (background_of(setup), " for backgrounds")):
        planner = PacedPlanner(prior, station, opening, background)  # pyrefly: ignore[bad-argument-type]
        for kind, hypothesis in enumerate(prior.hypotheses):  # pyrefly: ignore[missing-attribute]
            yield f"paced planner{words}, {hypothesis.name}", planner, _rigs(setup, kind, repeats + 1)


def _rigs(setup: Setup, kind: int, n: int) -> Packed:
    question, station = setup.questions[0], setup.station()
    hypothesis = question.hypotheses[kind] if hasattr(question, "hypotheses") else question.first
    family = Family(hypothesis, station.channels, station.actuators)
    return family.packed(np.random.default_rng(kind).uniform(-1.7, 1.7, (n, family.n_parameters)))


def _row(name: str, policy: ActingPolicy, rigs: Packed, repeats: int) -> Row:
    """Tests of one rig after the other; the first is not counted."""
    late, middle = [], []
    for i in range(repeats + 1):
        timed = Timed(policy)
        run_policy(timed, rigs.alone(i), disturbances(policy.station, 1, np.random.default_rng(i)))
        if i:
            late.append(1e3 * float(np.percentile(timed.seconds, 95)))
            middle.append(1e3 * float(np.median(timed.seconds)))
    low, high = np.percentile(late, [10, 90])
    return Row(
        name,
        float(np.median(late)),
        (float(low), float(high)),
        LIMIT,
        "milliseconds of a decision, the 95th percentile of a test's, the middle test",
        {"median_ms": float(np.median(middle)), "windows": policy.station.n_windows},
    )
