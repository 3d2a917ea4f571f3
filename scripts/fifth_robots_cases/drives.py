"""Goals and forces of drives, springs and ripple in a step.

All forces are added in place, with positions and velocities in the middle of the step.
"""

from __future__ import annotations

import numpy as np
from fourth_robots_cases.drives import Forces, Motion, add_stop, add_transmissions
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from fifth_robots_cases.machine import (
    GOALS,
    MOTOR,
    POSITION,
    TORQUES,
    VELOCITY,
    Cogging,
    Command,
    Machine,
    Servos,
)

SECOND_PHASE = 0.4
"""Phase of the second harmonic of ripple [rad]."""


@njit(cache=True)
def set_goal(goal: Array, command: Command, tick: int, q: Array, v: Array, motor: NDArray[np.int64]) -> None:
    """Set the goals (n) at a tick, by positions and velocities of the coordinates (n_coordinates)."""
    for j in range(len(goal)):
        wanted, rate = command.position[tick, j], command.velocity[tick, j]
        closer = command.gain[j] * (wanted - q[motor[j]])
        if command.kind == GOALS:
            goal[j] = wanted
        elif command.kind == TORQUES:
            goal[j] = closer + command.rate_gain[j] * (rate - v[motor[j]])
        else:
            goal[j] = rate + closer


@njit(cache=True)
def drive_force(servos: Servos, j: int, goal: float, q: float, v: float) -> float:
    """Torque or force of drive j at a position and velocity of its motor."""
    if servos.kind == MOTOR:
        wanted = servos.gear[j] * goal
    elif servos.kind == POSITION:
        error = goal - q
        beyond = max(abs(error) - servos.deadband[j], 0.0)
        wanted = servos.kp[j] * np.copysign(beyond, error) - servos.kv[j] * v
    elif servos.kind == VELOCITY:
        wanted = servos.kv[j] * (goal - v)
    else:
        voltage = servos.resistance / servos.constant * servos.kp[j] * (goal - q)
        voltage = min(max(voltage, -servos.voltage), servos.voltage)
        return servos.constant / servos.resistance * (voltage - servos.constant * v)
    return min(max(wanted, -servos.limit[j]), servos.limit[j])


@njit(cache=True)
def add_cogging(forces: Forces, cogging: Cogging, motion: Motion) -> None:
    """Ripple of the joints."""
    for j in range(len(motion.motor)):
        if cogging.amplitude[j] != 0.0:
            angle = 2 * np.pi * motion.q[j] / cogging.pitch[j] + cogging.phase[j]
            second = cogging.second[j] * np.sin(2 * angle + SECOND_PHASE)
            force = cogging.amplitude[j] * np.sin(angle) + second
            forces.fault[j] -= force
            forces.total[j] -= force


@njit(cache=True)
def forces_on(machine: Machine, goal: Array, motion: Motion) -> Forces:
    """Forces on all coordinates, but viscous and dry friction and what the links make themselves."""
    n, passive = len(goal), machine.passive
    forces = Forces(np.zeros(len(motion.q)), np.zeros(n), np.zeros(n))
    for j in range(n):
        m = motion.motor[j]
        forces.drive[j] = drive_force(machine.servos, j, goal[j], motion.q[m], motion.v[m])
        forces.total[m] += forces.drive[j]
        forces.total[j] -= passive.stiffness[j] * (motion.q[j] - passive.rest[j])
    add_stop(forces, machine.stop, motion)
    add_cogging(forces, machine.cogging, motion)
    add_transmissions(forces, machine.transmission, motion)
    return forces
