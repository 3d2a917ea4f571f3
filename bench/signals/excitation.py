"""What drives a rig in one test: a signal for each actuator, for one duration at one sample rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import (
    BASE_SETTINGS,
    Signal,
)
from bench.signals.streams import named_streams


@dataclass(frozen=True)
class Excitation:
    """Signals by actuator, sampled together.

    Each actuator draws from a random stream derived from its name, so that one more actuator changes
    nothing for the others.

    Attributes:
        signals: Signal by name of the actuator (read-only copy, in the order given).
        duration: Duration [s].
        sample_rate: Sample rate [Hz].
    """

    signals: Mapping[str, Signal]
    duration: float
    sample_rate: float

    def __post_init__(self) -> None:
        if not isinstance(self.signals, Mapping) or not self.signals:
            raise ParameterError(
                f"an excitation needs signals by name of the actuator; {self.signals!r} came"
            )
        for name, signal in self.signals.items():
            if not isinstance(name, str) or not isinstance(signal, Signal):
                raise ParameterError(f"an excitation maps names to signals; {name!r}: {signal!r} came")
        for field, unit in (("duration", "s"), ("sample_rate", "Hz")):
            value = getattr(self, field)
            if isinstance(value, bool | str) or not (np.isfinite(value) and value > 0.0):
                raise ParameterError(
                    f"{field} of the excitation is {value!r}; a positive number [{unit}] is expected"
                )
            object.__setattr__(self, field, float(value))
        object.__setattr__(self, "signals", MappingProxyType(dict(self.signals)))
        if not self.duration * self.sample_rate <= BASE_SETTINGS.max_samples:
            raise ParameterError(
                f"{self.duration:g} s at {self.sample_rate:g} Hz are {self.duration * self.sample_rate:g} samples; at most "
                f"{BASE_SETTINGS.max_samples} are expected: shorten the excitation, or make several records"
            )
        if self.n_samples < 1:
            raise ParameterError(
                f"{self.duration:g} s at {self.sample_rate:g} Hz is less than one sample; "
                "lengthen the excitation"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        return (Excitation, (dict(self.signals), self.duration, self.sample_rate))

    def __hash__(self) -> int:
        return hash((tuple(self.signals.items()), self.duration, self.sample_rate))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of the columns of `sample`."""
        return tuple(self.signals)

    @property
    def n_samples(self) -> int:
        """Number of samples, the duration times the sample rate rounded to a whole number."""
        return round(self.duration * self.sample_rate)

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the samples ``(n_samples,)`` [s], from 0."""
        return np.arange(self.n_samples) / self.sample_rate

    def sample(self, rng: np.random.Generator | None = None) -> NDArray[np.float64]:
        """Sample all signals.

        Args:
            rng: Source of randomness; may be None where no signal draws.

        Returns:
            ``(n_samples, n_channels)``, a column for each of `names`.

        Raises:
            ParameterError: A signal does not fit the sample rate or duration; the message names the actuator.
        """
        streams = dict.fromkeys(self.names) if rng is None else named_streams(rng, self.names)
        columns = np.empty((self.n_samples, len(self.names)))
        for column, (name, signal) in enumerate(self.signals.items()):
            try:
                columns[:, column] = signal.sample(self.n_samples, self.sample_rate, streams[name])
            except ParameterError as error:
                raise ParameterError(f"excitation of '{name}': {error}") from error
        return columns

    def to_dict(self) -> dict[str, Any]:
        """The excitation as numbers, strings, lists and dictionaries."""
        signals = {name: signal.to_dict() for name, signal in self.signals.items()}
        return {"duration": self.duration, "sample_rate": self.sample_rate, "signals": signals}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Excitation:
        """The excitation that `to_dict` (or a section of a TOML file) stands for.

        Raises:
            DocumentError: An entry, the type of a signal or a field of it is unknown, missing, of the wrong kind or out of range.
        """
        from bench.documents import checked, schema_of  # noqa: PLC0415  (pydantic, for those who read documents)

        return checked(schema_of("bench.signals").ExcitationDocument, data).excitation()
