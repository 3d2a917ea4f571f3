"""A motion that a machine prescribes: smoothed, its direction where the machine dwells, and how well both are known."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import CubicHermiteSpline

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.case.single_axis import motion_channels
from bench.discrepancy.motion.kalman_smoother import resting, smoother_of
from bench.discrepancy.settings import DEFAULT, MotionSettings, RecordMemorySettings
from bench.discrepancy.simulation.stick_slip import Motion


class Prescribed(NamedTuple):
    """A motion that drives a component.

    Attributes:
        motion: As measured, smoothed.
        noisy: The same, each with one more draw of its noise.
    """

    motion: Motion
    noisy: tuple[Motion, ...]


def prescribed_motion(
    case: Case, record: CaseRecord, draws: int, *, settings: MotionSettings = DEFAULT.motion
) -> Prescribed:
    """The motion that drives a component, with draws of its noise.

    It is the measured displacement, and velocity where there is one, smoothed.

    Args:
        case: The case.
        record: Record of the motion.
        draws: Number of draws.
        settings: `MotionSettings` of the diagnosis.
    """
    orders, samples, noise = _samples(case, record)
    smooth = resting(samples, orders, noise, settings=settings)
    errors: list[Array] = [np.zeros((len(samples), 3))] * draws
    if smooth is None:
        smoother = smoother_of(samples, orders, noise, record.step, settings=settings)
        rng = np.random.default_rng(0)
        smooth = smoother.smooth(samples)
        errors = [smoother.smooth(noise * rng.standard_normal(samples.shape)) for _ in range(draws)]
    out = [smooth, *(smooth + error for error in errors)]
    for moved in out:
        moved[:, 1] = held(moved[:, 0], moved[:, 1], settings.reversal * noise[0])
    motion, *noisy = (Motion(*(moved[:, [i]] for i in range(3))) for moved in out)
    return Prescribed(motion, tuple(noisy))


def earlier(motion: Motion, time: float, step: float) -> Motion:
    """A motion (n, n_dof) as it was some time before its samples; at the ends of the record it is held.

    Args:
        motion: Sampled.
        time: How long before [s]; negative for later.
        step: Time between samples [s].
    """
    clock = step * np.arange(len(motion.position))
    then = np.clip(clock - time, clock[0], clock[-1])
    position = CubicHermiteSpline(clock, motion.position, motion.velocity)(then)
    # straight lines between its samples: a velocity that is held at zero where the machine dwells stays there
    rates = (
        np.column_stack([np.interp(then, clock, column) for column in samples.T])
        for samples in (motion.velocity, motion.acceleration)
    )
    return Motion(position, *rates)


def decided(prescribed: Prescribed, *, settings: MotionSettings = DEFAULT.motion) -> Array | None:
    """Samples (n,) of a prescribed motion whose direction the noise leaves in no doubt, as ones and zeros.

    Dry friction changes its sign at a reversal, and the moment of the reversal is known to the noise only: a few
    samples there would outweigh all the others. So would the first and last ones, where the smoother knows but one side.
    None where hardly anything would be left.

    Args:
        prescribed: The motion of one coordinate.
        settings: `MotionSettings` of the diagnosis.
    """
    motion, draws = prescribed
    error = np.sqrt(np.mean([(drawn.velocity[:, 0] - motion.velocity[:, 0]) ** 2 for drawn in draws], axis=0))
    usual = float(np.sqrt(np.mean(error**2)))
    sure = np.abs(motion.velocity[:, 0]) > settings.doubt * usual
    sure = ndimage.binary_erosion(sure, iterations=2, border_value=1)
    # however fast it turns: by which of two samples, the clocks of two channels do not tell
    back = np.flatnonzero(motion.velocity[1:, 0] * motion.velocity[:-1, 0] < 0.0)
    sure[back] = sure[back + 1] = False
    sure[_edges(error, settings=settings)] = False
    sure[: remembering(motion.position[:, 0], settings.memory)] = False
    return np.asarray(sure, dtype=np.float64) if sure.mean() > 1.0 - settings.most_in_doubt else None


def _edges(error: Array, *, settings: MotionSettings) -> NDArray[np.bool_]:
    """Samples (n,) at both ends up to where the error of a motion has become the usual one."""
    local = np.sqrt(
        ndimage.convolve1d(error**2, np.full(settings.edge_width, 1.0 / settings.edge_width), mode="nearest")
    )
    usual = np.flatnonzero(local <= settings.edge_error * float(np.median(local)))
    out = np.ones(len(error), dtype=bool)
    out[usual[0] : usual[-1] + 1] = False
    return out


def remembering(position: Array, settings: RecordMemorySettings = DEFAULT.motion.memory) -> int:
    """Samples at the start of a prescribed motion during which a component remembers what was before.

    Args:
        position: (n,).
        settings: How long that is.
    """
    direction = np.zeros(len(position))
    _directions(np.ascontiguousarray(position), settings.width * float(np.ptp(position)), direction)
    turns = np.flatnonzero(direction[1:] * direction[:-1] < 0.0) + 1
    if len(turns) < settings.reversals:
        return 0
    until = int(turns[settings.reversals - 1])
    return until if until <= settings.longest * len(position) else 0


def _samples(case: Case, record: CaseRecord) -> tuple[tuple[int, ...], Array, Array]:
    """Orders, samples (n, n_channels) and noise of the channels that tell a prescribed motion."""
    told = {order: name for order, name in motion_channels(case).items() if name in record.values}
    have = list(told.values())
    noise = [case.channel(name).noise_std or noise_floor(record.values[name]) for name in have]
    samples = np.column_stack([record.values[name] for name in have])
    return tuple(told), samples, np.array(noise)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _directions(position, width, out):
    """Direction of motion (+1 or -1), turned back to the extremum once the motion has come back from it by `width`."""
    direction = 0.0
    turn = 0
    low = high = 0
    for k in range(position.shape[0]):
        if position[k] >= position[high]:
            high = k
        if position[k] <= position[low]:
            low = k
        if direction <= 0.0 and position[k] > position[low] + width:
            turn = low + 1 if direction < 0.0 else 0
            direction, high = 1.0, k
        elif direction >= 0.0 and position[k] < position[high] - width:
            turn = high + 1 if direction > 0.0 else 0
            direction, low = -1.0, k
        else:
            turn = k
        for i in range(turn, k + 1):
            out[i] = direction


def held(position: Array, velocity: Array, width: float) -> Array:
    """Velocity (n,) without the reversals that only noise makes.

    While a machine dwells, the smoothed velocity changes sign at random, and a friction law would make a rattle of it; a
    real one holds the force of the last slip. Where the velocity is against the direction of the motion, reversals smaller than
    `width` not counted, it is set to a trifle in that direction.

    Args:
        position: (n,).
        velocity: (n,).
        width: Way back that makes a reversal.
    """
    direction = np.zeros(len(position))
    _directions(np.ascontiguousarray(position), width, direction)
    trifle = 1e-9 * float(np.max(np.abs(velocity), initial=0.0))
    return np.where(velocity * direction < 0.0, trifle * direction, velocity)
