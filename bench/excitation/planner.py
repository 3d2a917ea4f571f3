"""Planning while testing: identify from what has been measured, then design the rest of the excitation for the rig that was found.

An open-loop design must serve every rig that may be there and keep the stroke on all of them. After the first seconds most of
that is known: the planner fits every hypothesis to the record so far, takes the most probable rig, and searches for the continuation
after which its parameters are known best, within what is left of the energy and within the stroke on that rig. It does so
several times in a test. The beginning is an open-loop design; a brake along the velocity guards the stroke where a rig is not as found.

A plan takes a fraction of a second of one core; a shaker waits that long, or the plan is made a window ahead.

References:
    Fedorov 1972, "Theory of Optimal Experiments", chapter 4 (sequential design); Chaloner, Verdinelli 1995, Statistical Science 10(3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.background import BackgroundTerm, errors_left, with_background
from bench.excitation.estimation import Estimates, Records, estimate, normal_equations
from bench.excitation.family import Family
from bench.excitation.methods import spectral_lines
from bench.excitation.prior import RigPrior
from bench.excitation.sequential import Decide, SequentialPlanner
from bench.excitation.station import Desk, Station


@dataclass(frozen=True)
class PlannerSettings:
    """Numbers of `bench.excitation.planner`."""

    population: int = 16
    margin: float = 0.94
    """Of the limits of stroke and velocity that a plan may use on the rig as found."""
    tries: int = 4


SETTINGS = PlannerSettings()


class Decision(NamedTuple):
    """What was decided at a time."""

    time: float  # [s]
    hypothesis: str
    values: dict[str, float]
    predicted: float  # expected error at the end, prior standard deviations


@dataclass(eq=False)
class Planner(SequentialPlanner):
    """Sequential design for one question.

    Attributes:
        prior: The hypotheses.
        station: What is measured and allowed.
        opening: Commands ``(n_samples, n_actuators)`` of an open-loop design, used until the first decision.
        decisions: Times of decisions, as shares of the test.
        generations: Generations of `population` candidates that a decision weighs.
        background: What a rig may have besides: a continuation is then designed for the error over all backgrounds. Rigs are still
            identified as if they had none.
    """

    prior: RigPrior
    station: Station
    opening: NDArray[np.float64]
    decisions: tuple[float, ...] = (0.2, 0.4, 0.6)
    generations: int = 16
    background: tuple[BackgroundTerm, ...] = ()

    def __post_init__(self) -> None:
        shape = (self.station.n_samples, len(self.station.actuators))
        if self.opening.shape != shape:
            raise ParameterError(f"the opening has shape {self.opening.shape}; {shape} is expected")
        ordered = (0.0, *self.decisions, 1.0)
        if any(a >= b for a, b in pairwise(ordered)) or self.generations < 1:
            raise ParameterError(
                f"decisions at {self.decisions} and {self.generations} generations came; ascending shares of the test between "
                "0 and 1 and at least one generation are expected"
            )
        station = self.station
        self.families = tuple(Family(h, station.channels, station.actuators) for h in self.prior.hypotheses)
        self.real = self.families
        if self.background:
            hypotheses = [with_background(h, self.background) for h in self.prior.hypotheses]
            self.real = tuple(Family(h, station.channels, station.actuators) for h in hypotheses)
        self.desk = Desk(station, 1)
        clock = np.arange(station.n_samples) * station.timestep
        angle = 2.0 * np.pi * np.outer(clock, spectral_lines(station.band, station.duration))
        self.basis = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)

    def _edges(self) -> list[int]:
        n = self.station.n_samples
        return [0, *(round(share * n) for share in self.decisions), n]

    def _decider(self, m: int, seed: int, told: Callable[[int, Decision], None] | None) -> Decide:
        def decide(records: Records, controls: NDArray[np.float64], begin: int) -> None:
            if not begin:
                controls[:] = self.opening
                return
            for i, (k, x) in enumerate(self._found(records)):
                share = None if told is None else partial(told, i)
                controls[i, begin:] = self.continuation(k, x, controls[i], begin, seed + i, share)

        return decide

    def _found(self, records: Records) -> list[tuple[int, NDArray[np.float64]]]:
        """The most probable hypothesis and rig of each record."""
        fits: list[Estimates] = [
            estimate(family, records, self.desk.noise, candidates=64, kept=2) for family in self.families
        ]
        odds = np.stack([fit.log_evidence for fit in fits]) + np.log(self.prior.weights)[:, None]
        best = np.argmax(odds, axis=0)
        return [(int(k), fits[k].coordinates[i]) for i, k in enumerate(best)]

    def continuation(
        self,
        kind: int,
        x: NDArray[np.float64],
        controls: NDArray[np.float64],
        begin: int,
        seed: int,
        told: Callable[[Decision], None] | None = None,
    ) -> NDArray[np.float64]:
        """The best commands found for the rest of a test of a rig ``(n - begin, n_actuators)``.

        Args:
            kind: Place of the rig's hypothesis.
            x: The rig ``(p,)``, standardised.
            controls: Commands so far, and those that the search starts from ``(n, n_actuators)``.
            begin: Sample from which on they are free.
            seed: Seed of the search.
            told: Called with the plan.
        """
        from cmaes import CMA  # noqa: PLC0415  (for this method alone)

        rest = controls[begin:]
        basis = self.basis[begin:]
        start = np.linalg.lstsq(basis, rest, rcond=None)[0]
        size = max(float(np.std(start)), 1e-9)
        errors, fitted = self._weigh(kind, x, controls, rest[None])
        best, least = fitted[0], float(errors[0])
        search = CMA(mean=start.ravel() / size, sigma=0.6, population_size=SETTINGS.population, seed=seed)
        for _ in range(self.generations):
            asked = [search.ask() for _ in range(SETTINGS.population)]
            rests = np.stack([basis @ (size * z).reshape(start.shape) for z in asked])
            errors, fitted = self._weigh(kind, x, controls, rests)
            search.tell([(z, float(np.log(e))) for z, e in zip(asked, errors, strict=True)])
            if errors.min() < least:
                best, least = fitted[int(np.argmin(errors))], float(errors.min())
        if told is not None:
            family = self.families[kind]
            values = dict(zip(family.hypothesis.names, family.values(x).tolist(), strict=True))
            told(Decision(begin * self.station.timestep, family.hypothesis.name, values, least))
        return best

    def _weigh(
        self,
        kind: int,
        x: NDArray[np.float64],
        controls: NDArray[np.float64],
        rests: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Expected errors of candidates ``(k,)`` after a whole test, and the candidates scaled to the limits.

        A candidate that leaves the stroke at every scale tried is worth as much as none.
        """
        family, k, n, width = self.families[kind], len(rests), len(controls), controls.shape[1]
        begin = n - rests.shape[1]
        spent = self.station.timestep * np.sum(controls[:begin] ** 2, axis=0)
        left = np.maximum(self.desk.budget - spent, 0.0)
        peak = np.max(np.abs(rests), axis=1)
        energy = self.station.timestep * np.sum(rests**2, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.minimum(self.desk.force / peak, np.sqrt(left / energy))
        rests = rests * np.where(np.isfinite(scale), scale, 0.0)[:, None, :]
        whole = np.empty((k, n, width))
        whole[:, :begin] = controls[:begin]
        point = np.broadcast_to(x, (k, 1, len(x))).copy()
        over = np.ones(k, dtype=bool)
        for _ in range(SETTINGS.tries):
            whole[:, begin:] = rests
            motion = family.record(point[over], whole[over])[:, 0, begin:]
            reached = np.max(np.nan_to_num(self.desk.reached(motion), nan=np.inf), axis=1) / SETTINGS.margin
            wide = np.flatnonzero(over)[reached > 1.0]
            over[:] = False
            over[wide] = True
            if not wide.size:
                break
            rests[wide] *= smaller(reached[reached > 1.0])[:, None, None]
        whole[:, begin:] = rests
        if self.background:
            left = errors_left(self.real[kind], x, whole, self.desk.noise)
            return np.where(over, 1.0, left.backed), rests
        empty = np.zeros((k, n, len(self.station.channels)))
        information, _ = normal_equations(
            family, Records(whole, empty, np.full(k, n)), point[:, 0], self.desk.noise
        )
        information = np.where(np.isfinite(information), information, 0.0)
        remaining = np.trace(np.linalg.inv(np.eye(len(x)) + information), axis1=1, axis2=2) / len(x)
        return np.where(over, 1.0, np.sqrt(remaining)), rests


def smaller(reached: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factors by which signals that reach more than one of a limit are made smaller: a little more than in proportion."""
    return np.clip(0.97 / reached, 0.3, 0.97)
