"""Signals that excite a test: tones, sweeps, bursts, and sines that are released.

All are functions of a generator, a clock of times [s] that start at zero and are evenly spaced, (n,), and the duration of the record
[s], beyond which the clock may reach. What is random is drawn before anything is sampled, so that it does not depend on the clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bench.arrays import Array

Excitation = Callable[[np.random.Generator, Array, float], Array]
"""Samples (n,) in SI units, from a generator, the clock and the duration of the record [s]."""
TURN = 2.0 * np.pi


def risen(t: Array, rise: float) -> Array:
    """A factor (n,) that rises from zero to one within some time [s], with two continuous derivatives."""
    s = np.clip(t / rise, 0, 1)
    return s * s * s * (10 - 15 * s + 6 * s * s)


def still(rng: np.random.Generator, t: Array, seconds: float) -> Array:
    """No load at all, as in a free decay."""
    return np.zeros_like(t)


def tones(
    size: float, low: float, high: float, count: int, *, tilt: float = 0.0, swell: float = 0.0
) -> Excitation:
    """Sines of random frequencies and phases, whose sum swells and fades slowly.

    Args:
        size: Root mean square of the sum, before it swells.
        low: Lowest frequency [Hz].
        high: Highest frequency [Hz]; logarithms of frequencies are distributed evenly between both.
        count: Number of sines.
        tilt: Amplitudes are as the frequencies to the power of minus this.
        swell: Depth of the slow swelling.
    """

    def sampled(rng: np.random.Generator, t: Array, seconds: float) -> Array:
        frequencies = np.exp(rng.uniform(np.log(low), np.log(high), count))
        phases = rng.uniform(0, TURN, count)
        amplitudes = frequencies**-tilt
        amplitudes /= np.sqrt((amplitudes * amplitudes).sum() / 2)
        swell_phase, swell_frequency = rng.uniform(0, TURN), rng.uniform(1.2, 2.3) / seconds
        y = np.zeros_like(t)
        for frequency, phase, amplitude in zip(frequencies, phases, amplitudes, strict=True):
            y += amplitude * np.sin(TURN * frequency * t + phase)
        return size * (y * (1 + swell * np.sin(TURN * swell_frequency * t + swell_phase)) * risen(t, 0.25))

    return sampled


def sweeps(size: float, low: float, high: float, count: float, *, breath: float) -> Excitation:
    """A sine that sweeps up and down in the logarithm of its frequency, with an amplitude that breathes.

    Args:
        size: Mean amplitude.
        low: Lowest frequency [Hz].
        high: Highest frequency [Hz].
        count: Sweeps of a record, up and down.
        breath: Relative depth of the breathing.
    """

    def sampled(rng: np.random.Generator, t: Array, seconds: float) -> Array:
        phase = rng.uniform(0, 6.28)
        height = 0.5 - 0.5 * np.cos(TURN * count * t / seconds)
        frequency = low * (high / low) ** height
        turns = np.concatenate([[0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(t))])
        breathing = 1 + breath * np.sin(TURN * 1.7 * t / seconds + 1)
        return size * (np.sin(TURN * turns + phase) * breathing * risen(t, 0.3))

    return sampled


def bursts(size: float, low: float, high: float, count: int) -> Excitation:
    """Wave packets of random starts, frequencies, sizes and lengths.

    Args:
        size: Amplitude of a mean packet.
        low: Lowest frequency [Hz].
        high: Highest frequency [Hz]; logarithms of frequencies are distributed evenly between both.
        count: Packets of a record.
    """

    def sampled(rng: np.random.Generator, t: Array, seconds: float) -> Array:
        starts = np.sort(rng.uniform(0, seconds * 0.93, count))
        frequencies = np.exp(rng.uniform(np.log(low), np.log(high), count))
        amplitudes = rng.uniform(0.5, 1.3, count) * rng.choice([-1, 1], count)
        periods, phases = rng.uniform(1.2, 4, count), rng.uniform(0, 6.28, count)
        y = np.zeros_like(t)
        packets = zip(starts, frequencies, amplitudes, periods, phases, strict=True)
        for start, frequency, amplitude, length, phase in packets:
            inside = np.clip((t - start) / (length / frequency), 0, 1)
            y += amplitude * np.sin(np.pi * inside) ** 2 * np.sin(TURN * frequency * (t - start) + phase)
        return size * (y * risen(t, 0.15))

    return sampled


def sine(size: float, frequency: float, *, rise: float, decay: float = math.inf) -> Excitation:
    """A sine [Hz] that rises within some time [s] and decays with a time constant [s]."""

    def sampled(rng: np.random.Generator, t: Array, seconds: float) -> Array:
        return size * np.sin(TURN * frequency * t) * risen(t, rise) * np.exp(-t / decay)

    return sampled


def added(*parts: Excitation, rise: float | None = None) -> Excitation:
    """Several excitations at once, drawn one after another; their sum rises within some time [s] where one is given."""

    def sampled(rng: np.random.Generator, t: Array, seconds: float) -> Array:
        first, *others = (part(rng, t, seconds) for part in parts)
        y = sum(others, first)
        return y if rise is None else y * risen(t, rise)

    return sampled
