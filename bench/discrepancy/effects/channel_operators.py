"""Effects of actuators and sensors: operations on one sampled channel, with one parameter each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

Samples = NDArray[np.float64]


@dataclass(frozen=True)
class ChannelOperatorsSettings:
    """Numbers of `bench.discrepancy.effects.channel_operators`."""

    taps: int = 24
    """Half-width in samples of the interpolation of a sensor's delay: flat within 0.1 % up to nine tenths of the Nyquist frequency."""
    kaiser: float = 6.0
    """Shape of its window."""


SETTINGS = ChannelOperatorsSettings()


def sensor_delay(x: Samples, values: Samples, step: float) -> Samples:
    """Return ``x(t - tau)``, band-limited, the ends held.

    A response holds the noise of measured loads up to the Nyquist frequency. Interpolation along straight lines would
    smooth that noise away, and a fraction of a sample of delay would seem to explain records that have none.
    """
    whole, fraction = divmod(values[0] / step, 1.0)
    lags = np.arange(1 - SETTINGS.taps, SETTINGS.taps + 1)
    taps = np.sinc(lags - fraction) * np.i0(
        SETTINGS.kaiser * np.sqrt(np.clip(1.0 - ((lags - fraction) / SETTINGS.taps) ** 2, 0.0, None))
    )
    before = min(int(whole), len(x)) + SETTINGS.taps
    held = np.pad(x, (before, SETTINGS.taps - 1), mode="edge")[: len(x) + 2 * SETTINGS.taps - 1]
    return np.asarray(np.convolve(held, taps / taps.sum(), mode="valid"), dtype=np.float64)


def delay(x: Samples, values: Samples, step: float) -> Samples:
    """Return the load ``x(t - tau)``, linear between samples as loads are, zero before the record."""
    shift = values[0] / step
    whole = int(shift)
    fraction = shift - whole
    padded = np.concatenate([np.zeros(whole + 1), x])
    n = len(x)
    return (1.0 - fraction) * padded[1 : n + 1] + fraction * padded[:n]


def skew(x: Samples, values: Samples, step: float) -> Samples:
    """Return the load ``x(t (1 + s))``, linear between samples as loads are: another clock wrote it; the end is held."""
    k = np.arange(len(x))
    return np.interp(k * (1.0 + values[0]), k, x)


def advance(x: Samples, values: Samples, step: float) -> Samples:
    """Return the load ``x(t + tau)``, linear between samples as loads are: its log was late; the end is held."""
    k = np.arange(len(x))
    return np.interp(k + values[0] / step, k, x)


def lag(x: Samples, values: Samples, step: float) -> Samples:
    """Return `x` through a first-order lag of time constant tau, updated once a sample.

    ``y[k] = y[k-1] + (1 - exp(-h / tau)) (x[k] - y[k-1])``, the recursion of a digital drive, half a sample earlier than an analogue lag.
    """
    share = 1.0 - np.exp(-step / values[0])
    return np.asarray(lfilter([share], [1.0, share - 1.0], x))


def analogue_lag(x: Samples, values: Samples, step: float) -> Samples:
    """Return `x` through an analogue lag, ``tau y' + y = x``, exact for lines between samples; zero before the record."""
    return low_pass(np.concatenate([[0.0], x]), values, step)[1:]


def held_lag(x: Samples, values: Samples, step: float) -> Samples:
    """Return the means over each sample of a lag of time constant tau, ``tau y' + y = x``, of samples that are held until the next.

    A drive works at a faster rate than the log of its commands, and follows a command while it is held.
    """
    ratio = step / values[0]
    kept = np.exp(-ratio)
    reached = lfilter([0.0, 1.0 - kept], [1.0, -kept], x)  # where each sample begins
    return np.asarray(x + (reached - x) * (1.0 - kept) / ratio)


def low_pass(x: Samples, values: Samples, step: float) -> Samples:
    """Return the reading of `x` through an analogue low-pass of first order, ``tau y' + y = x``, exact for lines between samples.

    It begins at the first sample, as a sensor that was on before the record.
    """
    ratio = step / values[0]
    kept = np.exp(-ratio)
    mean = -np.expm1(-ratio) / ratio  # of the kept part over a sample
    rise = lfilter([1.0 - mean, mean - kept], [1.0, -kept], x - x[0])
    return np.asarray(x[0] + rise)


def high_pass(x: Samples, values: Samples, step: float) -> Samples:
    """Return the reading of `x` through an analogue high-pass of first order with a corner f [Hz].

    Exact for lines between samples: ``y' + w y = x'``, w = 2 pi f. AC coupling, or a charge amplifier, has forgotten what was before the
    record but for its mean, zero of a motion about rest.
    """
    time_constant = np.array([1.0 / (2.0 * np.pi * values[0])])
    return x - low_pass(np.concatenate([[0.0], x]), time_constant, step)[1:]


def second_order_low_pass(x: Samples, values: Samples, step: float) -> Samples:
    """Return the reading of `x` through an analogue Butterworth low-pass of second order with a cutoff f [Hz].

    Exact for lines between samples: ``y'' + sqrt(2) w y' + w^2 y = w^2 x``, w = 2 pi f. It begins at the first sample, as a sensor that
    was on before the record.
    """
    w = 2.0 * np.pi * values[0]
    b, a, _ = cont2discrete(([w * w], [1.0, np.sqrt(2.0) * w, w * w]), step, method="foh")
    return np.asarray(x[0] + lfilter(np.ravel(b), a, x - x[0]))


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
