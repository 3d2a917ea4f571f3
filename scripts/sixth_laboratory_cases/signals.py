"""Loads and motions as laboratories play them: multisines, noise of a band, sweeps, levels and a made-up earthquake.

All are sampled at the steps of the integration. Those that are random draw from the generator of their case, one after the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array

Generator = np.random.Generator
"""Source of what is random."""
REST, RISE = 0.4, 0.6
"""Time [s] for which most signals rest, and within which they rise then."""


class Clock(NamedTuple):
    """Times at which a signal is sampled.

    Attributes:
        n: How many there are.
        rate: Samples a second.
    """

    n: int
    rate: float

    def times(self) -> Array:
        """These times [s] (n,)."""
        return np.arange(self.n) / self.rate


def ramp(clock: Clock) -> Array:
    """A factor (n,) that rests at zero, then rises to one with two continuous derivatives."""
    part = np.clip((clock.times() - REST) / RISE, 0.0, 1.0)
    return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)


def multisine(
    clock: Clock, rng: Generator, band: tuple[float, float], rms: float, *, period: float = 10.0
) -> Array:
    """Sines of equal amplitude and random phase.

    Args:
        clock: When it is sampled.
        rng: Source of the phases.
        band: Lowest and highest frequency [Hz].
        rms: Root mean square, before it is made to rise.
        period: Time [s] of which the period of each sine is a whole fraction.
    """
    time = clock.times()
    lines = np.arange(np.ceil(band[0] * period), np.floor(band[1] * period) + 1.0) / period
    out = np.zeros(clock.n)
    for line, phase in zip(lines, rng.uniform(0.0, 2.0 * np.pi, lines.size), strict=True):
        out += np.cos(2.0 * np.pi * line * time + phase)
    return rms * np.sqrt(2.0 / lines.size) * out * ramp(clock)


def band_noise(clock: Clock, rng: Generator, band: tuple[float, float], rms: float) -> Array:
    """Gaussian noise of a band [Hz], whose edges fall off over a quarter of an octave, of some root mean square before it rises."""
    spectrum = np.fft.rfft(rng.standard_normal(clock.n))
    frequency = np.maximum(np.fft.rfftfreq(clock.n, 1.0 / clock.rate), 1e-9)
    below = np.clip(1.0 + np.log2(frequency / band[0]) / 0.25, 0.0, 1.0)
    above = np.clip(1.0 - np.log2(frequency / band[1]) / 0.25, 0.0, 1.0)
    out = np.fft.irfft(spectrum * below * above, clock.n)
    return rms * out / out.std() * ramp(clock)


def sweep(clock: Clock, band: tuple[float, float], amplitude: float) -> Array:
    """A sine whose frequency [Hz] rises exponentially over the record."""
    speed = np.log(band[1] / band[0]) / (clock.n / clock.rate)
    phase = 2.0 * np.pi * band[0] * (np.exp(speed * clock.times()) - 1.0) / speed
    return amplitude * np.sin(phase) * ramp(clock)


def levels(clock: Clock, values: tuple[float, ...], rise: float) -> Array:
    """Levels of equal length, each reached along a smooth step that takes some time [s]; the first one begins at zero."""
    time, length = clock.times(), clock.n / clock.rate / len(values)
    out, last = np.zeros(clock.n), 0.0
    for number, value in enumerate(values):
        part = np.clip((time - number * length - 0.3) / rise, 0.0, 1.0)
        out += (value - last) * part**2 * (3.0 - 2.0 * part)
        last = value
    return out


def quake(clock: Clock, rng: Generator, rms: float) -> Array:
    """A made-up earthquake: noise about 2.5 Hz whose envelope rises, stays and dies away, twice."""
    time = clock.times()
    base = band_noise(clock, rng, (0.8, 12.0), 1.0) + band_noise(clock, rng, (1.5, 4.5), 0.8)
    late = np.maximum(time - 0.55 * clock.n / clock.rate, 0.0)
    envelope = (time / 3.0) * np.exp(1.0 - time / 3.0)
    envelope += 0.8 * (late / 2.5) * np.exp(1.0 - late / 2.5)
    out = base * (0.15 + envelope) * ramp(clock)
    return rms * out / out.std()


def rate_of(values: Array, rate: float) -> Array:
    """Time derivative of samples (n,) at a rate [Hz]: differences of fourth order inside, of lower order at the ends."""
    out = np.gradient(values, 1.0 / rate)
    out[2:-2] = (values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]) * rate / 12.0
    return out
