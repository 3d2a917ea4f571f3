"""The torque that a joint's equation misses along its measured motion: the equation error, compiled.

Every term of the equation of `bench.discrepancy.multibody.joint_run` is taken where the joint was measured, nothing is run. Bristles and
filters of the actuator, which have states of their own, follow the measured velocity and the recorded input from the first sample on. At
rest dry friction holds whatever it can, and only what exceeds it is missing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.multibody.joint_forces import (
    SLOTS,
    actuator_force,
    bristle_force_of,
    bristles_slid,
    cogging_force,
    delayed_input,
    entries,
    friction_limit,
    pair_friction,
    stop_force,
    surface_force,
)


class JointTorqueLimits(NamedTuple):
    """Numbers of `bench.discrepancy.multibody.joint_torque`."""

    least: float = 1e-3
    """Part of a drive's torque that friction leaves at least: a gear that leaves none locks itself, and no motion contradicts it."""


JOINT_TORQUE_LIMITS = JointTorqueLimits()


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _missing(p, mass, bias, load, beside, touch, u, step, motion, still, least, out):
    """Fill `out` (n_steps,), see `missing_torque`."""
    p = entries(p, SLOTS)
    lagged, target, z = math.nan, u[0], 0.0
    keep = math.exp(-step / p[27]) if p[27] > 0.0 else 0.0
    half = math.exp(-0.5 * step / p[39]) if p[39] > 0.0 else 0.0
    for k in range(out.shape[0]):
        q, v, a = motion[k, 0], motion[k, 1], motion[k, 2]
        command = delayed_input(u, k, p[28] / step)
        target = command + (target - command) * half
        force, _, lagged = actuator_force(p, target, q, v, lagged, keep)
        target = command + (target - command) * half
        bristles, implicit = bristle_force_of(p, v, z)
        own = force + bristles - implicit * v + cogging_force(p, q)
        rest = (
            p[15] - bias[k] - p[7] * (q - p[8]) + stop_force(p, q, v) + surface_force(p, touch, k, 0.0, v)[0]
        )
        rest -= pair_friction(p, v + p[42] * beside[k])
        free = own + rest - (p[6] + p[14] * abs(v)) * v - (mass[k] + p[9]) * a
        limit = friction_limit(p, v, load[k], force, bias[k])
        held = abs(free) if abs(v) < still else limit
        error = free - math.copysign(min(limit, held), free if abs(v) < still else v)
        # of what is added to the drive, friction that carries it takes a part, or adds as much where it is driven back
        if p[38] != 0.0 or p[45] != 0.0:
            more = p[38] * math.copysign(1.0, p[38] * force + p[43] * bias[k]) + 2.0 * p[45] * force
            error /= max(1.0 - more * math.copysign(1.0, v), least)
        out[k] = error
        z = bristles_slid(p, z, v, step)


def missing_torque(
    p: NDArray[np.float64],
    arrays: tuple[NDArray[np.float64], ...],
    u: NDArray[np.float64],
    step: float,
    motion: NDArray[np.float64],
    still: float,
    beside: NDArray[np.float64] | None = None,
    touch: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Torque (n_steps,) by which the drive exceeds what the motion takes.

    Args:
        p: (SLOTS,) parameters of a joint without an elastic train, see `joint_forces.Slot`.
        arrays: Inertia, bias (at the measured motion) and load at the middle of every step, each (n_steps,).
        u: (n_steps,) input.
        step: Length of a step [s].
        motion: (n_steps, 3) measured position, velocity, acceleration there.
        still: Speed below which a direction is not known.
        beside: Velocity (n_steps,) of the neighbour with which the joint shares a drive; at rest where None.
        touch: End of the tree (3, n_steps) that touches a surface, where one does.
    """
    mass, bias, load = arrays
    beside = np.zeros(len(motion)) if beside is None else beside
    touch = np.zeros((3, 0)) if touch is None else touch
    out = np.empty(len(motion))
    _missing(
        p, mass, bias, load, beside, touch, u, step, np.ascontiguousarray(motion), still, JOINT_TORQUE_LIMITS.least, out
    )  # fmt: skip
    return out
