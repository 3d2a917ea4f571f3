"""Time stepping of a driven chain with set-valued dry friction, and an elastic or loose gear at one joint.

A step of length h takes the forces at the midpoint of the step as the velocity and acceleration of the step before foretell it. Its new
velocities are those of the friction forces f that solve

    v+ = v + h A^-1 (F - f),   |f_j| <= L_j,   f_j = L_j sgn(v+_j) where v+_j is not zero,

for all joints together, A being the full matrix of inertia with the rotors, L_j the limit of the friction. Projected Gauss-Seidel sweeps
find them, from the friction of the step before. The positions advance by the mean of the old and the new velocities.

References:
    J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988;
    M. Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235-257 (sweeps over the friction of all contacts).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from third_robots_cases.dynamics import (
    GRAVITY,
    Moved,
    Placed,
    joint_forces,
    mass_matrix,
    place,
    room_to_move,
    room_to_place,
)
from third_robots_cases.machine import Belt, Command, Drives, Gear, Machine

SWEEPS = 200
"""Most sweeps over the friction of a step."""
CONVERGED = 1e-9
"""Largest change of a friction force, over its limit, at which the sweeps end."""
RECORDED = 7
"""What is recorded of a joint: position, velocity and acceleration of the link, the same of the rotor, and the torque of the drive."""


class State(NamedTuple):
    """State that the steps change in place. There are as many coordinates as joints, and a last one for a rotor behind a gear."""

    q: Array
    """Coordinates (n_coordinates)."""
    v: Array
    """Velocities (n_coordinates)."""
    acceleration: Array
    """Mean acceleration of the last step (n_coordinates)."""
    friction: Array
    """Friction force of the last step [N m or N] (n)."""
    carried: Array
    """Force or torque of the links at each joint in the last step [N m or N] (n)."""
    torque: Array
    """Torque or force of the drives in the last step [N m or N] (n)."""


class Step(NamedTuple):
    """What is found on the way through a step, in place."""

    q: Array
    """Coordinates at its midpoint (n_coordinates)."""
    v: Array
    """Velocities at its midpoint (n_coordinates)."""
    end: Array
    """Velocities at its end (n_coordinates)."""
    force: Array
    """Generalised forces without friction (n_coordinates)."""
    matrix: Array
    """Inertia with the rotors (n_coordinates, n_coordinates)."""
    bias: Array
    """Coriolis, centrifugal and gravitational forces (n)."""
    links: Array
    """Mass matrix of the links (n, n)."""
    placed: Placed
    moved: Moved


@njit(cache=True)
def start(machine: Machine, command: Command) -> tuple[State, Step, NDArray[np.int64]]:
    """State at rest at the first position, room for a step, and the coordinate of each joint on which its drive acts (n)."""
    n, joint = len(machine.chain.mass), machine.gear.joint
    rotor, size = np.arange(n), n
    if joint >= 0:
        rotor[joint], size = n, n + 1
    q = np.zeros(size)
    q[:n] = command.target[0] if machine.drives.servo else command.position[0]
    if joint >= 0:
        q[n] = q[joint]
    state = State(q, np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(n), np.zeros(n))
    step = Step(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros((size, size)), np.zeros(n), np.zeros((n, n)),
        room_to_place(n), room_to_move(n),
    )  # fmt: skip
    return state, step, rotor


@njit(cache=True)
def link_forces(machine: Machine, state: State, step: Step, rotor: NDArray[np.int64], h: float) -> None:
    """Midpoint of a step of length h, inertia there, and the forces of the links."""
    chain, n = machine.chain, len(machine.chain.mass)
    for i in range(len(state.q)):
        step.v[i] = state.v[i] + 0.5 * h * state.acceleration[i]
        step.q[i] = state.q[i] + 0.5 * h * state.v[i]
    place(step.q, chain, step.placed)
    joint_forces(step.v, np.zeros(n), GRAVITY, chain, step.placed, step.moved, step.bias)
    mass_matrix(chain, step.placed, step.moved, step.links)
    step.matrix[:] = 0.0
    step.force[:] = 0.0
    for i in range(n):
        for j in range(n):
            step.matrix[i, j] = step.links[i, j]
        step.force[i] = -step.bias[i]
    for i in range(n):
        step.matrix[rotor[i], rotor[i]] += machine.drives.armature[i]


@njit(cache=True)
def drive_torque(
    j: int, q: float, v: float, drives: Drives, command: Command, number: int, time: float
) -> float:
    """Torque or force of drive j, limited.

    Args:
        j: Index of the joint.
        q, v: Position and velocity on the motor side.
        drives, command: The drives and what they follow.
        number: Of the step, negative before the record begins.
        time: Midpoint of the step [s].
    """
    if drives.servo:
        k = int(np.floor((time - drives.delay[j]) * command.rate + 1e-9))
        k = min(max(k, 0), len(command.target) - 1)
        wanted = drives.gain[j] * (command.target[k, j] - q) - drives.kv[j] * v
    else:
        k = min(max(number, 0), len(command.position) - 1)
        feedback = drives.gain[j] * (command.position[k, j] - q)
        wanted = command.feedforward[k, j] + feedback + drives.kv[j] * (command.velocity[k, j] - v)
    return min(max(wanted, -drives.limit[j]), drives.limit[j])


@njit(cache=True)
def add_belt(belt: Belt, step: Step) -> None:
    """Add the ripple of a belt to the forces on the first two joints."""
    if belt.amplitude != 0.0:
        ripple = belt.amplitude * np.sin(2 * np.pi * (step.q[0] + step.q[1]) / belt.pitch + belt.phase)
        step.force[0] += ripple
        step.force[1] += belt.ratio * ripple


@njit(cache=True)
def add_gear(gear: Gear, step: Step, rotor: NDArray[np.int64]) -> None:
    """Add the torque of an elastic or loose gear to the forces on its link and its rotor."""
    if gear.joint < 0:
        return
    link, motor = gear.joint, rotor[gear.joint]
    twist, rate, half = step.q[motor] - step.q[link], step.v[motor] - step.v[link], 0.5 * gear.gap
    torque = 0.0
    if gear.gap <= 0.0:
        torque = gear.stiffness * twist + gear.damping * rate
    elif twist > half:
        torque = max(0.0, gear.stiffness * (twist - half) + gear.damping * rate)
    elif twist < -half:
        torque = min(0.0, gear.stiffness * (twist + half) + gear.damping * rate)
    step.force[motor] -= torque
    step.force[link] += torque


@njit(cache=True)
def solve_friction(
    v: Array, friction: Array, limit: Array, inverse: NDArray[np.floating], rotor: NDArray[np.int64], h: float
) -> None:
    """Find the friction of a step by sweeps over the joints; velocities and friction are changed in place.

    Args:
        v: Velocities at the end of the step, without friction before and with it after (n_coordinates).
        friction: That of the step before, and of this one after [N m or N] (n).
        limit: Largest friction [N m or N] (n).
        inverse: Of the matrix of inertia (n_coordinates, n_coordinates).
        rotor: Coordinate of each joint on which friction acts (n).
        h: Length of the step [s].
    """
    for j in range(len(friction)):
        friction[j] = min(max(friction[j], -limit[j]), limit[j])
        for i in range(len(v)):
            v[i] -= h * inverse[i, rotor[j]] * friction[j]
    for _ in range(SWEEPS):
        largest = 0.0
        for j in range(len(friction)):
            b = rotor[j]
            if limit[j] <= 0.0:
                continue
            new = min(max(friction[j] + v[b] / (h * inverse[b, b]), -limit[j]), limit[j])
            change = new - friction[j]
            if change != 0.0:
                friction[j] = new
                largest = max(largest, abs(change) / limit[j])
                for i in range(len(v)):
                    v[i] -= h * inverse[i, b] * change
        if largest < CONVERGED:
            break


@njit(cache=True)
def finish(machine: Machine, state: State, step: Step, rotor: NDArray[np.int64], h: float) -> None:
    """Velocities at the end of a step with friction, the mean acceleration of the step, and what the joints carry."""
    drives, n, size = machine.drives, len(machine.chain.mass), len(state.q)
    inverse = np.linalg.inv(step.matrix)
    for i in range(size):
        x = 0.0
        for j in range(size):
            x += inverse[i, j] * step.force[j]
        step.end[i] = state.v[i] + h * x
    limit = drives.coulomb + drives.load_friction * np.abs(state.carried)
    solve_friction(step.end, state.friction, limit, inverse, rotor, h)
    for i in range(size):
        state.acceleration[i] = (step.end[i] - state.v[i]) / h
    for i in range(n):
        x = step.bias[i]
        for j in range(n):
            x += step.links[i, j] * state.acceleration[j]
        state.carried[i] = x


@njit(cache=True)
def record(row: Array, after: float, state: State, rotor: NDArray[np.int64]) -> None:
    """Write links, rotors and torques at a time after the begin of a step [s] into a row (n, RECORDED)."""
    for j in range(len(rotor)):
        for side in range(2):
            i = j if side == 0 else rotor[j]
            a = state.acceleration[i]
            row[j, 3 * side] = state.q[i] + after * (state.v[i] + 0.5 * after * a)
            row[j, 3 * side + 1] = state.v[i] + after * a
            row[j, 3 * side + 2] = a
        row[j, 6] = state.torque[j]


@njit(cache=True)
def simulate(machine: Machine, command: Command, times: Array, settling: int, h: float) -> Array:
    """Simulate a machine from rest, and record it at given times.

    Args:
        machine: What moves.
        command: What its drives follow.
        times: When it is recorded [s] (n_samples).
        settling: Steps for which it holds its first position before time 0.
        h: Length of a step [s].

    Returns:
        What `RECORDED` tells of every joint (n_samples, n, RECORDED).
    """
    n = len(machine.chain.mass)
    state, step, rotor = start(machine, command)
    out = np.zeros((len(times), n, RECORDED))
    sample, number = 0, -settling
    while sample < len(times):
        time = number * h
        link_forces(machine, state, step, rotor, h)
        for j in range(n):
            b = rotor[j]
            torque = drive_torque(j, step.q[b], step.v[b], machine.drives, command, number, time + 0.5 * h)
            state.torque[j] = torque
            step.force[b] += torque - machine.drives.damping[j] * step.v[b]
        add_belt(machine.belt, step)
        add_gear(machine.gear, step, rotor)
        finish(machine, state, step, rotor, h)
        while sample < len(times) and times[sample] < time + h:
            record(out[sample], times[sample] - time, state, rotor)
            sample += 1
        for i in range(len(state.q)):
            state.q[i] += 0.5 * h * (state.v[i] + step.end[i])
            state.v[i] = step.end[i]
        number += 1
    return out
