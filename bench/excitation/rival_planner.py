"""Planning while testing which of two rivals is true: the next windows are those expected to tell them apart best, as things stand.

After each interval both rivals are fitted to the record so far. About the two fits, and about some rigs of either that the record
leaves possible, each with the other's best imitation of it, the continuation is sought after which the expected log Bayes factor
of the whole record is largest (`bench.excitation.bayes_factor`): knots of force over a horizon of a good period of the rig, by
CMA-ES from sines of the band and from what is left of the plan before. Only the next interval of it is run. The first plan is
made for pairs of prior draws. Energy ends a plan; stroke and velocity bound it on every pair.

In contrast to `bench.excitation.planner.Planner`, which wants to know the parameters at the end of a test, certainty is wanted
soon: the merit is averaged over parts of the horizon, so that what tells early counts more often.

References:
    Box, Hill 1967, Technometrics 9(1) (sequential discrimination); Fedorov 1972, "Theory of Optimal Experiments", chapter 6.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.bayes_factor import Contrast, accumulate_contrast, weigh_contrast
from bench.excitation.estimation import (
    ESTIMATION_SETTINGS,
    Records,
    estimate,
)
from bench.excitation.family import Family, fans
from bench.excitation.information import (
    INFORMATION_LIMITS,
)
from bench.excitation.rivals import RivalDraws, Rivals
from bench.excitation.sequential import Decide, SequentialPlanner
from bench.excitation.shaping import Shaping
from bench.excitation.station import Desk, Station
from bench.excitation.stepping import integrate_cases


@dataclass(frozen=True)
class RivalPlannerSettings:
    """Numbers of `bench.excitation.rival_planner`."""

    population: int = 16
    first_generations: int = 60
    margin: float = 0.92
    """Of the limits of stroke and velocity that a plan may use on the rigs it is made for."""
    parts: int = 4
    """Ends of equal parts of the horizon at which the expected log Bayes factor counts."""
    settled: float = 2.0 * math.log(99.0)
    """Log Bayes factor [nat] from which nothing is planned any more; what was planned before is run to its end."""
    stretch: float = 0.15
    """Shortest interval between decisions, as a share of the time since the beginning: late ones change little."""
    spread: float = 0.5
    excess: float = 10.0
    tones: int = 12
    phases: int = 6


SETTINGS = RivalPlannerSettings()


class RivalPlan(NamedTuple):
    """What was decided at a time."""

    time: float  # [s]
    log_odds: float  # in favour of the first rival [nat]
    predicted: float  # mean of log(1 + expected log Bayes factor) over the parts of the plan and the pairs; 0 without a plan


@dataclass(eq=False)
class RivalPlanner(SequentialPlanner):
    """Sequential discrimination of two rivals.

    Attributes:
        rivals: The question.
        station: What is measured and allowed.
        draws: Pairs of prior draws that the first plan is made for.
        interval: Time between decisions at first, in periods of the highest frequency of the station's band.
        horizon: Time that a plan looks ahead, in the same periods.
        knot: Time between knots of the force, in the same periods.
        generations: Generations of `population` candidates that a decision weighs.
        samples: Pairs of rigs that a decision is made for besides the two fits.

    Raises:
        ParameterError: The times are not in the order timestep ≤ knot ≤ interval ≤ horizon, or a number is too small.
        ModelError: A rival is no `Family`.
    """

    rivals: Rivals
    station: Station
    draws: tuple[RivalDraws, ...]
    interval: float = 0.5
    horizon: float = 4.0
    knot: float = 0.2
    generations: int = 12
    samples: int = 4

    def __post_init__(self) -> None:
        step = self.station.timestep * self.station.band[1]
        times = (step, self.knot, self.interval, self.horizon)
        if any(a > b * (1.0 + 1e-9) for a, b in pairwise(times)) or self.generations < 1 or self.samples < 0:
            raise ParameterError(
                f"a knot of {self.knot:g}, an interval of {self.interval:g} and a horizon of {self.horizon:g} periods, "
                f"{self.generations} generations and {self.samples} samples came; timestep ({step:g} periods) ≤ knot ≤ interval ≤ "
                "horizon, at least one generation and no negative number of samples are expected"
            )
        if not self.draws:
            raise ParameterError("the first plan is made for pairs of prior draws; none came")
        station = self.station
        self.families = tuple(
            Family(h, station.channels, station.actuators) for h in (self.rivals.first, self.rivals.second)
        )
        self.desk = Desk(station, 1)

    def _edges(self) -> list[int]:
        edges, n = [0], self.station.n_samples
        while edges[-1] < n:
            pause = max(self._samples(self.interval), SETTINGS.stretch * edges[-1])
            edges.append(min(edges[-1] + math.ceil(pause - 1e-9), n))
        return edges

    def _samples(self, periods: float) -> int:
        """Samples in periods of the highest frequency."""
        return round(periods / (self.station.band[1] * self.station.timestep))

    def _decider(self, m: int, seed: int, told: Callable[[int, RivalPlan], None] | None) -> Decide:
        near = [np.zeros((m, family.n_parameters)) for family in self.families]
        undecided = np.arange(m)
        tell = told or (lambda place, plan: None)

        def decide(records: Records, controls: NDArray[np.float64], begin: int) -> None:
            nonlocal undecided
            if not begin:
                controls[:], predicted = self._opening
                for i in range(m):
                    tell(i, RivalPlan(0.0, 0.0, predicted))
                return
            if not undecided.size:
                return
            some = records.part(1.0, undecided)
            fits = [
                estimate(family, some, self.desk.noise, near=x[undecided], candidates=64, kept=2)
                for family, x in zip(self.families, near, strict=True)
            ]
            for x, fit in zip(near, fits, strict=True):
                x[undecided] = fit.coordinates
            odds = fits[0].log_evidence - fits[1].log_evidence
            for i, log_odds in zip(undecided.tolist(), odds.tolist(), strict=True):
                predicted = 0.0
                if abs(log_odds) < SETTINGS.settled:
                    pairs = self._possible(near[0][i], near[1][i], controls[i, :begin], seed + i)
                    plan = self._plan(pairs, controls[i], begin, seed + i, self.generations)
                    controls[i, begin:], predicted = plan
                tell(i, RivalPlan(begin * self.station.timestep, log_odds, predicted))
            undecided = undecided[np.abs(odds) < SETTINGS.settled]

        return decide

    @cached_property
    def _opening(self) -> tuple[NDArray[np.float64], float]:
        """The first plan and its worth, the same for all rigs."""
        first, second = (np.stack([pair[k].coordinates for pair in self.draws]) for k in range(2))
        rest = np.zeros((self.station.n_samples, len(self.station.actuators)))
        return self._plan((first, second), rest, 0, 0, SETTINGS.first_generations)

    def _possible(
        self, first: NDArray[np.float64], second: NDArray[np.float64], past: NDArray[np.float64], seed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The fits and, in turn, rigs of either rival that the record leaves possible, with the other's imitation; linearised."""
        sums = _Outlook(self.families, self.desk, (first[None], second[None]), past).sums
        p = (len(first), len(second))
        inner = [
            np.eye(size) + fisher[0, 0, :size, :size]
            for size, fisher in zip(p, (sums.fisher_first, sums.fisher_second), strict=True)
        ]
        cross = sums.cross[0, 0, : p[0], : p[1]]
        across = (np.linalg.solve(inner[1], cross.T), np.linalg.solve(inner[0], cross))
        rng = np.random.default_rng(seed)
        fits, points = (first, second), ([first], [second])
        for k in range(self.samples):
            lead, other = k % 2, 1 - k % 2
            away = np.linalg.solve(np.linalg.cholesky(inner[lead]).T, rng.standard_normal(p[lead]))
            points[lead].append(
                np.clip(fits[lead] + away, -ESTIMATION_SETTINGS.bound, ESTIMATION_SETTINGS.bound)
            )
            moved = points[lead][-1] - fits[lead]
            points[other].append(
                np.clip(
                    fits[other] + across[lead] @ moved, -ESTIMATION_SETTINGS.bound, ESTIMATION_SETTINGS.bound
                )
            )
        return np.stack(points[0]), np.stack(points[1])

    def _plan(
        self,
        pairs: tuple[NDArray[np.float64], NDArray[np.float64]],
        controls: NDArray[np.float64],
        begin: int,
        seed: int,
        generations: int,
    ) -> tuple[NDArray[np.float64], float]:
        """The best commands found for the rest of the test, and their worth; none after the horizon."""
        from cmaes import CMA  # noqa: PLC0415  (for this method alone)

        station = self.station
        part = self._samples(self.knot)
        knots = min(self._samples(self.horizon), station.n_samples - begin) // part
        rest = np.zeros_like(controls[begin:])
        if not knots:
            return rest, 0.0
        look = _Outlook(self.families, self.desk, pairs, controls[:begin])
        spent = station.timestep * np.sum(controls[:begin] ** 2, axis=0)
        left = np.maximum(self.desk.budget - spent, 0.0)
        last = controls[begin - 1] / self.desk.force if begin else np.zeros(len(self.desk.force))

        def commands(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
            many = np.clip(candidates, -1.0, 1.0).reshape(len(candidates), -1)
            u = self._commands(np.concatenate([np.tile(last, (len(many), 1)), many], axis=1), part)
            return np.where(station.timestep * np.cumsum(u**2, axis=1) <= left, u, 0.0)

        def worth(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
            told, reached = look.weigh(commands(candidates))
            over = np.minimum(np.maximum(reached / SETTINGS.margin - 1.0, 0.0), 1.0).sum(axis=1)
            return told - SETTINGS.excess * over

        before = controls[begin + part - 1 :: part][:knots] / self.desk.force
        before = np.pad(before, ((0, knots - len(before)), (0, 0)))
        starts = np.concatenate([before.reshape(1, -1), self._tones(knots, part)])
        values = worth(starts)
        best, most = starts[int(np.argmax(values))], float(values.max())
        search = CMA(mean=best.copy(), sigma=SETTINGS.spread, population_size=SETTINGS.population, seed=seed)
        for _ in range(generations):
            asked = [search.ask() for _ in range(SETTINGS.population)]
            values = worth(np.stack(asked))
            search.tell([(z, -float(value)) for z, value in zip(asked, values, strict=True)])
            if values.max() > most:
                best, most = asked[int(np.argmax(values))], float(values.max())
        rest[: knots * part] = commands(best[None])[0]
        return rest, most

    def _commands(self, knots: NDArray[np.float64], part: int) -> NDArray[np.float64]:
        """Commands ``(k, n, n_actuators)`` from the first knot on, which is the last command before."""
        station, k = self.station, len(knots)
        count = knots.shape[1] // len(self.desk.force)
        shaping = Shaping("knots", k, n_actuators=len(self.desk.force), band=station.band, n_knots=count)
        u = shaping.commands(np.arange(k), knots, count * part, station.timestep)
        return self.desk.force * u[:, part:]

    def _tones(self, knots: int, part: int) -> NDArray[np.float64]:
        """Sines over the band at two levels as starts of a search, the same on all actuators, and nothing at all."""
        station = self.station
        clock = (1.0 + np.arange(knots)) * (part * station.timestep)
        angle = 2.0 * np.pi * np.outer(np.geomspace(*station.band, SETTINGS.tones), clock)
        phase = 2.0 * np.pi * np.arange(SETTINGS.phases) / SETTINGS.phases
        sines = np.sin(angle[:, None] + phase[:, None]).reshape(-1, knots)
        levels = np.concatenate([1.6 * sines, 0.5 * sines, np.zeros((1, knots))])
        return np.clip(np.repeat(levels, len(self.desk.force), axis=1), -1.0, 1.0)


class _Outlook:
    """Pairs of rivals at a time of a test, and what may follow.

    Attributes:
        sums: What the record so far holds of each pair, with one leading case.
    """

    def __init__(
        self,
        families: tuple[Family, ...],
        desk: Desk,
        pairs: tuple[NDArray[np.float64], NDArray[np.float64]],
        past: NDArray[np.float64],
    ) -> None:
        self._desk, self._families = desk, families
        self._clock = 0.0
        n, sizes = len(pairs[0]), [1 + family.n_parameters for family in families]
        self._packed = [
            family.packed(fans(x, INFORMATION_LIMITS.step).reshape(-1, family.n_parameters))
            for family, x in zip(families, pairs, strict=True)
        ]
        self._states = [packed.start[None] for packed in self._packed]
        places = np.stack([np.arange(n) * sizes[0], n * sizes[0] + np.arange(n) * sizes[1]], axis=1)
        self._drawn = places.ravel()
        self._places, self._counts = places[None], np.tile(np.array(sizes) - 1, (1, n, 1))
        self.sums = Contrast.zeros(1, n, parameters=max(sizes) - 1)
        if len(past):
            outputs, self._states = self._records(past[None])
            self._book(outputs, self.sums)
            self._clock = len(past) * desk.station.timestep

    def weigh(self, controls: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What continuations are expected to tell, and what they reach.

        Args:
            controls: Commands ``(n_cases, n, n_actuators)``.

        Returns:
            Mean of ``log(1 + K)`` over the pairs and the ends of `clipped_parts` parts, K the expected log Bayes factor [nat] of the
            record up to there ``(n_cases,)``; largest stroke and velocity of any rig, as fractions of the limits ``(n_cases, 2)``.
        """
        cases, n, _ = controls.shape
        outputs, _ = self._records(controls)
        drawn = outputs[:, self._drawn]
        reached = self._desk.reached(drawn.reshape(-1, *drawn.shape[2:])).reshape(cases, -1, 2)
        sums = Contrast(*(np.repeat(array, cases, axis=0) for array in self.sums))
        values, told = np.zeros(sums.square.shape), np.zeros(cases)
        for a, b in pairwise(np.linspace(0, n, SETTINGS.parts + 1).astype(int)):
            self._book(np.ascontiguousarray(outputs[:, :, a:b]), sums)
            weigh_contrast(0, cases, sums, values)
            told += np.mean(np.log1p(np.maximum(np.nan_to_num(values), 0.0)), axis=1)
        return told / SETTINGS.parts, np.nan_to_num(reached, nan=np.inf).max(axis=1)

    def _records(
        self, controls: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
        """Channels of all rigs ``(n_cases, n_rigs, n, n_channels)``, those of the second rival last, and their states after it."""
        cases, outputs, after = len(controls), [], []
        for packed, states in zip(self._packed, self._states, strict=True):
            rigs = len(packed.start)
            after.append(np.repeat(states, cases, axis=0))
            outputs.append(
                integrate_cases(
                    packed, controls, after[-1], members=np.tile(np.arange(rigs), (cases, 1)),
                    counts=np.full(cases, rigs), timestep=self._desk.station.timestep,
                    clock=np.full(cases, self._clock),
                )
            )  # fmt: skip
        return np.concatenate(outputs, axis=1), after

    def _book(self, outputs: NDArray[np.float64], sums: Contrast) -> None:
        """Add records to the sums of their cases."""
        cases = len(outputs)
        places, counts = (np.repeat(array, cases, axis=0) for array in (self._places, self._counts))
        accumulate_contrast(
            0, cases, outputs, places, counts, INFORMATION_LIMITS.step, 1.0 / self._desk.noise, sums
        )
