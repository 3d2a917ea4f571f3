"""Equations of motion of a serial chain of hinges and slides, by the Jacobians of its bodies in the room.

    M_kl = sum_i m_i JV_ik . JV_il + JW_ik . I_i JW_il
    h_k  = sum_i JV_ik . m_i a_i + JW_ik . (I_i alpha_i + omega_i x I_i omega_i)

over the bodies i, with the partial velocities JV of their centres of mass and JW of their rotation, and with the accelerations a and alpha
that they have where no joint accelerates and the base accelerates upwards with gravity.

References:
    T. R. Kane and D. A. Levinson, *Dynamics: Theory and Applications*, 1985, ch. 6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array

GRAVITY = 9.81
"""Acceleration of gravity, downwards [m/s^2]."""


class Chain(NamedTuple):
    """Links and joints from the base to the tip."""

    origin: Array
    """Position of each joint in the frame of the body before [m] (n, 3)."""
    axis: Array
    """Unit axis of each joint there (n, 3)."""
    slide: NDArray[np.bool_]
    """Whether a joint is a slide (n)."""
    mass: Array
    """[kg] (n)."""
    com: Array
    """Centre of mass in the frame of its body [m] (n, 3)."""
    inertia: Array
    """Principal moments about it, along the axes of the body [kg m^2] (n, 3)."""


@njit(cache=True)
def cross(a: Array, b: Array) -> Array:
    """Vector product (3)."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@njit(cache=True)
def rotation(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) about a unit axis (3) by an angle [rad] (Rodrigues)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            turn[i, j] = axis[i] * axis[j] * (1 - cosine)
        turn[i, i] += cosine
    turn[0, 1] -= axis[2] * sine
    turn[1, 0] += axis[2] * sine
    turn[0, 2] += axis[1] * sine
    turn[2, 0] -= axis[1] * sine
    turn[1, 2] -= axis[0] * sine
    turn[2, 1] += axis[0] * sine
    return turn


@njit(cache=True)
def partial_velocities(
    slide: NDArray[np.bool_], axes: Array, joints: Array, centre: Array
) -> tuple[Array, Array]:
    """Partial velocities of a centre of mass and of the rotation of its body, see `add_body`; each (n_joints, 3)."""
    linear, angular = np.zeros(axes.shape), np.zeros(axes.shape)
    for k in range(len(slide)):
        if slide[k]:
            linear[k] = axes[k]
        else:
            linear[k] = cross(axes[k], centre - joints[k])
            angular[k] = axes[k]
    return linear, angular


@njit(cache=True)
def add_body(
    matrix: Array, bias: Array, slide: NDArray[np.bool_], axes: Array, joints: Array, centre: Array,
    mass: float, inertia: Array, force: Array, moment: Array,
) -> None:  # fmt: skip
    """Add the last body of a chain to its mass matrix and bias.

    Args:
        matrix: Mass matrix, of which the rows and columns of the joints up to the body are changed (n, n).
        bias: Bias likewise (n).
        slide: Whether each joint up to the body is a slide (n_joints).
        axes: Their axes in the room (n_joints, 3).
        joints: Their positions in the room [m] (n_joints, 3).
        centre: Centre of mass of the body in the room [m] (3).
        mass: Mass of the body [kg].
        inertia: Its inertia about the centre of mass, in the room [kg m^2] (3, 3).
        force, moment: Its inertial force [N] (3) and moment [N m] (3) where no joint accelerates.
    """
    count = len(slide)
    linear, angular = partial_velocities(slide, axes, joints, centre)
    for k in range(count):
        bias[k] += np.dot(linear[k], force) + np.dot(angular[k], moment)
        turned = inertia @ angular[k]
        for other in range(k + 1):
            term = mass * np.dot(linear[k], linear[other]) + np.dot(angular[other], turned)
            matrix[k, other] += term
            if other != k:
                matrix[other, k] += term


@njit(cache=True)
def mass_matrix_and_bias(q: Array, v: Array, chain: Chain) -> tuple[Array, Array]:
    """Mass matrix of the links (n, n) and their Coriolis, centrifugal and gravitational forces (n), at positions and velocities (n)."""
    n = len(q)
    matrix, bias = np.zeros((n, n)), np.zeros(n)
    frame, at = np.eye(3), np.zeros(3)
    spin, spin_rate = np.zeros(3), np.zeros(3)
    acceleration = np.array([0.0, 0.0, GRAVITY])
    axes, joints = np.zeros((n, 3)), np.zeros((n, 3))
    for i in range(n):
        axis = frame @ chain.axis[i]
        lever = frame @ chain.origin[i]
        if chain.slide[i]:
            lever = lever + axis * q[i]
        acceleration = acceleration + cross(spin_rate, lever) + cross(spin, cross(spin, lever))
        at = at + lever
        if chain.slide[i]:
            acceleration = acceleration + 2 * v[i] * cross(spin, axis)
        else:
            spin_rate = spin_rate + v[i] * cross(spin, axis)
            spin = spin + v[i] * axis
            frame = frame @ rotation(chain.axis[i], q[i])
        axes[i], joints[i] = axis, at
        to_centre = frame @ chain.com[i]
        of_centre = acceleration + cross(spin_rate, to_centre) + cross(spin, cross(spin, to_centre))
        inertia = frame @ np.diag(chain.inertia[i]) @ frame.T
        moment = inertia @ spin_rate + cross(spin, inertia @ spin)
        add_body(
            matrix, bias, chain.slide[: i + 1], axes[: i + 1], joints[: i + 1], at + to_centre,
            chain.mass[i], inertia, chain.mass[i] * of_centre, moment,
        )  # fmt: skip
    return matrix, bias
