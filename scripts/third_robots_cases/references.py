"""Reference motions of a robot, as functions of the time.

References:
    R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain Approach*, 2012, ch. 5 (multisines);
    T. Flash and N. Hogan, *The coordination of arm movements*, J. Neurosci. 5 (1985) 1688-1703 (the minimum-jerk profile).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from bench.arrays import Array

Plan = Literal["multisine", "chirp", "moves"]
"""A kind of motion."""
Motion = Callable[[Array], Array]
"""Positions (n_samples, n) at times (n_samples) [s]."""
COMPONENTS = 6
"""Sines of a multisine."""


class Course(NamedTuple):
    """How far, how fast and how long a robot moves in a record."""

    centre: Array
    """Middle of the motion [rad or m] (n)."""
    amplitude: Array
    """Largest distance from it [rad or m] (n)."""
    lowest: float
    """Lowest frequency [Hz]."""
    highest: float
    """Highest frequency [Hz]."""
    spacing: float
    """Time from one move to the next [s]."""
    speed: float
    """Factor that `highest` holds already; moves take less time by its root."""
    seconds: float
    """Duration [s]."""


def minimum_jerk(x: Array) -> Array:
    """Rise from zero to one while its argument does, by a quintic of zero slope and curvature at both ends."""
    y = np.clip(x, 0, 1)
    return y**3 * (10 - 15 * y + 6 * y * y)


def multisine(rng: np.random.Generator, course: Course) -> Motion:
    """Sines of random phases and uniform frequencies for every joint, which set in over 0.8 s; amplitudes fall with frequency^0.7."""
    shape = len(course.centre), COMPONENTS
    frequency = np.sort(rng.uniform(course.lowest, course.highest, shape), 1)
    phase = rng.uniform(0, 2 * np.pi, shape)
    weight = (course.lowest / frequency) ** 0.7
    weight = weight / np.sqrt((weight**2).sum(1, keepdims=True) / 2) * 0.55

    def sines(i: int, time: Array) -> Array:
        angle = 2 * np.pi * frequency[i] * time[:, None] + phase[i]
        return (weight[i] * np.sin(angle)).sum(1)

    over = np.linspace(0, course.seconds, 4000)
    for i, row in enumerate(weight):
        weight[i] = row / max(1.0, 0.9 * np.abs(sines(i, over)).max())

    def motion(time: Array) -> Array:
        together = np.stack([sines(i, time) for i in range(len(weight))], 1)
        return course.centre + course.amplitude * (minimum_jerk(time / 0.8)[:, None] * together)

    return motion


def chirp(rng: np.random.Generator, course: Course) -> Motion:
    """A sine of rising frequency at one joint after the other, while the others rest."""
    each = (course.seconds - 0.6) / len(course.centre)
    first, last = course.lowest * 1.5, course.highest * 1.2

    def motion(time: Array) -> Array:
        out = np.tile(course.centre, (len(time), 1))
        for i, amplitude in enumerate(course.amplitude):
            since = time - 0.3 - i * each
            on = (since > 0) & (since < each)
            x = since[on] / each
            angle = 2 * np.pi * (first * x * each + 0.5 * (last - first) * x * x * each)
            window = minimum_jerk(x / 0.15) * minimum_jerk((1 - x) / 0.15)
            out[on, i] += amplitude * 0.75 * window * np.sin(angle) / (1 + 0.6 * x)
        return out

    return motion


def moves(rng: np.random.Generator, course: Course) -> Motion:
    """Minimum-jerk moves of all joints from point to point, each joint with a duration of its own, and rests between."""
    n, count = len(course.centre), int(course.seconds / course.spacing)
    points = course.centre + course.amplitude * rng.uniform(-1, 1, (count + 1, n))
    points[0] = course.centre
    spacing = course.seconds / count
    duration = spacing * rng.uniform(0.62, 0.9, (count, n)) / course.speed**0.5
    # a move that is shorter than half the amplitude becomes one of 0.8 of it, back over the middle
    for k in range(1, count + 1):
        short = np.abs(points[k] - points[k - 1]) < 0.5 * course.amplitude
        longer = points[k - 1] + np.copysign(0.8 * course.amplitude, course.centre - points[k - 1])
        points[k] = np.where(short, longer, points[k])

    def motion(time: Array) -> Array:
        out = np.tile(points[0], (len(time), 1))
        for k in range(count):
            part = minimum_jerk((time[:, None] - 0.2 - k * spacing) / duration[k])
            out += (points[k + 1] - points[k]) * part
        return out

    return motion


PLANS: dict[Plan, Callable[[np.random.Generator, Course], Motion]] = {
    "multisine": multisine,
    "chirp": chirp,
    "moves": moves,
}
"""What makes the motion of each kind; a chirp takes no random numbers."""
