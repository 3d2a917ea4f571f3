"""A measured or otherwise given record as an excitation."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import Signal

if TYPE_CHECKING:
    from bench.recording import Recording


@dataclass(frozen=True)
class RecordSettings:
    """Numbers of `bench.signals.record`."""

    largest_ratio: int = 10_000
    """Largest number in the ratio of sample rates for band-limited resampling; the filter has 20 times as many taps."""


SETTINGS = RecordSettings()


@dataclass(frozen=True, eq=False)
class Record(Signal, name="record"):
    """A given record, resampled to the rate it is sampled at.

    Attributes:
        values: The record ``(m,)``, in the unit of the channel; copied and made read-only.
        rate: Sample rate of `values` [Hz].
        resampling: "band_limited" (polyphase filter against images and aliases; the ratio of the rates must
            be a fraction of numbers up to 10 000) or "linear" (straight lines between samples, any ratio,
            no protection against aliasing).
        after: What follows the end of the record: "zero", "hold" (its last value) or "repeat" (from the
            start again).
    """

    values: NDArray[np.float64] = field(repr=False)
    rate: float
    resampling: Literal["band_limited", "linear"] = "band_limited"
    after: Literal["zero", "hold", "repeat"] = "zero"

    def __post_init__(self) -> None:
        try:
            values = np.array(self.values, dtype=float)
        except (TypeError, ValueError):
            raise ParameterError(
                "values of signal 'record' are no numbers; a list of finite numbers is expected"
            ) from None
        if values.ndim != 1 or values.size < 2 or not np.all(np.isfinite(values)):
            raise ParameterError(
                f"values of signal 'record' have shape {values.shape}; "
                "a finite record of shape (m,) with m >= 2 is expected"
            )
        values.flags.writeable = False
        self._set("values", values)
        self._real("rate", "Hz", above=0.0)
        self._choice("resampling", ("band_limited", "linear"))
        self._choice("after", ("zero", "hold", "repeat"))

    @classmethod
    def from_recording(
        cls,
        recording: Recording,
        channel: str,
        *,
        resampling: Literal["band_limited", "linear"] = "band_limited",
        after: Literal["zero", "hold", "repeat"] = "zero",
    ) -> Record:
        """The record of one channel of a recording.

        Args:
            recording: The recording.
            channel: Name of the channel.
            resampling: As the attribute.
            after: As the attribute.

        Raises:
            BenchError: The recording has no such channel.
        """
        return cls(recording[channel], recording.sample_rate, resampling=resampling, after=after)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Record):
            return NotImplemented
        return self._key() == other._key() and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self._key(), self.values.tobytes()))

    def _key(self) -> tuple[float, str, str]:
        return (self.rate, self.resampling, self.after)

    @property
    def duration(self) -> float:
        """Time the record lasts [s]."""
        return self.values.size / self.rate

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        source = self.values
        needed = int(np.ceil(n * self.rate / sample_rate)) + 1
        if self.after == "repeat":
            source = np.resize(source, max(needed, source.size))
        if sample_rate == self.rate:
            x = source[:n]
        elif self.resampling == "linear":
            inside = int(np.floor((source.size - 1) * sample_rate / self.rate + 1e-9)) + 1
            x = np.interp(
                np.arange(min(n, inside)) * (self.rate / sample_rate), np.arange(source.size), source
            )
        else:
            x = self._polyphase(source, sample_rate)[:n]
        rest = self.values[-1] if self.after == "hold" else 0.0
        return np.concatenate([x, np.full(n - x.size, rest)])

    def _polyphase(self, source: NDArray[np.float64], sample_rate: float) -> NDArray[np.float64]:
        from scipy.signal import resample_poly  # noqa: PLC0415  (scipy.signal is slow to import)

        ratio = Fraction(sample_rate / self.rate).limit_denominator(SETTINGS.largest_ratio)
        # 1e-9 of a ratio shifts the last of a million samples by a thousandth of one.
        if (
            ratio.numerator > SETTINGS.largest_ratio
            or abs(float(ratio) * self.rate / sample_rate - 1.0) > 1e-9
        ):
            raise ParameterError(
                f"a record at {self.rate:.9g} Hz cannot be resampled to {sample_rate:.9g} Hz by a ratio of "
                f"numbers up to {SETTINGS.largest_ratio}; choose another sample rate, or resampling='linear'"
            )
        # "line" continues the record along its end points' line: zeros outside would ring at both ends.
        return resample_poly(source, ratio.numerator, ratio.denominator, padtype="line")
