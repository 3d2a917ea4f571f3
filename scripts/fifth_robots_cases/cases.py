"""The nine cases: which robot, how it is moved and logged, what is wrong with it, and what its maker states.

README.md in this folder tells of each case what is right to say of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from fourth_robots_cases.cases import BasicCase
from fourth_robots_cases.faults import Fault, backlash, joint_compliance, one_sided_stop

from fifth_robots_cases.faults import (
    actuator_deadband,
    base_tilt,
    cogging,
    mass_error,
    position_delay,
    rotor,
    stribeck_friction,
)
from fifth_robots_cases.references import Motion, chirp, gait, hold, moves, multisine, slow
from fifth_robots_cases.robots import (
    Robot,
    exoleg,
    gantry,
    hexleg,
    pantilt,
    shoulder,
    springarm,
    surgwrist,
)

TURN = 2 * np.pi
"""[rad]."""
SERVO_COUNT = TURN / 4096
"""One count of the servos of the hexapod [rad], to which their goals are rounded as well."""


class Plan(NamedTuple):
    """How a record is made."""

    seconds: float
    """Its duration [s]."""
    joints: tuple[Motion, ...]
    """Motion of each joint (n)."""
    moving: bool = False
    """Whether it begins in motion; at rest otherwise."""


@dataclass(frozen=True, kw_only=True)
class RobotCase(BasicCase):
    """A case before it is simulated.

    Attributes:
        background: Dry friction at every joint [N m or N].
        plans: Of its records; the last one is for validation.
        counts: One count of each encoder [rad or m], which is stated.
        speed_noise: Standard deviation of the noise of each speed [rad/s]; None where speeds are not logged.
        load_noise: That of each current or torque [A or N m]; servos log goals, which have none.
        load_step: What currents are rounded to [A], which is not stated; None where they are not.
        goal_step: What goals are rounded to [rad]; None where they are not.
        ticks: Ticks of the controller a sample.
        held: Whether goals and currents are stated to be held between samples.
        tells_motion: Whether it is stated that the records begin in motion.
        longest_step: Longest step of the simulation [s].
    """

    robot: Robot
    background: tuple[float, ...]
    plans: tuple[Plan, ...]
    counts: tuple[float, ...]
    speed_noise: tuple[float, ...] | None = None
    load_noise: tuple[float, ...] | None = None
    load_step: float | None = None
    goal_step: float | None = None
    ticks: int = 1
    held: bool = True
    tells_motion: bool = False
    longest_step: float = 2.5e-4

    @property
    def records(self) -> dict[str, Plan]:
        """Plans by the names of the records."""
        numbered = ["identification", *(f"identification_{k}" for k in range(2, len(self.plans)))]
        return dict(zip((*numbered, "validation"), self.plans, strict=True))


def hexleg_cases() -> tuple[RobotCase, ...]:
    """The leg of the hexapod: play of a servo, and nothing but small dry friction."""
    return (
        RobotCase(
            name="fifth_hexleg_1", robot=hexleg(0.03), seed=1, faults=(backlash("tibia", gap=0.040, stiffness=140.0, damping=0.12),),
            background=(0.004, 0.003, 0.003), rate=100, side="link", position_noise=(4e-4,) * 3, stated=1.0,
            counts=(SERVO_COUNT,) * 3, goal_step=SERVO_COUNT, longest_step=1e-4,
            plans=(
                Plan(15, (multisine(0, 0.6, 0.2, 1.6), multisine(0.25, 0.4, 0.2, 1.5), multisine(0, 0.6, 0.2, 1.8))),
                Plan(12, (hold(0.1), hold(0.2), chirp(0.05, 0.5, 0.15, 2.2))),
                Plan(14, (moves(0, 0.7, 1.2), moves(0.2, 0.45, 1.3), moves(0, 0.6, 1.6))),
            ),
        ),
        RobotCase(
            name="fifth_hexleg_2", robot=hexleg(0.0), seed=2, background=(0.006, 0.002, 0.004), rate=50, side="link",
            position_noise=(1.8e-3,) * 3, stated=0.5, counts=(SERVO_COUNT,) * 3, goal_step=SERVO_COUNT,
            plans=(
                Plan(20, (multisine(0, 0.6, 0.15, 1.5), multisine(0.2, 0.45, 0.15, 1.4), multisine(0.1, 0.6, 0.15, 1.7))),
                Plan(18, (moves(0, 0.7, 1.0), moves(0.2, 0.4, 1.2), moves(0.1, 0.6, 1.1)), moving=True),
                Plan(20, (chirp(0, 0.5, 0.2, 1.6), multisine(0.25, 0.4, 0.2, 1.6), moves(0.1, 0.7, 1.3)), moving=True),
            ),
        ),
    )  # fmt: skip


def gantry_case(
    name: str, seed: int, fault: Fault, stated: float | None, background: tuple[float, ...], plans: tuple[Plan, ...]
) -> RobotCase:  # fmt: skip
    """A case of the gantry; its background is in N and N m."""
    count = TURN / 65536
    return RobotCase(
        name=name, robot=gantry(), seed=seed, faults=(fault,), background=background, rate=250, side="link",
        position_noise=(3e-6, 3e-6, 6e-5, 6e-5), stated=stated, counts=(5e-6, 5e-6, count, count),
        load_noise=(0.006, 0.006, 0.004, 0.004), load_step=1 / 1024, plans=plans,
    )  # fmt: skip


def gantry_cases() -> tuple[RobotCase, ...]:
    """The gantry: a spindle that runs in its head, and ripple of its first slide."""
    yaw, pitch = multisine(0.2, 0.8, 0.2, 1.9), multisine(0.1, 0.7, 0.3, 2.2)
    return (
        gantry_case(
            "fifth_gantry_1", 3, rotor("head", "pitch", momentum=(0.12, 0, 0)), 1.0, (0.15, 0.15, 0.008, 0.006),
            (
                Plan(14, (
                    multisine(0, 0.2, 0.2, 1.8), multisine(0, 0.1, 0.2, 1.8),
                    multisine(0, 0.7, 0.2, 2.2), multisine(0.2, 0.6, 0.2, 2.4),
                )),
                Plan(12, (moves(0, 0.25, 1.2), moves(0, 0.12, 1.2), moves(0, 1.0, 1.4), moves(0.2, 0.8, 1.5))),
                Plan(14, (multisine(0.05, 0.2, 0.15, 1.5), moves(0, 0.12, 1.0), yaw, pitch)),
            ),
        ),
        gantry_case(
            "fifth_gantry_2", 4, cogging("x", amplitude=8.0, second=1.0, pitch=0.030, phase=0.8), None, (0.3, 0.12, 0.003, 0.004),
            (
                Plan(14, (
                    multisine(0, 0.12, 0.15, 1.4), multisine(0, 0.1, 0.2, 1.6),
                    multisine(0, 0.7, 0.2, 2.0), multisine(0.2, 0.6, 0.2, 2.2),
                )),
                Plan(16, (slow(0, 0.22, 0.08), hold(0), moves(0, 0.8, 1.0), hold(0.2))),
                Plan(14, (moves(0.02, 0.2, 1.0), moves(0, 0.12, 1.0), yaw, pitch)),
            ),
        ),
    )  # fmt: skip


def pantilt_cases() -> tuple[RobotCase, ...]:
    """The camera's head, whose base leans."""
    return (
        RobotCase(
            name="fifth_pantilt_1", robot=pantilt(), seed=5, faults=(base_tilt("pan", tilt=4.5, towards=115.0),),
            background=(0.009, 0.009), rate=200, side="link", position_noise=(2.4e-4,) * 2, stated=0.5, counts=(TURN / 32768,) * 2,
            speed_noise=(0.008, 0.008),
            plans=(
                Plan(20, (multisine(0, 1.3, 0.1, 0.9), multisine(0.1, 0.6, 0.15, 1.2))),
                Plan(20, (moves(0, 1.8, 0.5), moves(0.1, 0.7, 0.7)), moving=True),
                Plan(15, (slow(0, 1.5, 0.1), chirp(0.1, 0.5, 0.1, 1.2))),
                Plan(20, (moves(0.3, 1.6, 0.6), multisine(0.15, 0.7, 0.15, 1.3))),
            ),
        ),
    )  # fmt: skip


def exoleg_cases() -> tuple[RobotCase, ...]:
    """The leg of the exoskeleton: a stop of the knee, and friction of the hip that falls with speed."""
    stop = one_sided_stop("knee", place=-0.15, stiffness=180.0, damping=2.0, side=1)
    return (
        RobotCase(
            name="fifth_exoleg_1", robot=exoleg(), seed=6,
            faults=(stop, stribeck_friction("hip", coulomb=1.2, peak=1.7, velocity=0.13)), background=(0.08, 0.07, 0.009),
            rate=500, side="link", position_noise=(8e-5,) * 3, stated=1.0, counts=(TURN / 65536,) * 3, load_noise=(0.06, 0.05, 0.03),
            ticks=4, held=False, tells_motion=True,
            plans=(
                Plan(12, (gait(0.1, 0.45, 0.7, 0.0), gait(-0.5, 0.45, 0.7, 1.9), gait(0, 0.25, 0.7, 3.0)), moving=True),
                Plan(16, (slow(0.1, 0.4, 0.12), gait(-0.55, 0.45, 0.31, 1.9), multisine(0, 0.2, 0.1, 1.0)), moving=True),
                Plan(
                    10, (multisine(0.1, 0.4, 0.2, 1.6), multisine(-0.55, 0.5, 0.2, 1.9), multisine(0, 0.25, 0.2, 2.2)),
                    moving=True,
                ),
                Plan(12, (multisine(0.1, 0.4, 0.12, 0.9), gait(-0.5, 0.47, 0.5, 1.2), gait(0.02, 0.22, 0.8, 2.0)), moving=True),
            ),
        ),
    )  # fmt: skip


def springarm_cases() -> tuple[RobotCase, ...]:
    """The arm with a spring: a payload, and a position that is logged late."""
    arm = springarm()
    payload = mass_error("forearm", "elbow", mass=0.16, place=arm.links[2].tip)
    return (
        RobotCase(
            name="fifth_springarm_1", robot=arm, seed=7, faults=(payload, position_delay("yaw", late=0.011)),
            background=(0.06, 0.045, 0.016), rate=200, side="link", position_noise=(1.2e-4,) * 3, stated=None,
            counts=(TURN / 16384,) * 3, load_noise=(0.02, 0.025, 0.012),
            plans=(
                Plan(15, (multisine(0, 0.7, 0.2, 1.7), multisine(0.1, 0.5, 0.2, 1.5), multisine(0.2, 0.7, 0.2, 1.9))),
                Plan(15, (moves(0, 1.0, 1.0), moves(0.1, 0.6, 1.0), moves(0.2, 0.8, 1.2))),
                Plan(15, (chirp(0, 0.5, 0.2, 1.8), multisine(0.15, 0.55, 0.15, 1.6), moves(0.2, 0.8, 1.2))),
            ),
        ),
    )  # fmt: skip


def shoulder_cases() -> tuple[RobotCase, ...]:
    """The humanoid's shoulder: an elastic drive of the elbow."""
    return (
        RobotCase(
            name="fifth_shoulder_1", robot=shoulder(), seed=8, faults=(joint_compliance("elbow", stiffness=45.0, damping=0.08),),
            background=(0.05, 0.025, 0.008, 0.02), rate=400, side="motor", position_noise=(5e-5,) * 4, stated=1.0,
            counts=(TURN / 65536,) * 4, load_noise=(0.01, 0.01, 0.006, 0.006),
            plans=(
                Plan(12, (
                    multisine(0.2, 0.5, 0.2, 1.6), multisine(0.2, 0.4, 0.2, 1.6),
                    multisine(0, 0.5, 0.2, 2.2), multisine(0.7, 0.5, 0.3, 6.0),
                )),
                Plan(10, (moves(0.2, 0.6, 1.2), moves(0.25, 0.5, 1.2), moves(0, 0.6, 1.4), moves(0.7, 0.7, 2.2)), moving=True),
                Plan(
                    12, (
                        moves(0.2, 0.5, 1.0), multisine(0.2, 0.4, 0.2, 1.7),
                        multisine(0, 0.5, 0.2, 2.4), multisine(0.7, 0.5, 0.4, 5.0),
                    ), moving=True,
                ),
            ),
        ),
    )  # fmt: skip


def surgwrist_cases() -> tuple[RobotCase, ...]:
    """The wrist of the instrument: a dead band of a servo."""
    return (
        RobotCase(
            name="fifth_surgwrist_1", robot=surgwrist(), seed=9, faults=(actuator_deadband("yaw_drive", "yaw", half=0.018),),
            background=(0.0011, 0.0008, 0.0005, 0.00025), rate=300, side="motor", position_noise=(1.5e-4,) * 4, stated=1.0,
            counts=(TURN / 20000,) * 4, goal_step=1e-4,
            plans=(
                Plan(12, (
                    multisine(0, 0.9, 0.3, 3), multisine(0, 0.6, 0.3, 3), multisine(0, 0.6, 0.3, 3), multisine(0.3, 0.4, 0.3, 3),
                )),
                Plan(12, (moves(0, 1.0, 1.6), moves(0, 0.7, 1.8), moves(0, 0.7, 1.8), moves(0.3, 0.4, 2.0))),
                Plan(12, (moves(0, 0.9, 1.6), multisine(0, 0.6, 0.3, 3.3), multisine(0, 0.5, 0.2, 2.6), moves(0.3, 0.4, 2.0))),
            ),
        ),
    )  # fmt: skip


def robot_cases() -> dict[str, RobotCase]:
    """All cases by their names."""
    groups = (
        hexleg_cases, gantry_cases, pantilt_cases, exoleg_cases, springarm_cases, shoulder_cases, surgwrist_cases,
    )  # fmt: skip
    return {case.name: case for group in groups for case in group()}
