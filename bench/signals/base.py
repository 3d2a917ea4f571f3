"""What a signal is: a frozen description that can be sampled at any rate.

A signal knows nothing of sample rates or lengths: it states its band, amplitude and shape in physical
units, and `Signal.sample` evaluates it at ``t = k / sample_rate``, ``k = 0 … n-1``. The same signal sampled
twice with generators in the same state gives the same numbers; random waveforms (`BandLimitedNoise`,
`Multisine`) are drawn in the frequency domain, so that a record of the same duration at another rate is the
same waveform, which a convergence study over the time step needs.

Signals compose: ``a + b``, ``2.0 * a``, `scaled`, `Tapered`, `Concatenation`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.description import Described
from bench.signals.measures import energy, rms
from bench.signals.streams import named_streams


@dataclass(frozen=True)
class SignalSettings:
    """Numbers of `bench.signals.base`."""

    max_samples: int = 10_000_000
    """Samples of one record at most: with the states, sensors and commands of a small rig they take 2 GB while they are simulated."""


BASE_SETTINGS = SignalSettings()


@dataclass(frozen=True)
class Signal(Described, ABC, kind="signal"):
    """A signal of one channel.

    A new one is a frozen dataclass ``class Mine(Signal, name="mine")`` with a method `_values`; it then has
    `sample`, the JSON round trip, and a place in `SIGNALS`.
    """

    def sample(
        self, n: int, sample_rate: float, rng: np.random.Generator | None = None
    ) -> NDArray[np.float64]:
        """Evaluate the signal at ``t = k / sample_rate``.

        Args:
            n: Number of samples.
            sample_rate: Sample rate [Hz].
            rng: Source of randomness; may be None for signals that draw nothing.

        Returns:
            The signal ``(n,)``, in the unit of its amplitude.

        Raises:
            ParameterError: `n` or `sample_rate` is not positive, a frequency lies at or above half the
                sample rate, or the signal is random and `rng` is None.
        """
        check_sampling(n, sample_rate)
        return np.ascontiguousarray(self._values(int(n), float(sample_rate), rng), dtype=float)

    @abstractmethod
    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        """The samples ``(n,)``; arguments are checked already."""

    def __add__(self, other: object) -> Signal:
        return Sum((self, other)) if isinstance(other, Signal) else NotImplemented

    def __mul__(self, gain: object) -> Signal:
        return Scaled(self, gain=float(gain)) if isinstance(gain, int | float) else NotImplemented

    __rmul__ = __mul__

    def __neg__(self) -> Signal:
        return self * -1.0

    def _generator(self, rng: np.random.Generator | None) -> np.random.Generator:
        if not isinstance(rng, np.random.Generator):
            raise ParameterError(
                f"signal '{self.name}' is random: pass rng=np.random.default_rng(seed); {rng!r} came"
            )
        return rng

    def _below_nyquist(self, frequency: float, sample_rate: float) -> None:
        if frequency >= 0.5 * sample_rate:
            raise ParameterError(
                f"signal '{self.name}' reaches {frequency:g} Hz, but a sample rate of {sample_rate:g} Hz "
                f"shows only frequencies below {0.5 * sample_rate:g} Hz; raise the sample rate or lower the frequency"
            )


@dataclass(frozen=True)
class Sum(Signal, name="sum"):
    """The sum of signals, each with a random stream of its own.

    Attributes:
        signals: The signals.
    """

    signals: tuple[Signal, ...]

    def __post_init__(self) -> None:
        check_signals(self, self.signals)

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        streams = streams_of(rng, len(self.signals))
        total = np.zeros(n)
        for signal, stream in zip(self.signals, streams, strict=True):
            total += signal.sample(n, sample_rate, stream)
        return total


@dataclass(frozen=True)
class Scaled(Signal, name="scaled"):
    """A signal times a constant, given as such or by what the result shall have.

    Attributes:
        signal: The signal.
        gain: Factor.
        peak: Largest magnitude of the record.
        rms: Root mean square of the record.
        energy: Energy ``dt sum(x^2)`` of the record, in the unit of the channel squared times s.
    """

    signal: Signal
    gain: float | None = None
    peak: float | None = None
    rms: float | None = None
    energy: float | None = None

    def __post_init__(self) -> None:
        check_signal(self, self.signal)
        self._real("gain", optional=True)
        for name in ("peak", "rms", "energy"):
            self._real(name, above=0.0, optional=True)
        given = [name for name in ("gain", "peak", "rms", "energy") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ParameterError(
                "a signal is scaled by exactly one of gain, peak, rms, energy; "
                f"{', '.join(given) or 'none'} came"
            )

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        x = self.signal.sample(n, sample_rate, rng)
        if self.gain is not None:
            return self.gain * x
        largest = float(np.max(np.abs(x)))
        if largest == 0.0:
            raise ParameterError(
                f"signal '{self.signal.name}' is zero throughout the record and cannot be scaled"
            )
        x = x / largest
        if self.peak is not None:
            return self.peak * x
        if self.rms is not None:
            return (self.rms / rms(x)) * x
        assert self.energy is not None  # the last of the four, of which one is given
        return np.sqrt(self.energy / energy(x, 1.0 / sample_rate)) * x


def check_sampling(n: int, sample_rate: float) -> None:
    """Raise `ParameterError` unless `n` is a whole number above 0 and `sample_rate` [Hz] above 0."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise ParameterError(f"the number of samples is {n!r}; a whole number of at least 1 is expected")
    if n > BASE_SETTINGS.max_samples:
        raise ParameterError(
            f"{n} samples were asked for; at most {BASE_SETTINGS.max_samples} are expected: make several records"
        )
    if not (np.isfinite(sample_rate) and sample_rate > 0.0):
        raise ParameterError(f"the sample rate is {sample_rate!r} Hz; a positive number is expected")


def levelled(x: NDArray[np.float64], *, rms_level: float | None, peak: float | None) -> NDArray[np.float64]:
    """The signal scaled to a peak where one is given, else to a root mean square (1 where both are None)."""
    if peak is not None:
        return x * (peak / np.max(np.abs(x)))
    return x * ((1.0 if rms_level is None else rms_level) / rms(x))


def streams_of(rng: np.random.Generator | None, count: int) -> list[np.random.Generator | None]:
    """One stream for each part, by its place: a part appended does not change those before it."""
    if rng is None:
        return [None] * count
    return list(named_streams(rng, [str(k) for k in range(count)]).values())


def check_signals(owner: Signal, signals: object) -> None:
    """Check that `signals` is a list of signals, and make it the tuple that `owner` holds."""
    if not isinstance(signals, list | tuple) or not signals:
        raise ParameterError(f"signal '{owner.name}' needs a list of signals; {signals!r} came")
    for signal in signals:
        check_signal(owner, signal)
    object.__setattr__(owner, "signals", tuple(signals))


def check_signal(owner: Signal, signal: object) -> None:
    """Check that what `owner` is made of is a signal."""
    if not isinstance(signal, Signal):
        raise ParameterError(f"signal '{owner.name}' is made of signals; {signal!r} came")
