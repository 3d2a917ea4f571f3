"""Signals of the records: excitations, scheduling signals, and loads that no channel tells.

All are functions of a fine clock: `t` holds times [s] that start at zero and are evenly spaced, (n,).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.signal import fftconvolve, lfilter

from bench.arrays import Array

Excitation = Callable[[np.random.Generator, Array], Array]
"""Samples (n,) of any size, from a generator and the clock."""
RecordSignal = Callable[[np.random.Generator, Array, str], Array]
"""Samples (n,) in SI units, from a generator, the clock and the name of the record."""
TURN = 2.0 * np.pi


def faded(y: Array, t: Array, seconds: float = 0.4) -> Array:
    """Samples (n,) that rise from zero and fall to it, each within some time [s]."""
    inside = np.minimum(t, t[-1] - t) / seconds
    return y * 0.5 * (1.0 - np.cos(np.pi * np.clip(inside, 0.0, 1.0)))


def lagged(y: Array, t: Array, lag: float) -> Array:
    """Samples (n,) behind a lag of first order with a time constant [s], settled at the start."""
    share = 1.0 - math.exp(-(t[1] - t[0]) / lag)
    return np.asarray(lfilter([share], [1.0, share - 1.0], y, zi=[(1.0 - share) * y[0]])[0])


def held(values: Array, t: Array, seconds: float) -> Array:
    """Samples (n,) of values that are held one after another, each for some time [s]; the last is held on."""
    return values[np.minimum((t / seconds).astype(int), len(values) - 1)]


def rest(rng: np.random.Generator, t: Array) -> Array:
    """No load at all, as in a free decay."""
    return np.zeros(len(t))


def chirp(start: float, end: float) -> Excitation:
    """A sine whose frequency [Hz] rises exponentially."""

    def sampled(rng: np.random.Generator, t: Array) -> Array:
        growth = math.log(end / start)
        turns = start * t[-1] / growth * (np.exp(t / t[-1] * growth) - 1.0)
        return faded(np.sin(TURN * turns), t)

    return sampled


def noise_band(low: float, high: float) -> Excitation:
    """Gaussian noise in a band [Hz], as lines of random phase and of exponentially distributed power."""

    def sampled(rng: np.random.Generator, t: Array) -> Array:
        n, seconds = len(t) - 1, t[-1]
        lines = np.arange(max(1, math.ceil(low * seconds)), int(high * seconds) + 1)
        spectrum = np.zeros(n // 2 + 1, complex)
        phases = np.exp(1j * TURN * rng.random(len(lines)))
        spectrum[lines] = phases * np.sqrt(rng.exponential(1.0, len(lines)))
        y = np.fft.irfft(spectrum, n)
        return faded(np.append(y, y[0]), t)

    return sampled


def stepped_sine(frequencies: Sequence[float], amplitudes: Sequence[float]) -> Excitation:
    """Sines of equal duration one after another, whose frequencies [Hz] and amplitudes change smoothly within half a second."""

    def sampled(rng: np.random.Generator, t: Array) -> Array:
        h = t[1] - t[0]
        width = max(3, int(0.5 / h))
        window = np.hanning(width)
        window /= window.sum()

        def smoothed(values: Sequence[float]) -> Array:
            steps = held(np.asarray(values, float), t, t[-1] / len(frequencies))
            return fftconvolve(np.pad(steps, (width // 2, width - 1 - width // 2), "edge"), window, "valid")

        return faded(smoothed(amplitudes) * np.sin(TURN * np.cumsum(smoothed(frequencies)) * h), t)

    return sampled


def random_steps(seconds: float) -> Excitation:
    """Random levels, every other one of at least half the largest, each held for some time [s] and approached with two lags of 30 ms."""

    def sampled(rng: np.random.Generator, t: Array) -> Array:
        levels = rng.uniform(-1.0, 1.0, math.ceil(t[-1] / seconds) + 1)
        levels[0] = 0.0
        levels[1::2] = np.sign(levels[1::2]) * np.maximum(np.abs(levels[1::2]), 0.5)
        y = held(levels, t, seconds)
        return faded(lagged(lagged(y, t, 0.03), t, 0.03), t, 0.2)

    return sampled


def smooth_walk(low: float, high: float, period: float) -> RecordSignal:
    """A slow signal between two values: three sines, the first with a period [s]."""

    def sampled(rng: np.random.Generator, t: Array, stem: str) -> Array:
        y = np.zeros(len(t))
        for ratio in (1.0, 0.43, 2.3):
            amplitude = rng.uniform(0.5, 1.0)
            y += amplitude * np.sin(TURN * t / period / ratio + rng.uniform(0.0, 6.28))
        return low + (high - low) * (y - y.min()) / (y.max() - y.min())

    return sampled


def shuffled_levels(values: Sequence[float], seconds: float, lag: float) -> RecordSignal:
    """Given levels in random order, all of them before any comes again, each held for some time [s] behind a lag [s]."""

    def sampled(rng: np.random.Generator, t: Array, stem: str) -> Array:
        n = math.ceil(t[-1] / seconds) + 1
        rounds = [rng.permutation(values) for _ in range(math.ceil(n / len(values)))]
        return lagged(held(np.concatenate(rounds)[:n], t, seconds), t, lag)

    return sampled


def warming(courses: Mapping[str, tuple[float, float, float]]) -> RecordSignal:
    """A temperature that nears an end, with a slow ripple: of each record, where it starts and ends, and its time constant [s]."""

    def sampled(rng: np.random.Generator, t: Array, stem: str) -> Array:
        first, last, seconds = courses[stem]
        return last + (first - last) * np.exp(-t / seconds) + 0.4 * np.sin(t / 3.1)

    return sampled


def hall_temperature(rng: np.random.Generator, t: Array, stem: str) -> Array:
    """Temperature [degC] of a hall that is heated, with a slow ripple whose phase differs between records."""
    return 19.0 + 9.0 * (1.0 - np.exp(-t / 14.0)) + 0.8 * np.sin(t / 2.3 + len(stem))


def pushes(t: Array, starts: Sequence[float], seconds: float, size: float, edge: float) -> Array:
    """A load (n,) of a size for some time [s] from each start [s] on, with linear edges [s]."""
    y = np.zeros(len(t))
    for start in starts:
        y += size * np.clip(np.minimum((t - start) / edge, (start + seconds - t) / edge), 0.0, 1.0)
    return y


def pusher(rng: np.random.Generator, t: Array, stem: str) -> Array:
    """A force of -28 N for 0.9 s every 5 s, first at a random time."""
    starts = np.arange(2.3 + rng.uniform(0.0, 2.0), t[-1] - 1.5, 5.0)
    return pushes(t, starts.tolist(), 0.9, -28.0, 0.02)


def blower(windows: Mapping[str, tuple[float, float]]) -> RecordSignal:
    """A torque of 6.5 N m once a record: of each record, when it begins and how long it lasts [s]."""

    def sampled(rng: np.random.Generator, t: Array, stem: str) -> Array:
        start, seconds = windows[stem]
        return pushes(t, [start], seconds, 6.5, 0.08)

    return sampled
