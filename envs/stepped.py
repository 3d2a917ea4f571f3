"""Benches that are stepped window by window: the clock, the limits and the account that all environments share."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation import Draw, Rivals
from bench.excitation.station import Desk

from .coverage import CoverageReward
from .options import Options, check_size
from .places import StationSetup


@dataclass(frozen=True)
class BenchesSettings:
    """Numbers of `envs.benches`."""

    certain: float = math.log(99.0)
    """Log Bayes factor of 99 % certainty between two rivals that were equally likely [nat]."""
    lost: float = 10.0
    """Fraction of the limits that is reported where a simulation diverged; ends the episode like the limit switch."""


SETTINGS = BenchesSettings()

FLOATS = (
    "merit", "gain", "cost", "stroke", "velocity", "force", "energy", "time", "effective_draws", "separated"
)  # fmt: skip
"""Entries of `info`, all floats; see the environments."""


class StepOutcome(NamedTuple):
    """What a step of several benches gives; m of them."""

    observation: NDArray[np.float32]  # (m, n_observations)
    reward: NDArray[np.float64]  # (m,)
    terminated: NDArray[np.bool_]  # (m,)
    truncated: NDArray[np.bool_]  # (m,)
    info: dict[str, Any]  # arrays (m,)


def sensed(ideal: NDArray, disturbance: NDArray) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """What sensors show in a window, and which simulations diverged, of which nothing more can be measured.

    Args:
        ideal: What perfect sensors show ``(m, n_steps, n_channels)``; zeroed where a simulation diverged.
        disturbance: What the sensors add ``(m, n_steps, n_channels)``.
    """
    lost = np.logical_not(np.isfinite(ideal).all(axis=(1, 2)))
    ideal[lost] = 0.0
    return ideal + disturbance, lost


class SteppedBenches(ABC):
    """Benches that are stepped a window at a time, and the experimenter's books on them.

    How a window is run, and what it tells, is left to the kind of bench.

    Attributes:
        setup: The laboratory and its questions.
        options: What was asked for.
        n: Number of benches.
        timestep: Interval of commands and measurements [s].
        n_steps: Steps a window.
        n_windows: Windows an episode.
        station: What is measured and allowed.
        desk: The experimenter's books.
        truth: The hidden rigs.
        question: Question asked of each bench ``(n,)``.
    """

    question: NDArray[np.int64]
    _values: NDArray[np.float64]  # worth of the records so far, by bench (and draw, or pair of rivals) [nat]

    def __init__(self, setup: StationSetup, options: Options, n: int) -> None:
        """Set up the books; each bench must be `reset` before it is stepped.

        Raises:
            ParameterError: A window is shorter than a step, an episode shorter than a window, or a window not made of `n_knots`
                parts of whole steps.
        """
        self.setup, self.options, self.n = setup, options, n
        self.timestep = setup.timestep
        self.n_steps = round((options.window or setup.window) / self.timestep)
        self.n_windows = (
            round((options.duration or setup.duration) / (self.n_steps * self.timestep))
            if self.n_steps
            else 0
        )
        if self.n_steps < 1 or self.n_windows < 1:
            raise ParameterError(
                f"a window of {options.window} s and an episode of {options.duration} s came; a window takes at least one step "
                f"of {self.timestep:g} s and an episode at least one window"
            )
        if options.shaping == "knots" and self.n_steps % options.n_knots:
            raise ParameterError(
                f"n_knots is {options.n_knots} in a window of {self.n_steps} steps; a number that divides them is expected"
            )
        check_size(
            n * (self.n_windows + 1) * self.n_steps * len(setup.noise),
            f"an episode of {n} environment{'s' * (n > 1)}",
        )
        self._merit = np.zeros(n)
        self.station = setup.station(
            self.n_steps, self.n_windows, shaping=options.shaping, n_knots=options.n_knots
        )
        self.desk = Desk(self.station, n)
        self.truth: list[Draw | None] = [None] * n
        self._rivals = isinstance(setup.questions[0], Rivals)
        self._coverage = CoverageReward(setup, n) if options.reward == "coverage" else None
        # The sensors' noise of an episode and, last, of the rest before it: drawn at once, which is faster.
        self._disturbance = np.zeros((n, self.n_windows + 1, self.n_steps, len(self.station.channels)))

    @property
    def width(self) -> int:
        """Length of an action."""
        return self.desk.shaping.width

    @property
    def n_observations(self) -> int:
        """Length of an observation."""
        return self.desk.n_observations

    @abstractmethod
    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """Effective number of the draws that the reward is averaged over, at the start of an episode ``(m,)``."""

    @abstractmethod
    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Run the next window under commands ``(m, n_steps, n_actuators)``.

        Returns:
            What was measured ``(m, n_steps, n_channels)``, and whether the simulation diverged ``(m,)``.
        """

    @abstractmethod
    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Book what the window that was run last tells: growth of the merit [nat] and effective number of draws ``(m,)``."""

    def step(self, places: NDArray[np.int64], actions: NDArray) -> StepOutcome:
        """Run the next window on some benches.

        Args:
            places: Benches, ascending ``(m,)``.
            actions: Actions ``(m, width)``, finite; clipped to −1 … 1.

        Raises:
            ParameterError: Actions of another shape, or not finite. No bench has moved.
        """
        actions = np.clip(self._checked(actions, len(places)), -1.0, 1.0)
        commands, exhausted = self.desk.commands(places, actions)
        if self._coverage is not None:
            self._coverage.begin(places[self.desk.window[places] == 0])
        measured, lost = self._measured(places, commands)
        reached = self.desk.book(places, measured)
        reached[lost] = SETTINGS.lost
        self.desk.window[places] += 1
        observation = self.desk.observe(places, measured, commands, actions, self.question)
        gain, effective = self._worth(places, measured)
        over = reached > 1.0
        stop = lost | (over[:, 0] & (self.options.enforcement == "terminate"))
        excess = np.minimum(np.maximum(reached - 1.0, 0.0), 1.0).sum(axis=1)
        cost = self.options.penalty * np.where(stop, 1.0, excess)
        separated = self._separated(places)
        certain = (separated >= 1.0) & self.options.terminate_when_certain
        terminated = stop | exhausted | certain
        truncated = ~terminated & (self.desk.window[places] >= self.n_windows)
        info: dict[str, Any] = {
            "merit": self._merit[places],
            "gain": gain,
            "cost": cost,
            "stroke": reached[:, 0],
            "velocity": reached[:, 1],
            "force": np.max(np.abs(commands) / self.desk.force, axis=(1, 2)),
            "energy": np.max(self.desk.energy[places] / self.desk.budget, axis=1),
            "time": self.desk.window[places] * (self.n_steps * self.timestep),
            "effective_draws": effective,
            "separated": separated,
            "violation": over.any(axis=1),
        }
        return StepOutcome(observation, gain - cost, terminated, truncated, info)

    def _worth(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Growth of the merit by the window that was run last [nat], and effective number of draws ``(m,)``."""
        if self._coverage is None:
            return self._told(places, measured)
        gain = self._coverage.gain(places, measured)
        self._merit[places] += gain
        return gain, self.effective_draws(places)

    def _checked(self, actions: NDArray, m: int) -> NDArray[np.float64]:
        given = np.asarray(actions)
        if given.dtype.kind not in "fiu":
            raise ParameterError(f"an action of type {given.dtype} came; real numbers in −1 … 1 are expected")
        numbers = given.astype(float)
        if numbers.shape != (m, self.width):
            came, expected = numbers.shape, (m, self.width)
            if m == 1 and numbers.ndim:  # the single environment's view of it
                came, expected = came[1:], expected[1:]
            raise ParameterError(f"an action of shape {came} came; {expected} is expected")
        if not np.isfinite(numbers).all():
            bench, entry = (int(i) for i in np.argwhere(~np.isfinite(numbers))[0])
            raise ParameterError(
                f"entry {entry} of the action of environment {bench} is {numbers[bench, entry]}; numbers in −1 … 1 are expected"
            )
        return numbers

    def _separated(self, places: NDArray) -> NDArray[np.float64]:
        """Share of a bench's pairs of rivals that are expected to be told apart with 99 % certainty ``(m,)``."""
        if not self._rivals:
            return np.zeros(len(places))
        certain = self._values[places].reshape(len(places), -1) >= math.log1p(SETTINGS.certain)
        return np.count_nonzero(certain, axis=1) / certain.shape[1]

    def _clock(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """Time at which the next window begins ``(m,)`` [s]."""
        return (self.n_steps * self.timestep) * self.desk.window[places].astype(float)
