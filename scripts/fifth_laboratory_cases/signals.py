"""Signals that excite a test: noise of a band, multisines, sweeps, steps, moves from point to point, and two sines.

All are functions of a clock of times [s] that start at zero and are evenly spaced, (n,), and the duration of the record [s]. Those that
are random have a seed of their own, so that they are the same signal on any clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array

Excitation = Callable[[Array, float], Array]
"""Samples (n,) in SI units, from the clock and the duration of the record [s]."""
RISE = 0.3
"""Time [s] within which most signals rise."""
MOST_STEPS, LEVEL = 200, 13.0
"""Levels of a signal of steps, and the largest of them."""


def still(t: Array, seconds: float) -> Array:
    """No load at all."""
    return np.zeros_like(t)


def ramp(t: Array, rise: float) -> Array:
    """A factor (n,) that rises from zero to one within some time [s], as a cosine."""
    return np.where(t < rise, 0.5 - 0.5 * np.cos(np.pi * np.minimum(t, rise) / rise), 1.0)


def smooth(size: float | Array, w: Array) -> Array:
    """A rise (n,) from zero to a size while w rises from zero to one, with two continuous derivatives."""
    return size * w**3 * (10 - 15 * w + 6 * w**2)


def _lines(
    low: float,
    high: float,
    size: float,
    slope: float,
    rise: float,
    drawn: Callable[[int], NDArray[np.complex128]],
) -> Excitation:
    """Sines of all whole numbers of periods a record within a band, from what draws their complex amplitudes."""

    def sampled(t: Array, seconds: float) -> Array:
        lines = np.arange(math.ceil(low * seconds), math.floor(high * seconds) + 1)
        amplitudes = drawn(len(lines)) * (lines / lines[0]) ** slope
        n = len(t) - 1
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[lines] = amplitudes
        y = np.fft.irfft(spectrum, n) * n / 2
        y = np.append(y, y[0]) * size / np.sqrt(np.sum(np.abs(amplitudes) ** 2) / 2)
        return y * ramp(t, rise) if rise else y

    return sampled


def band(
    seed: int, low: float, high: float, size: float, slope: float = 0.0, *, rise: float = RISE
) -> Excitation:
    """Noise of a band [Hz] of some root mean square, with random phases and amplitudes; these go with a power of the frequency."""

    def drawn(count: int) -> NDArray[np.complex128]:
        rng = np.random.default_rng(seed)
        return rng.normal(size=count) + 1j * rng.normal(size=count)

    return _lines(low, high, size, slope, rise, drawn)


def multisine(
    seed: int, low: float, high: float, size: float, slope: float = 0.0, *, rise: float = RISE
) -> Excitation:
    """Sines of a band [Hz] of some root mean square, with random phases; their amplitudes go with a power of the frequency."""

    def drawn(count: int) -> NDArray[np.complex128]:
        return np.exp(2j * np.pi * np.random.default_rng(seed).random(count))

    return _lines(low, high, size, slope, rise, drawn)


def sweep(low: float, high: float, amplitude: float) -> Excitation:
    """A sine whose frequency [Hz] rises evenly in time."""

    def sampled(t: Array, seconds: float) -> Array:
        phase = 2 * np.pi * (low * t + (high - low) * t**2 / (2 * seconds))
        return amplitude * np.sin(phase) * ramp(t, RISE)

    return sampled


def steps(seed: int) -> Excitation:
    """Random levels that last for 30 to 159 samples each, smoothed over 13."""

    def sampled(t: Array, seconds: float) -> Array:
        rng = np.random.default_rng(seed)
        levels = rng.uniform(-LEVEL, LEVEL, MOST_STEPS)
        level = np.repeat(levels, rng.integers(30, 160, MOST_STEPS))[: len(t)]
        window = np.hanning(13)
        return np.convolve(level, window / window.sum())[: len(t)] * ramp(t, RISE)

    return sampled


def moves(seed: int) -> Excitation:
    """Positions [m] of moves from point to point within 80 mm either way, with pauses of up to 0.15 s."""

    def sampled(t: Array, seconds: float) -> Array:
        rng = np.random.default_rng(seed)
        y, begin, position = np.zeros_like(t), 0.4, 0.0
        while begin < seconds - 1.2:
            target = rng.uniform(-0.08, 0.08)
            lasting = max(0.35, abs(target - position) / rng.uniform(0.05, 0.22))
            y = y + smooth(target - position, np.clip((t - begin) / lasting, 0, 1))
            begin += lasting + rng.uniform(0.0, 0.15)
            position = target
        return y

    return sampled


def two_sines(t: Array, seconds: float) -> Array:
    """Positions [m] of a slow sine of 50 mm and a faster one of 6 mm."""
    return 0.05 * np.sin(2 * np.pi * 0.31 * t) + 0.006 * np.sin(2 * np.pi * 1.7 * t + 1)


def started_slowly(excitation: Excitation) -> Excitation:
    """An excitation that rises within a second."""
    return lambda t, seconds: smooth(excitation(t, seconds), np.clip(t, 0, 1))
