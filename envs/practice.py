"""Practice benches: the environments for training, some four times as fast and with the reward taken at each rig itself.

An adaptive excitation is worth what it tells about the rig that it adapted to, averaged over rigs: the mean of this reward over episodes
is that expectation under the prior. The registered environments average the merit over a fixed handful of draws under the commands
of the episode instead, as a laboratory could; a policy that follows the hidden rig's resonance gets little of that, because the
draws have other resonances. Policies see the same here as there, and nothing of the hidden rig; only their teacher knows it.

Rigs are compiled `Family` members, equal to MuJoCo to rounding. Bench i hides a rig of hypothesis (or question) i modulo their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import UnknownNameError
from bench.excitation import Contrast, Draw, Family, Hypothesis, Rivals, expected_log_bayes_factor, fans
from bench.excitation.bayes_factor import accumulate_contrast
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
)
from bench.excitation.station import Desk
from bench.excitation.stepping import Packed, integrate_cases

from .base import options_of, setup_of
from .options import Options
from .setups import Setup, made, rival_experiment
from .stepped import SteppedBenches, sensed
from .vector import BenchVectorEnv


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
    """The rigs of a hypothesis on some benches, each followed by its perturbed ones."""

    def __init__(self, hypothesis: Hypothesis, n: int, channels: tuple[str, ...], actuators: tuple[str, ...]):
        self.family = Family(hypothesis, channels, actuators)
        self.p = self.family.n_parameters
        self.coordinates = np.zeros((n, self.p))
        self._packed: Packed = self.family.packed(
            fans(self.coordinates, INFORMATION_LIMITS.step).reshape(-1, self.p)
        )
        self._states = self._packed.start.reshape(n, 1 + self.p, -1).copy()
        self._members = np.arange(n * (1 + self.p)).reshape(n, 1 + self.p)

    def install(self, place: int, coordinates: NDArray[np.float64]) -> None:
        """Put a rig at rest on a bench."""
        self.coordinates[place] = coordinates
        fresh = self.family.packed(fans(coordinates, INFORMATION_LIMITS.step))
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
            counts=np.full(len(places), 1 + self.p),
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

    def __init__(self, hypothesis: Hypothesis, n: int, desk: Desk) -> None:
        self.fan = _Fan(hypothesis, n, desk.station.channels, desk.station.actuators)
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
        parts = [array[places] for array in self._sums]
        values = np.zeros((len(places), 1))
        counts = np.full((len(places), 1), self.fan.p)
        fisher, score, square = parts
        measured = outputs[:, 0].copy()
        accumulate(
            0,
            len(places),
            outputs,
            counts,
            INFORMATION_LIMITS.step,
            self._weights,
            measured,
            fisher,
            score,
            square,
            values,
        )
        for array, part in zip(self._sums, parts, strict=True):
            array[places] = part
        p = self.fan.p
        known = np.where(np.isfinite(fisher[:, 0]), fisher[:, 0], 0.0)
        remaining = np.trace(np.linalg.inv(np.eye(p) + known), axis1=1, axis2=2) / p
        return outputs[:, 0], -p * np.log(remaining + PRACTICE_SETTINGS.floor**2)


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

    def __init__(self, setup: Setup, options: Options, n: int, *, question: int | None = None) -> None:
        """Set up benches; only one of the setup's questions is asked where `question` is given."""
        super().__init__(setup, options, n)
        kinds: list[tuple[int, Any]] = []
        for i, asked in enumerate(setup.questions):
            if question is None or i == question:
                kinds += [(i, asked)] if isinstance(asked, Rivals) else [(i, h) for h in asked.hypotheses]
        size = -(-n // len(kinds))
        self._groups = [
            _Pairs(kind, _pool(setup.recipe, i), size, self.desk)
            if isinstance(kind, Rivals)
            else _Priors(kind, size, self.desk)
            for i, kind in kinds
        ]
        self._asked = np.array([i for i, _ in kinds])
        self.question = self._asked[np.arange(n) % len(kinds)]
        self._values = np.zeros(n)
        self._latest = np.zeros(n)

    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """One: the reward knows one rig ``(m,)``."""
        return np.ones(len(places))

    def reset(self, places: NDArray[np.int64], rngs: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """As `envs.benches.Benches.reset`."""
        for place in places:
            group, row = self._groups[place % len(self._groups)], int(place) // len(self._groups)
            self.truth[place] = group.reset(row, rngs[place])
            rngs[place].standard_normal(out=self._disturbance[place])
        self._disturbance[places] *= self.desk.noise
        self.desk.begin(places)
        self._values[places], self._merit[places] = 0.0, 0.0
        rest = np.zeros((len(places), self.n_steps, len(self.station.actuators)))
        still = np.zeros((len(places), self.width))
        return self.desk.observe(places, self._disturbance[places, -1], rest, still, self.question)

    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        clock = self._clock(places)
        ideal = np.zeros((len(places), self.n_steps, len(self.station.channels)))
        values = np.zeros(len(places))
        for g, group in enumerate(self._groups):
            mine = np.flatnonzero(places % len(self._groups) == g)
            if mine.size:
                rows = places[mine] // len(self._groups)
                ideal[mine], values[mine] = group.run(rows, commands[mine], clock[mine])
        self._latest = np.where(np.isfinite(values), values, self._values[places])
        return sensed(ideal, self._disturbance[places, self.desk.window[places]])

    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        gain = self._latest - self._values[places]
        self._values[places] = self._latest
        self._merit[places] += gain
        return gain, self.effective_draws(places)


class PracticeVectorEnv(BenchVectorEnv):
    """Vector environment of practice benches; see the module.

    Not registered: its reward looks at the hidden rig.
    """

    KINDS = ("sdof", "joint", "discrimination")

    def __init__(self, kind: str, num_envs: int = 1, **arguments: Any) -> None:
        """Set up practice benches.

        Args:
            kind: "sdof", "joint" or "discrimination".
            num_envs: How many.
            **arguments: Those of `BenchVectorEnv` and of the environment.
        """
        if kind not in self.KINDS:
            raise UnknownNameError("kind of practice bench", kind, self.KINDS)
        self.kind = kind  # type: ignore[misc]
        super().__init__(num_envs, **arguments)

    def _make(self, n: int, threads: int, arguments: dict[str, Any]) -> Any:
        rest = dict(arguments)
        return PracticeBenches(setup_of(self.kind, rest), options_of(rest), n)
