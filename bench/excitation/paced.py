"""Planning at the pace of the test: what a planner does in half a second, spread over the windows, and a command is never late.

A planner stops to think: it identifies the rig from the whole record, then searches for the rest of the test. Here neither waits. The rig
is followed while the record grows (`bench.excitation.following`), and once the opening has told enough, every window weighs
a few changes of the plan on the rig as it is known by then and keeps what is better. The work of a window is a number of integration
steps, not a time, so that what is done does not depend on the machine.

What is wanted is what a planner wants: the least expected error of the parameters at the end of the test, within what is left of the
energy and within stroke and velocity on the rig as known. The search is an evolution strategy: multisines of the band, whole or under
a bell in time, are added to the plan, and their size follows the one-fifth rule.

References:
    Fedorov 1972, "Theory of Optimal Experiments", chapter 4 (sequential design);
    Rechenberg 1973, "Evolutionsstrategie" (the one-fifth rule); Beyer, Schwefel 2002, Natural Computing 1(1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.acting import check_window, rows_of
from bench.excitation.background import BackgroundTerm, with_background
from bench.excitation.family import Family
from bench.excitation.following import Bank, Follower
from bench.excitation.known_rig import KnownRig
from bench.excitation.methods import spectral_lines
from bench.excitation.prior import RigPrior
from bench.excitation.station import Desk, Station


@dataclass(frozen=True)
class PacedSettings:
    """Numbers of `bench.excitation.paced`."""

    followed: float = 0.05
    begin: float = 0.2
    """Shares of the test from which on the rig is looked for and the plan is changed; a planner's first decision is at the latter."""
    again: float = 0.15
    """Growth of the record from one step of identification to the next, once the plan is being changed: late ones change little."""
    work: int = 6500
    """Integration steps of rigs that a window may take, at some 50 to 120 ns each."""
    together: int = 8
    """Most changes of the plan in a window."""
    size: float = 0.3
    sizes: tuple[float, float] = (0.02, 1.0)
    growth: float = 1.5
    """Size of a change, of the largest command, at first; its range; and what a success makes of it. A failure makes it less by
    the fourth root, so that it stays where a fifth succeed."""
    local: float = 0.7
    """Of the changes are under a bell in time, as wide as three knots or anything up to the whole rest."""
    wide: float = 1e4
    """Scale of a channel without a limit, in deviations of its noise, where a station is made for a planner: observations are numbers of
    32 bits up to one, which are finer than a hundredth of the noise then, and nothing is cut off."""


SETTINGS = PacedSettings()


@dataclass(eq=False)
class PacedPlanner:
    """A planner in the place of a policy: `run_policy` runs it, and so does a loop around sensors.

    Attributes:
        prior: The hypotheses.
        station: What is measured and allowed; its actions are knots.
        opening: Commands ``(n_samples, n_actuators)`` of an open-loop design, which the plan is until it is changed; as far as knots
            follow them.
        background: What a rig may have besides: plans are then made for the error over all backgrounds.
        name: Name.
        seed: Seed of the searches.

    Raises:
        ParameterError: The opening or the station's actions are of another kind.
        ModelError: A rig is not linear around its elements, or not affine in an uncertain parameter.
    """

    prior: RigPrior
    station: Station
    opening: NDArray[np.float64] = field(repr=False)
    background: tuple[BackgroundTerm, ...] = ()
    name: str = "paced planner"
    seed: int = 0

    def __post_init__(self) -> None:
        station = self.station
        shape = (station.n_samples, len(station.actuators))
        if station.shaping != "knots" or self.opening.shape != shape or not np.isfinite(self.opening).all():
            raise ParameterError(
                f"{self.name} came with actions of kind '{station.shaping}' and an opening of shape {self.opening.shape}; knots and finite "
                f"commands {shape} are expected"
            )
        hypotheses = self.prior.hypotheses
        families = [Family(each, station.channels, station.actuators) for each in hypotheses]
        self.banks = tuple(map(Bank.of, families, self.prior.weights))
        self.real = tuple(families)
        if self.background:
            real = [with_background(each, self.background) for each in hypotheses]
            self.real = tuple(Family(each, station.channels, station.actuators) for each in real)
        self.desk = Desk(station, 1)
        self.scale = np.array([station.scale[name] for name in station.channels])
        part = station.n_steps // station.n_knots
        ends = np.arange(part, station.n_samples + 1, part)
        self.plan = np.clip(self.opening[ends - 1] / self.desk.force, -1.0, 1.0)  # (n_knots, n_actuators)
        lines = spectral_lines(station.band, station.duration)
        angle = 2.0 * np.pi * station.timestep * np.outer(ends, lines)
        self.basis = np.concatenate([np.cos(angle), np.sin(angle)], axis=1) / np.sqrt(len(lines))

    @property
    def about(self) -> Mapping[str, Any]:
        """Where it comes from: nowhere, it is not trained."""
        return MappingProxyType({})

    def memory(self, shape: int | tuple[int, ...] = ()) -> list[PacedTest]:
        """What is known at the start of as many tests; made anew for each.

        Args:
            shape: Number of tests m, or the shape of what stands before the last axis of the observations; () for one test.
        """
        return [PacedTest(self, self.seed + i) for i in range(int(np.prod(shape, dtype=int)))]

    def act(self, observation: NDArray[np.float32], memory: Any = None) -> NDArray[np.float32]:
        """Actions ``(…, width)`` in −1 … 1 for observations ``(…, n_observations)``; with one load in about a millisecond a test.

        Args:
            observation: What was seen of the last window.
            memory: What `memory` gave at the start of the test; brought up to date here.

        Raises:
            ParameterError: The observations have another length, no memory came, or the test is over.
        """
        observation = np.asarray(observation, dtype=np.float32)
        rows = rows_of(self, observation, None if memory is None else len(memory))
        actions = np.array([test.act(row) for test, row in zip(memory, rows, strict=True)], dtype=np.float32)
        return actions.reshape(*observation.shape[:-1], self.station.width)


class PacedTest:
    """A test under way: the record, what it tells of the rig, and the plan.

    Attributes:
        window: Windows run.
        plan: Actions of each window ``(n_windows, width)``, done and planned.
        follower: What is known of the rig.
        expected: Error that is expected at the end [prior standard deviations]; None before there is a plan for the rig found.
        weighed: Plans weighed so far.
    """

    def __init__(self, planner: PacedPlanner, seed: int) -> None:
        """Begin."""
        station = planner.station
        self._planner, self._rng = planner, np.random.default_rng(seed)
        self.window, self.weighed = 0, 0
        self.plan = planner.plan.reshape(station.n_windows, station.width).copy()
        self.follower = Follower(
            planner.banks, planner.desk.noise, station.n_samples, len(station.actuators), seed, planner.scale
        )
        self.expected: float | None = None
        self._begin = round(SETTINGS.begin * station.n_windows)
        self._first = max(1, round(SETTINGS.followed * station.n_windows))
        self._turn, self._next = 0, self._begin  # of identification, and the window of the next one
        self._size = SETTINGS.size
        self._kind = 0  # the likeliest hypothesis
        self._rig: KnownRig | None = None

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """The action of the next window ``(width,)`` for what was seen of the last ``(n_observations,)``."""
        check_window(self._planner, self.window)
        if self.window:  # what is seen first is the rest before the test
            self._see(observation)
        if self.window >= self._first:
            self._think()
        action = np.clip(self.plan[self.window], -1.0, 1.0)
        self.window += 1
        return action

    @property
    def _looking(self) -> bool:
        """Whether the rig is still looked for among all that may be there."""
        return self.window <= self._begin or None in self.follower.found

    def _see(self, observation: NDArray[np.float32]) -> None:
        planner, n = self._planner, self._planner.station.n_steps
        measured, commands, _ = np.split(
            observation.astype(float), np.cumsum([n * len(planner.scale), n * len(planner.desk.force)])
        )
        self.follower.append(
            commands.reshape(n, -1) * planner.desk.force, measured.reshape(n, -1) * planner.scale
        )
        if self._looking:
            self.follower.run_banks()

    def _think(self) -> None:
        """A window's work: a step of identification where one is due, and changes of the plan as far as there is time."""
        if self.window < self._begin or None in self.follower.found:
            self.follower.improve(self._turn % len(self.follower.found))
            self._turn += 1
            return
        before, left = self.follower.steps, SETTINGS.work
        if self.window >= self._next:
            self._identify()
            left -= self.follower.steps - before
        run = (1 + self._planner.real[self._kind].n_parameters) * self.follower.length
        if self._rig is None and (left >= run or left == SETTINGS.work):
            self._rig, self.expected = self._known_rig(), None
            left -= run
        if self._rig is not None:
            self._change_plan(self._rig, left)

    def _identify(self) -> None:
        """A step for the likeliest hypothesis, every other time for one of the others; the next one soon where it was worth it."""
        self._kind, *others = self.follower.log_odds()
        kind = others[self._turn // 2 % len(others)] if others and self._turn % 2 else self._kind
        self._turn += 1
        gain = self.follower.improve(kind)
        first, self._kind = self._kind, next(iter(self.follower.log_odds()))
        if self._kind != first or (gain > 0.0 and kind == first):
            self._rig = None
        # a gain of more than noise makes of as many parameters is worth another step at once
        soon = gain > self._planner.banks[kind].family.n_parameters
        later = max(self.window + 2, round((1.0 + SETTINGS.again) * self.window))
        self._next = self.window + 1 if soon else later

    def _known_rig(self) -> KnownRig:
        found = self.follower.found[self._kind]
        assert found is not None
        return KnownRig(self._planner.real[self._kind], found.x, self._planner.desk, self.follower)

    def _change_plan(self, rig: KnownRig, left: int) -> None:
        """Weigh the plan where that is not known, and changes of it, in so many steps of integration, and keep the best."""
        station = self._planner.station
        knots = self.plan[self.window :].reshape(-1, len(station.actuators))
        each = (1 + rig.n_rigs) * (station.n_windows - self.window) * station.n_steps
        count = min(max(left // each, int(left == SETTINGS.work)), SETTINGS.together)
        if not count:
            return
        rig.catch_up(self.follower)
        known = self.expected is not None
        tried = knots + self._size * self._changes(count, len(knots))
        if not known:
            tried[0] = knots
        errors, made = rig.weigh(tried, self.follower)
        self.weighed += count
        best = int(np.argmin(errors))
        better = self.expected is None or errors[best] < self.expected
        if better:
            self.expected = float(errors[best])
            self.plan[self.window :] = made[best].reshape(-1, station.width)
        if known or count > 1:
            factor = SETTINGS.growth if better and (known or best) else SETTINGS.growth**-0.25
            self._size = float(np.clip(factor * self._size, *SETTINGS.sizes))

    def _changes(self, count: int, n: int) -> NDArray[np.float64]:
        """Multisines of the band with a mean square of one at each actuator, mostly under a bell ``(count, n, n_actuators)``."""
        basis, width = self._planner.basis[-n:], len(self._planner.desk.force)
        made = np.moveaxis(
            np.tensordot(basis, self._rng.standard_normal((basis.shape[1], count, width)), axes=1), 1, 0
        )
        middle = self._rng.uniform(0.0, n, count)
        wide = np.exp(self._rng.uniform(np.log(3.0), np.log(max(n, 4)), count))
        wide[self._rng.random(count) > SETTINGS.local] = np.inf
        bells = np.exp(-0.5 * ((np.arange(n) - middle[:, None]) / wide[:, None]) ** 2)
        return bells[:, :, None] * made
