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
from bench.signals.measures import rms

MAX_SAMPLES = 10_000_000
"""Samples of one record at most: with the states, sensors and commands of a small rig they take 2 GB while they are simulated."""


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
        from bench.signals.composition import Sum  # noqa: PLC0415  (composition builds on this module)

        return Sum((self, other)) if isinstance(other, Signal) else NotImplemented

    def __mul__(self, gain: object) -> Signal:
        from bench.signals.composition import Scaled  # noqa: PLC0415

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


def check_sampling(n: int, sample_rate: float) -> None:
    """Raise `ParameterError` unless `n` is a whole number above 0 and `sample_rate` [Hz] above 0."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise ParameterError(f"the number of samples is {n!r}; a whole number of at least 1 is expected")
    if n > MAX_SAMPLES:
        raise ParameterError(
            f"{n} samples were asked for; at most {MAX_SAMPLES} are expected: make several records"
        )
    if not (np.isfinite(sample_rate) and sample_rate > 0.0):
        raise ParameterError(f"the sample rate is {sample_rate!r} Hz; a positive number is expected")


def levelled(x: NDArray[np.float64], *, rms_level: float | None, peak: float | None) -> NDArray[np.float64]:
    """The signal scaled to a peak where one is given, else to a root mean square (1 where both are None)."""
    if peak is not None:
        return x * (peak / np.max(np.abs(x)))
    return x * ((1.0 if rms_level is None else rms_level) / rms(x))
