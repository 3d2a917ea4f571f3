"""Time stepping: positions in the middle of a step, forces at its mean velocity, found in three passes, and friction as impulses.

Viscous friction is taken at the mean of old and new velocities without iteration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from fourth_robots_cases.drives import Forces, Motion
from fourth_robots_cases.friction import largest_impulses, stick
from fourth_robots_cases.stepping import Trace, at_rest, empty_trace, motor_coordinates
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from fifth_robots_cases.drives import forces_on, set_goal
from fifth_robots_cases.dynamics import mass_matrix_and_bias
from fifth_robots_cases.machine import Command, Machine

PASSES = 3
"""Passes of the forces over a step."""
SWEEPS, CONVERGED = 200, 1e-11
"""Most sweeps over the friction in a pass, and the largest change of an impulse, over its limit, at which they end."""


class Steps(NamedTuple):
    """States at the ends of the steps; motors behind transmissions come after the joints."""

    q: Array
    """Coordinates [rad or m] (n_steps, n_coordinates)."""
    v: Array
    """Velocities [rad/s or m/s] (n_steps, n_coordinates)."""


@njit(cache=True)
def inertia_and_momentum(
    machine: Machine, matrix: Array, v: Array, motor: NDArray[np.int64], step: float
) -> tuple[Array, Array]:
    """Inertia (n_coordinates, n_coordinates) and momentum (n_coordinates) of a step [s], each with half its viscous friction."""
    n, size, passive = len(motor), len(v), machine.passive
    inertia = np.zeros((size, size))
    inertia[:n, :n] = matrix
    for j in range(n):
        inertia[motor[j], motor[j]] += passive.armature[j]
    momentum = inertia @ v
    for j in range(n):
        m = motor[j]
        half = 0.5 * step * passive.damping[j]
        inertia[m, m] += half
        momentum[m] -= half * v[m]
    return inertia, momentum


@njit(cache=True)
def advanced(
    machine: Machine, goal: Array, q: Array, v: Array, motor: NDArray[np.int64], step: float
) -> tuple[Array, Array, Array, Forces]:
    """A step.

    Args:
        machine: What moves.
        goal: Goals of its drives (n).
        q, v: Coordinates and velocities before the step (n_coordinates).
        motor: Coordinate of the motor of each joint (n).
        step: Length of the step [s].

    Returns:
        Coordinates, velocities and impulses of friction afterwards (n_coordinates), and the forces of the last pass.
    """
    n = len(motor)
    middle = q + 0.5 * step * v
    matrix, bias = mass_matrix_and_bias(middle[:n], v[:n], machine.chain)
    inertia, momentum = inertia_and_momentum(machine, matrix, v, motor, step)
    top = largest_impulses(machine.friction, v, motor, step)
    inverse = np.linalg.inv(inertia)
    impulse, mean, after = np.zeros(len(v)), v.copy(), v.copy()
    forces = forces_on(machine, goal, Motion(middle, mean, motor))
    for number in range(PASSES):
        if number > 0:
            _, bias = mass_matrix_and_bias(middle[:n], mean[:n], machine.chain)
            forces = forces_on(machine, goal, Motion(middle, mean, motor))
        given = momentum + step * forces.total
        given[:n] -= step * bias
        after = stick(inverse @ given, impulse, top, inverse, SWEEPS, CONVERGED)
        mean = 0.5 * (v + after)
    return middle + 0.5 * step * after, after, impulse, forces


@njit(cache=True)
def simulate(machine: Machine, command: Command, substeps: int, step: float) -> tuple[Steps, Trace]:
    """Simulate a machine from rest.

    Args:
        machine: What moves.
        command: What its drives follow.
        substeps: Steps from tick to tick.
        step: Length of a step [s].

    Returns:
        The state at each step and after the last one, and what the machine did at each tick.
    """
    ticks, n = command.position.shape
    motor = motor_coordinates(machine.transmission.present)
    state, goal = at_rest(command.start, motor), np.zeros(n)
    q, v = state.q, state.v
    size = (ticks * substeps + 1, len(q))
    steps, trace = Steps(np.zeros(size), np.zeros(size)), empty_trace(ticks, ticks, n)
    for tick in range(ticks):
        set_goal(goal, command, tick, q, v, motor)
        trace.goal[tick] = goal
        trace.position[tick], trace.velocity[tick] = q[:n], v[:n]
        for part in range(substeps):
            row = tick * substeps + part
            steps.q[row], steps.v[row] = q, v
            q, v, impulse, forces = advanced(machine, goal, q, v, motor, step)
            if part == 0:
                trace.torque[tick], trace.fault[tick] = forces.drive, forces.fault
                for j in range(n):
                    trace.motor[tick, j] = steps.q[row, motor[j]]
                    trace.friction[tick, j] = impulse[motor[j]] / step
    steps.q[-1], steps.v[-1] = q, v
    return steps, trace
