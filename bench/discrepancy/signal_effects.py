"""Effects of actuators and sensors: operations on one sampled channel, with one parameter each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Samples = NDArray[np.float64]


def delay(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x(t - tau)``, linear between samples, zero before the record."""
    shift = values[0] / step
    whole = int(shift)
    fraction = shift - whole
    padded = np.concatenate([np.zeros(whole + 1), x])
    n = len(x)
    return (1.0 - fraction) * padded[1 : n + 1] + fraction * padded[:n]


def lag(x: Samples, values: Samples, step: float) -> Samples:
    """Return the response of ``tau y' + y = x`` to piecewise linear `x`, from rest."""
    ratio = step / values[0]
    e = np.exp(-ratio)
    # first-order hold: y[k+1] = e y[k] + b1 x[k+1] + b0 x[k]
    b1 = 1.0 - (1.0 - e) / ratio
    b0 = (1.0 - e) / ratio - e
    y, _ = lfilter([b1, b0], [1.0, -e], x, zi=[-b1 * x[0]])
    return y


def gain(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``(1 + e) x``."""
    return (1.0 + values[0]) * x


def offset(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x + b``."""
    return x + values[0]


def drift(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x + d t / T``: a drift that reaches d at the end of the record."""
    return x + values[0] * np.arange(len(x)) / len(x)


def clip(x: Samples, values: Samples, step: float) -> Samples:
    """Return `x` clipped at ± level."""
    return np.clip(x, -values[0], values[0])
