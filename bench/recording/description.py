"""The recording: channels on one uniform clock, immutable."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError, UnknownNameError
from bench.recording.channel import Channel, channels_from
from bench.recording.clock import CLOCK_SETTINGS, grid, samples_between, uniform_clock
from bench.recording.columns import as_columns, digest, refuse_not_finite, refuse_twins, stacked
from bench.recording.frozen import frozen
from bench.recording.mending import on_clock
from bench.recording.units import si_unit


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Measured or simulated channels on one uniform clock, with units and provenance; nothing in it can be changed.

    Most recordings come from `Recording.from_arrays`, `bench.read_recording` or `bench.simulate`. All methods return new
    recordings. Two recordings are equal when clock, channels, values, settle and meta are.

    Attributes:
        time: Times of the samples [s], ``(n,)``, n >= 2; put on the exactly uniform clock ``start + k / sample_rate``.
        values: ``(n, n_channels)``, finite, read-only; each column contiguous in memory.
        channels: Name, unit, quantity, role and noise of each column.
        settle: Seconds from the start that scores leave out [s].
        meta: Provenance, JSON values only.
        sample_rate: Samples a second [Hz]; found from `time` where not given.

    Raises:
        RecordingError: Values not finite, of the wrong shape, or channels of the same name; times with gaps, not
            increasing or not uniform; settle not inside the record; meta not of JSON values.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float64]
    channels: tuple[Channel, ...]
    settle: float = 0.0
    meta: Mapping[str, Any] = field(default_factory=dict)
    sample_rate: float = 0.0

    def __post_init__(self) -> None:
        channels = tuple(self.channels)
        refuse_twins([channel.name for channel in channels])
        start, rate = uniform_clock(self.time, sample_rate=self.sample_rate)
        n = np.size(self.time)
        values = as_columns(self.values, n, len(channels))
        time = grid(start, rate, n)
        refuse_not_finite(time, values, channels)
        settle = float(self.settle)
        if not 0.0 <= settle < time[-1] - time[0]:
            raise RecordingError(
                f"settle is {settle} s; the record lasts {time[-1] - time[0]:.9g} s, and 0 <= settle < that is expected"
            )
        entries = {
            "time": time,
            "values": values,
            "channels": channels,
            "settle": settle,
            "sample_rate": rate,
        }
        for name, value in entries.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "meta", frozen(self.meta or {}))

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike | None,
        arrays: Mapping[str, ArrayLike],
        *,
        units: Mapping[str, str],
        quantities: Mapping[str, str] | None = None,
        roles: Mapping[str, str] | None = None,
        noise_std: Mapping[str, float] | None = None,
        settle: float = 0.0,
        meta: Mapping[str, Any] | None = None,
        sample_rate: float = 0.0,
        gaps: Literal["raise", "interpolate"] = "raise",
        jitter: float = CLOCK_SETTINGS.jitter,
    ) -> Recording:
        """A recording from arrays by channel name.

        Args:
            time: Times of the samples [s], ``(n,)``; None for a clock from 0 at `sample_rate`.
            arrays: Values by channel name, each ``(n,)``; copied.
            units: Unit of every channel.
            quantities: Quantity of some, one of `bench.recording.SI_UNITS`.
            roles: Role of some, one of `bench.recording.ROLES`.
            noise_std: Standard deviation of the noise of some [unit of the channel].
            settle: Seconds left out of scores [s].
            meta: Provenance.
            sample_rate: Samples a second [Hz]; 0 to find it from the time.
            gaps: What to do about dropped samples and values that are not finite: refuse them, or bridge up to ten in a
                row by shape-preserving interpolation, and interpolate away a clock that jitters by up to 30 % of a step; both
                are reported in ``meta["repaired"]``.
            jitter: Largest deviation of a time from the uniform clock that is taken for none, as a fraction of the step.

        Raises:
            RecordingError: As the class; a channel without unit or of another length.
            UnitError: A unit is unknown or does not fit the quantity.
            UnknownNameError: A mapping names a channel that is not there, or an unknown quantity.
        """
        if gaps not in ("raise", "interpolate"):
            raise RecordingError(f"gaps is {gaps!r}; 'raise' or 'interpolate' is expected")
        channels = channels_from(arrays, units=units, quantities=quantities, roles=roles, noise_std=noise_std)
        values = stacked(arrays, None if time is None else np.size(time))
        if time is None:
            if not (math.isfinite(sample_rate) and sample_rate > 0.0):
                raise RecordingError("without a time, sample_rate is needed: a finite number > 0 [Hz]")
            time = grid(0.0, sample_rate, len(values))
        meta = dict(meta or {})
        names = [channel.name for channel in channels]
        time, rate, values, report = on_clock(
            time, values, names, sample_rate=sample_rate, jitter=jitter, mend=gaps == "interpolate"
        )
        if report:
            meta["repaired"] = report
        return cls(time, values, channels, settle=settle, meta=meta, sample_rate=rate)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels, in the order of the columns."""
        return tuple(channel.name for channel in self.channels)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def scored(self) -> slice:
        """The samples that scores are computed over: those at or after `settle` seconds from the start."""
        # one part in a million of a step: settle * sample_rate of a settle that is a whole number of steps may round up
        return slice(math.ceil(self.settle * self.sample_rate - 1e-6), None)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over clock, channels, settle and values, in hexadecimal; meta does not count.

        The same data give the same hash on every machine, whichever run or file they came from.
        """
        return digest(self.time, self.sample_rate, self.settle, self.values, self.channels)

    def __len__(self) -> int:
        return len(self.time)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.values[:, self._column(name)]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return (
            self.channels == other.channels
            and self.settle == other.settle
            and self.sample_rate == other.sample_rate
            and self.meta == other.meta
            and np.array_equal(self.time, other.time)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        return hash(self.content_hash)

    def __reduce__(self) -> tuple[Any, ...]:  # through the constructor: unpickled arrays would be writeable
        return type(self), (self.time, self.values, self.channels, self.settle, self.meta, self.sample_rate)

    def __repr__(self) -> str:
        labels = ", ".join(channel.label for channel in self.channels)
        return f"Recording({len(self)} samples at {self.sample_rate:g} Hz, {self.duration:g} s: {labels})"

    def channel(self, name: str) -> Channel:
        """The description of a channel.

        Args:
            name: Its name.

        Raises:
            UnknownNameError: There is no such channel.
        """
        return self.channels[self._column(name)]

    def select(self, names: Sequence[str]) -> Recording:
        """A recording of some channels only, in the order given.

        Args:
            names: Names of channels.

        Raises:
            UnknownNameError: There is no such channel.
            RecordingError: A name comes twice.
        """
        if isinstance(names, str):
            raise RecordingError(f"select takes a sequence of names; write select(['{names}'])")
        columns = [self._column(name) for name in names]
        channels = tuple(self.channels[i] for i in columns)
        return replace(self, values=self.values[:, columns], channels=channels)

    def renamed(self, names: Mapping[str, str]) -> Recording:
        """A recording with channels renamed.

        Args:
            names: New name by old name; the others keep theirs.

        Raises:
            UnknownNameError: There is no such channel.
            RecordingError: Two channels would have the same name.
        """
        for name in names:
            self._column(name)
        return replace(
            self, channels=tuple(replace(c, name=names.get(c.name, c.name)) for c in self.channels)
        )

    def with_(self, *, settle: float | None = None, meta: Mapping[str, Any] | None = None) -> Recording:
        """A copy with another settle, or with entries added to meta.

        Args:
            settle: Seconds left out of scores [s]; None to keep it.
            meta: Entries to add to meta, or to put in the place of those there.

        Raises:
            RecordingError: As the class.
        """
        settle = self.settle if settle is None else settle
        return replace(self, settle=settle, meta={**self.meta, **(meta or {})})

    def with_channels(
        self,
        arrays: Mapping[str, ArrayLike],
        *,
        units: Mapping[str, str] | None = None,
        quantities: Mapping[str, str] | None = None,
        roles: Mapping[str, str] | None = None,
        noise_std: Mapping[str, float] | None = None,
    ) -> Recording:
        """A recording with channels added, or with new values in the place of those there.

        Args:
            arrays: Values by channel name, each ``(n,)``.
            units: Unit of every new channel; one that is replaced keeps its description where nothing is given.
            quantities: Quantity of some.
            roles: Role of some.
            noise_std: Noise of some [unit of the channel].

        Raises:
            RecordingError: Another length, not finite, or a new channel without unit.
            UnitError: A unit is unknown or does not fit the quantity.
            UnknownNameError: A mapping names a channel that is not in `arrays`.
        """
        known = {channel.name: channel for channel in self.channels}
        new = channels_from(
            arrays, units=units or {}, quantities=quantities, roles=roles, noise_std=noise_std, known=known
        )
        described = known | {channel.name: channel for channel in new}
        columns = dict(zip(self.names, self.values.T, strict=True)) | dict(arrays)
        return replace(self, values=stacked(columns, len(self)), channels=tuple(described.values()))

    def slice_time(
        self, start: float | None = None, stop: float | None = None, *, rezero: bool = False
    ) -> Recording:
        """The part with ``start <= time < stop``; what is left of `settle` goes with it.

        Args:
            start: First time [s]; None for the beginning.
            stop: Time before which it ends [s]; None to go to the end, the last sample included.
            rezero: Let the part begin at time zero.

        Raises:
            RecordingError: Fewer than two samples lie there.
        """
        first, last = samples_between(self.time, self.sample_rate, start, stop)
        settle = max(0.0, self.settle - first / self.sample_rate)
        if settle >= (last - first - 1) / self.sample_rate:
            raise RecordingError(
                f"the part {start} <= t < {stop} s lies within the {self.settle:g} s left out of scores (settle); "
                "take a longer part, or a copy with_(settle=0.0) first"
            )
        time = grid(0.0 if rezero else float(self.time[first]), self.sample_rate, last - first)
        return replace(self, time=time, values=self.values[first:last], settle=settle)

    def resample(self, sample_rate: float) -> Recording:
        """The record on another uniform clock with the same start, band-limited and without delay.

        A linear-phase filter (Kaiser window) passes what lies below 0.8 of the lower of the two Nyquist frequencies
        within 0.01 % and stops what lies above that frequency by 80 dB. Its ends assume that the record goes on about the
        straight line between its first and last sample: within some 30 samples of the slower clock, the ends are less
        exact. Steps, such as a held command, ring as any band-limited signal does. Lowering the rate scales `noise_std`
        by the root of the ratio, as for white noise; ``meta["resampled_from"]`` keeps the old rate [Hz].

        Args:
            sample_rate: The new rate [Hz].

        Raises:
            RecordingError: Not a finite number > 0, or not a ratio of whole numbers up to 20 000 to the old rate.
        """
        from bench.recording.resampling import ratio_of, resampled  # noqa: PLC0415  (scipy.signal is slow to import)

        ratio = ratio_of(self.sample_rate, sample_rate, self.duration)
        values = resampled(self.values, ratio.numerator, ratio.denominator)
        noise = math.sqrt(min(1.0, float(ratio)))
        channels = tuple(channel.with_noise_times(noise) for channel in self.channels)
        return Recording(
            grid(float(self.time[0]), sample_rate, len(values)),
            values,
            channels,
            settle=self.settle,
            meta={**self.meta, "resampled_from": self.sample_rate},
            sample_rate=sample_rate,
        )

    def to_units(self, units: Mapping[str, str]) -> Recording:
        """The record with channels converted to other units.

        Args:
            units: Unit by channel name; the others keep theirs.

        Raises:
            UnknownNameError: There is no such channel.
            UnitError: A unit is unknown, or of another dimension than the channel's.
        """
        values, channels = np.array(self.values, order="F"), list(self.channels)
        for name, unit in units.items():
            column = self._column(name)
            slope, offset, channels[column] = channels[column].in_unit(unit)
            values[:, column] = slope * values[:, column] + offset
        return replace(self, values=values, channels=tuple(channels))

    def to_si(self) -> Recording:
        """The record with every channel in the SI unit of its dimension (m, m/s, N, rad, N m, …)."""
        units = {channel.name: si_unit(channel.unit, channel.quantity) for channel in self.channels}
        return self.to_units(units)

    def _column(self, name: str) -> int:
        try:
            return self.names.index(name)
        except ValueError:
            raise UnknownNameError("channel of the recording", str(name), self.names) from None
