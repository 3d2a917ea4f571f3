"""Reference motions (n_samples, n_joints) of a robot.

References:
    T. Flash and N. Hogan, *The coordination of arm movements*, J. Neurosci. 5 (1985) 1688-1703 (the minimum-jerk profile);
    R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain Approach*, 2012, ch. 5 (multisines).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from bench.arrays import Array
from second_robots_cases.robots import Robot

Plan = Literal["multisine", "moves", "sines"]
"""A kind of motion."""
LOWEST_FREQUENCY = 0.12
"""Lowest frequency of a multisine [Hz]."""
COMPONENTS = 6
"""Sines of a multisine."""


def reference(
    rng: np.random.Generator, plan: Plan, robot: Robot, seconds: float, highest_frequency: float
) -> Array:
    """A motion of a robot, of a kind and a duration; the highest frequency [Hz] is that of a multisine."""
    time = np.arange(round(seconds * robot.rate)) / robot.rate
    joints = zip(robot.centre, robot.amplitude, strict=True)
    if plan == "multisine":
        columns = [multisine(rng, time, centre, amplitude, highest_frequency) for centre, amplitude in joints]
    elif plan == "moves":
        columns = [moves(rng, time, seconds, centre, amplitude) for centre, amplitude in joints]
    else:
        columns = [swelling_sine(rng, time, seconds, centre, amplitude) for centre, amplitude in joints]
    return np.column_stack(columns)


def smooth_start(time: Array, seconds: float) -> Array:
    """Factor that rises from zero to one over the first seconds, by a cubic of zero slope at both ends."""
    s = np.clip(time / seconds, 0, 1)
    return s**2 * (3 - 2 * s)


def multisine(
    rng: np.random.Generator, time: Array, centre: float, amplitude: float, highest_frequency: float
) -> Array:
    """Sines of random phases and log-uniform frequencies, with amplitudes that fall with the root of the frequency."""
    ends = np.log(LOWEST_FREQUENCY), np.log(highest_frequency)
    frequency = np.exp(rng.uniform(*ends, COMPONENTS))
    phase = rng.uniform(0, 2 * np.pi, COMPONENTS)
    x = (np.sin(2 * np.pi * np.outer(time, frequency) + phase) / np.sqrt(frequency)).sum(1)
    return centre + amplitude * (x / np.abs(x).max()) * smooth_start(time, 1.5)


def moves(rng: np.random.Generator, time: Array, seconds: float, centre: float, amplitude: float) -> Array:
    """Minimum-jerk moves from point to point with dwells between them, at times of the joint's own."""
    x = np.full(len(time), float(centre))
    start, here = 0.3 + rng.uniform(0, 0.3), centre
    while start < seconds - 0.2:
        duration = rng.uniform(0.35, 0.9)
        there = centre + amplitude * rng.uniform(-1, 1)
        if abs(there - here) < 0.4 * amplitude:
            side = np.sign(centre - here or 1)
            there = centre + amplitude * side * rng.uniform(0.4, 1)
        s = np.clip((time - start) / duration, 0, 1)
        x = x + (there - here) * s**3 * (10 - 15 * s + 6 * s**2)
        here = there
        start += duration + rng.uniform(0.1, 0.5)
    return x


def swelling_sine(
    rng: np.random.Generator, time: Array, seconds: float, centre: float, amplitude: float
) -> Array:
    """One sine of a frequency of the joint's own, whose amplitude swells and shrinks twice."""
    frequency = rng.uniform(0.3, 0.9)
    swelling = 0.65 + 0.35 * np.cos(2 * np.pi * time / seconds * 2)
    return centre + amplitude * smooth_start(time, 2) * np.sin(2 * np.pi * frequency * time) * swelling
