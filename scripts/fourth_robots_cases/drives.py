"""Forces of drives, springs and transmissions in a step, and those of the effects that a case may plant.

All forces are added in place, with positions and velocities at the midpoint of the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from fourth_robots_cases.machine import (
    POSITION,
    VELOCITY,
    Cogging,
    Command,
    Hose,
    Machine,
    Stop,
    Transmission,
)


class Motion(NamedTuple):
    """Motion at the midpoint of a step."""

    q: Array
    """Coordinates [rad or m] (n_coordinates)."""
    v: Array
    """Velocities [rad/s or m/s] (n_coordinates)."""
    motor: NDArray[np.int64]
    """Coordinate of the motor of each joint (n)."""


class Forces(NamedTuple):
    """Forces in a step, without dry friction."""

    total: Array
    """On each coordinate [N m or N] (n_coordinates)."""
    drive: Array
    """Of each drive [N m or N] (n)."""
    fault: Array
    """Of ripple, stop and hose at each joint [N m or N] (n)."""


@njit(cache=True)
def set_goal(goal: Array, command: Command, tick: int, q: Array, motor: NDArray[np.int64]) -> None:
    """Set the goals (n) of servos at a tick, or before the first one (-1), where the reference rests.

    Goals of rates are velocities of the reference and a gain times the distance of the motors from it.
    """
    row = max(tick, 0)
    if command.kind == POSITION:
        goal[:] = command.position[row]
    elif command.kind == VELOCITY:
        for j in range(len(goal)):
            ahead = command.velocity[row, j] if tick >= 0 else 0.0
            goal[j] = ahead + command.outer_gain * (command.position[row, j] - q[motor[j]])


@njit(cache=True)
def drive_force(j: int, machine: Machine, command: Command, row: int, goal: Array, motion: Motion) -> float:
    """Torque or force of drive j, within its limit; a controller reads a row of its reference."""
    servos, q, v = machine.servos, motion.q[motion.motor[j]], motion.v[motion.motor[j]]
    if command.kind == POSITION:
        wanted = servos.kp[j] * (goal[j] - q) - servos.kv[j] * v
    elif command.kind == VELOCITY:
        wanted = servos.kv[j] * (goal[j] - v)
    else:
        wanted = (
            command.feedforward[row, j]
            + command.gain[row, j] * (command.position[row, j] - q)
            + command.rate_gain[row, j] * (command.velocity[row, j] - v)
        )
    return min(max(wanted, -servos.limit[j]), servos.limit[j])


@njit(cache=True)
def add_drives(
    forces: Forces, machine: Machine, command: Command, row: int, goal: Array, motion: Motion
) -> None:
    """Drives and viscous friction on the motors, springs on the links."""
    passive = machine.passive
    for j in range(len(goal)):
        force = drive_force(j, machine, command, row, goal, motion)
        forces.drive[j] = force
        forces.total[motion.motor[j]] += force - passive.damping[j] * motion.v[motion.motor[j]]
        forces.total[j] -= passive.stiffness[j] * (motion.q[j] - passive.rest[j])


@njit(cache=True)
def add_cogging(forces: Forces, cogging: Cogging, motion: Motion) -> None:
    """Ripple on the motors."""
    for j in range(len(motion.motor)):
        if cogging.amplitude[j] != 0.0:
            angle = cogging.periods[j] * motion.q[motion.motor[j]] + cogging.phase[j]
            forces.fault[j] -= cogging.amplitude[j] * np.sin(angle)
            forces.total[motion.motor[j]] += forces.fault[j]


@njit(cache=True)
def add_transmissions(forces: Forces, transmission: Transmission, motion: Motion) -> None:
    """Forces between motors and links."""
    for j in range(len(motion.motor)):
        if transmission.present[j]:
            motor, half = motion.motor[j], transmission.half_gap[j]
            stiffness, damping = transmission.stiffness[j], transmission.damping[j]
            twist, rate = motion.q[motor] - motion.q[j], motion.v[motor] - motion.v[j]
            force = 0.0
            if half <= 0:
                force = stiffness * twist + damping * rate
            elif twist > half:
                force = max(0.0, stiffness * (twist - half) + damping * rate)
            elif twist < -half:
                force = min(0.0, stiffness * (twist + half) + damping * rate)
            forces.total[motor] -= force
            forces.total[j] += force


@njit(cache=True)
def add_stop(forces: Forces, stop: Stop, motion: Motion) -> None:
    """Stops on the links, which push and never pull."""
    for j in range(len(motion.motor)):
        if stop.stiffness[j] > 0:
            side = stop.side[j]
            depth = side * (motion.q[j] - stop.place[j])
            if depth > 0:
                force = max(0.0, stop.stiffness[j] * depth + stop.damping[j] * side * motion.v[j]) * side
                forces.total[j] -= force
                forces.fault[j] -= force


@njit(cache=True)
def hose_levers(q: Array, levers: Array) -> Array:
    """Derivatives of the length of the hose by the positions of its joints [m] (3)."""
    out = np.zeros(3)
    out[0] = levers[0] * np.cos(q[1])
    out[1] = (
        -levers[0] * q[0] * np.sin(q[1])
        + levers[1] * np.cos(q[1] + 0.3)
        + levers[2] * q[2] * 0.6 * np.cos(q[1])
    )
    out[2] = levers[2] * (1 + 0.6 * np.sin(q[1]))
    return out


@njit(cache=True)
def add_hose(forces: Forces, hose: Hose, tension: Array, motion: Motion, step: float) -> None:
    """Advance the tension of the elastic part of the hose [N] (1) by a step [s], and add the pull to the links."""
    if hose.stiffness > 0:
        levers = hose_levers(motion.q[:3], hose.levers)
        longer = 0.0
        for j in range(3):
            longer += levers[j] * motion.v[j] * step
        tension[0] = min(max(tension[0] + hose.stiffness * longer, -hose.slip), hose.slip)
        for j in range(3):
            force = -(tension[0] + hose.pretension) * levers[j]
            forces.total[j] += force
            forces.fault[j] += force
