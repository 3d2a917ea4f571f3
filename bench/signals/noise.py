"""Random signals: band-limited noise and pseudo-random binary sequences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import Signal, levelled


@dataclass(frozen=True)
class BandLimitedNoise(Signal, name="band_limited_noise"):
    """Gaussian noise of flat expected spectrum in a band and nothing outside.

    Drawn in the frequency domain: a complex normal number for each line of the record inside the band, in
    ascending order. The record joins its own start smoothly, so that it may be repeated. The constant is
    never among the lines. The noise of the deck's joint rig is ``BandLimitedNoise(cutoff=12.0,
    peak=1000.0)``.

    Attributes:
        cutoff: Upper end of the flat band [Hz].
        low: Lower end of the band [Hz].
        rolloff: Width above the cut-off over which the amplitude falls to zero along half a cosine [Hz]; 0:
            at once.
        rms: Root mean square of the record, in the unit of the channel (1 where neither this nor `peak` is
            given).
        peak: Largest magnitude of the record.
    """

    cutoff: float
    low: float = 0.0
    rolloff: float = 0.0
    rms: float | None = None
    peak: float | None = None

    def __post_init__(self) -> None:
        self._real("cutoff", "Hz", above=0.0)
        self._real("low", "Hz", at_least=0.0)
        self._real("rolloff", "Hz", at_least=0.0)
        self._real("rms", above=0.0, optional=True)
        self._real("peak", above=0.0, optional=True)
        if self.low >= self.cutoff:
            raise self._fail("low", f"a frequency below the cut-off of {self.cutoff:g} Hz")
        if self.rms is not None and self.peak is not None:
            raise ParameterError("band-limited noise takes either rms or peak, not both")

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        top = self.cutoff + self.rolloff
        self._below_nyquist(top, sample_rate)
        duration = n / sample_rate
        first = max(1, int(np.ceil(self.low * duration - 1e-9)))
        lines = np.arange(first, int(np.floor(top * duration + 1e-9)) + 1)
        if lines.size == 0:
            raise ParameterError(
                f"a record of {duration:g} s has no spectral line between {self.low:g} and {top:g} Hz; "
                f"lengthen it or widen the band"
            )
        shape = np.ones(lines.size)
        if self.rolloff > 0.0:
            above = np.clip((lines / duration - self.cutoff) / self.rolloff, 0.0, 1.0)
            shape = 0.5 + 0.5 * np.cos(np.pi * above)
        parts = self._generator(rng).standard_normal((lines.size, 2))
        spectrum = np.zeros(n // 2 + 1, dtype=complex)
        spectrum[lines] = shape * (parts[:, 0] + 1j * parts[:, 1])
        return levelled(np.fft.irfft(spectrum, n), rms_level=self.rms, peak=self.peak)


@dataclass(frozen=True)
class PRBS(Signal, name="prbs"):
    """Pseudo-random binary sequence of maximal length, from a linear-feedback shift register.

    Two-valued, hence of crest factor 1, with a period of ``(2^order - 1) / clock``; the autocorrelation
    over a period is that of white noise held over a clock, up to a constant of ``-amplitude^2 / (2^order -
    1)``. Useful up to about 0.44 `clock`, where the spectrum has fallen by half. The register starts in a
    state drawn from `rng`, which shifts the sequence in time.

    Attributes:
        clock: Clock of the register [Hz]; best a whole fraction of the sample rate, else the bits differ by
            one sample in length.
        order: Number of bits of the register, 2 to 31.
        amplitude: Magnitude, in the unit of the channel.

    References:
        Golomb 1967, "Shift Register Sequences"; Söderström, Stoica 1989, "System Identification", section
        5.3.
    """

    clock: float
    order: int = 10
    amplitude: float = 1.0

    def __post_init__(self) -> None:
        self._real("clock", "Hz", above=0.0)
        self._integer("order", at_least=2, at_most=31)
        self._real("amplitude", above=0.0)

    @property
    def period(self) -> float:
        """Period of the sequence [s]."""
        return (2**self.order - 1) / self.clock

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        from scipy.signal import max_len_seq  # noqa: PLC0415  (scipy.signal is slow to import)

        if self.clock > sample_rate:
            raise ParameterError(
                f"a clock of {self.clock:g} Hz cannot be shown at a sample rate of {sample_rate:g} Hz; "
                f"a clock of at most the sample rate is expected"
            )
        # A tick falls on the sample that it equals up to rounding.
        ticks = np.floor(np.arange(n) * (self.clock / sample_rate) + 1e-9).astype(np.int64)
        length = min(int(ticks[-1]) + 1, 2**self.order - 1)
        seed = int(self._generator(rng).integers(1, 2**self.order))
        register = np.array([seed >> bit & 1 for bit in range(self.order)], dtype=np.int8)
        bits = max_len_seq(self.order, state=register, length=length)[0]
        return self.amplitude * (2.0 * bits[ticks % (2**self.order - 1)] - 1.0)
