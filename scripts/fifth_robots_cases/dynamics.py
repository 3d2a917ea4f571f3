"""Equations of motion of a serial chain of hinges and slides, by Newton and Euler, with the Jacobians of its bodies in the room.

They differ from those of the fourth set in what a body may have: products of inertia, and a rotor that turns in it and is not told. The
base may lean, so that gravity is a vector. The order of all sums is the author's, so that the records are his to the last digit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from fourth_robots_cases.dynamics import cross, partial_velocities, rotation
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array


class Chain(NamedTuple):
    """Links and joints from the base to the tip."""

    mass: Array
    """Of each body [kg] (n)."""
    com: Array
    """Its centre of mass, in its frame [m] (n, 3)."""
    inertia: Array
    """Its inertia about that, in its axes [kg m^2] (n, 3, 3)."""
    rotor: Array
    """Angular momentum of a rotor in it, in its axes [N m s] (n, 3)."""
    slide: NDArray[np.bool_]
    """Whether the joint that carries it is a slide (n)."""
    axis: Array
    """Unit axis of that joint, in the frame of the body before (n, 3)."""
    origin: Array
    """Position of the joint there [m] (n, 3)."""
    gravity: Array
    """Acceleration of gravity [m/s^2] (3)."""


@njit(cache=True)
def dot(a: Array, b: Array) -> float:
    """Scalar product of two vectors (3)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def turned(frame: Array, vector: Array) -> Array:
    """A vector (3) of a frame (3, 3) in the room (3)."""
    return np.array([dot(frame[0], vector), dot(frame[1], vector), dot(frame[2], vector)])


@njit(cache=True)
def about(spin: Array, spin_rate: Array, lever: Array) -> tuple[Array, Array]:
    """Parts of the acceleration of a point at a lever [m] on a body that turns and turns faster: of its rate, and towards the axis (3)."""
    return cross(spin_rate, lever), cross(spin, cross(spin, lever))


@njit(cache=True)
def add_to(
    matrix: Array, bias: Array, linear: Array, angular: Array, mass: float, inertia: Array, force: Array, moment: Array
) -> None:  # fmt: skip
    """Add a body to the mass matrix and bias of the joints up to it.

    Args:
        matrix: Mass matrix (n, n).
        bias: Bias (n).
        linear, angular: Partial velocities of its centre of mass and of its rotation (n_joints, 3).
        mass: Its mass [kg].
        inertia: Its inertia in the room [kg m^2] (3, 3).
        force, moment: Its inertial force [N] (3) and moment [N m] (3) where no joint accelerates.
    """
    for j in range(len(linear)):
        for d in range(3):
            bias[j] += linear[j, d] * force[d] + angular[j, d] * moment[d]
        momentum = turned(inertia, angular[j])
        for k in range(len(linear)):
            matrix[j, k] += mass * dot(linear[j], linear[k]) + dot(momentum, angular[k])


@njit(cache=True)
def mass_matrix_and_bias(q: Array, v: Array, chain: Chain) -> tuple[Array, Array]:
    """Mass matrix of the links (n, n) and their Coriolis, gyroscopic and gravitational forces (n), at positions and velocities (n)."""
    n = len(q)
    matrix, bias = np.zeros((n, n)), np.zeros(n)
    frame, at = np.eye(3), np.zeros(3)
    spin, spin_rate, acceleration = np.zeros(3), np.zeros(3), -chain.gravity
    axes, joints = np.zeros((n, 3)), np.zeros((n, 3))
    for i in range(n):
        axis, lever = turned(frame, chain.axis[i]), turned(frame, chain.origin[i])
        if chain.slide[i]:
            lever = lever + axis * q[i]
        faster, inwards = about(spin, spin_rate, lever)
        acceleration = acceleration + faster + inwards
        at = at + lever
        own = axis * v[i]
        carried = cross(spin, own)
        if chain.slide[i]:
            acceleration = acceleration + 2.0 * carried
        else:
            spin_rate, spin = spin_rate + carried, spin + own
            frame = frame @ rotation(chain.axis[i], q[i])
        axes[i], joints[i] = axis, at
        to_centre = turned(frame, chain.com[i])
        faster, inwards = about(spin, spin_rate, to_centre)
        force = chain.mass[i] * (acceleration + faster + inwards)
        inertia = frame @ chain.inertia[i] @ frame.T
        momentum = inertia @ spin + turned(frame, chain.rotor[i])
        moment = inertia @ spin_rate + cross(spin, momentum)
        linear, angular = partial_velocities(
            chain.slide[: i + 1], axes[: i + 1], joints[: i + 1], at + to_centre
        )
        add_to(matrix, bias, linear, angular, chain.mass[i], inertia, force, moment)
    return matrix, bias
