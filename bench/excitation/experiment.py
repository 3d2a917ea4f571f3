"""An experiment before it is made: what is asked of which rigs, what is measured, and how much an excitation would tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.bayes_factor import Contrast, accumulate_contrast, expected_log_bayes_factor
from bench.excitation.ensemble import Ensemble
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
    noise_vector,
)
from bench.excitation.limits import Instrumented, Limits, motion_ratio
from bench.excitation.prior import Draw, RigPrior
from bench.excitation.rivals import RivalDraws, Rivals


def fan(draws: tuple[Draw, ...], step: float) -> tuple[tuple, NDArray[np.int64], NDArray[np.int64]]:
    """Rigs of an ensemble that holds each draw followed by its perturbed ones.

    Returns:
        The rigs; the place of each draw; its number of parameters.
    """
    rigs, places, counts = [], [], []
    for draw in draws:
        places.append(len(rigs))
        rigs += [draw.rig, *draw.perturbed(step)]
        counts.append(len(draw.hypothesis.parameters))
    return tuple(rigs), np.array(places), np.array(counts)


@dataclass(frozen=True, eq=False)
class Experiment(Instrumented):
    """A question about a rig, and the means of answering it.

    Attributes:
        question: A prior, whose parameters are to be identified, or rivals, of which one is to be found true.
        noise: Standard deviation of the white noise of each measured channel, in the channel's unit.
        limits: The limits; the actuators with a force limit are driven.
        draws: A fixed, small set of prior draws (of pairs for rivals) over which merits are averaged.
        threads: Threads to use.
    """

    question: RigPrior | Rivals
    noise: Mapping[str, float]  # pyrefly: ignore[bad-override]
    limits: Limits  # pyrefly: ignore[bad-override]
    draws: tuple[Draw, ...] | tuple[RivalDraws, ...] = field(repr=False)
    threads: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "noise", MappingProxyType({key: float(value) for key, value in self.noise.items()})
        )
        noise_vector(self.noise, self.channels)
        object.__setattr__(self, "draws", tuple(self.draws))
        if not self.draws:
            raise ParameterError("an experiment is weighed on draws of its prior; none came")

    def __reduce__(self) -> tuple:
        return (Experiment, (self.question, dict(self.noise), self.limits, self.draws, self.threads))

    @property
    def rigs_drawn(self) -> tuple[Draw, ...]:
        """All rigs among the draws."""
        return tuple(d for draw in self.draws for d in (draw if isinstance(draw, RivalDraws) else (draw,)))

    @property
    def timestep(self) -> float:
        """Step of the commands [s]."""
        return self.rigs_drawn[0].hypothesis.rig.timestep

    @cached_property
    def watched(self) -> Ensemble:
        """The drawn rigs with the channels that the limits watch."""
        rigs = tuple(draw.rig for draw in self.rigs_drawn)
        return Ensemble(rigs, tuple(self.limits.watched), self.actuators, self.threads)

    @cached_property
    def _fan(self) -> tuple[Ensemble, NDArray, NDArray]:
        rigs, places, counts = fan(self.rigs_drawn, INFORMATION_LIMITS.step)
        return Ensemble(rigs, self.channels, self.actuators, self.threads), places, counts

    def violation(self, controls: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest stroke or velocity over its limit, over the draws, for commands ``(n_cases, n, n_actuators)``."""
        return motion_ratio(self.watched, self.limits, controls)

    def merit(self, controls: NDArray[np.float64]) -> NDArray[np.float64]:
        """What commands are expected to tell, averaged over the draws.

        Args:
            controls: Commands ``(n_cases, n, n_actuators)`` from rest.

        Returns:
            ``(n_cases,)``: mean ``log det(I + F)`` [nat] for a prior, mean of ``log(1 + K)`` with the expected log Bayes factor
            K [nat] of each pair for rivals (the logarithm so that no easy pair makes up for a hard one).
        """
        ensemble, places, counts = self._fan
        outputs = ensemble.record(controls)
        n, weights = len(controls), 1.0 / noise_vector(self.noise, self.channels)
        p = int(counts.max())
        if isinstance(self.question, RigPrior):
            many = np.tile(counts, (n, 1))
            fisher, score = np.zeros((n, len(counts), p, p)), np.zeros((n, len(counts), p))
            square, measured = np.zeros((n, len(counts))), np.zeros((n, *outputs.shape[2:]))
            values = np.zeros((n, len(counts)))
            ensemble.spread(
                lambda a, b: accumulate(
                    a, b, outputs, many, INFORMATION_LIMITS.step, weights, measured, fisher, score, square, values
                ),
                n,
            )  # fmt: skip
            return values @ self.question.draw_weights(self.rigs_drawn)
        pairs = len(self.draws)
        contrast = Contrast.zeros(n, pairs, parameters=p)
        at = np.tile(places.reshape(pairs, 2), (n, 1, 1))
        size = np.tile(counts.reshape(pairs, 2), (n, 1, 1))
        ensemble.spread(
            lambda a, b: accumulate_contrast(
                a, b, outputs, at, size, INFORMATION_LIMITS.step, weights, contrast
            ),
            n,
        )
        return np.mean(np.log1p(np.maximum(expected_log_bayes_factor(contrast), 0.0)), axis=1)
