"""Excitations of the records: loads, targets and prescribed motions, of unit size."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, convolve, lfilter, sosfilt

from bench.arrays import Array


def faded(y: Array, rate: int) -> Array:
    """Samples (n,) that rise from zero and fall to it, each within half a second."""
    n = rate // 2
    ramp = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))
    window = np.ones(len(y))
    window[:n], window[-n:] = ramp, ramp[::-1]
    return y * window


def times(seconds: float, rate: int) -> Array:
    """Times of samples [s], both ends included."""
    return np.arange(int(seconds * rate) + 1) / rate


@dataclass(frozen=True)
class Excitation(ABC):
    """An excitation; its largest absolute value is one unless it says otherwise."""

    @abstractmethod
    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """Samples (int(seconds * rate) + 1,) of any size."""

    def sample(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """Samples (int(seconds * rate) + 1,) of unit size."""
        y = self.shape(rng, seconds, rate)
        return y / np.max(np.abs(y))


@dataclass(frozen=True)
class Multisine(Excitation):
    """All frequencies of a band [Hz] with a whole number of periods in the record, of equal amplitude and random phase."""

    low: float
    high: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        n = int(seconds * rate)
        lines = np.arange(max(1, math.ceil(self.low * seconds)), int(self.high * seconds) + 1)
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[lines] = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, len(lines)))
        y = np.fft.irfft(spectrum, n)
        return faded(np.append(y, y[0]), rate)


@dataclass(frozen=True)
class LogarithmicSweep(Excitation):
    """A sine whose frequency [Hz] rises exponentially."""

    start: float
    end: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        growth = math.log(self.end / self.start)
        turns = np.exp(times(seconds, rate) / seconds * growth) - 1.0
        return faded(np.sin(2.0 * np.pi * self.start * seconds / growth * turns), rate)


@dataclass(frozen=True)
class LinearSweep(Excitation):
    """A sine whose frequency [Hz] rises linearly."""

    start: float
    end: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        t = times(seconds, rate)
        turns = self.start * t + (self.end - self.start) * t * t / (2.0 * seconds)
        return faded(np.sin(2.0 * np.pi * turns), rate)


@dataclass(frozen=True)
class BandNoise(Excitation):
    """Gaussian noise in a band [Hz] (Butterworth filter of third order)."""

    low: float
    high: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        band = butter(3, [self.low, self.high], "bandpass", fs=rate, output="sos")
        return faded(np.asarray(sosfilt(band, rng.standard_normal(int(seconds * rate) + 1))), rate)


@dataclass(frozen=True)
class SineBlocks(Excitation):
    """Sines one after another, each of a frequency [Hz] and a relative amplitude, which change smoothly within 0.8 s."""

    blocks: tuple[tuple[float, float], ...]

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        n = int(seconds * rate) + 1
        held = np.array(self.blocks)[
            np.minimum(np.arange(n) // (n // len(self.blocks)), len(self.blocks) - 1)
        ]
        half = int(0.4 * rate)
        window = np.hanning(2 * half + 1)
        window /= window.sum()
        method = "direct" if n < 50_000 else "fft"
        frequency, amplitude = (
            convolve(np.pad(y, half, "edge"), window, "valid", method=method) for y in held.T
        )
        return faded(amplitude * np.sin(2.0 * np.pi * np.cumsum(frequency) / rate), rate)


@dataclass(frozen=True)
class Steps(Excitation):
    """Random levels, every other one of at least 0.4, held for some time [s] and approached with a time constant [s], as a valve does."""

    held: float
    lag: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        n = int(seconds * rate) + 1
        levels = rng.uniform(-1.0, 1.0, math.ceil(n / (self.held * rate)))
        levels[0] = levels[-1] = 0.0
        levels[1::2] = np.sign(levels[1::2] + 1e-9) * np.maximum(np.abs(levels[1::2]), 0.4)
        y = np.repeat(levels, int(self.held * rate))[:n]
        y = np.pad(y, (0, n - len(y)))
        share = 1.0 - math.exp(-1.0 / (rate * self.lag))
        return np.asarray(lfilter([share], [1.0, share - 1.0], y))


@dataclass(frozen=True)
class Bursts(Excitation):
    """Decaying sines of random sign, amplitude and frequency, as of an impact hammer with a soft tip.

    Attributes:
        every: Time from one to the next [s].
        frequency: Frequency [Hz], of which each takes 0.8 to 1.25.
        decay: Time constant of the decay [s].
    """

    every: float
    frequency: float
    decay: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        t = times(seconds, rate)
        y = np.zeros(len(t))
        for k in range(int(seconds / self.every)):
            since = t - k * self.every - 0.2
            amplitude = rng.uniform(0.5, 1.0) * rng.choice([-1, 1])
            frequency = self.frequency * rng.uniform(0.8, 1.25)
            after = np.maximum(since, 0.0)
            y += amplitude * np.sin(2.0 * np.pi * frequency * after) * np.exp(-after / self.decay)
        return y


@dataclass(frozen=True)
class Pulses(Excitation):
    """Pushes by hand: squared half sines of random amplitude and sign.

    Attributes:
        every: Time from one to the next [s].
        width: Duration of a push [s].
    """

    every: float
    width: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        t = times(seconds, rate)
        y = np.zeros(len(t))
        for k in range(int(seconds / self.every)):
            since = t - k * self.every - 0.5
            amplitude = rng.uniform(0.35, 1.0) * (rng.choice([-1, 1]) if k else 1)
            inside = (since > 0.0) & (since < self.width)
            y += amplitude * np.where(inside, np.sin(np.pi * np.clip(since / self.width, 0.0, 1.0)) ** 2, 0.0)
        return y


@dataclass(frozen=True)
class PointToPoint(Excitation):
    """Moves of an axis between random positions in [-1, 1], as polynomials of fifth degree with rests between; not scaled.

    Attributes:
        slowness: Duration of a move over its distance [s], to which 0.3 s are added.
    """

    slowness: float

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """As of `Excitation.shape`."""
        n = int(seconds * rate) + 1
        y = np.zeros(n)
        position, i = 0.0, int(0.3 * rate)
        while i < n:
            goal = rng.uniform(-1.0, 1.0)
            moving = int(max(0.5, self.slowness * abs(goal - position) + 0.3) * rate)
            s = np.arange(moving) / moving
            path = position + (goal - position) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
            y[i : i + moving] = path[: n - i]
            position = goal
            i += moving
            resting = int(rng.uniform(0.1, 0.5) * rate)
            y[i : i + resting] = position
            i += resting
        return y

    def sample(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """Samples (int(seconds * rate) + 1,) as they are drawn."""
        return self.shape(rng, seconds, rate)


@dataclass(frozen=True)
class Rest(Excitation):
    """No load at all, as in a free decay."""

    def shape(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """Zeros."""
        return np.zeros(int(seconds * rate) + 1)

    def sample(self, rng: np.random.Generator, seconds: float, rate: int) -> Array:
        """Zeros."""
        return self.shape(rng, seconds, rate)
