"""What the acquisition did: how a load ran between its samples, and which filter a response passed before it was sampled.

A free run needs the load at every instant, a record gives it at its samples. Three readings are usual: a straight line
between samples, which is right where the samples are dense; the band-limited signal through the samples, which is right behind
a reconstruction filter or an anti-aliasing filter; and the held value, which is what a converter without a filter puts out.
At a fifth of the sample rate a straight line loses 12 % of a sine, so the choice matters long before Nyquist.

A response may be sampled behind an analogue filter, or at a high rate and decimated behind a digital one. Such a filter is
linear and known; it is applied to the simulated channel as a frequency response, over the band of the record. What lies
above half the sample rate and is folded back is not followed: a filter worth its name leaves little of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal
from scipy.interpolate import CubicSpline

from bench.arrays import Array
from bench.errors import ParameterError, UnknownNameError

Interpolation = Literal["linear", "band_limited", "zero_order_hold"]
INTERPOLATIONS = get_args(Interpolation)
"""Readings of a load between its samples."""


@dataclass(frozen=True)
class AcquisitionSettings:
    """Numbers of `bench.discrepancy.case.acquisition`."""

    reach: int = 48
    """Samples on either side that a band-limited value is made of; with `kaiser` exact to 1e-5 up to 0.46 of the sample rate."""
    kaiser: float = 9.0


SETTINGS = AcquisitionSettings()


def upsampled(samples: Array, factor: int, *, interpolation: str = "linear", periodic: bool = False) -> Array:
    """Load on a grid `factor` times as fine.

    A record that is no period of anything is continued beyond its ends by its point reflection, which keeps its slope.

    Args:
        samples: (n, n_loads).
        factor: Rows a sample.
        interpolation: "linear" or "band_limited".
        periodic: Whether the samples are whole periods, so that their end joins their start.

    Returns:
        ((n - 1) factor + 1, n_loads), every `factor`-th row as it was given.

    Raises:
        UnknownNameError: No such interpolation.
    """
    if interpolation not in {"linear", "band_limited"}:
        raise UnknownNameError("interpolation", interpolation, ("linear", "band_limited"))
    n = len(samples)
    fine = np.arange((n - 1) * factor + 1) / factor
    if interpolation == "linear":
        return np.column_stack([np.interp(fine, np.arange(n), column) for column in samples.T])
    if periodic:
        whole = np.asarray(signal.resample(samples, n * factor, axis=0), dtype=np.float64)
        whole[::factor] = samples
        return whole[: len(fine)]
    pad = min(2 * SETTINGS.reach, n - 1)
    extended = np.pad(samples, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
    t = np.arange(-SETTINGS.reach * factor, SETTINGS.reach * factor + 1) / factor
    kernel = np.sinc(t) * np.kaiser(len(t), SETTINGS.kaiser)
    dense = signal.upfirdn(kernel, extended, up=factor, axis=0)
    first = (pad + SETTINGS.reach) * factor
    return np.ascontiguousarray(dense[first : first + len(fine)])


FilterKind = Literal["butterworth", "bessel", "fir", "delay"]
"""Kinds of filters."""


@dataclass(frozen=True)
class Antialias:
    """Filter that a response passed on its way into a record.

    Attributes:
        kind: "butterworth" or "bessel" (analogue low-pass), "fir" (digital, before decimation) or "delay" (nothing but `delay_s`).
        cutoff_hz: Frequency of -3 dB of an analogue low-pass (of half its phase for "bessel"); of -6 dB of a designed FIR [Hz].
        order: Order of an analogue low-pass.
        rate_hz: Rate at which an FIR ran [Hz].
        taps: Number of coefficients of an FIR, where it is to be designed by `window` and `cutoff_hz`.
        window: Its window.
        coefficients: Coefficients of an FIR, where they are known.
        zero_phase: Whether the delay of half an FIR was taken back, as decimators do.
        delay_s: Further delay of the channel [s].
        records: Names of the records that passed it; all where empty.

    Example:
        >>> Antialias("fir", cutoff_hz=375.0, rate_hz=15000.0, taps=31).gain(np.array([0.0])).round(3)
        array([1.+0.j])
    """

    kind: FilterKind
    cutoff_hz: float = 0.0
    order: int = 4
    rate_hz: float = 0.0
    taps: int = 0
    window: str = "hamming"
    coefficients: tuple[float, ...] = ()
    zero_phase: bool = True
    delay_s: float = 0.0
    records: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in RESPONSES:
            raise UnknownNameError("kind of antialias filter", self.kind, RESPONSES)
        designed = self.kind == "fir" and not self.coefficients
        if (designed or self.kind in {"butterworth", "bessel"}) and not self.cutoff_hz > 0.0:
            raise ParameterError(
                f"the antialias filter '{self.kind}' has a cutoff_hz of {self.cutoff_hz:g}; give one above zero [Hz]"
            )
        if self.kind in {"butterworth", "bessel"} and not 1 <= self.order <= 20:
            raise ParameterError(f"the antialias filter has order {self.order}; give one from 1 to 20")
        if self.kind == "fir" and not self.rate_hz > 2.0 * self.cutoff_hz:
            raise ParameterError(
                f"the FIR antialias filter ran at rate_hz {self.rate_hz:g}, which is not above twice its cutoff_hz "
                f"{self.cutoff_hz:g}; give the rate before decimation [Hz]"
            )
        if designed and self.taps < 3:
            raise ParameterError(
                f"the FIR antialias filter has {self.taps} taps; give taps (3 or more) or coefficients"
            )

    def passed(self, record: str) -> bool:
        """Whether a record passed the filter."""
        return not self.records or record in self.records

    def gain(self, frequency: Array) -> NDArray[np.complex128]:
        """Frequency response at `frequency` (n,) [Hz]."""
        return RESPONSES[self.kind](self, frequency) * np.exp(-2j * np.pi * frequency * self.delay_s)

    def apply(self, samples: Array, step: float, *, periodic: bool = False) -> Array:
        """Filter one channel.

        Before the record the channel stood at its first value; after it, it is continued by its point reflection.

        Args:
            samples: (n,).
            step: Time between samples [s].
            periodic: Whether the samples are whole periods.

        Returns:
            (n,) samples behind the filter.
        """
        n = len(samples)
        if periodic:
            return _filtered(samples, _gain_of(self, n, step))
        memory = (
            10.0 / self.cutoff_hz if self.cutoff_hz else len(self.coefficients) / (self.rate_hz or np.inf)
        )
        pad = min(int((memory + abs(self.delay_s)) / step) + 64, n - 1)
        length = int(fft.next_fast_len(n + 3 * pad, real=True) or n + 3 * pad)
        after = 2.0 * samples[-1] - samples[-2 : -2 - pad : -1]
        way = np.sin(np.linspace(0.0, 0.5 * np.pi, length - n - 2 * pad)) ** 2
        back = after[-1] + (samples[0] - after[-1]) * way
        extended = np.concatenate([np.full(pad, samples[0]), samples, after, back])
        return _filtered(extended, _gain_of(self, length, step))[pad : pad + n]


def at_times(samples: Array, at: Array, interpolation: str) -> Array:
    """Values (m,) of a load (n,) at times (m,) counted in samples, as it ran between them; its last value beyond its end."""
    if interpolation == "zero_order_hold":
        return samples[np.clip(np.floor(at + 1e-9).astype(np.int64), 0, len(samples) - 1)]
    clock = np.arange(len(samples))
    if interpolation == "band_limited":
        return np.asarray(CubicSpline(clock, samples)(np.clip(at, 0.0, clock[-1])), dtype=np.float64)
    return np.interp(at, clock, samples)


def _filtered(samples: Array, gain: NDArray[np.complex128]) -> Array:
    """Periodic samples (n,) behind a gain at the bins of their real transform."""
    spectrum = np.asarray(fft.rfft(samples), dtype=np.complex128)
    return np.asarray(fft.irfft(spectrum * gain, len(samples)), dtype=np.float64)


@lru_cache(maxsize=16)
def _gain_of(filtered: Antialias, length: int, step: float) -> NDArray[np.complex128]:
    """Frequency response at the bins of a real transform, kept since a fit asks for it a thousand times."""
    return filtered.gain(np.asarray(fft.rfftfreq(length, step), dtype=np.float64))


def _fir(filtered: Antialias, frequency: Array) -> NDArray[np.complex128]:
    b = np.array(filtered.coefficients)
    if not b.size:
        b = signal.firwin(filtered.taps, filtered.cutoff_hz, window=filtered.window, fs=filtered.rate_hz)
    lag = 0.5 * (len(b) - 1) if filtered.zero_phase else 0.0
    omega = 2.0 * np.pi * frequency / filtered.rate_hz
    return np.exp(1j * omega * lag) * signal.freqz(b, worN=omega)[1]


def _analogue(filtered: Antialias, frequency: Array) -> NDArray[np.complex128]:
    design = signal.butter if filtered.kind == "butterworth" else signal.bessel
    zpk: Any = design(filtered.order, 2.0 * np.pi * filtered.cutoff_hz, analog=True, output="zpk")
    response = signal.freqresp(signal.ZerosPolesGain(*zpk), 2.0 * np.pi * frequency)[1]
    return np.asarray(response, dtype=np.complex128)


RESPONSES: dict[FilterKind, Callable[[Antialias, Array], NDArray[np.complex128]]] = {
    "butterworth": _analogue,
    "bessel": _analogue,
    "fir": _fir,
    "delay": lambda filtered, frequency: np.ones(len(frequency), dtype=complex),
}
"""Frequency responses by kind."""
