"""Reference motions of a robot, sampled over time.

References:
    T. Flash and N. Hogan, *The coordination of arm movements*, J. Neurosci. 5 (1985) 1688-1703 (the minimum-jerk profile).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from bench.arrays import Array

Plan = Literal["multisine", "moves", "turns", "mixed"]
"""A kind of motion: sines of all joints, moves with rests, a chirp at one joint after the other, moves and sines together."""
ONSET = 0.9
"""Time over which a multisine sets in [s]."""
FIRST_MOVE = 0.3
"""Time of the first move, and over which a chirp sets in and ends [s]."""


class Course(NamedTuple):
    """How far and how fast the joints move."""

    rms: tuple[float, ...]
    """Root mean square of a multisine, by which moves and chirps go as well; zero where a joint is not moved [rad or m] (n)."""
    mean: tuple[float, ...]
    """Middle of the motion [rad or m] (n)."""
    band: tuple[float, float]
    """Lowest and highest frequency [Hz]."""
    duration: float = 0.5
    """Of a move [s]; 0.7 to 1.5 times that."""
    rest: float = 0.35
    """Between moves [s]; 0.3 to 1.6 times that."""


def minimum_jerk(t: Array, duration: float) -> Array:
    """Rise from zero to one over a duration, by a quintic of zero slope and curvature at both ends."""
    x = np.clip(t / duration, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x * x)


def multisine(
    rng: np.random.Generator, t: Array, rms: float, low: float, high: float, sines: int = 9
) -> Array:
    """Sines of random phases at frequencies about a geometric row, whose amplitudes fall with frequency^0.8 (n_samples).

    Args:
        rng: Source of phases and frequencies.
        t: Times [s] (n_samples).
        rms: Root mean square [rad or m].
        low, high: Ends of the row [Hz].
        sines: How many.
    """
    frequency = np.geomspace(low, high, sines) * rng.uniform(0.93, 1.07, sines)
    phase = rng.uniform(0, 2 * np.pi, sines)
    weight = frequency**-0.8
    angle = 2 * np.pi * frequency[:, None] * t + phase[:, None]
    total = np.sum(weight[:, None] * np.sin(angle), 0)
    return rms * np.sqrt(2 / np.sum(weight**2)) * total * minimum_jerk(t, ONSET)


def moves(rng: np.random.Generator, t: Array, amplitude: float, duration: float, rest: float) -> Array:
    """Moves from point to point within an amplitude [rad or m], with rests between (n_samples); a short move goes back beyond the middle.

    Args:
        rng: Source of points and times.
        t: Times [s] (n_samples).
        amplitude: Largest distance from the middle, but for short moves [rad or m].
        duration: Of a move [s].
        rest: Between moves [s].
    """
    out, start, at = np.zeros_like(t), FIRST_MOVE, 0.0
    while start < t[-1]:
        to = rng.uniform(-1, 1) * amplitude
        if abs(to - at) < 0.5 * amplitude:
            to = at - np.sign(at or 1) * amplitude * rng.uniform(0.8, 1.3)
        takes = duration * rng.uniform(0.7, 1.5)
        out += (to - at) * minimum_jerk(t - start, takes)
        at = to
        start += takes + rest * rng.uniform(0.3, 1.6)
    return out


def chirp(t: Array, amplitude: float, begin: float, end: float, low: float, high: float) -> Array:
    """A sine of an amplitude [rad or m] between two times [s], from a low to a high frequency [Hz] (n_samples)."""
    window = minimum_jerk(t - begin, FIRST_MOVE) * minimum_jerk(end - t, FIRST_MOVE)
    x = np.clip(t - begin, 0, end - begin)
    return amplitude * window * np.sin(2 * np.pi * (low * x + (high - low) * x * x / 2 / (end - begin)))


def reference(rng: np.random.Generator, plan: Plan, t: Array, course: Course) -> Array:
    """A motion of a kind at times [s] (n_samples), for all joints (n_samples, n)."""
    n = len(course.rms)
    out, (low, high) = np.zeros((len(t), n)), course.band
    for j, rms in enumerate(course.rms):
        if rms == 0:
            continue
        if plan == "multisine":
            out[:, j] = multisine(rng, t, rms, low, high)
        elif plan == "moves":
            out[:, j] = moves(rng, t, 1.7 * rms, course.duration, course.rest)
        elif plan == "turns":
            begin, end = t[-1] * j / n, t[-1] * (j + 1) / n
            alone = chirp(t, 1.35 * rms, begin, end, 0.5 * low + 0.1, high)
            out[:, j] = alone + 0.25 * multisine(rng, t, rms, low, 0.6 * high)
        else:
            jumps = moves(rng, t, 1.3 * rms, 1.3 * course.duration, 1.2 * course.rest)
            out[:, j] = 0.8 * jumps + 0.65 * multisine(rng, t, rms, 1.15 * low, 0.93 * high, 7)
    return out + np.array(course.mean)
