"""A robot run along a reference: by position servos, by velocity servos under an outer loop, or by a controller that gives torques.

Neither the outer loop nor the controller is stated. The controller knows the nominal model with the true centres of mass: it adds to the
torques of that model along the reference a feedback of the true position and velocity of the motors, scaled by the diagonal of the inertia
there, at every step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bench.arrays import Array
from fourth_robots_cases.cases import RobotCase
from fourth_robots_cases.dynamics import Chain, mass_matrix_and_bias
from fourth_robots_cases.machine import CONTROLLER, POSITION, VELOCITY, Command, Machine, Passive
from fourth_robots_cases.references import reference
from fourth_robots_cases.stepping import Trace, simulate

STEP = 1e-4
"""Time step of the integration [s]."""
BEFORE = 1.5
"""Time for which a robot is held at the beginning of its reference before the record begins [s]."""
PAST_END = 0.1
"""Time for which the reference of a controller goes on after the record [s]."""
OUTER_GAIN = 1.2
"""Gain of the outer loop of velocity servos [1/s]."""
BANDWIDTH, DAMPING_RATIO = 2 * np.pi * 3.2, 0.8
"""Feedback of the controller [rad/s]."""
JITTER, MOST_JITTER = 0.015, 3.0
"""Standard deviation of a tick or sample from its time, over the period, and its bound in standard deviations."""


class Clock(NamedTuple):
    """When goals are set, and when samples are taken; the stamps of the log tell the former."""

    ticks: Array
    """[s] (n_samples)."""
    taken: Array
    """[s] (n_samples)."""


def clock_of(rng: np.random.Generator, case: RobotCase) -> Clock:
    """The clock of a record."""
    samples, period = case.seconds * case.rate + 1, 1 / case.rate
    time = np.arange(samples, dtype=np.float64) * period
    jitter = np.clip(rng.standard_normal(samples), -MOST_JITTER, MOST_JITTER) * JITTER * period
    jitter[0] = abs(jitter[0])
    if case.clock == "stamped":
        return Clock(time + jitter, time + jitter)
    return Clock(time, time + np.abs(jitter) if case.clock == "late" else time.copy())


@njit(cache=True)
def rigid_torques(q: Array, v: Array, a: Array, chain: Chain, passive: Passive) -> tuple[Array, Array]:
    """Torques of a motion, with rotors, viscous friction and springs, and the diagonal of the inertia along it.

    Args:
        q, v, a: Positions, velocities and accelerations (n_samples, n).
        chain: Links and joints.
        passive: What the joints have besides.

    Returns:
        Both (n_samples, n).
    """
    torque, inertia = np.zeros(q.shape), np.zeros(q.shape)
    for i in range(q.shape[0]):
        matrix, bias = mass_matrix_and_bias(q[i], v[i], chain)
        for j in range(q.shape[1]):
            x = bias[j] + passive.damping[j] * v[i, j] + passive.stiffness[j] * (q[i, j] - passive.rest[j])
            x += passive.armature[j] * a[i, j]
            for k in range(q.shape[1]):
                x += matrix[j, k] * a[i, k]
            torque[i, j], inertia[i, j] = x, matrix[j, j] + passive.armature[j]
    return torque, inertia


def command_of(case: RobotCase, nominal: Machine, seed: int, record: int) -> Command:
    """What the drives of a robot follow in a record.

    Args:
        case: The case.
        nominal: What a controller knows of the robot.
        seed: Of the case.
        record: Number of the record, from 0.
    """
    rng, plan = np.random.default_rng([seed, 20 + record]), case.plans[record]
    drive, nothing = case.robot.drive, np.zeros((1, len(case.robot.links)))
    if case.robot.has_servos:
        position = reference(rng, plan, np.arange(case.seconds * case.rate + 1) / case.rate, case.course)
        velocity = np.gradient(position, 1 / case.rate, axis=0) if drive == "velocity" else nothing
        kind = VELOCITY if drive == "velocity" else POSITION
        return Command(kind, position[0], position, velocity, OUTER_GAIN, nothing, nothing, nothing)
    steps = int((BEFORE + case.seconds + PAST_END) / STEP)
    time = np.arange(steps, dtype=np.float64) * STEP - BEFORE
    position = reference(rng, plan, np.clip(time, 0, None), case.course)
    velocity = np.gradient(position, STEP, axis=0)
    acceleration = np.gradient(velocity, STEP, axis=0)
    torque, inertia = rigid_torques(position, velocity, acceleration, nominal.chain, nominal.passive)
    gain = inertia * BANDWIDTH * BANDWIDTH
    rate_gain = 2 * DAMPING_RATIO * BANDWIDTH * inertia
    return Command(CONTROLLER, position[0], position, velocity, 0.0, torque, gain, rate_gain)


def replayed(command: Command, trace: Trace) -> Command:
    """Goals as they were logged, from the first logged position and without an outer loop, where goals are rates; else the command."""
    if command.kind != VELOCITY:
        return command
    return command._replace(start=trace.position[0].copy(), velocity=trace.goal, outer_gain=0.0)


def run(machine: Machine, command: Command, clock: Clock) -> Trace:
    """Simulate a machine from rest, and sample it."""
    return Trace(*simulate(machine, command, clock.ticks, clock.taken, STEP, BEFORE))
