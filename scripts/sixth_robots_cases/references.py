"""References that robots follow: multisines, moves from point to point and chirps, which begin at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bench.arrays import Array

Motion = Callable[[Array], Array]
"""Times [s] (n_samples) to positions [rad or m] (n_samples, n)."""
FADE = 0.6
"""Time over which a signal swells from rest [s]."""


@dataclass(frozen=True)
class Signal:
    """A reference of every joint.

    Attributes:
        kind: Shape.
        seconds: Duration [s].
        size: Largest excursion of every joint about its posture [rad or m] (n).
        band: Frequencies of a multisine or chirp [Hz].
        pause: Move and rest of a move from point to point [s].
    """

    kind: Literal["multisine", "points", "chirp"]
    seconds: float
    size: tuple[float, ...]
    band: tuple[float, float] = (0.1, 3.0)
    pause: tuple[float, float] = (0.8, 0.5)


def reference(signal: Signal, posture: tuple[float, ...], rng: np.random.Generator) -> Motion:
    """The reference about a posture [rad or m], as a function of time."""
    make = {"multisine": _multisine, "points": _points, "chirp": _chirp}[signal.kind]
    shapes = [make(signal, index, rng) for index in range(len(posture))]

    def motion(time: Array) -> Array:
        return np.stack(
            [m + a * f(time) for m, a, f in zip(posture, signal.size, shapes, strict=True)], axis=1
        )

    return motion


def _swell(time: Array) -> Array:
    s = np.clip(time / FADE, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def _multisine(signal: Signal, index: int, rng: np.random.Generator) -> Motion:
    low, high = signal.band
    base = 1.0 / signal.seconds
    lines = np.arange(max(1, round(low / base)), round(high / base) + 1)
    lines = lines[index % 2 :: 2] if len(lines) > 12 else lines
    frequency = np.asarray(lines * base, float)
    weight = 1.0 / (1.0 + (frequency / (low + 0.25 * (high - low))) ** 1.5)
    phase = rng.uniform(0.0, 2.0 * np.pi, len(lines))

    def raw(time: Array) -> Array:
        return np.cos(2.0 * np.pi * np.outer(time, frequency) + phase) @ weight

    peak = np.abs(raw(np.linspace(0.0, signal.seconds, 4000))).max()
    return lambda time: _swell(time) * raw(time) / peak


def _points(signal: Signal, index: int, rng: np.random.Generator) -> Motion:
    move, rest = signal.pause
    count = int(signal.seconds / (move + rest)) + 2
    places = np.concatenate([[0.0], rng.uniform(0.35, 1.0, count) * rng.choice([-1.0, 1.0], count)])
    begin = 0.3 + 0.11 * index + np.arange(count) * (move + rest)

    def shape(time: Array) -> Array:
        out = np.full_like(time, places[0])
        for start, a, b in zip(begin, places[:-1], places[1:], strict=True):
            s = np.clip((time - start) / move, 0.0, 1.0)
            out = out + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        return out

    return shape


def _chirp(signal: Signal, index: int, rng: np.random.Generator) -> Motion:
    low, high = signal.band[0] * (1.0 + 0.13 * index), signal.band[1] * (1.0 - 0.09 * index)
    phase = rng.uniform(0.0, 2.0 * np.pi)

    def shape(time: Array) -> Array:
        rate = (high - low) / signal.seconds
        turn = 2.0 * np.pi * (low * time + 0.5 * rate * time**2)
        return _swell(time) * np.sin(turn + phase) / (1.0 + (low + rate * time) / (0.3 * high))

    return shape
