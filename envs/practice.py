"""Practice benches: the environments for training, some four times as fast and with the reward taken at each rig itself.

An adaptive excitation is worth what it tells about the rig that it adapted to, averaged over rigs: the mean of this reward over episodes
is that expectation under the prior. The registered environments average the merit over a fixed handful of draws under the commands
of the episode instead, as a laboratory could; a policy that follows the hidden rig's resonance gets little of that, because the
draws have other resonances. Policies see the same here as there, and nothing of the hidden rig; only their teacher knows it.

With ``reward="error"`` the rigs have a background besides, see `bench.excitation.background`, and the reward is what an identification
that does not know it gains: minus the logarithm of its expected error. Of the rewards that were tried this one ranks the error that
identification leaves of a record (docs/excitation.md).

Rigs are compiled `Family` members, equal to MuJoCo to rounding. Bench i hides a rig of hypothesis (or question) i modulo their number,
or of one that is drawn in each episode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation import Contrast, Draw, Family, RigHypothesis, Rivals, expected_log_bayes_factor, fans
from bench.excitation.background import SETTINGS as BACKGROUND_SETTINGS
from bench.excitation.background import BackgroundTerm, expected_error, with_background
from bench.excitation.bayes_factor import accumulate_contrast
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
)
from bench.excitation.station import Desk
from bench.excitation.stepping import Packed, integrate_cases

from .background import background_of
from .options import Options
from .setups import Setup, made, rival_experiment
from .stepped import SteppedBenches, sensed


@dataclass(frozen=True)
class PracticeSettings:
    """Numbers of `envs.practice`."""

    floor: float = 0.005
    """Error in prior standard deviations that the value takes for nothing, root mean square over the parameters. Sensitivities grow
    without bound where motion is chaotic (a rig that keeps grazing its gap's edges), and no identification gets that from a record:
    without the floor policies learn to claim errors in the gap a hundred times smaller than what identification leaves."""
    pairs_kept: int = 24
    """Pairs of rivals, each the other's best imitation, that a question's rigs are taken from."""


PRACTICE_SETTINGS = PracticeSettings()


class _Fan:
    """The rigs of a hypothesis on some benches, each followed by its perturbed ones, or alone where the step is zero."""

    def __init__(
        self,
        hypothesis: RigHypothesis,
        n: int,
        channels: tuple[str, ...],
        actuators: tuple[str, ...],
        step: float = INFORMATION_LIMITS.step,
    ):
        self.family = Family(hypothesis, channels, actuators)
        self.p = self.family.n_parameters
        self.coordinates = np.zeros((n, self.p))
        self._step, self._size = step, 1 + self.p if step else 1
        self._packed: Packed = self.family.packed(self._around(self.coordinates).reshape(-1, self.p))
        self._states = self._packed.start.reshape(n, self._size, -1).copy()
        self._members = np.arange(n * self._size).reshape(n, self._size)

    def _around(self, coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
        return fans(coordinates, self._step)[..., : self._size, :]

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_packed"}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__dict__.update(saved)  # addresses of kernels hold in one process
        self._packed = self.family.packed(self._around(self.coordinates).reshape(-1, self.p))

    def install(self, place: int, coordinates: NDArray[np.float64]) -> None:
        """Put a rig at rest on a bench."""
        self.coordinates[place] = coordinates
        fresh = self.family.packed(self._around(coordinates))
        rows = self._members[place]
        for name in ("constants", "coefficients", "theta"):
            getattr(self._packed, name)[rows] = getattr(fresh, name)
        self._states[place] = fresh.start

    def run(self, places: NDArray[np.int64], commands: NDArray[np.float64], clock: NDArray) -> NDArray:
        """Channels ``(m, 1 + p, n, n_channels)`` of the next window."""
        states = self._states[places]
        outputs = integrate_cases(
            self._packed,
            commands,
            states,
            members=self._members[places],
            counts=np.full(len(places), self._size),
            timestep=self.family.timestep,
            clock=clock,
        )
        self._states[places] = states
        return outputs


class _Priors:
    """Benches of one hypothesis of a prior; the value is ``-p log(tr((I + F)^-1) / p + FLOOR^2)``.

    Above the floor it is ``log det(I + F)`` where all directions are known equally well, and less where one lags behind: minus 2 p times
    the logarithm of the expected error, root mean square over the parameters. Trained for the determinant, policies went for sensitive
    motions that multiply what is known well already (Bouc-Wen's weakest direction stayed at a quarter of the prior).
    """

    step = INFORMATION_LIMITS.step

    def __init__(self, hypothesis: RigHypothesis, n: int, desk: Desk) -> None:
        self.fan = _Fan(hypothesis, n, desk.station.channels, desk.station.actuators, self.step)
        p = self.fan.p
        self._weights = 1.0 / desk.noise
        self._sums = [np.zeros((n, 1, p, p)), np.zeros((n, 1, p)), np.zeros((n, 1))]

    def reset(self, place: int, rng: np.random.Generator) -> Draw:
        bound = np.sqrt(3.0)
        self.fan.install(place, rng.uniform(-bound, bound, self.fan.p))
        for array in self._sums:
            array[place] = 0.0
        return self.fan.family.hypothesis.at(self.fan.coordinates[place])

    def run(self, places: NDArray[np.int64], commands: NDArray, clock: NDArray) -> tuple[NDArray, NDArray]:
        """What ideal sensors show ``(m, n, n_channels)``, and the values ``(m,)``."""
        outputs = self.fan.run(places, commands, clock)
        ideal = self._shown(outputs, places, commands, clock)
        parts = [array[places] for array in self._sums]
        counts, values = np.full((len(places), 1), self.fan.p), np.zeros((len(places), 1))
        fisher, score, square = parts
        accumulate(
            0, len(places), outputs, counts, self.step, self._weights, ideal.copy(), fisher, score, square, values
        )  # fmt: skip
        for array, part in zip(self._sums, parts, strict=True):
            array[places] = part
        known, bias = (np.where(np.isfinite(part[:, 0]), part[:, 0], 0.0) for part in (fisher, score))
        return ideal, self._value(known, bias)

    def _shown(
        self, outputs: NDArray, places: NDArray[np.int64], commands: NDArray, clock: NDArray
    ) -> NDArray[np.float64]:
        """What ideal sensors show ``(m, n, n_channels)``."""
        return outputs[:, 0]

    def _value(self, fisher: NDArray, score: NDArray) -> NDArray[np.float64]:
        p = self.fan.p
        remaining = np.trace(np.linalg.inv(np.eye(p) + fisher), axis1=1, axis2=2) / p
        return -p * np.log(remaining + PRACTICE_SETTINGS.floor**2)


class _Errors(_Priors):
    """Benches of rigs with a background; the value is minus the logarithm of the expected error of an identification."""

    step = BACKGROUND_SETTINGS.step

    def __init__(
        self, hypothesis: RigHypothesis, n: int, desk: Desk, terms: tuple[BackgroundTerm, ...]
    ) -> None:
        super().__init__(hypothesis, n, desk)
        channels, actuators = desk.station.channels, desk.station.actuators
        self._real = _Fan(with_background(hypothesis, terms), n, channels, actuators, 0.0)

    def reset(self, place: int, rng: np.random.Generator) -> Draw:
        super().reset(place, rng)
        bound = np.sqrt(3.0)
        besides = rng.uniform(-bound, bound, self._real.p - self.fan.p)
        self._real.install(place, np.concatenate([self.fan.coordinates[place], besides]))
        return self._real.family.hypothesis.at(self._real.coordinates[place])

    def _shown(
        self, outputs: NDArray, places: NDArray[np.int64], commands: NDArray, clock: NDArray
    ) -> NDArray[np.float64]:
        return self._real.run(places, commands, clock)[:, 0]

    def _value(self, fisher: NDArray, score: NDArray) -> NDArray[np.float64]:
        return -np.log(expected_error(fisher, score))


@lru_cache(maxsize=16)
def _pool(recipe: tuple[str, tuple], question: int) -> tuple[Any, ...]:
    """Pairs of rivals for a question of a setup; they take some seconds to find."""
    setup = made(*recipe)
    asked = setup.questions[question]
    assert isinstance(asked, Rivals)
    return rival_experiment(setup.place, asked, PRACTICE_SETTINGS.pairs_kept).draws


class _Pairs:
    """Benches of one question between rivals; the value is ``log(1 + K)``."""

    def __init__(self, rivals: Rivals, pool: tuple[Any, ...], n: int, desk: Desk) -> None:
        channels, actuators = desk.station.channels, desk.station.actuators
        self.fans = [_Fan(h, n, channels, actuators) for h in (rivals.first, rivals.second)]
        self.pool = pool
        self._truth = np.zeros(n, dtype=np.int64)
        self._weights = 1.0 / desk.noise
        self._sums = Contrast.zeros(n, 1, parameters=max(fan.p for fan in self.fans))

    def reset(self, place: int, rng: np.random.Generator) -> Draw:
        pair = self.pool[int(rng.integers(len(self.pool)))]
        self._truth[place] = int(rng.integers(2))
        for fan, draw in zip(self.fans, pair, strict=True):
            fan.install(place, draw.coordinates)
        for array in self._sums:
            array[place] = 0.0
        return pair[self._truth[place]]

    def run(self, places: NDArray[np.int64], commands: NDArray, clock: NDArray) -> tuple[NDArray, NDArray]:
        """What ideal sensors show ``(m, n, n_channels)``, and the values ``(m,)``."""
        m = len(places)
        parts = [fan.run(places, commands, clock) for fan in self.fans]
        outputs = np.concatenate(parts, axis=1)
        at = np.tile(np.array([0, 1 + self.fans[0].p]), (m, 1, 1))
        counts = np.tile(np.array([fan.p for fan in self.fans]), (m, 1, 1))
        sums = Contrast._make(array[places] for array in self._sums)
        accumulate_contrast(0, m, outputs, at, counts, INFORMATION_LIMITS.step, self._weights, sums)
        for array, part in zip(self._sums, sums, strict=True):
            array[places] = part
        factor = expected_log_bayes_factor(sums)[:, 0]
        truth = np.where(self._truth[places][:, None, None] == 0, parts[0][:, 0], parts[1][:, 0])
        return truth, np.log1p(np.maximum(factor, 0.0))


class PracticeBenches(SteppedBenches):
    """In the place of `envs.benches.Benches`, with the reward at each rig itself; the option `average` means nothing here."""

    def __init__(
        self, setup: Setup, options: Options, n: int, *, question: int | None = None, drawn: bool = False
    ) -> None:
        """Set up benches.

        Args:
            setup: The laboratory and its questions.
            options: What is asked for.
            n: Number of benches.
            question: Only one of the setup's questions is asked.
            drawn: The kind of rig is drawn in each episode, where it belongs to the bench by default.

        Raises:
            ParameterError: The reward is "error" and the questions are of rivals, of which no error is told.
        """
        super().__init__(setup, options, n)
        self.setup: Setup = setup  # pyrefly: ignore[bad-override-mutable-attribute]
        kinds: list[tuple[int, Any]] = []
        for i, asked in enumerate(setup.questions):
            if question is None or i == question:
                kinds += [(i, asked)] if isinstance(asked, Rivals) else [(i, h) for h in asked.hypotheses]
        self._drawn = drawn
        self._kind = np.arange(n) % len(kinds)
        self._groups = [self._group(i, kind) for i, kind in kinds]
        self._asked = np.array([i for i, _ in kinds])
        self.question = self._asked[self._kind]
        self._values = np.zeros(n)
        self._latest = np.zeros(n)

    def _group(self, question: int, kind: Any) -> _Priors | _Pairs:
        """Benches of one kind of rig; each has room for every bench."""
        if isinstance(kind, Rivals):
            if self.options.reward == "error":
                raise ParameterError(
                    'reward is "error", which rivals have not: their question is which of two holds; "information" is expected'
                )
            return _Pairs(kind, _pool(self.setup.recipe, question), self.n, self.desk)
        if self.options.reward == "error":
            return _Errors(kind, self.n, self.desk, background_of(self.setup))
        return _Priors(kind, self.n, self.desk)

    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """One: the reward knows one rig ``(m,)``."""
        return np.ones(len(places))

    def reset(self, places: NDArray[np.int64], rngs: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """As `envs.benches.Benches.reset`."""
        for place in places:
            if self._drawn:
                self._kind[place] = rngs[place].integers(len(self._groups))
            self.truth[place] = self._groups[self._kind[place]].reset(int(place), rngs[place])
            rngs[place].standard_normal(out=self._disturbance[place])
        self._disturbance[places] *= self.desk.noise
        self.question[places] = self._asked[self._kind[places]]
        self.desk.begin(places)
        self._values[places], self._merit[places] = 0.0, 0.0
        rest = np.zeros((len(places), self.n_steps, len(self.station.actuators)))
        still = np.zeros((len(places), self.width))
        return self.desk.observe(places, self._disturbance[places, -1], rest, still, self.question)

    def positions(self, place: int) -> NDArray[np.float64]:
        """Nothing: compiled rigs keep what moves only.

        Raises:
            ParameterError: Always.
        """
        raise ParameterError(
            'practice benches, and environments with reward="error", have no pictures; render with reward="information"'
        )

    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        clock = self._clock(places)
        ideal = np.zeros((len(places), self.n_steps, len(self.station.channels)))
        values = np.zeros(len(places))
        for g, group in enumerate(self._groups):
            mine = np.flatnonzero(self._kind[places] == g)
            if mine.size:
                ideal[mine], values[mine] = group.run(places[mine], commands[mine], clock[mine])
        self._latest = np.where(np.isfinite(values), values, self._values[places])
        return sensed(ideal, self._disturbance[places, self.desk.window[places]])

    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        gain = self._latest - self._values[places]
        self._values[places] = self._latest
        self._merit[places] += gain
        return gain, self.effective_draws(places)
