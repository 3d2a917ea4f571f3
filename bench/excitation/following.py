"""Identification that follows a record as it grows, at a small and equal price at any time.

Rigs of every hypothesis, spread over the prior, run beside the test from its start, so that the likeliest of each is known at any
time without a search. From it, or from what was found before, single steps of least squares are taken on the record so far, one
hypothesis at a time; a rig of the bank that explains the record better takes the place of what was found.

References:
    Voss, Timmer, Kurths 2004, Int. J. Bifurcation and Chaos 14(6) (horizons that grow, against local minima);
    Kass, Raftery 1995, J. American Statistical Association 90(430), section 4.1 (Laplace's approximation of the evidence).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.excitation.estimation import (
    ESTIMATION_SETTINGS,
    spread_points,
    squared_residuals,
)
from bench.excitation.family import Family, fans
from bench.excitation.information import INFORMATION_LIMITS, accumulate
from bench.excitation.stepping import Packed, integrate_cases


@dataclass(frozen=True)
class FollowingSettings:
    """Numbers of `bench.excitation.following`."""

    rigs: int = 64
    """Of each hypothesis that run beside a test; as many as the planner's identification starts from."""
    possible: int = 12
    unexplained: float = 3.0
    steps: int = 4000
    """Rigs that the record left possible when a step was last taken, tried beside the next one where noise does not explain what is
    left: where the sum of squares is so many of its standard deviations above its mean; and the integration steps they may take."""
    damping: float = 1e-2
    dampings: tuple[float, float] = (1e-9, 1e6)
    """Damping of a first step, its least, and that from which a search begins anew."""


SETTINGS = FollowingSettings()


@dataclass(frozen=True, eq=False)
class Bank:
    """Rigs of a hypothesis spread over its prior.

    Attributes:
        family: The hypothesis' rigs.
        log_weight: Logarithm of its prior probability.
        points: The rigs, standardised ``(n_rigs, p)``.
        packed: The same for `integrate_cases`.
    """

    family: Family
    log_weight: float
    points: NDArray[np.float64] = field(repr=False)
    packed: Packed = field(repr=False)

    @classmethod
    def of(cls, family: Family, weight: float) -> Bank:
        """A bank of as many rigs as the settings say, always the same."""
        points = spread_points(SETTINGS.rigs, family.n_parameters)
        return cls(family, float(np.log(weight)), points, family.packed(points))


class Alongside:
    """Rigs of a family that run beside a test.

    Attributes:
        points: The rigs, standardised ``(n_rigs, p)``.
        costs: Squared whitened residuals of the record so far and squared coordinates ``(n_rigs,)``; infinite where one diverged.
    """

    def __init__(self, points: NDArray[np.float64], packed: Packed, timestep: float) -> None:
        """Begin at rest."""
        self.points, self.costs = points, np.sum(points**2, axis=1)
        self._packed, self._timestep = packed, timestep
        self._states, self._length = packed.start[None].copy(), 0

    def run(self, record: Follower) -> NDArray[np.float64]:
        """Run to where a record has come; channels of the rigs since the last time ``(1, n_rigs, n, n_channels)``."""
        begin, n = self._length, len(self.points)
        controls, measured = (
            rows[None, begin : record.length] for rows in (record.controls, record.measured)
        )
        outputs = integrate_cases(
            self._packed, controls, self._states, members=np.arange(n)[None], counts=np.array([n]),
            timestep=self._timestep, clock=np.array([begin * self._timestep]),
        )  # fmt: skip
        np.clip(outputs, -record.shown, record.shown, out=outputs)
        squares = np.empty((1, n))
        squared_residuals(outputs, measured, record.weights, np.array([record.length - begin]), squares)
        self.costs = self.costs + np.where(np.isfinite(squares[0]), squares[0], np.inf)
        self._length = record.length
        return outputs

    def best(self) -> Alongside:
        """The rig of the least cost alone, where it is."""
        i = int(np.argmin(self.costs))
        alone = Alongside(self.points[i : i + 1], self._packed.alone(i), self._timestep)
        alone.costs, alone._length = self.costs[i : i + 1], self._length
        alone._states = self._states[:, i : i + 1].copy()
        return alone


@dataclass(eq=False)
class Found:
    """What was found of a hypothesis.

    Attributes:
        rig: It, running beside the test.
        inner: Information with that of the prior, where a step was last taken ``(p, p)``.
        damping: Of the next step.
    """

    rig: Alongside
    inner: NDArray[np.float64]
    damping: float = SETTINGS.damping

    @property
    def x(self) -> NDArray[np.float64]:
        """The rig, standardised ``(p,)``."""
        return self.rig.points[0]

    @property
    def cost(self) -> float:
        """Its squared whitened residual and squared coordinates."""
        return float(self.rig.costs[0])


class Follower:
    """What a record tells of one rig while it is measured.

    Attributes:
        weights: One over the noise standard deviations ``(n_channels,)``.
        shown: Largest magnitude that is shown of each channel ``(n_channels,)``; what is more is cut off, of rigs as of the record.
        controls: Commands so far ``(n_samples, n_actuators)``.
        measured: Channels so far ``(n_samples, n_channels)``.
        length: Samples so far.
        steps: Integration steps of rigs that identification has taken, the banks apart.
        found: By hypothesis; None where nothing was looked for.
    """

    def __init__(
        self,
        banks: tuple[Bank, ...],
        noise: NDArray[np.float64],
        n_samples: int,
        n_actuators: int,
        seed: int = 0,
        shown: NDArray[np.float64] | float = np.inf,
    ) -> None:
        """Begin a test.

        Args:
            banks: A bank for each hypothesis.
            noise: Standard deviations of the channels ``(n_channels,)``.
            n_samples: Samples of the whole test.
            n_actuators: Actuators that are driven.
            seed: Seed of the rigs that are tried.
            shown: Largest magnitude that is shown of each channel ``(n_channels,)``.
        """
        self._banks, self.weights, self.shown = banks, 1.0 / noise, np.broadcast_to(shown, noise.shape)
        self.controls, self.measured = np.zeros((n_samples, n_actuators)), np.zeros((n_samples, len(noise)))
        self.length = self.steps = 0
        self.found: list[Found | None] = [None] * len(banks)
        self._running = [Alongside(bank.points, bank.packed, bank.family.timestep) for bank in banks]
        self._run = 0  # samples that the banks have run
        self._rng = np.random.default_rng(seed)

    def append(self, controls: NDArray[np.float64], measured: NDArray[np.float64]) -> None:
        """Take in what was commanded ``(n, n_actuators)`` and measured ``(n, n_channels)`` since."""
        end = self.length + len(controls)
        self.controls[self.length : end], self.measured[self.length : end] = controls, measured
        self.length = end

    def run_banks(self) -> None:
        """Run the banks up to now; where that is left out, they fall behind, and no longer take part."""
        for rigs in self._running:
            rigs.run(self)
        self._run = self.length

    def improve(self, kind: int) -> float:
        """Take a step of least squares for a hypothesis on the record so far.

        Returns:
            How much less the cost is by it; 0 where nothing better was found, infinity where nothing was known.
        """
        family, found = self._banks[kind].family, self.found[kind]
        before = np.inf if found is None else self._brought_up(found).cost
        if self._run == self.length:
            likeliest = self._running[kind].best()
            if likeliest.costs[0] < before:
                found = Found(likeliest, np.eye(family.n_parameters))
        if found is None:
            return 0.0
        self.found[kind] = found
        self._step(family, found)
        return before - found.cost if np.isfinite(found.cost) else 0.0

    def _brought_up(self, found: Found) -> Found:
        """What was found, its cost that of the record so far."""
        found.rig.run(self)
        return found

    def _from_rest(
        self, family: Family, points: NDArray[np.float64]
    ) -> tuple[Alongside, NDArray[np.float64]]:
        """Rigs run over the whole record so far, and their channels."""
        rigs = Alongside(points, family.packed(points), family.timestep)
        self.steps += len(points) * self.length
        return rigs, rigs.run(self)

    def _step(self, family: Family, found: Found) -> None:
        """A step of Levenberg and Marquardt, the best of three dampings, or to one of the rigs that were possible before."""
        p, n = family.n_parameters, self.length
        x, step = found.x, INFORMATION_LIMITS.step
        _, outputs = self._from_rest(family, fans(x, step))
        fisher, scores, unused = (
            np.zeros((1, 1, p, p)),
            np.zeros((1, 1, p)),
            (np.zeros((1, 1)), np.zeros((1, 1))),
        )
        counts = np.array([[p]])
        accumulate(
            0, 1, outputs, counts, step, self.weights, self.measured[None, :n], fisher, scores, *unused
        )
        information, score = fisher[0, 0], scores[0, 0]
        if not (np.isfinite(information).all() and np.isfinite(score).all()):
            return
        inner = information + np.eye(p)
        dampings = found.damping * ESTIMATION_SETTINGS.dampings
        damped = inner + dampings[:, None, None] * (inner * np.eye(p))
        moves = np.linalg.solve(damped, np.broadcast_to((score - x)[:, None], (len(dampings), p, 1)))
        moves = moves[..., 0]
        freedom = n * len(self.weights)
        if found.cost > freedom + SETTINGS.unexplained * np.sqrt(2.0 * freedom):
            draws = self._rng.standard_normal((min(SETTINGS.possible, SETTINGS.steps // n), p))
            moves = np.concatenate([moves, np.linalg.solve(np.linalg.cholesky(found.inner).T, draws.T).T])
        trials = np.clip(x + moves, -ESTIMATION_SETTINGS.bound, ESTIMATION_SETTINGS.bound)
        rigs, _ = self._from_rest(family, trials)
        best = int(np.argmin(rigs.costs))
        found.inner = inner
        if rigs.costs[best] < found.cost:
            found.rig = rigs.best()
            stepped = best < len(dampings)
            found.damping = max(float(dampings[best]), SETTINGS.dampings[0]) if stepped else SETTINGS.damping
        else:
            stuck = 100.0 * found.damping > SETTINGS.dampings[1]
            found.damping = SETTINGS.damping if stuck else 100.0 * found.damping

    def log_odds(self) -> dict[int, float]:
        """Log odds of each hypothesis of which something was found against the likeliest one [nat], the likeliest first."""
        evidence = {
            kind: self._banks[kind].log_weight
            - 0.5 * (self._brought_up(found).cost + np.linalg.slogdet(found.inner)[1])
            for kind, found in enumerate(self.found)
            if found is not None
        }
        most = max(evidence.values(), default=0.0)
        return {kind: value - most for kind, value in sorted(evidence.items(), key=lambda item: -item[1])}
