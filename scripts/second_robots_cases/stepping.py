"""Time stepping of a driven chain with Coulomb friction that really sticks.

A step is semi-implicit: new velocities from the forces at the old positions, new positions from the new velocities. Friction is the
set-valued impulse p that solves

    v+ = v_free + M^-1 p,   |p_i| <= h F_i,   p_i = -h F_i sgn(v+_i) where v+_i is not zero,

for all joints together, by projected Gauss-Seidel sweeps over the full inverse of the mass matrix that start from the impulses of the
step before. A joint with an elastic transmission or play has a rotor of its own, on which its drive, damping and friction act.

References:
    J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988;
    M. Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235-257 (sweeps over the impulses).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from second_robots_cases.dynamics import Chain, Pose, bias_force, cross, mass_matrix, pose_of

SWEEPS = 60
"""Most sweeps over the friction impulses of a step."""
CONVERGED = 1e-13
"""Largest change of an impulse [N s or N m s] at which the sweeps end."""


class Drives(NamedTuple):
    """The drive of every joint, and the friction of the joint."""

    armature: Array
    """Rotor inertia, reflected to the joint [kg m^2 or kg] (n)."""
    damping: Array
    """Viscous friction [N m s/rad or N s/m] (n)."""
    coulomb: Array
    """Coulomb friction [N m or N] (n)."""
    load_friction: Array
    """Coulomb friction per unit of the absolute drive torque [-] (n)."""
    servo: NDArray[np.bool_]
    """Whether the drive is a position servo; otherwise the command is a current or a torque (n)."""
    gain: Array
    """Proportional gain of a servo [N m/rad or N/m], or torque per unit of the command (n)."""
    kv: Array
    """Velocity gain of a servo [N m s/rad or N s/m] (n)."""
    limit: Array
    """Largest torque or force of the drive [N m or N] (n)."""
    delay: Array
    """Delay of the command [s] (n)."""


class Transmission(NamedTuple):
    """Elasticity and play between rotor and link of every joint."""

    elastic: NDArray[np.bool_]
    """Whether the rotor of a joint moves apart from its link (n)."""
    stiffness: Array
    """Stiffness [N m/rad] (n)."""
    damping: Array
    """Damping in parallel with it [N m s/rad] (n)."""
    half_clearance: Array
    """Half of the play [rad]; zero for a purely elastic transmission (n)."""


class Hose(NamedTuple):
    """A hose from a fixed point of the room to a body: a linear spring under tension, and slack below its free length."""

    fitted: bool
    """Whether there is one."""
    anchor: Array
    """Its end in the room, in the world frame [m] (3)."""
    attached: Array
    """Its end on the body, in the frame of the body [m] (3)."""
    body: int
    """Index of the body."""
    stiffness: float
    """Stiffness [N/m]."""
    free_length: float
    """Length below which it is slack [m]."""


class State(NamedTuple):
    """State of a chain, which `advance` changes in place; each array (n)."""

    q: Array
    """Positions of the links."""
    v: Array
    """Velocities of the links."""
    motor_q: Array
    """Positions of the rotors of elastic joints."""
    motor_v: Array
    """Velocities of the rotors of elastic joints."""
    impulse: Array
    """Friction impulses of the last step."""


@njit(cache=True)
def delayed(history: Array, joint: int, substep: int, late: int, substeps: int) -> float:
    """Command of a joint as it arrives after a delay of `late` steps; history[m] is the command m samples ago."""
    sample, k = 0, substep - late
    while k < 0:
        k += substeps
        sample += 1
    return history[sample, joint]


@njit(cache=True)
def drive_torque(i: int, command: float, state: State, drives: Drives, elastic: bool) -> float:
    """Torque or force of drive i, limited; a servo reads position and velocity on the motor side."""
    if drives.servo[i]:
        q = state.motor_q[i] if elastic else state.q[i]
        v = state.motor_v[i] if elastic else state.v[i]
        wanted = drives.gain[i] * (command - q) - drives.kv[i] * v
    else:
        wanted = drives.gain[i] * command
    return min(max(wanted, -drives.limit[i]), drives.limit[i])


@njit(cache=True)
def transmitted(i: int, state: State, transmission: Transmission) -> float:
    """Torque that elastic transmission i exerts on its link; with play it can push only, never pull."""
    twist, play = state.motor_q[i] - state.q[i], transmission.half_clearance[i]
    rate = transmission.damping[i] * (state.motor_v[i] - state.v[i])
    torque = 0.0
    if twist > play:
        torque = transmission.stiffness[i] * (twist - play) + rate
        if play > 0:
            torque = max(torque, 0.0)
    elif twist < -play:
        torque = transmission.stiffness[i] * (twist + play) + rate
        if play > 0:
            torque = min(torque, 0.0)
    return torque


@njit(cache=True)
def advance_rotor(i: int, torque: float, friction: float, state: State, drives: Drives, h: float) -> None:
    """One step of the rotor of elastic joint i under a torque, its damping and a friction impulse of at most `friction`."""
    inertia = drives.armature[i]
    free = state.motor_v[i] + h * torque / inertia
    impulse = min(max(-free * inertia, -friction), friction)
    state.motor_v[i] = free + impulse / inertia
    state.motor_q[i] += h * state.motor_v[i]


@njit(cache=True)
def add_hose(force: Array, hose: Hose, chain: Chain, pose: Pose) -> None:
    """Add the pull of a hose to joint forces (n), in place, by the transposed Jacobian of the point where it is attached."""
    point = pose.origin[hose.body] + pose.rotation[hose.body] @ hose.attached
    d = hose.anchor - point
    length = np.sqrt(d @ d)
    if length > hose.free_length:
        pull = hose.stiffness * (length - hose.free_length) / length * d
        for j in range(hose.body + 1):
            if chain.hinge[j]:
                force[j] += pose.axis[j] @ cross(point - pose.origin[j], pull)
            else:
                force[j] += pose.axis[j] @ pull


@njit(cache=True)
def solve_friction(v: Array, impulse: Array, inverse: NDArray[np.floating], limit: Array) -> None:
    """Projected Gauss-Seidel sweeps that change velocities (n) and friction impulses (n) in place, within limits (n)."""
    for _ in range(SWEEPS):
        largest = 0.0
        for i in range(len(v)):
            old = impulse[i]
            new = min(max(old - v[i] / inverse[i, i], -limit[i]), limit[i])
            change = new - old
            if change != 0.0:
                impulse[i] = new
                for j in range(len(v)):
                    v[j] += inverse[j, i] * change
                largest = max(largest, abs(change))
        if largest < CONVERGED:
            break


@njit(cache=True)
def advance(
    state: State,
    history: Array,
    late: NDArray[np.int64],
    substeps: int,
    h: float,
    chain: Chain,
    drives: Drives,
    transmission: Transmission,
    hose: Hose,
) -> None:
    """Advance a state by one sample, in place.

    Args:
        state: It is changed.
        history: Commands (n_past, n), of which history[m] was given m samples ago and is held from there on.
        late: Delay of each command in steps (n).
        substeps: Steps a sample.
        h: Length of a step [s].
        chain, drives, transmission, hose: The robot.
    """
    n = len(state.q)
    limit = np.zeros(n)
    for s in range(substeps):
        pose = pose_of(state.q, chain)
        matrix, force = mass_matrix(chain, pose), -bias_force(state.v, chain, pose)
        for i in range(n):
            elastic = transmission.elastic[i]
            command = delayed(history, i, s, late[i], substeps)
            torque = drive_torque(i, command, state, drives, elastic)
            friction = h * (drives.coulomb[i] + drives.load_friction[i] * abs(torque))
            if elastic:
                through = transmitted(i, state, transmission)
                force[i] += through
                rest = torque - drives.damping[i] * state.motor_v[i] - through
                advance_rotor(i, rest, friction, state, drives, h)
                limit[i] = 0.0
                state.impulse[i] = 0.0
            else:
                matrix[i, i] += drives.armature[i]
                force[i] += torque - drives.damping[i] * state.v[i]
                limit[i] = friction
        if hose.fitted:
            add_hose(force, hose, chain, pose)
        inverse = np.linalg.inv(matrix)
        v = state.v + h * (inverse @ force) + inverse @ state.impulse
        solve_friction(v, state.impulse, inverse, limit)
        for i in range(n):
            state.v[i] = v[i]
            state.q[i] += h * v[i]
