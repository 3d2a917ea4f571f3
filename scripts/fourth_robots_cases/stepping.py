"""Time stepping: the forces at the midpoint of a step, then its friction, then the positions by the mean of old and new velocities.

The midpoint is foretold by the velocity at the beginning of the step and the acceleration of the step before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from fourth_robots_cases.drives import (
    Forces,
    Motion,
    add_cogging,
    add_drives,
    add_hose,
    add_stop,
    add_transmissions,
    set_goal,
)
from fourth_robots_cases.dynamics import mass_matrix_and_bias
from fourth_robots_cases.friction import largest_impulses, stick
from fourth_robots_cases.machine import Command, Machine


class State(NamedTuple):
    """State, which the steps change in place. Motors behind transmissions come after the joints."""

    q: Array
    """Coordinates [rad or m] (n_coordinates)."""
    v: Array
    """Velocities [rad/s or m/s] (n_coordinates)."""
    acceleration: Array
    """Mean acceleration of the last step [rad/s^2 or m/s^2] (n_coordinates)."""
    impulse: Array
    """Friction impulses of the last step [N m s or N s] (n_coordinates)."""
    tension: Array
    """Tension of the elastic part of the hose [N] (1)."""


class Trace(NamedTuple):
    """What a machine did; each (n_samples, n), but the goals, which are (n_ticks, n)."""

    position: Array
    """Positions of the links [rad or m]."""
    velocity: Array
    """Velocities of the links [rad/s or m/s]."""
    motor: Array
    """Positions of the motors [rad or m]."""
    torque: Array
    """Torques or forces of the drives [N m or N]."""
    fault: Array
    """Those of ripple, stop and hose [N m or N]."""
    friction: Array
    """Those of dry friction [N m or N]."""
    goal: Array
    """Goals of the servos [rad, m, rad/s or m/s]; zero where a tick is later than the last step."""


@njit(cache=True)
def motor_coordinates(present: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Coordinate of the motor of each joint (n): its own behind a transmission, that of the joint otherwise."""
    n = len(present)
    motor, following = np.empty(n, np.int64), n
    for j in range(n):
        motor[j] = j
        if present[j]:
            motor[j] = following
            following += 1
    return motor


@njit(cache=True)
def at_rest(start: Array, motor: NDArray[np.int64]) -> State:
    """State at rest at positions (n)."""
    size = max(len(start), np.max(motor) + 1)
    q = np.zeros(size)
    for j in range(len(start)):
        q[j] = start[j]
        q[motor[j]] = start[j]
    return State(q, np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(1))


@njit(cache=True)
def empty_trace(samples: int, ticks: int, n: int) -> Trace:
    """Room for what a machine of n joints does."""
    size = (samples, n)
    return Trace(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size),
        np.zeros((ticks, n)),
    )  # fmt: skip


@njit(cache=True)
def step_forces(
    machine: Machine, command: Command, row: int, goal: Array, tension: Array, motion: Motion, step: float
) -> tuple[Forces, NDArray[np.floating]]:
    """Forces of a step but its dry friction, and the inverse of the inertia (n_coordinates, n_coordinates)."""
    n, size = len(goal), len(motion.q)
    matrix, bias = mass_matrix_and_bias(motion.q[:n], motion.v[:n], machine.chain)
    inertia, forces = np.zeros((size, size)), Forces(np.zeros(size), np.zeros(n), np.zeros(n))
    inertia[:n, :n] = matrix
    forces.total[:n] = -bias
    for j in range(n):
        inertia[motion.motor[j], motion.motor[j]] += machine.passive.armature[j]
    add_drives(forces, machine, command, row, goal, motion)
    add_cogging(forces, machine.cogging, motion)
    add_transmissions(forces, machine.transmission, motion)
    add_stop(forces, machine.stop, motion)
    add_hose(forces, machine.hose, tension, motion, step)
    return forces, np.linalg.inv(inertia)


@njit(cache=True)
def record(
    trace: Trace, sample: int, part: float, state: State, q: Array, v: Array, motor: NDArray[np.int64]
) -> None:
    """Record a sample within a step, by how much of the step has passed, and its last positions and velocities (n_coordinates)."""
    before = 1 - part
    for j in range(len(motor)):
        m = motor[j]
        trace.position[sample, j] = before * state.q[j] + part * q[j]
        trace.velocity[sample, j] = before * state.v[j] + part * v[j]
        trace.motor[sample, j] = before * state.q[m] + part * q[m]


@njit(cache=True)
def simulate(
    machine: Machine, command: Command, ticks: Array, taken: Array, step: float, before: float
) -> Trace:
    """Simulate a machine from rest.

    Args:
        machine: What moves.
        command: What its drives follow.
        ticks: When goals are set [s] (n_ticks).
        taken: When samples are taken [s] (n_samples).
        step: Length of a step [s].
        before: Time for which it is simulated before time 0 [s].
    """
    n = len(machine.chain.mass)
    motor = motor_coordinates(machine.transmission.present)
    state, trace, goal = at_rest(command.start, motor), empty_trace(len(taken), len(ticks), n), np.zeros(n)
    tick, sample, number = 0, 0, 0
    while sample < len(taken):
        time = -before + number * step
        while tick < len(ticks) and time >= ticks[tick] - 1e-9:
            set_goal(goal, command, tick, state.q, motor)
            trace.goal[tick] = goal
            tick += 1
        if tick == 0:
            set_goal(goal, command, -1, state.q, motor)
        middle = state.q + 0.5 * step * state.v
        motion = Motion(middle, state.v + 0.5 * step * state.acceleration, motor)
        row = max(0, min(round((time + before) / step), len(command.position) - 1))
        forces, inverse = step_forces(machine, command, row, goal, state.tension, motion, step)
        top = largest_impulses(machine.friction, state.v, motor, step)
        v = stick(state.v + step * (inverse @ forces.total), state.impulse, top, inverse)
        q = middle + 0.5 * step * v
        while sample < len(taken) and taken[sample] < time + step - 1e-12:
            record(trace, sample, (taken[sample] - time) / step, state, q, v, motor)
            for j in range(n):
                trace.torque[sample, j], trace.fault[sample, j] = forces.drive[j], forces.fault[j]
                trace.friction[sample, j] = state.impulse[motor[j]] / step
            sample += 1
        state.acceleration[:] = (v - state.v) / step
        state.q[:], state.v[:] = q, v
        number += 1
    return trace
