"""Band-limited change of the sample rate by a ratio of whole numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, resample_poly

from bench.errors import RecordingError


@dataclass(frozen=True)
class ResamplingSettings:
    """Numbers of `bench.recording.resampling`."""

    crossings: int = 32
    """Zero crossings of the filter on either side; sets its length."""
    beta: float = 8.6
    """Kaiser shape: 86 dB stop band, 5e-5 pass-band ripple."""


SETTINGS = ResamplingSettings()


def ratio_of(old: float, new: float, duration: float) -> Fraction:
    """Ratio of two sample rates, of whole numbers.

    Args:
        old: The record's [Hz].
        new: The one asked for [Hz].
        duration: Of the record [s].

    Raises:
        RecordingError: Not a finite number > 0, or not a ratio of whole numbers up to 20 000.
    """
    if not (math.isfinite(new) and new > 0.0):
        raise RecordingError(f"sample_rate is {new}; a finite number > 0 [Hz] is expected")
    ratio = Fraction(new / old).limit_denominator(20_000)
    nearest = float(old * ratio)
    # a thousandth of a step over the record: a tenth of the jitter that passes for a uniform clock
    if ratio.numerator > 20_000 or ratio == 0 or abs(nearest / new - 1.0) * duration * new > 1e-3:
        raise RecordingError(
            f"{new} Hz is no ratio of whole numbers up to 20 000 to the record's {old} Hz; "
            f"the nearest rate that is: {nearest:.12g} Hz"
        )
    return ratio


def resampled(values: NDArray[np.float64], up: int, down: int) -> NDArray[np.float64]:
    """Values at ``up / down`` times the rate, without delay; the last sample lies at or before the old last one.

    scipy's own default filter has its half-power point at the Nyquist frequency, so that a tenth of the band folds back;
    this one is three times as long and has its stop band begin there.

    Args:
        values: ``(n, n_channels)``.
        up: Numerator of the ratio.
        down: Denominator.
    """
    if up == down or values.shape[1] == 0:
        return values[:: max(down // up, 1)]
    slower = max(up, down)
    half = SETTINGS.crossings * slower
    # transition band of a Kaiser window, (A - 8) / (2.285 (taps - 1)) rad a sample, laid below the Nyquist frequency
    width = (86.0 - 8.0) / (2.285 * 2.0 * half) / np.pi
    cutoff = 1.0 / slower - width / 2.0
    taps = firwin(2 * half + 1, cutoff, window=("kaiser", SETTINGS.beta))
    kept = (len(values) - 1) * up // down + 1
    return resample_poly(values, up, down, axis=0, window=taps, padtype="line")[:kept]
