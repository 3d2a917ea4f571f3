"""The acceleration behind a measured position or velocity, as a load that keeps to it."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from bench.arrays import Array
from bench.discrepancy.motion.kalman_smoother import resting, smoother_of
from bench.discrepancy.settings import DEFAULT, MotionSettings


class TrackedAcceleration(NamedTuple):
    """An acceleration made of other channels.

    Attributes:
        samples: (n,) acceleration; straight between its samples, its double integral is the motion measured.
        noise: One-sigma white noise that counts as much as its own, which is coloured, in the band of the motion.
        start: Position at the start, from which the motion is counted where it begins at rest.
    """

    samples: Array
    noise: float
    start: float


def tracked_acceleration(
    samples: Array,
    orders: tuple[int, ...],
    noise: Array,
    step: float,
    *,
    at_rest: bool = True,
    settings: MotionSettings = DEFAULT.motion,
) -> TrackedAcceleration:
    """The acceleration that moves a coordinate along what was measured of it.

    The smoothed acceleration alone would drift from the position that it was made of, by the error of its integral; a loop
    of position and velocity holds it there, slower than the motion.

    Args:
        samples: (n, n_channels) measured.
        orders: Derivative that each channel measures: 0, 1 or 2.
        noise: (n_channels,) white noise.
        step: Time between samples [s].
        at_rest: Whether the motion begins at rest.
        settings: `MotionSettings` of the diagnosis.
    """
    still = resting(samples, orders, noise, settings=settings)
    if still is not None:
        return TrackedAcceleration(np.zeros(len(samples)), 0.0, float(still[0, 0]))
    smoother = smoother_of(samples, orders, noise, step, settings=settings)
    rate = 2.0 * np.pi * settings.tracking / (len(samples) * step)

    def tracked(motion: Array) -> Array:
        from_rest = motion - np.array([motion[0, 0], 0.0, 0.0]) if at_rest else motion
        start = (0.0, 0.0) if at_rest else (float(motion[0, 0]), float(motion[0, 1]))
        return _tracked(np.ascontiguousarray(from_rest), step, rate, *start)

    motion = smoother.smooth(samples)
    drawn = noise * np.random.default_rng(0).standard_normal(samples.shape)
    out, error = tracked(motion), tracked(smoother.smooth(drawn))
    power, of_noise = (np.abs(np.fft.rfft(x)) ** 2 for x in (out, error))
    level = float(np.sqrt(np.sum(power * of_noise) / np.sum(power) / len(out)))
    return TrackedAcceleration(out, level, float(motion[0, 0]))


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _tracked(motion, step, rate, position, velocity):
    """Acceleration (n,) whose integrals from a start follow a motion (n, 3): its own, and a critically damped pull towards it."""
    out = np.empty(motion.shape[0])
    for k in range(motion.shape[0]):
        wanted = motion[k, 2]
        ahead, faster = position, velocity
        if k > 0:
            ahead += step * velocity + step * step * (2.0 * out[k - 1] + wanted) / 6.0
            faster += 0.5 * step * (out[k - 1] + wanted)
        out[k] = wanted + 2.0 * rate * (motion[k, 1] - faster) + rate * rate * (motion[k, 0] - ahead)
        if k > 0:
            position += step * velocity + step * step * (2.0 * out[k - 1] + out[k]) / 6.0
            velocity += 0.5 * step * (out[k - 1] + out[k])
    return out
