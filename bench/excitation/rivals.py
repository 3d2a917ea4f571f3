"""Two rival explanations of the same joint, and draws in which the one imitates the other as well as it can."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.excitation.ensemble import Ensemble
from bench.excitation.information import (
    INFORMATION_LIMITS,
)
from bench.excitation.prior import Draw, RigHypothesis, RigPrior


@dataclass(frozen=True)
class RivalsSettings:
    """Numbers of `bench.excitation.rivals`."""

    rounds: int = 20
    settled: float = 1e-6
    """Steps of a fit, rejected ones included, and the relative change of the misfit at which it ends before."""
    bound: float = math.sqrt(3.0)


SETTINGS = RivalsSettings()


class RivalDraws(NamedTuple):
    """A rig under each of two hypotheses."""

    first: Draw
    second: Draw


@dataclass(frozen=True, eq=False)
class Rivals:
    """Two hypotheses of which one holds.

    Attributes:
        name: Name of the question, as "gap_cubic".
        first: One hypothesis.
        second: The other.
    """

    name: str
    first: RigHypothesis
    second: RigHypothesis

    @property
    def prior(self) -> RigPrior:
        """Both hypotheses, equally likely."""
        return RigPrior((self.first, self.second))

    def draws(
        self,
        n: int,
        rng: np.random.Generator,
        *,
        reference: NDArray[np.float64],
        channels: tuple[str, ...],
        actuators: tuple[str, ...],
        noise: NDArray[np.float64],
    ) -> tuple[RivalDraws, ...]:
        """Draw pairs that are hard to tell apart: a rig of one hypothesis, and the other's best imitation of it.

        Two independent draws would differ in what both hypotheses leave open, such as their stiffness at rest, and tell
        nothing of the question. The imitation is fitted to the record under `reference`, the prior included.

        Args:
            n: Number of pairs; the first and the second hypothesis lead in turn.
            rng: Source of randomness.
            reference: Commands ``(n_samples, n_actuators)`` of a middling test.
            channels: Measured channels.
            actuators: Driven actuators.
            noise: Standard deviations of the channels' noise ``(n_channels,)``.
        """
        leaders = [
            *RigPrior((self.first,)).draws(n - n // 2, rng),
            *(RigPrior((self.second,)).draws(n // 2, rng) if n > 1 else ()),
        ]
        pairs = []
        for leader in leaders:
            other = self.second if leader.hypothesis is self.first else self.first
            record = Ensemble((leader.rig,), channels, actuators).record(reference[None])[0, 0]
            follower = imitate(
                other, record, reference=reference, channels=channels, actuators=actuators, noise=noise
            )
            swap = leader.hypothesis is not self.first
            pairs.append(RivalDraws(follower, leader) if swap else RivalDraws(leader, follower))
        return tuple(pairs)


def imitate(
    hypothesis: RigHypothesis,
    record: NDArray[np.float64],
    *,
    reference: NDArray[np.float64],
    channels: tuple[str, ...],
    actuators: tuple[str, ...],
    noise: NDArray[np.float64],
) -> Draw:
    """The most probable rig of a hypothesis given a record (Levenberg-Marquardt on the standardised parameters).

    Args:
        hypothesis: The hypothesis.
        record: Channels ``(n, n_channels)``.
        reference: Commands that produced it ``(n, n_actuators)``.
        channels: Their names.
        actuators: Names of the actuators.
        noise: Standard deviations ``(n_channels,)``.
    """
    x = np.zeros(len(hypothesis.parameters))

    def misfit(coordinates: NDArray, *, derive: bool) -> tuple[NDArray, NDArray]:
        draw = hypothesis.at(coordinates)
        rigs = (draw.rig, *draw.perturbed(INFORMATION_LIMITS.step)) if derive else (draw.rig,)
        outputs = Ensemble(rigs, channels, actuators).record(reference[None])[0]
        whitened = (outputs / noise).reshape(len(rigs), -1)
        residual = (record / noise).ravel() - whitened[0]
        return residual, ((whitened[1:] - whitened[0]) / INFORMATION_LIMITS.step).T

    residual, jacobian = misfit(x, derive=True)
    cost = residual @ residual + x @ x
    damping = 1.0
    for _ in range(SETTINGS.rounds):
        normal = jacobian.T @ jacobian + np.eye(x.size)
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), jacobian.T @ residual - x)
        trial = np.clip(x + step, -SETTINGS.bound, SETTINGS.bound)
        new, _ = misfit(trial, derive=False)
        new_cost = new @ new + trial @ trial
        settled = abs(cost - new_cost) < SETTINGS.settled * cost
        if new_cost < cost:
            x, cost, damping = trial, new_cost, damping / 5.0
            residual, jacobian = misfit(x, derive=True)
        else:
            damping *= 5.0
        if settled:
            break
    return hypothesis.at(x)
