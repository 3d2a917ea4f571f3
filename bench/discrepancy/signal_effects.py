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
    """Return `x` through a first-order lag of time constant tau, updated once a sample.

    ``y[k] = y[k-1] + (1 - exp(-h / tau)) (x[k] - y[k-1])``, the recursion of a digital drive. An analogue lag differs
    from it by half a sample of delay.
    """
    share = 1.0 - np.exp(-step / values[0])
    return np.asarray(lfilter([share], [1.0, share - 1.0], x))


def gain(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``(1 + e) x``."""
    return (1.0 + values[0]) * x


def offset(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x + b``."""
    return x + values[0]


def drift(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x + d t / T``: a drift that reaches d at the end of the record."""
    return x + values[0] * np.arange(len(x)) / len(x)


def reverse(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``-r x``: a channel wired the wrong way round, r = 1."""
    return -values[0] * x


def quantise(x: Samples, values: Samples, step: float) -> Samples:
    """Return `x` rounded to a multiple of q."""
    return values[0] * np.round(x / values[0])


def clip(x: Samples, values: Samples, step: float) -> Samples:
    """Return `x` clipped at ± level."""
    return np.clip(x, -values[0], values[0])
