"""Sum of harmonics of one period, with the band, the amplitudes and the phases chosen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import Signal, levelled
from bench.signals.crest import optimised_phases, schroeder_phases, waveform


@dataclass(frozen=True)
class Multisine(Signal, name="multisine"):
    """A periodic signal with power at the harmonics of ``1 / period`` inside a band, and nowhere else.

    Against `BandLimitedNoise` of the same band: amplitudes are set and not drawn, so that no line of the
    spectrum is weak by chance, and the crest factor can be made small.

    Random and optimised phases are drawn from `rng` and differ between channels; Schroeder's are one
    formula, and two channels that use them move alike.

    Attributes:
        band: Lowest and highest frequency [Hz], both included.
        period: Period [s], a whole number of samples; None: the whole record is one period.
        phases: "random" (uniform), "schroeder", or "optimised" (crest factor minimised from a random start).
        odd: Whether only odd harmonics are excited; distortion of even order then shows at the even ones.
        spectrum: Points (frequency [Hz], relative amplitude) joined by straight lines; None: flat.
        rms: Root mean square of a period, in the unit of the channel (1 where neither this nor `peak` is
            given).
        peak: Largest magnitude of the samples of a period.

    References:
        Pintelon, Schoukens 2012, "System Identification: A Frequency Domain Approach", chapter 5.
    """

    band: tuple[float, float]
    period: float | None = None
    phases: Literal["random", "schroeder", "optimised"] = "random"
    odd: bool = False
    spectrum: tuple[tuple[float, float], ...] | None = None
    rms: float | None = None
    peak: float | None = None

    def __post_init__(self) -> None:
        self._reals("band", "Hz", length=2)
        if not 0.0 <= self.band[0] <= self.band[1]:
            raise self._fail("band", "a pair 0 <= lowest <= highest [Hz]")
        self._real("period", "s", above=0.0, optional=True)
        self._choice("phases", ("random", "schroeder", "optimised"))
        self._flag("odd")
        self._real("rms", above=0.0, optional=True)
        self._real("peak", above=0.0, optional=True)
        if self.rms is not None and self.peak is not None:
            raise ParameterError("a multisine takes either rms or peak, not both")
        if self.spectrum is not None:
            self._check_spectrum()

    def _check_spectrum(self) -> None:
        expected = "points (frequency [Hz], relative amplitude >= 0) of ascending frequency"
        try:
            points = np.array(self.spectrum, dtype=float)
        except (TypeError, ValueError):
            raise self._fail("spectrum", expected) from None
        if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
            raise self._fail("spectrum", expected)
        if (
            np.any(np.diff(points[:, 0]) <= 0.0)
            or np.any(points[:, 1] < 0.0)
            or not np.any(points[:, 1] > 0.0)
        ):
            raise self._fail("spectrum", expected)
        self._set("spectrum", tuple((float(f), float(a)) for f, a in points))

    def harmonics(self, period: float) -> NDArray[np.int64]:
        """Harmonic numbers of ``1 / period`` inside the band ``(n_harmonics,)``, the constant never among
        them.

        Args:
            period: Period [s].

        Raises:
            ParameterError: No harmonic lies inside the band.
        """
        # Band edges such as 0.3 Hz times 10 s are whole numbers up to rounding.
        first = max(1, int(np.ceil(self.band[0] * period - 1e-9)))
        last = int(np.floor(self.band[1] * period + 1e-9))
        numbers = np.arange(first, last + 1)
        if self.odd:
            numbers = numbers[numbers % 2 == 1]
        if numbers.size == 0:
            raise ParameterError(
                f"no {'odd ' if self.odd else ''}harmonic of {1.0 / period:g} Hz lies between "
                f"{self.band[0]:g} and {self.band[1]:g} Hz; widen the band or lengthen the period of {period:g} s"
            )
        return numbers

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        self._below_nyquist(self.band[1], sample_rate)
        samples = self._period_samples(n, sample_rate)
        harmonics = self.harmonics(samples / sample_rate)
        amplitudes = np.ones(harmonics.size)
        if self.spectrum is not None:
            points = np.array(self.spectrum)
            amplitudes = np.interp(harmonics * sample_rate / samples, points[:, 0], points[:, 1])
            excited = amplitudes > 0.0
            if not np.any(excited):
                raise ParameterError(
                    f"the spectrum of the multisine is zero at every line of its band {self.band} Hz"
                )
            harmonics, amplitudes = harmonics[excited], amplitudes[excited]
        if self.phases == "schroeder":
            phases = schroeder_phases(amplitudes)
        else:
            phases = self._generator(rng).uniform(0.0, 2.0 * np.pi, harmonics.size)
        if self.phases == "optimised":
            phases = optimised_phases(harmonics, amplitudes, phases)
        one = levelled(waveform(harmonics, amplitudes, phases, samples), rms_level=self.rms, peak=self.peak)
        return np.resize(one, n)

    def _period_samples(self, n: int, sample_rate: float) -> int:
        if self.period is None:
            return n
        samples = round(self.period * sample_rate)
        if samples < 1 or abs(self.period * sample_rate - samples) > 1e-6:
            nearest = max(1, samples) / sample_rate
            raise ParameterError(
                f"a period of {self.period:g} s is {self.period * sample_rate:.6g} samples at {sample_rate:g} Hz, "
                f"and only a whole number repeats exactly; the nearest such period is {nearest:.9g} s"
            )
        return samples
