"""The nine cases: which robot, how it is moved and logged, what is wrong with it, and what its maker states.

README.md in this folder tells of each case what is right to say of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fourth_robots_cases.faults import (
    Fault,
    backlash,
    cogging,
    coulomb_friction,
    damping_error,
    hose,
    joint_compliance,
    kind_of,
    one_sided_stop,
    servo_gain_error,
    stribeck_friction,
)
from fourth_robots_cases.references import Course, Plan
from fourth_robots_cases.robots import Robot, ankle, balanced, crane, finger, stage, wrist

Clock = Literal["exact", "late", "stamped"]
"""The clock of a log: exact, samples taken late by what the stamps do not tell, or ticks that jitter and are stamped rightly."""
MIXED: tuple[Plan, Plan, Plan] = ("multisine", "moves", "mixed")
"""Plans of most cases."""


@dataclass(frozen=True, kw_only=True)
class BasicCase:
    """What a case of any set of robots has.

    Attributes:
        name: Of its folder.
        robot: The robot.
        seed: Of all its random numbers.
        faults: What is wrong with it.
        rate: Samples a second [Hz].
        side: Side of the transmission on which positions are logged, which is stated; servos read the motor side.
        position_noise: Standard deviation of the noise of each position [rad or m].
        stated: Noise as it is stated over what it is; None where it is not stated.
    """

    name: str
    robot: Robot
    seed: int
    faults: tuple[Fault, ...] = ()
    rate: int
    side: Literal["motor", "link"]
    position_noise: tuple[float, ...]
    stated: float | None

    @property
    def kind(self) -> Literal["single", "double", "foreign", "none"]:
        """See `kind_of`."""
        return kind_of(self.faults)


@dataclass(frozen=True, kw_only=True)
class RobotCase(BasicCase):
    """A case before it is simulated.

    Attributes:
        background: Dry friction at every joint, over the root mean square of its torque or force.
        seconds: Duration of a record [s].
        course: How the joints move.
        plans: Motions of the two records for identification and of the one for validation.
        clock: Of the log.
        torque_noise: Noise of torques or currents over their root mean square; servos log goals, which have none.
        degrees: Whether the log is in degrees.
        counts: One count of each encoder [rad or m], which is stated; None where positions are not rounded.
    """

    background: float
    seconds: int
    course: Course
    plans: tuple[Plan, Plan, Plan] = MIXED
    clock: Clock
    torque_noise: float = 0.0
    degrees: bool = False
    counts: tuple[float | None, ...] | None = None

    @property
    def encoder_counts(self) -> tuple[float | None, ...]:
        """One count of each encoder [rad or m]; None where positions are not rounded (n)."""
        return self.counts or (None,) * len(self.robot.links)


def finger_cases() -> tuple[RobotCase, ...]:
    """The finger: a rubber stop, and play beside a servo that is too soft."""
    return (
        RobotCase(
            name="finger-1", robot=finger(), seed=4101, faults=(one_sided_stop("flex", place=0.72, stiffness=9.0, damping=0.02, side=1),),
            background=0.02, rate=200, seconds=10, course=Course((0.22, 0.24, 0.26), (0, 0.5, 0.45), (0.25, 3.0)),
            clock="late", side="link", position_noise=(3e-4, 3e-4, 3e-4), stated=1.0,
        ),
        RobotCase(
            name="finger-2", robot=finger(), seed=4202,
            faults=(backlash("splay", gap=0.034, stiffness=60.0, damping=0.06), servo_gain_error("curl_servo", gain=0.62)),
            background=0.015, rate=200, seconds=9, course=Course((0.2, 0.22, 0.24), (0.03, 0.45, 0.4), (0.3, 3.4)),
            plans=("multisine", "turns", "mixed"), clock="stamped", side="link", position_noise=(3.5e-4, 3.5e-4, 3.5e-4),
            stated=0.5, degrees=True,
        ),
    )  # fmt: skip


def crane_cases() -> tuple[RobotCase, ...]:
    """The crane: viscous friction that is larger than stated."""
    return (
        RobotCase(
            name="crane-1", robot=crane(), seed=4303, faults=(damping_error("pan", more=22.0),), background=0.02, rate=125, seconds=12,
            course=Course((0.28, 0.16, 0.25), (0, 0.05, 0.1), (0.12, 1.0), duration=1.1), clock="stamped", side="motor",
            position_noise=(2e-4, 2e-4, 3e-4), stated=None,
        ),
    )  # fmt: skip


def wrist_cases() -> tuple[RobotCase, ...]:
    """The wrist: ripple of a motor, and a hose over all joints."""
    laid = hose(
        ("twist", "bend", "spin"), levers=(0.045, 0.05, 0.028), stiffness=450.0, slip=3.6, pretension=2.5
    )
    return (
        RobotCase(
            name="wrist-1", robot=wrist(), seed=4404, faults=(cogging("spin", amplitude=0.11, periods=18, phase=0.8),), background=0.0,
            rate=250, seconds=9, course=Course((0.45, 0.4, 0.55), (0.3, 0.5, 0.2), (0.2, 1.6)), clock="exact", side="motor",
            position_noise=(2e-5, 2e-5, 2e-5), torque_noise=0.005, stated=None,
        ),
        RobotCase(
            name="wrist-2", robot=wrist(), seed=4505, faults=(laid,), background=0.01, rate=200, seconds=10,
            course=Course((0.5, 0.4, 0.6), (-0.2, 0.45, 0.3), (0.2, 1.7)), plans=("multisine", "mixed", "multisine"), clock="late",
            side="motor", position_noise=(3e-5, 3e-5, 3e-5), torque_noise=0.006, stated=1.0,
        ),
    )  # fmt: skip


def balanced_cases() -> tuple[RobotCase, ...]:
    """The balanced arm: friction that falls with speed, and nothing but small dry friction."""
    falling = stribeck_friction("raise", static=2.4, coulomb=1.1, velocity=0.12)
    return (
        RobotCase(
            name="balanced-1", robot=balanced(), seed=4606, faults=(falling,), background=0.01, rate=250, seconds=10,
            course=Course((0.25, 0.35), (-0.05, 0.2), (0.15, 1.4)), clock="late", side="link", position_noise=(4e-5, 4e-5),
            torque_noise=0.006, stated=1.0,
        ),
        RobotCase(
            name="balanced-2", robot=balanced(), seed=4707, background=0.015, rate=200, seconds=10,
            course=Course((0.25, 0.35), (0.05, 0.1), (0.2, 1.6)), plans=("multisine", "turns", "mixed"), clock="stamped", side="link",
            position_noise=(5e-5, 5e-5), torque_noise=0.01, stated=0.5,
        ),
    )  # fmt: skip


def stage_cases() -> tuple[RobotCase, ...]:
    """The cart with its pendulum: dry friction of the pivot."""
    return (
        RobotCase(
            name="stage-1", robot=stage(), seed=4808, faults=(coulomb_friction("pivot", limit=0.012),), background=0.012, rate=200,
            seconds=12, course=Course((0.07, 0), (0, 0), (0.25, 1.8), duration=0.4, rest=1.4), clock="late", side="link",
            position_noise=(4e-5, 4e-4), stated=1.0, counts=(None, 2 * np.pi / 4096),
        ),
    )  # fmt: skip


def ankle_cases() -> tuple[RobotCase, ...]:
    """The ankle: an elastic drive."""
    count = 2 * np.pi / 2**14
    return (
        RobotCase(
            name="ankle-1", robot=ankle(), seed=4909, faults=(joint_compliance("pitch", stiffness=640.0, damping=2.0),),
            background=0.015, rate=250, seconds=9, course=Course((0.09, 0.08), (0.02, -0.01), (0.2, 2.6)), clock="exact", side="link",
            position_noise=(1.5e-4, 1.5e-4), stated=1.0, counts=(count, count),
        ),
    )  # fmt: skip


def robot_cases() -> dict[str, RobotCase]:
    """All cases by their names."""
    groups = (finger_cases, crane_cases, wrist_cases, balanced_cases, stage_cases, ankle_cases)
    return {case.name: case for group in groups for case in group()}
