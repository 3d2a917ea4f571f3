"""Reference motions of a joint over time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from fourth_robots_cases.references import minimum_jerk

from bench.arrays import Array

Shape = Callable[[np.random.Generator, Array], Array]
"""Positions [rad or m] (n_samples) at times [s] (n_samples), with random numbers."""
SINES = 9
"""Sines of a multisine."""


@dataclass(frozen=True)
class Motion:
    """A motion of a joint.

    Attributes:
        centre: Its middle, at which the joint is before a motion sets in [rad or m].
        shape: Gives it.
    """

    centre: float
    shape: Shape = field(repr=False)


def hold(centre: float) -> Motion:
    """No motion."""
    return Motion(centre, lambda _, t: np.full_like(t, centre))


def multisine(centre: float, amplitude: float, low: float, high: float) -> Motion:
    """Sines at random frequencies [Hz] between two, whose amplitudes fall with the root of the frequency, within an amplitude."""

    def shape(rng: np.random.Generator, t: Array) -> Array:
        frequency = np.sort(low * (high / low) ** rng.uniform(0, 1, SINES))
        weight, total = frequency**-0.5, np.zeros_like(t)
        for share, each in zip(weight, frequency, strict=True):
            total = total + share * np.sin(2 * np.pi * each * t + rng.uniform(0, 2 * np.pi))
        return centre + amplitude * total / np.abs(total).max()

    return Motion(centre, shape)


def chirp(centre: float, amplitude: float, low: float, high: float) -> Motion:
    """A sine of an amplitude, from a low to a high frequency [Hz]."""

    def shape(_: np.random.Generator, t: Array) -> Array:
        angle = 2 * np.pi * (low * t + 0.5 * (high - low) * t * t / t[-1])
        return centre + amplitude * np.sin(angle)

    return Motion(centre, shape)


def moves(centre: float, amplitude: float, rate: float) -> Motion:
    """Moves from point to point within an amplitude, with rests between, at a rate [1/s] of about one each."""

    def shape(rng: np.random.Generator, t: Array) -> Array:
        out, now, start = np.full_like(t, centre), centre, 0.0
        while start < t[-1]:
            to = centre + amplitude * rng.uniform(-1, 1)
            takes = rng.uniform(0.35, 0.9) / rate
            out = np.where(t >= start, now + (to - now) * minimum_jerk(t - start, takes), out)
            now = to
            start += takes + rng.uniform(0.0, 0.4) / rate
        return out

    return Motion(centre, shape)


def slow(centre: float, amplitude: float, frequency: float) -> Motion:
    """A triangle of rounded tips, of a frequency [Hz]."""

    def shape(rng: np.random.Generator, t: Array) -> Array:
        sine = np.sin(2 * np.pi * frequency * t + rng.uniform(0, 6.28))
        return centre + amplitude * 2 / np.pi * np.arcsin(0.995 * sine)

    return Motion(centre, shape)


def gait(centre: float, amplitude: float, frequency: float, phase: float) -> Motion:
    """Steps of walking at a frequency [Hz], by a phase [rad] ahead: two harmonics and a line that is none."""

    def shape(rng: np.random.Generator, t: Array) -> Array:
        w, first = 2 * np.pi * frequency, rng.uniform(0, 2 * np.pi)
        main = 0.75 * np.sin(w * t + first + phase)
        second = 0.28 * np.sin(2 * w * t + 2 * first + 0.9 + phase)
        return centre + amplitude * (main + second + 0.1 * np.sin(3.37 * w * t + first))

    return Motion(centre, shape)
