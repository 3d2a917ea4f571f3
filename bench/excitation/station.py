"""The experimenter's place: what is measured and allowed there, and the books kept while an excitation is shaped window by window.

Environments, policies on a shaker, and evaluations share it, so that a policy sees the same numbers wherever it runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.information import noise_vector
from bench.excitation.limits import Instrumented, Limits
from bench.excitation.shaping import Shaping

if TYPE_CHECKING:
    from bench.excitation.schema import StationEntry


@dataclass(frozen=True)
class Station(Instrumented):
    """What is measured and allowed, and how time is cut into windows.

    Attributes:
        noise: Standard deviation of each measured channel's noise, in the channel's unit.
        scale: What 1 stands for in observations, by channel, in the channel's unit.
        limits: Limits; stroke and velocity of measured channels.
        timestep: Interval of commands and measurements [s].
        n_steps: Steps a window.
        n_windows: Windows of a whole test.
        band: Frequencies excited [Hz].
        shaping: How actions become commands, see `bench.excitation.shaping`.
        n_knots: Knots a window.
        questions: Names of the questions that may be asked; empty where there is one only.
    """

    noise: Mapping[str, float]  # pyrefly: ignore[bad-override]
    scale: Mapping[str, float]
    limits: Limits  # pyrefly: ignore[bad-override]
    timestep: float
    n_steps: int
    n_windows: int
    band: tuple[float, float]
    shaping: str = "knots"
    n_knots: int = 1
    questions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", MappingProxyType({k: float(v) for k, v in self.noise.items()}))
        scale = {name: float(self.scale[name]) for name in self.noise if name in self.scale}
        object.__setattr__(self, "scale", MappingProxyType(scale))
        object.__setattr__(self, "band", tuple(self.band))
        object.__setattr__(self, "questions", tuple(self.questions))
        missing = [
            name
            for name in (*self.limits.watched, *self.noise)
            if name not in self.noise or name not in scale
        ]
        if missing:
            raise ParameterError(
                f"channels {missing} have no noise or no scale; every measured channel, those with limits among them, needs both"
            )
        if self.n_steps < 1 or self.n_windows < 1:
            raise ParameterError(
                f"{self.n_windows} windows of {self.n_steps} steps came; at least one of at least one is expected"
            )

    def __reduce__(self) -> tuple:
        return (Station.from_dict, (self.to_dict(),))

    @property
    def n_samples(self) -> int:
        """Samples of a whole test."""
        return self.n_windows * self.n_steps

    @property
    def duration(self) -> float:
        """Duration of a whole test [s]."""
        return self.n_samples * self.timestep

    @property
    def width(self) -> int:
        """Length of an action."""
        return len(self.actuators) * (self.n_knots if self.shaping == "knots" else 2)

    @property
    def n_observations(self) -> int:
        """Length of an observation."""
        samples = self.n_steps * (len(self.channels) + len(self.actuators))
        return samples + self.width + 1 + len(self.actuators) + 2 + len(self.questions)

    def scheduled(
        self, observation: NDArray[np.float32], schedule: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Actions that a schedule has for the next window, by the time and the question that observations show.

        Args:
            observation: ``(…, n_observations)``.
            schedule: Actions of each window ``(n_questions, n_windows, width)``; one question where there is one only.
        """
        clock = self.n_steps * (len(self.channels) + len(self.actuators)) + self.width
        share = 0.5 * (observation[..., clock] + 1.0)
        window = np.clip(np.rint(share * self.n_windows).astype(np.int64), 0, self.n_windows - 1)
        asked = np.argmax(observation[..., -len(self.questions) :], axis=-1) if len(schedule) > 1 else 0
        return schedule[asked, window]

    def to_dict(self) -> dict[str, Any]:
        """The station in JSON values."""
        limits = {
            name: dict(getattr(self.limits, name)) for name in ("force", "energy", "stroke", "velocity")
        }
        plain = ("timestep", "n_steps", "n_windows", "shaping", "n_knots")
        return {
            "noise": dict(self.noise),
            "scale": dict(self.scale),
            "limits": limits,
            "band": list(self.band),
            "questions": list(self.questions),
            **{name: getattr(self, name) for name in plain},
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Station:
        """The station that `to_dict` described.

        Raises:
            DocumentError: An entry is not known, missing, of the wrong kind or out of range.
        """
        from bench.documents import checked  # noqa: PLC0415  (pydantic, for those who read documents)
        from bench.excitation.schema import StationEntry  # noqa: PLC0415

        return cls.from_entry(checked(StationEntry, document))

    @classmethod
    def from_entry(cls, entry: StationEntry) -> Station:
        """The station of a document."""
        rest = {name: value for name, value in entry.given.items() if name != "limits"}
        return cls(limits=Limits(**entry.limits.given), **rest)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _largest(measured, places, bounds, found):
    """Write the largest magnitude of some channels over their bounds ``(m,)``; NaN where one is."""
    for m in range(measured.shape[0]):
        for i in range(measured.shape[1]):
            for k in range(places.size):
                share = abs(measured[m, i, places[k]]) / bounds[k]
                if share > found[m] or share != share:  # noqa: PLR0124  (NaN stays: nothing is larger)
                    found[m] = share


class Desk:
    """The books on several rigs.

    Attributes:
        station: Where they stand.
        shaping: How actions become commands.
        window: Windows run on each rig ``(n,)``.
        energy: Energy spent ``(n, n_actuators)``.
        peak: Largest stroke and velocity so far, as fractions of the limits ``(n, 2)``.
    """

    def __init__(self, station: Station, n: int) -> None:
        """Open the books on `n` rigs."""
        self.station = station
        limits, actuators = station.limits, station.actuators
        self.shaping = Shaping(
            station.shaping, n, n_actuators=len(actuators), band=station.band, n_knots=station.n_knots
        )
        self.noise = noise_vector(station.noise, station.channels)
        self._scale = np.array([station.scale[name] for name in station.channels])
        self.force = np.array([limits.force[name] for name in actuators])
        self.budget = np.array([limits.energy.get(name, np.inf) for name in actuators])
        self._watch = [
            (
                np.array([station.channels.index(name) for name in table], dtype=np.int64),
                np.array(list(table.values())),
            )
            for table in (limits.stroke, limits.velocity)
        ]
        self.window = np.zeros(n, dtype=np.int64)
        self.energy = np.zeros((n, len(actuators)))
        self.peak = np.zeros((n, 2))

    @property
    def n_observations(self) -> int:
        """Length of an observation."""
        return self.station.n_observations

    def begin(self, places: NDArray[np.int64]) -> None:
        """Start anew on some rigs."""
        self.shaping.begin(places)
        for book in (self.window, self.energy, self.peak):
            book[places] = 0

    def commands(
        self, places: NDArray[np.int64], actions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Commands of the next window within force and what is left of the energy, and whether the energy is used up.

        Args:
            places: Rigs ``(m,)``.
            actions: Actions ``(m, shaping.width)`` in −1 … 1.
        """
        station = self.station
        commands = self.force * self.shaping.commands(places, actions, station.n_steps, station.timestep)
        spent = station.timestep * np.sum(commands**2, axis=1)
        left = np.maximum(self.budget - self.energy[places], 0.0)
        over = spent > left
        if over.any():
            commands = commands * np.sqrt(np.where(over, left / np.where(over, spent, 1.0), 1.0))[:, None]
            spent = np.minimum(spent, left)
        self.energy[places] += spent
        return commands, np.all(self.energy[places] >= self.budget * (1.0 - 1e-9), axis=1)

    def book(self, places: NDArray[np.int64], measured: NDArray[np.float64]) -> NDArray[np.float64]:
        """Book what was measured in a window; the largest stroke and velocity in it, as fractions of the limits ``(m, 2)``."""
        reached = self.reached(measured)
        self.peak[places] = np.maximum(self.peak[places], reached)
        return reached

    def reached(self, measured: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest stroke and velocity in measurements ``(m, n, n_channels)``, as fractions of the limits ``(m, 2)``."""
        found = np.zeros((len(measured), 2))
        for kind, (places, bounds) in enumerate(self._watch):
            _largest(measured, places, bounds, found[:, kind])
        return found

    def observe(
        self,
        places: NDArray[np.int64],
        measured: NDArray[np.float64],
        commands: NDArray[np.float64],
        actions: NDArray[np.float64],
        question: NDArray[np.int64] | None = None,
    ) -> NDArray[np.float32]:
        """What a policy is shown of the last window ``(m, n_observations)``, in −1 … 1.

        Args:
            places: Rigs ``(m,)``.
            measured: Channels ``(m, n_steps, n_channels)``.
            commands: Commands ``(m, n_steps, n_actuators)``.
            actions: Actions that shaped them ``(m, shaping.width)``.
            question: Question asked of each of all rigs, where there are several.
        """
        m = len(places)
        parts = [
            (measured / self._scale).reshape(m, -1),
            (commands / self.force).reshape(m, -1),
            actions,
            2.0 * self.window[places, None] / self.station.n_windows - 1.0,
            2.0 * np.minimum(self.energy[places] / self.budget, 1.0) - 1.0,
            2.0 * np.minimum(self.peak[places], 1.0) - 1.0,
        ]
        if self.station.questions:
            asked = np.zeros(len(self.window), dtype=np.int64) if question is None else question
            parts.append(np.eye(len(self.station.questions))[asked[places]])
        return np.clip(np.concatenate(parts, axis=1), -1.0, 1.0).astype(np.float32)
