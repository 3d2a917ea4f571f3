"""Inverse dynamics of a serial chain of hinges and slides, recursive and in the frames of the bodies.

One outward pass gives the motion of every body and the force and moment that it takes, one inward pass the force or torque at every
joint. The mass matrix is that of unit accelerations at rest without gravity.

References:
    J. Y. S. Luh, M. W. Walker and R. P. C. Paul, *On-line computational scheme for mechanical manipulators*, J. Dyn. Syst. Meas.
    Control 102 (1980) 69-76 (the recursion);
    M. W. Walker and D. E. Orin, *Efficient dynamic computer simulation of robotic mechanisms*, J. Dyn. Syst. Meas. Control 104 (1982)
    205-211 (the mass matrix out of it).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array

GRAVITY = 9.81
"""Acceleration of gravity, against z [m/s^2]."""


class Chain(NamedTuple):
    """Bodies of a serial chain; the frame of a body has its origin at the joint that carries it."""

    slide: NDArray[np.bool_]
    """Whether the joint of a body is a slide; otherwise it is a hinge (n)."""
    axis: Array
    """Unit axis of the joint in the frame of the body before (n, 3)."""
    origin: Array
    """Position of the joint in the frame of the body before [m] (n, 3)."""
    com: Array
    """Centre of mass in the frame of the body [m] (n, 3)."""
    mass: Array
    """Mass [kg] (n)."""
    inertia: Array
    """Inertia about the centre of mass in the frame of the body [kg m^2] (n, 3, 3)."""


class Placed(NamedTuple):
    """How each body lies in the frame of the body before."""

    rotation: Array
    """Rotation matrix (n, 3, 3)."""
    origin: Array
    """Origin of its frame [m] (n, 3)."""


class Moved(NamedTuple):
    """Motion of the bodies and what it takes, in their own frames; row 0 is the base, row i + 1 is body i."""

    omega: Array
    """Angular velocity [rad/s] (n + 1, 3)."""
    alpha: Array
    """Angular acceleration [rad/s^2] (n + 1, 3)."""
    acceleration: Array
    """Acceleration of the origin, gravity included [m/s^2] (n + 1, 3)."""
    force: Array
    """Force through the joint [N] (n + 1, 3)."""
    moment: Array
    """Moment through the joint, about its origin [N m] (n + 1, 3)."""
    scratch: Array
    """Room for intermediate vectors (3, 3)."""


@njit(cache=True)
def room_to_place(n: int) -> Placed:
    """Room for the poses of n bodies."""
    return Placed(np.zeros((n, 3, 3)), np.zeros((n, 3)))


@njit(cache=True)
def room_to_move(n: int) -> Moved:
    """Room for the motion of n bodies."""
    return Moved(
        np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)),
        np.zeros((3, 3)),
    )  # fmt: skip


@njit(cache=True)
def cross(a: Array, b: Array, out: Array) -> None:
    """Cross product of two vectors (3), into `out` (3), which is neither of them."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def times(matrix: Array, a: Array, out: Array) -> None:
    """Product of a matrix (3, 3) with a vector (3), into `out` (3)."""
    for k in range(3):
        out[k] = matrix[k, 0] * a[0] + matrix[k, 1] * a[1] + matrix[k, 2] * a[2]


@njit(cache=True)
def times_transposed(matrix: Array, a: Array, out: Array) -> None:
    """Product of a transposed matrix (3, 3) with a vector (3), into `out` (3)."""
    for k in range(3):
        out[k] = matrix[0, k] * a[0] + matrix[1, k] * a[1] + matrix[2, k] * a[2]


@njit(cache=True)
def add_centripetal(omega: Array, alpha: Array, r: Array, scratch: Array, out: Array) -> None:
    """Add alpha x r + omega x (omega x r) to an acceleration (3), in place."""
    cross(omega, r, scratch[0])
    cross(omega, scratch[0], scratch[1])
    cross(alpha, r, scratch[0])
    for k in range(3):
        out[k] = out[k] + scratch[0, k] + scratch[1, k]


@njit(cache=True)
def rotate(axis: Array, angle: float, out: Array) -> None:
    """Rotation matrix (3, 3) about a unit axis (3), by the formula of Rodrigues, into `out`."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = np.cos(angle), np.sin(angle)
    rest = 1 - c
    out[0, 0], out[0, 1], out[0, 2] = c + x * x * rest, x * y * rest - z * s, x * z * rest + y * s
    out[1, 0], out[1, 1], out[1, 2] = y * x * rest + z * s, c + y * y * rest, y * z * rest - x * s
    out[2, 0], out[2, 1], out[2, 2] = z * x * rest - y * s, z * y * rest + x * s, c + z * z * rest


@njit(cache=True)
def place(q: Array, chain: Chain, placed: Placed) -> None:
    """Poses of all bodies at joint positions (n), each in the frame of the body before."""
    for i in range(len(chain.mass)):
        placed.origin[i] = chain.origin[i]
        if chain.slide[i]:
            for k in range(3):
                placed.origin[i, k] += chain.axis[i, k] * q[i]
                for m in range(3):
                    placed.rotation[i, k, m] = 1.0 if k == m else 0.0
        else:
            rotate(chain.axis[i], q[i], placed.rotation[i])


@njit(cache=True)
def move_body(i: int, v: float, a: float, chain: Chain, placed: Placed, moved: Moved) -> None:
    """Motion of body i out of that of the body before it, and the force and moment that this alone takes.

    Args:
        i: Index of the body.
        v, a: Velocity and acceleration of its joint.
        chain, placed: The chain and its pose.
        moved: Row i is read, row i + 1 is written.
    """
    scratch, rotation, axis = moved.scratch, placed.rotation[i], chain.axis[i]
    omega, alpha, acceleration = moved.omega[i + 1], moved.alpha[i + 1], moved.acceleration[i + 1]
    force, moment = moved.force[i + 1], moved.moment[i + 1]
    scratch[2] = moved.acceleration[i]
    add_centripetal(moved.omega[i], moved.alpha[i], placed.origin[i], scratch, scratch[2])
    times_transposed(rotation, moved.omega[i], omega)
    times_transposed(rotation, moved.alpha[i], alpha)
    times_transposed(rotation, scratch[2], acceleration)
    cross(omega, axis, scratch[0])
    for k in range(3):
        if chain.slide[i]:
            acceleration[k] += 2 * scratch[0, k] * v + axis[k] * a
        else:
            alpha[k] += scratch[0, k] * v + axis[k] * a
            omega[k] += axis[k] * v
    force[:] = acceleration
    add_centripetal(omega, alpha, chain.com[i], scratch, force)
    for k in range(3):
        force[k] = chain.mass[i] * force[k]
    times(chain.inertia[i], omega, scratch[2])
    cross(omega, scratch[2], scratch[0])
    cross(chain.com[i], force, scratch[1])
    times(chain.inertia[i], alpha, moment)
    for k in range(3):
        moment[k] = moment[k] + scratch[0, k] + scratch[1, k]


@njit(cache=True)
def joint_forces(
    v: Array, a: Array, gravity: float, chain: Chain, placed: Placed, moved: Moved, out: Array
) -> None:
    """Forces or torques at the joints that a motion of the links takes, without rotors and friction.

    Args:
        v, a: Velocities and accelerations of the joints (n).
        gravity: Acceleration of gravity [m/s^2].
        chain, placed: The chain and its pose.
        moved: Room for the motion of the bodies.
        out: Where the forces or torques are written [N or N m] (n).
    """
    n, scratch = len(chain.mass), moved.scratch
    moved.acceleration[0, 2] = gravity
    for i in range(n):
        move_body(i, v[i], a[i], chain, placed, moved)
    for i in range(n - 1, -1, -1):
        force, moment, axis = moved.force[i + 1], moved.moment[i + 1], chain.axis[i]
        at_joint = force if chain.slide[i] else moment
        out[i] = axis[0] * at_joint[0] + axis[1] * at_joint[1] + axis[2] * at_joint[2]
        if i > 0:
            times(placed.rotation[i], force, scratch[0])
            times(placed.rotation[i], moment, scratch[1])
            cross(placed.origin[i], scratch[0], scratch[2])
            for k in range(3):
                moved.force[i, k] += scratch[0, k]
                moved.moment[i, k] += scratch[1, k] + scratch[2, k]


@njit(cache=True)
def mass_matrix(chain: Chain, placed: Placed, moved: Moved, out: Array) -> None:
    """Mass matrix of the links, without rotor inertias, into `out` (n, n) [kg m^2 or kg]."""
    n = len(chain.mass)
    rest, unit, column = np.zeros(n), np.zeros(n), np.zeros(n)
    for j in range(n):
        unit[:] = 0.0
        unit[j] = 1.0
        joint_forces(rest, unit, 0.0, chain, placed, moved, column)
        out[:, j] = column


@njit(cache=True)
def inverse_dynamics(q: Array, v: Array, a: Array, chain: Chain) -> Array:
    """Forces or torques (n_samples, n) that a motion of the links takes under gravity, without rotors and friction.

    Args:
        q, v, a: Positions, velocities and accelerations of the joints (n_samples, n).
        chain: The links.
    """
    n = len(chain.mass)
    placed, moved, out = room_to_place(n), room_to_move(n), np.empty((len(q), n))
    for k in range(len(q)):
        place(q[k], chain, placed)
        joint_forces(v[k], a[k], GRAVITY, chain, placed, moved, out[k])
    return out


def link_inertia(q: Array, chain: Chain) -> Array:
    """Mass matrix of the links (n, n) at joint positions (n), from the torques of unit accelerations [kg m^2 or kg]."""
    n = len(q)
    poses, accelerations = np.tile(q, (n + 1, 1)), np.vstack([np.zeros((1, n)), np.eye(n)])
    forces = inverse_dynamics(poses, np.zeros_like(poses), accelerations, chain)
    return (forces[1:] - forces[0]).T
