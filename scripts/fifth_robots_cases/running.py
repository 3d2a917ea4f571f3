"""A robot run along its references: by servos, by velocity servos under an outer loop, or by a controller of currents or torques.

Neither the outer loop nor the controller is stated; both read the true positions and velocities of the motors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from fourth_robots_cases.references import minimum_jerk
from fourth_robots_cases.stepping import Trace

from fifth_robots_cases.cases import Plan, RobotCase
from fifth_robots_cases.machine import GOALS, RATES, TORQUES, Command, Machine
from fifth_robots_cases.stepping import Steps, simulate

BEFORE = 2.5
"""Time for which a robot is simulated before a record begins [s]: held at the middle of its motions, or already moving."""
ONSET = 1.0
"""Time over which a motion sets in that begins at rest [s]."""


class Run(NamedTuple):
    """What a robot did in a record."""

    step: float
    """Length of a step [s]."""
    steps: Steps
    """States at the steps, from the beginning of the record on."""
    trace: Trace
    """What it did at the ticks of its controller, from the beginning of the record on."""
    replay: Command
    """Its goals as they were, with those before the record."""


def period(case: RobotCase) -> float:
    """Time between ticks of the controller [s]."""
    return 1.0 / case.rate / case.ticks


def command_of(rng: np.random.Generator, case: RobotCase, plan: Plan) -> Command:
    """What the drives of a robot follow in a record, from `BEFORE` on."""
    tick, drive, links = period(case), case.robot.drive, case.robot.links
    before, ticks = round(BEFORE / tick), round(plan.seconds / tick) + 1
    t = np.arange(-before if plan.moving else 0, ticks, dtype=np.float64) * tick
    if plan.moving:
        t = t + BEFORE
    position = np.stack([motion.shape(rng, t) for motion in plan.joints], 1)
    if not plan.moving:
        centre = np.array([motion.centre for motion in plan.joints], float)
        position = centre + minimum_jerk(t, ONSET)[:, None] * (position - centre)
        position = np.vstack([np.repeat(position[:1], before, 0), position])
    velocity = np.gradient(position, tick, axis=0)
    if case.goal_step is not None:
        position = np.round(position / case.goal_step) * case.goal_step
    gain = np.array([link.control.gain for link in links], float)
    rate_gain = np.array([link.control.rate_gain for link in links], float)
    kind = {"position": GOALS, "velocity": RATES}.get(drive, TORQUES)
    return Command(kind, position[0].copy(), position, velocity, gain, rate_gain)


def run(case: RobotCase, machine: Machine, command: Command) -> Run:
    """Simulate a robot from rest."""
    tick = period(case)
    substeps = math.ceil(tick / case.longest_step - 1e-9)
    states, done = simulate(machine, command, substeps, tick / substeps)
    before = round(BEFORE / tick)
    steps = Steps(*(values[before * substeps :] for values in states))
    trace = Trace(*(values[before:] for values in done))
    return Run(tick / substeps, steps, trace, command._replace(kind=GOALS, position=done.goal))
