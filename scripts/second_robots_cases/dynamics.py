"""Rigid-body dynamics of a serial chain of hinges and slides: kinematics, joint-space mass matrix and bias forces.

The bias forces (Coriolis, centrifugal and gravitational) come from one recursive Newton-Euler pass with zero joint accelerations, the
mass matrix from the Jacobians of the centres of mass. All vectors are expressed in the world frame.

References:
    J. Y. S. Luh, M. W. Walker and R. P. C. Paul, *On-line computational scheme for mechanical manipulators*, J. Dyn. Syst. Meas.
    Control 102 (1980) 69-76 (the recursion);
    B. Siciliano, L. Sciavicco, L. Villani and G. Oriolo, *Robotics: Modelling, Planning and Control*, 2009, eq. (7.32) (the mass matrix).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array


class Chain(NamedTuple):
    """Bodies of a serial chain, each carried by the one before through one joint."""

    hinge: NDArray[np.bool_]
    """Whether the joint of a body is a hinge; otherwise it is a slide (n)."""
    axis: Array
    """Unit axis of the joint in the frame of the parent body (n, 3)."""
    origin: Array
    """Position of the joint in the frame of the parent body [m] (n, 3)."""
    com: Array
    """Centre of mass in the frame of the body [m] (n, 3)."""
    mass: Array
    """Mass [kg] (n)."""
    inertia: Array
    """Inertia about the centre of mass in the frame of the body [kg m^2] (n, 3, 3)."""
    gravity: Array
    """Acceleration of gravity in the frame of the base [m/s^2] (3)."""


class Pose(NamedTuple):
    """Where the bodies of a chain are, in the world frame."""

    rotation: Array
    """Rotation matrix of a body (n, 3, 3)."""
    origin: Array
    """Origin of the frame of a body [m] (n, 3)."""
    axis: Array
    """Axis of its joint (n, 3)."""
    centre: Array
    """Its centre of mass [m] (n, 3)."""
    inertia: Array
    """Its inertia about the centre of mass [kg m^2] (n, 3, 3)."""


@njit(cache=True)
def cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3)."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@njit(cache=True)
def pose_of(q: Array, chain: Chain) -> Pose:
    """Forward kinematics at joint positions (n); the rotation of a hinge is by the formula of Rodrigues."""
    n = len(q)
    rotation, inertia = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    origin, axis, centre = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    parent, at = np.eye(3), np.zeros(3)
    for i in range(n):
        a = chain.axis[i]
        axis[i] = parent @ a
        if chain.hinge[i]:
            origin[i] = at + parent @ chain.origin[i]
            skew = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
            turned = np.eye(3) + np.sin(q[i]) * skew + (1 - np.cos(q[i])) * (skew @ skew)
            rotation[i] = parent @ turned
        else:
            origin[i] = at + parent @ (chain.origin[i] + a * q[i])
            rotation[i] = parent
        centre[i] = origin[i] + rotation[i] @ chain.com[i]
        inertia[i] = rotation[i] @ chain.inertia[i] @ rotation[i].T
        parent, at = rotation[i].copy(), origin[i].copy()
    return Pose(rotation, origin, axis, centre, inertia)


@njit(cache=True)
def mass_matrix(chain: Chain, pose: Pose) -> Array:
    """Joint-space mass matrix (n, n) without rotor inertias: the sum of m Jv'Jv + Jw' I Jw over the bodies."""
    n = len(chain.mass)
    matrix = np.zeros((n, n))
    for i in range(n):
        linear = np.zeros((i + 1, 3))
        for j in range(i + 1):
            arm = pose.centre[i] - pose.origin[j]
            linear[j] = cross(pose.axis[j], arm) if chain.hinge[j] else pose.axis[j]
        for j in range(i + 1):
            for k in range(j, i + 1):
                entry = chain.mass[i] * (linear[j] @ linear[k])
                if chain.hinge[j] and chain.hinge[k]:
                    entry += pose.axis[j] @ (pose.inertia[i] @ pose.axis[k])
                matrix[j, k] += entry
                if j != k:
                    matrix[k, j] += entry
    return matrix


@njit(cache=True)
def bias_force(v: Array, chain: Chain, pose: Pose) -> Array:
    """Joint forces or torques (n) that hold the velocities v (n) constant: Coriolis, centrifugal and gravitational."""
    n = len(v)
    force, torque = np.zeros((n, 3)), np.zeros((n, 3))
    omega, alpha, a, at = np.zeros(3), np.zeros(3), -chain.gravity, np.zeros(3)
    for i in range(n):
        r, axis = pose.origin[i] - at, pose.axis[i]
        a = a + cross(alpha, r) + cross(omega, cross(omega, r))
        if chain.hinge[i]:
            alpha = alpha + cross(omega, axis) * v[i]
            omega = omega + axis * v[i]
        else:
            a = a + 2 * cross(omega, axis) * v[i]
        d = pose.centre[i] - pose.origin[i]
        force[i] = chain.mass[i] * (a + cross(alpha, d) + cross(omega, cross(omega, d)))
        torque[i] = pose.inertia[i] @ alpha + cross(omega, pose.inertia[i] @ omega)
        at = pose.origin[i]
    bias = np.zeros(n)
    for j in range(n):
        for i in range(j, n):
            if chain.hinge[j]:
                bias[j] += pose.axis[j] @ (torque[i] + cross(pose.centre[i] - pose.origin[j], force[i]))
            else:
                bias[j] += pose.axis[j] @ force[i]
    return bias
