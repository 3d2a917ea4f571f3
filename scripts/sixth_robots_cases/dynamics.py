"""Equations of motion of a chain of rigid bodies.

Every body hangs on the one before it by a hinge or a slide whose axis goes through the origin of the body. Equations stand in the
coordinates of the room.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bench.arrays import Array
from sixth_robots_cases.machine import Machine


@njit(cache=True)
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _turn(axis: Array, angle: float, out: Array) -> None:
    """Matrix of a rotation [rad] about a unit axis."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    d = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + x * x * d, x * y * d - z * s, x * z * d + y * s
    out[1, 0], out[1, 1], out[1, 2] = y * x * d + z * s, c + y * y * d, y * z * d - x * s
    out[2, 0], out[2, 1], out[2, 2] = z * x * d - y * s, z * y * d + x * s, c + z * z * d


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _times(a: Array, b: Array, out: Array) -> None:
    for i in range(3):
        out[i] = a[i, 0] * b[0] + a[i, 1] * b[1] + a[i, 2] * b[2]


@njit(cache=True)
def _shift(omega: Array, alpha: Array, arm: Array, t: Array, out: Array) -> None:
    """Add the acceleration of a point that an arm carries about another."""
    _cross(alpha, arm, t)
    for a in range(3):
        out[a] += t[a]
    _cross(omega, arm, t)
    x, y, z = t[0], t[1], t[2]
    out[0] += omega[1] * z - omega[2] * y
    out[1] += omega[2] * x - omega[0] * z
    out[2] += omega[0] * y - omega[1] * x


@njit(cache=True)
def _body(
    machine: Machine,
    i: int,
    frame: Array,
    motion: Array,
    axes: Array,
    origins: Array,
    matrix: Array,
    bias: Array,
    work: Array,
) -> None:
    """Add what one body contributes to the mass matrix and to the bias.

    Args:
        machine: What moves.
        i: The body.
        frame: Its axes in the room, as columns (3, 3).
        motion: Its angular velocity [rad/s] and acceleration [rad/s^2], and the acceleration of its origin [m/s^2] (3, 3).
        axes, origins: Axes of the joints, and their origins [m], in the room (n, 3).
        matrix: Mass matrix, of which the lower half is added to (n, n).
        bias: Added to (n).
        work: Room for what lies between (32, 3).
    """
    omega, alpha = motion[0], motion[1]
    spread, arm, force, moment, t1, own = work[0:3], work[3], work[4], work[5], work[6], work[7]
    for a in range(3):
        for b in range(3):
            spread[a, b] = 0.0
            for c in range(3):
                spread[a, b] += frame[a, c] * machine.inertia[i, c] * frame[b, c]
    _times(frame, machine.com[i], arm)
    force[:] = motion[2]
    _shift(omega, alpha, arm, t1, force)
    _times(spread, omega, own)
    if i == len(machine.mass) - 1:
        _times(frame, machine.spin, t1)
        for a in range(3):
            own[a] += t1[a]
    _cross(omega, own, t1)
    _times(spread, alpha, moment)
    for a in range(3):
        moment[a] += t1[a]
        force[a] *= machine.mass[i]
    moving, turning = work[8 : 9 + i], work[20 : 21 + i]
    for j in range(i + 1):
        if machine.slide[j]:
            moving[j] = axes[j]
            turning[j] = 0.0
        else:
            turning[j] = axes[j]
            for a in range(3):
                t1[a] = arm[a] + origins[i, a] - origins[j, a]
            _cross(axes[j], t1, moving[j])
        bias[j] += _dot(moving[j], force) + _dot(turning[j], moment)
        _times(spread, turning[j], own)
        for k in range(j + 1):
            matrix[j, k] += machine.mass[i] * _dot(moving[j], moving[k]) + _dot(own, turning[k])


@njit(cache=True)
def mass_matrix_and_bias(machine: Machine, q: Array, dq: Array) -> tuple[Array, Array]:
    """Mass matrix and bias.

    Args:
        machine: What moves.
        q, dq: Positions [rad or m] and velocities [rad/s or m/s] (n).

    Returns:
        The mass matrix [kg m^2 or kg] (n, n), without armature, and the bias [N m or N] (n): gravity, Coriolis and centrifugal forces.
    """
    n = len(q)
    matrix, bias, work = np.zeros((n, n)), np.zeros(n), np.empty((32, 3))
    axes, origins = np.empty((n, 3)), np.empty((n, 3))
    frame, turn, old = np.eye(3), np.empty((3, 3)), np.empty((3, 3))
    motion = np.zeros((3, 3))
    arm, t = work[30], work[31]
    motion[2] = -machine.gravity
    for i in range(n):
        _times(frame, machine.axis[i], axes[i])
        _times(frame, machine.pos[i], arm)
        if machine.slide[i]:
            for a in range(3):
                arm[a] += axes[i, a] * q[i]
        for a in range(3):
            origins[i, a] = arm[a] + (origins[i - 1, a] if i else 0.0)
        _shift(motion[0], motion[1], arm, t, motion[2])
        _cross(motion[0], axes[i], t)
        for a in range(3):
            if machine.slide[i]:
                motion[2, a] += 2.0 * dq[i] * t[a]
            else:
                motion[1, a] += dq[i] * t[a]
                motion[0, a] += dq[i] * axes[i, a]
        if not machine.slide[i]:
            _turn(machine.axis[i], q[i], turn)
            old[:] = frame
            for a in range(3):
                for b in range(3):
                    frame[a, b] = old[a, 0] * turn[0, b] + old[a, 1] * turn[1, b] + old[a, 2] * turn[2, b]
        _body(machine, i, frame, motion, axes, origins, matrix, bias, work)
    for j in range(n):
        for k in range(j):
            matrix[k, j] = matrix[j, k]
    return matrix, bias


@njit(cache=True)
def rigid_torques(machine: Machine, q: Array, dq: Array, ddq: Array) -> Array:
    """Torques that a motion takes with rigid trains, without dry friction.

    Args:
        machine: What moves.
        q, dq, ddq: Positions, velocities and accelerations (n_samples, n).

    Returns:
        Torques [N m or N] (n_samples, n).
    """
    out = np.zeros_like(q)
    for k in range(len(q)):
        matrix, bias = mass_matrix_and_bias(machine, q[k], dq[k])
        out[k] = matrix @ ddq[k] + machine.armature * ddq[k] + bias + machine.damping * dq[k]
    return out
