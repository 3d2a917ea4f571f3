"""The benches behind the environments: any number side by side, stepped together.

The single environment is one bench, the vector environment many; their numbers agree because they are the same code, and because
nothing that a bench computes depends on how many stand beside it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.excitation import Contrast, Draw, Ensemble, RigPrior, Rivals
from bench.excitation.experiment import fan
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
    misfit,
)
from bench.excitation.shaping import SHAPINGS
from bench.excitation.station import Desk
from bench.excitation.stepping import run_of
from bench.excitation.windows import Window, advance, advance_prior, advance_rivals
from bench.limits import READING_LIMITS, size_text

from .laboratory import Laboratories
from .places import StationSetup
from .setups import Setup

ENFORCEMENTS = ("terminate", "cost")
AVERAGES = ("prior", "posterior")
REWARDS = ("merit", "error")


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


@dataclass(frozen=True)
class Options:
    """What the environments can be asked for; see their documentation."""

    shaping: str = "knots"
    n_knots: int = 1
    window: float | None = None
    duration: float | None = None
    enforcement: str = "terminate"
    penalty: float = 10.0
    average: str = "prior"
    reward: str = "merit"
    terminate_when_certain: bool = False

    def __post_init__(self) -> None:
        for kind, name, known in (
            ("shaping of actions", self.shaping, SHAPINGS),
            ("enforcement of limits", self.enforcement, ENFORCEMENTS),
            ("average of rewards", self.average, AVERAGES),
            ("reward", self.reward, REWARDS),
        ):
            if name not in known:
                raise UnknownNameError(kind, str(name), known)
        if not (_is_number(self.penalty) and self.penalty >= 0.0):
            raise ParameterError(f"penalty is {self.penalty} nat; a number of at least 0 is expected")
        for name in ("window", "duration"):
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and value > 0.0):
                raise ParameterError(f"{name} is {value} s; a positive number is expected")
        require_count("n_knots", self.n_knots)


def require_count(name: str, value: Any, most: int | None = None) -> int:
    """The value of an argument that counts something.

    Raises:
        ParameterError: It is no whole number of at least one, or more than `most`.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ParameterError(f"{name} is {value}; a whole number of at least one is expected")
    if most is not None and value > most:
        raise ParameterError(f"{name} is {value}; at most {most} are expected")
    return int(value)


def _check_size(numbers: int, what: str) -> None:
    """Refuse what would take more memory than any file that is read may.

    Raises:
        ParameterError: It would.
    """
    if numbers > READING_LIMITS.numbers:
        raise ParameterError(
            f"{what} takes {size_text(8.0 * numbers)}, and at most {size_text(8.0 * READING_LIMITS.numbers)} are taken: ask for shorter "
            "episodes, or for fewer environments or draws"
        )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


class Outcome(NamedTuple):
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
        _check_size(
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

    def step(self, places: NDArray[np.int64], actions: NDArray) -> Outcome:
        """Run the next window on some benches.

        Args:
            places: Benches, ascending ``(m,)``.
            actions: Actions ``(m, width)``, finite; clipped to −1 … 1.

        Raises:
            ParameterError: Actions of another shape, or not finite. No bench has moved.
        """
        actions = np.clip(self._checked(actions, len(places)), -1.0, 1.0)
        commands, exhausted = self.desk.commands(places, actions)
        measured, lost = self._measured(places, commands)
        reached = self.desk.book(places, measured)
        reached[lost] = SETTINGS.lost
        self.desk.window[places] += 1
        observation = self.desk.observe(places, measured, commands, actions, self.question)
        gain, effective = self._told(places, measured)
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
        return Outcome(observation, gain - cost, terminated, truncated, info)

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


class _Panel(NamedTuple):
    """The prior draws of all questions as one ensemble, and where each question's lie in it."""

    ensemble: Ensemble
    members: NDArray[np.int64]  # (n_questions, n_members), −1 beyond a question's own
    n_members: NDArray[np.int64]  # (n_questions,)
    counts: NDArray[np.int64]  # (n_questions, n_draws) parameters, −1 for none
    places: NDArray[np.int64]  # (n_questions, n_draws) among a question's members
    weights: NDArray[np.float64]  # (n_questions, n_draws) prior weights


class _Account(NamedTuple):
    """A window on the prior draws under way."""

    window: Window
    # states, information, score, square and contrast of the benches that run
    books: list[NDArray[np.float64]]
    values: NDArray[np.float64]  # (m, n_draws) or (m, n_pairs), written


@lru_cache(maxsize=16)
def _panel(setup: Setup, threads: int) -> _Panel:
    rigs: list = []
    parts = []
    for experiment in setup.experiments:
        own, places, counts = fan(experiment.rigs_drawn, INFORMATION_LIMITS.step)
        parts.append((len(rigs), len(own), places, counts))
        rigs += own
    n_draws = max(len(part[2]) for part in parts)
    width = max(part[1] for part in parts)
    shape = (len(parts), n_draws)
    members = np.full((len(parts), width), -1, dtype=np.int64)
    counts, places = np.full(shape, -1, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    weights = np.zeros(shape)
    for i, (first, size, at, count) in enumerate(parts):
        members[i, :size] = np.arange(first, first + size)
        counts[i, : len(count)], places[i, : len(at)] = count, at
        question, drawn = setup.questions[i], setup.experiments[i].rigs_drawn
        weights[i, : len(count)] = (
            question.draw_weights(drawn) if isinstance(question, RigPrior) else 1.0 / len(drawn)
        )
    sizes = np.array([part[1] for part in parts], dtype=np.int64)
    ensemble = Ensemble(tuple(rigs), tuple(setup.noise), setup.limits.actuators, threads)
    return _Panel(ensemble, members, sizes, counts, places, weights)


class Benches(SteppedBenches):
    """Laboratories with hidden rigs, and the experimenter's books on them; the merit is averaged over prior draws."""

    def __init__(self, setup: Setup, options: Options, n: int, threads: int = 1) -> None:
        """Set up benches; each must be `reset` before it is stepped."""
        super().__init__(setup, options, n)
        self.setup: Setup = setup
        self.threads = threads
        self.channels, self.actuators = self.station.channels, self.station.actuators
        hypotheses = [
            h
            for q in setup.questions
            for h in (q.hypotheses if isinstance(q, RigPrior) else (q.first, q.second))
        ]
        self._laboratories = Laboratories(
            tuple(hypotheses), n, channels=self.channels, actuators=self.actuators, threads=(threads + 1) // 2
        )  # the other half of the threads runs the prior draws meanwhile
        self._noise = self.desk.noise
        panel = _panel(setup, threads)
        draws, p = panel.counts.shape[1], int(panel.counts.max())
        self.question = np.zeros(n, dtype=np.int64)
        self._states = np.zeros((n, panel.members.shape[1], panel.ensemble.n_states))
        _check_size(
            n * draws * (p * p + p), f"what is known of {draws} draws in {n} environment{'s' * (n > 1)}"
        )
        self._fisher, self._score = np.zeros((n, draws, p, p)), np.zeros((n, draws, p))
        self._square = np.zeros((n, draws))
        self._contrast = Contrast.zeros(n, draws // 2, parameters=p) if self._rivals else None
        self._values = np.zeros((n, draws // 2 if self._rivals else draws))
        self._account: _Account | None = None

    def reset(self, places: NDArray[np.int64], rngs: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """Put new hidden rigs, at rest, into some benches; return what their sensors show at rest.

        Args:
            places: Benches, ascending ``(m,)``.
            rngs: Generators of all benches; only those of `places` are drawn from.
        """
        panel = _panel(self.setup, self.threads)
        for place in places:
            rng = rngs[place]
            self.question[place] = rng.integers(len(self.setup.questions))
            question = self.setup.questions[self.question[place]]
            self.truth[place] = (question if isinstance(question, RigPrior) else question.prior).draw(rng)
            self._laboratories.install(int(place), self.truth[place])
            rng.standard_normal(out=self._disturbance[place])
        self.desk.begin(places)
        for array in (
            self._merit,
            self._fisher,
            self._score,
            self._square,
            self._values,
        ):
            array[places] = 0.0
        for array in self._contrast or ():
            array[places] = 0.0
        self._states[places] = panel.ensemble.start(panel.members[self.question[places]])
        m = len(places)
        measured = self._noise * self._disturbance[places, -1]
        rest = np.zeros((m, self.n_steps, len(self.actuators)))
        return self.desk.observe(places, measured, rest, np.zeros((m, self.width)), self.question)

    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        self._account = self._opened(places, commands)  # of which other threads take care meanwhile
        ideal = self._laboratories.run(places, commands)
        noise = self._noise * self._disturbance[places, self.desk.window[places] % self.n_windows]
        return sensed(ideal, noise)

    def _opened(self, places: NDArray[np.int64], commands: NDArray[np.float64]) -> _Account:
        """Begin to run the window on all prior draws."""
        panel = _panel(self.setup, self.threads)
        asked = self.question[places]
        books = [self._states, self._fisher, self._score, self._square, *(self._contrast or ())]
        if len(places) < self.n:
            books = [np.ascontiguousarray(book[places]) for book in books]
        states, fisher, score, square, *contrast = books
        run = run_of(
            panel.ensemble.packed,
            commands,
            states,
            members=panel.members[asked],
            counts=panel.n_members[asked],
            timestep=self.timestep,
            clock=self._clock(places),
        )
        weights, counts = 1.0 / self._noise, panel.counts[asked]
        if self._rivals:
            pairs = counts.reshape(len(places), -1, 2)
            at, values = panel.places[asked].reshape(pairs.shape), np.zeros(pairs.shape[:2])
            window = advance_rivals(panel.ensemble, run, at, pairs, weights, Contrast(*contrast), values)
        elif self.options.average == "prior":
            values = np.zeros(counts.shape)
            window = advance_prior(panel.ensemble, run, counts, weights, (fisher, score, square), values)
        else:
            values = np.zeros(counts.shape)
            window = advance(panel.ensemble, run)
        return _Account(window, books, values)

    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        panel, m = _panel(self.setup, self.threads), len(places)
        asked = self.question[places]
        assert self._account is not None  # `_measured` opened it
        (window, books, values), self._account = self._account, None
        _, fisher, score, square, *_ = books
        window.finish()
        if self.options.average == "posterior":
            counts, weights = panel.counts[asked], 1.0 / self._noise
            logarithms = np.zeros(counts.shape)
            panel.ensemble.spread(
                lambda a, b: accumulate(
                    a,
                    b,
                    window.outputs,
                    counts,
                    INFORMATION_LIMITS.step,
                    weights,
                    measured,
                    fisher,
                    score,
                    square,
                    logarithms,
                ),
                m,
            )
            values = values if self._rivals else logarithms
        if self._rivals:
            values = np.log1p(np.maximum(values, 0.0))
        values = np.where(
            np.isfinite(values), values, self._values[places]
        )  # of a draw that diverged: no more
        if m < self.n:
            whole = (self._states, self._fisher, self._score, self._square, *(self._contrast or ()))
            for book, part in zip(whole, books, strict=True):
                book[places] = part
        probability = self._probability(panel.weights[asked], fisher, score, square, self.desk.window[places])
        if self._rivals:
            probability = probability.reshape(m, -1, 2).sum(axis=2)
        gain = np.sum(probability * (values - self._values[places]), axis=1)
        self._values[places] = values
        self._merit[places] += gain
        return gain, 1.0 / np.sum(probability**2, axis=1)

    def _probability(
        self, prior: NDArray, fisher: NDArray, score: NDArray, square: NDArray, windows: NDArray
    ) -> NDArray[np.float64]:
        """Weights of the prior draws ``(m, n_draws)``: the prior's own, or given the measurements so far.

        A handful of draws never meets the hidden rig within the noise, so that the noise level of the sensors would put all
        weight on one of them. The level of the misfit is taken as unknown instead (Jeffreys' prior) and a window as one
        independent observation of it, which makes the likelihood a power of the misfit.
        """
        if self.options.average == "prior":
            return prior
        remainder = np.log(np.maximum(misfit(fisher, score, square), 1e-300))
        logarithm = np.log(np.maximum(prior, 1e-300)) - 0.5 * windows[:, None] * remainder
        weight = np.exp(logarithm - logarithm.max(axis=1, keepdims=True)) * (prior > 0.0)
        return weight / weight.sum(axis=1, keepdims=True)

    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """One over the sum of the squared prior weights of the draws (of the pairs, for rivals) ``(m,)``."""
        weights = _panel(self.setup, self.threads).weights[self.question[places]]
        if self._rivals:
            weights = weights.reshape(len(places), -1, 2).sum(axis=2)
        return 1.0 / np.sum(weights**2, axis=1)

    def positions(self, place: int) -> NDArray[np.float64]:
        """Joint positions of a bench's rig, to be looked at."""
        return self._laboratories.positions(place)
