"""A robot run along a reference, by its position servos or by torques that a feedback corrects.

Where torques or currents are commanded, the controller knows the nominal model only: it adds to the inverse dynamics along the reference a
feedback of the true position and velocity on the motor side, scaled by the diagonal of the mass matrix. Both are continuous in time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from third_robots_cases.cases import RobotCase
from third_robots_cases.machine import Command
from third_robots_cases.plant import Plant
from third_robots_cases.references import PLANS, Course, Motion
from third_robots_cases.stepping import simulate

STEP = 1e-4
"""Time step of the integration [s]."""
SETTLING = 3.0
"""Time for which a robot holds its first position before the record begins [s]."""
PAST_END = 50
"""Steps for which the reference is known beyond the end of a record."""
JITTER, MOST_JITTER = 0.02, 0.2
"""Standard deviation and bound of the deviation of a sample from its time stamp, over the period."""


class Run(NamedTuple):
    """What a robot was commanded and did, without errors of the log but its offset; arrays (n_samples, n), times (n_samples)."""

    time: Array
    """Time stamps [s]."""
    target: Array
    """Position targets [rad or m]; empty where the drives are no servos."""
    torque: Array
    """Torques or forces of the drives [N m or N]."""
    position: Array
    """Positions on the side that is logged [rad or m]."""
    velocity: Array
    """Velocities there [rad/s or m/s]."""
    acceleration: Array
    """Accelerations there [rad/s^2 or m/s^2]."""


def motion_of(case: RobotCase, seed: int, record: int) -> Motion:
    """Reference of a record, by its number."""
    robot, speed = case.robot, case.speed[record]
    course = Course(
        centre=np.array(case.centre or robot.centre),
        amplitude=np.array(robot.amplitude) * case.scale[record],
        lowest=robot.lowest,
        highest=robot.highest * speed,
        spacing=robot.spacing,
        speed=speed,
        seconds=case.seconds,
    )
    rng = np.random.default_rng([seed, 7 * record + 1])
    return PLANS[case.plans[record]](rng, course)


def command_of(case: RobotCase, nominal: Plant, motion: Motion, time: Array) -> Command:
    """What the drives follow along a motion: targets at the time stamps, or torque and reference at the midpoints of the steps."""
    if case.drive == "servo":
        nothing = np.zeros((1, len(case.robot.links)))
        return Command(float(case.rate), np.round(motion(time), 6), nothing, nothing, nothing)
    steps = round(case.seconds / STEP) + PAST_END
    middle = (np.arange(steps, dtype=np.float64) + 0.5) * STEP
    position = motion(middle)
    velocity = np.gradient(position, STEP, axis=0)
    acceleration = np.gradient(velocity, STEP, axis=0)
    torque = nominal.rigid_torque(position, velocity, acceleration)
    along = (np.ascontiguousarray(x) for x in (torque, position, velocity))
    return Command(float(case.rate), np.zeros((1, len(case.robot.links))), *along)


def run(case: RobotCase, plant: Plant, nominal: Plant, seed: int, record: int, *, jitter: bool) -> Run:
    """Simulate a plant along the reference of a record.

    Args:
        case: The case.
        plant: What is simulated.
        nominal: What the controller knows of it.
        seed: Of the case.
        record: Number of the record, from 0.
        jitter: Whether the clock that takes the samples is jittery.
    """
    samples = round(case.seconds * case.rate) + 1
    time = np.arange(samples) / case.rate
    command = command_of(case, nominal, motion_of(case, seed, record), time)
    taken = time.copy()
    if jitter:
        rng, period = np.random.default_rng([seed, 200 + record]), 1 / case.rate
        late = JITTER * period * rng.standard_normal(samples - 1)
        taken[1:] += np.clip(late, -MOST_JITTER * period, MOST_JITTER * period)
    out = simulate(plant.machine, command, taken, round(SETTLING / STEP), STEP)
    first = 0 if case.side == "link" else 3
    return Run(
        time,
        command.target if case.drive == "servo" else np.zeros((samples, 0)),
        out[:, :, 6],
        out[:, :, first] + plant.offset,
        out[:, :, first + 1],
        out[:, :, first + 2],
    )
