"""Time stepping of a robot with drives, trains and dry friction.

Dry friction is solved for the velocity at the end of each step, so that a joint that sticks stands still.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from sixth_robots_cases.dynamics import mass_matrix_and_bias
from sixth_robots_cases.machine import POSITION, TORQUE, VELOCITY, Command, Machine

Rows = NDArray[np.int64]
"""Coordinates of the motors: those of the joints, or those behind them where a train is elastic."""


@njit(cache=True)
def _inverse(a: Array) -> Array:
    """Inverse of a small positive definite matrix."""
    n = len(a)
    out, work = np.eye(n), a.copy()
    for i in range(n):
        p = 1.0 / work[i, i]
        for k in range(n):
            work[i, k] *= p
            out[i, k] *= p
        for j in range(n):
            if j != i:
                f = work[j, i]
                if f != 0.0:
                    for k in range(n):
                        work[j, k] -= f * work[i, k]
                        out[j, k] -= f * out[i, k]
    return out


@njit(cache=True)
def _drive(machine: Machine, i: int, command: float, angle: float, rate: float) -> float:
    """Torque of a drive [N m or N] at an angle [rad or m] and a rate [rad/s or m/s] of its motor."""
    torque = command
    if machine.kind[i] == POSITION:
        torque = machine.kp[i] * (command - angle) - machine.kv[i] * rate
    elif machine.kind[i] == VELOCITY:
        torque = machine.kv[i] * (command - rate)
    return min(max(torque, -machine.limit[i]), machine.limit[i])


@njit(cache=True)
def _train(row: Array, twist: float, rate: float) -> float:
    """Torque that a train passes from motor to link [N m or N]: a spring with a damper behind half the clearance, which never pulls."""
    half = 0.5 * row[2]
    if half == 0.0:
        return row[0] * twist + row[1] * rate
    if twist > half:
        return max(0.0, row[0] * (twist - half) + row[1] * rate)
    if twist < -half:
        return min(0.0, row[0] * (twist + half) + row[1] * rate)
    return 0.0


@njit(cache=True)
def _stick(speed: Array, inverse: Array, bound: Array, impulse: Array) -> None:
    """Add impulses of dry friction [N m s or N s] to the speeds: as large as it takes to stop a coordinate, at most its bound."""
    n = len(speed)
    for i in range(n):
        impulse[i] = min(max(impulse[i], -bound[i]), bound[i])
        for j in range(n):
            speed[j] += inverse[j, i] * impulse[i]
    for _ in range(200):
        change = 0.0
        for i in range(n):
            if bound[i] > 0.0:
                new = min(max(impulse[i] - speed[i] / inverse[i, i], -bound[i]), bound[i])
                step = new - impulse[i]
                impulse[i] = new
                for j in range(n):
                    speed[j] += inverse[j, i] * step
                change = max(change, abs(step) * inverse[i, i])
        if change < 1e-12:
            return


@njit(cache=True)
def _advance(machine: Machine, state: Array, commands: Array, impulse: Array, where: Rows, h: float) -> Array:
    """A step of all coordinates [s]: links first, then the motors of elastic trains; returns the torques of the drives [N m or N] (n)."""
    n, total = len(machine.mass), len(impulse)
    q, dq, th, dth = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n :]
    matrix, bias = mass_matrix_and_bias(machine, q, dq)
    mass, force, bound, speed = np.zeros((total, total)), np.zeros(total), np.zeros(total), np.zeros(total)
    mass[:n, :n] = matrix
    torques = np.zeros(n)
    for i in range(n):
        m = where[i]
        torques[i] = _drive(machine, i, commands[i], th[i], dth[i])
        force[i] -= bias[i]
        if machine.cogging[i, 0] != 0.0:
            force[i] += machine.cogging[i, 0] * math.sin(
                2.0 * math.pi * q[i] / machine.cogging[i, 1] + machine.cogging[i, 2]
            )
        force[m] += torques[i] - machine.damping[i] * dth[i]
        mass[m, m] += machine.armature[i]
        bound[i] += machine.link_friction[i] * h
        bound[m] += machine.friction[i] * h
        speed[i] = dq[i]
        if m != i:
            passed = _train(machine.train[i], th[i] - q[i], dth[i] - dq[i])
            force[i] += passed
            force[m] -= passed
            speed[m] = dth[i]
    inverse = _inverse(mass)
    for i in range(total):
        for j in range(total):
            speed[i] += h * inverse[i, j] * force[j]
    _stick(speed, inverse, bound, impulse)
    for i in range(n):
        dq[i], dth[i] = speed[i], speed[where[i]]
        q[i] += h * dq[i]
        th[i] = th[i] + h * dth[i] if where[i] != i else q[i]
    return torques


@njit(cache=True)
def _command(command: Command, k: int, state: Array, kind: Rows, n: int, out: Array) -> None:
    """Command of the controller at a sample; it reads the motors."""
    for i in range(n):
        off, rate = command.position[k, i] - state[2 * n + i], command.speed[k, i] - state[3 * n + i]
        if kind[i] == TORQUE:
            out[i] = command.torque[k, i] + command.gains[i, 0] * off + command.gains[i, 1] * rate
        elif kind[i] == POSITION:
            out[i] = command.position[k, i]
        else:
            out[i] = command.speed[k, i] + command.gains[i, 0] * off


@njit(cache=True)
def simulate(machine: Machine, command: Command) -> tuple[Array, Array, Array]:
    """Simulate a robot.

    Args:
        machine: What moves.
        command: What its controller is asked for.

    Returns:
        States (positions, speeds, motor positions and motor speeds; n_samples, 4 n), commands (n_samples, n) and mean torques of the drives
        [N m or N] (n_samples, n), a row a sample.
    """
    n, samples = len(machine.mass), len(command.times) - 1
    where, total = np.arange(n), n
    for i in range(n):
        if machine.train[i, 0] > 0.0:
            where[i] = total
            total += 1
    states, commands, torques = np.zeros((samples, 4 * n)), np.zeros((samples, n)), np.zeros((samples, n))
    state, impulse, now = command.states[0].copy(), np.zeros(total), np.zeros(n)
    for k in range(samples):
        if command.restart[k]:
            state[:] = command.states[k]
            impulse[:] = 0.0
        states[k] = state
        if command.closed:
            _command(command, k, state, machine.kind, n, commands[k])
        else:
            commands[k] = command.commands[k]
        span = command.times[k + 1] - command.times[k]
        count = max(1, math.ceil(span / command.step - 1e-9))
        h = span / count
        for s in range(count):
            for i in range(n):
                from_ = k
                while (
                    from_ > 0 and command.times[from_] > command.times[k] + (s + 0.5) * h - machine.delay[i]
                ):
                    from_ -= 1
                now[i] = commands[from_, i]
            torques[k] += _advance(machine, state, now, impulse, where, h) / count
    return states, commands, torques
