"""The ten cases: which robot, how it is driven and moved, what is wrong with it, and what its maker states.

README.md in this folder tells of each case what is right to say of it.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Literal

from third_robots_cases.faults import (
    Fault,
    actuator_delay,
    actuator_saturation,
    backlash,
    belt_ripple,
    coulomb_friction,
    joint_compliance,
    load_dependent_friction,
    payload,
    position_offset,
    servo_gain_error,
)
from third_robots_cases.references import Plan
from third_robots_cases.robots import Drive, Robot, boom, gantry, hung_leg, palletiser, slide_scara

TWICE: tuple[Plan, Plan, Plan] = ("multisine", "moves", "multisine")
"""Plans of cases that are judged by a multisine, as one of the records for identification is."""


@dataclass(frozen=True)
class RobotCase:
    """A case before it is simulated.

    Attributes:
        name: Of its folder.
        robot: The robot.
        drive: How it is driven.
        rate: Samples a second [Hz].
        seed: Of all its random numbers.
        faults: What is wrong with it.
        background: Dry friction at every joint, over the root mean square of its torque or force.
        plans: Motions of the two records for identification and of the one for validation.
        seconds: Duration of a record [s].
        scale: Amplitude in each record over that of the robot.
        speed: Highest frequency in each record over that of the robot; moves take less time by its root.
        centre: Middle of the motions [rad or m]; that of the robot where None.
        position_noise: Standard deviation of the noise of the positions [rad or m].
        torque_noise: That of the noise of torques or currents, over their root mean square.
        noise_stated: Whether the noise is stated.
        quantised: Whether positions are rounded to encoder counts; the counts are stated.
        velocities: Whether velocities are logged as well.
        side: Side of the gear on which positions are logged, which is stated; drives read the motor side.
    """

    name: str
    robot: Robot
    drive: Drive
    rate: int
    seed: int
    faults: tuple[Fault, ...] = ()
    _: KW_ONLY
    background: float = 0.008
    plans: tuple[Plan, Plan, Plan] = ("multisine", "chirp", "moves")
    seconds: float = 12.0
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    speed: tuple[float, float, float] = (1.0, 1.0, 1.0)
    centre: tuple[float, ...] | None = None
    position_noise: float = 2e-5
    torque_noise: float = 0.003
    noise_stated: bool = True
    quantised: bool = False
    velocities: bool = False
    side: Literal["motor", "link"] = "motor"

    @property
    def kind(self) -> Literal["single", "double", "foreign", "none"]:
        """One effect, two, one that the catalogue of the diagnosis lacks (foreign), or none."""
        if not self.faults:
            return "none"
        if not all(fault.named for fault in self.faults):
            return "foreign"
        return "double" if len(self.faults) > 1 else "single"


def scara_cases() -> tuple[RobotCase, ...]:
    """The SCARA robot: dry friction at one joint, and a servo that is weaker than stated."""
    return (
        RobotCase(
            "slide-1", slide_scara(), "torque", 250, 11, (coulomb_friction("j2", limit=1.7),), noise_stated=False,
        ),
        RobotCase(
            "slide-2", slide_scara(), "servo", 250, 17, (actuator_saturation("j1_servo", limit=29.0),), background=0.03,
            plans=TWICE, scale=(0.306, 1.36, 0.52), speed=(1.25, 1.25, 1.25), position_noise=2e-4,
        ),
    )  # fmt: skip


def leg_cases() -> tuple[RobotCase, ...]:
    """The hung leg: a gap in the gear of the knee, and a hip servo that is too soft."""
    return (
        RobotCase(
            "hung-1", hung_leg(), "servo", 500, 12, (backlash("knee", gap=0.032),), background=0.03, plans=TWICE, seconds=10.0,
            centre=(0.55, 0.60), position_noise=5e-4, side="link",
        ),
        RobotCase(
            "hung-2", hung_leg(), "servo", 400, 15, (servo_gain_error("hip_servo", factor=0.75),), background=0.04,
            plans=("chirp", "multisine", "moves"), seconds=10.0, position_noise=5e-4,
        ),
    )  # fmt: skip


def palletiser_cases() -> tuple[RobotCase, ...]:
    """The palletiser: a payload that the model lacks, and an elastic gear."""
    return (
        RobotCase(
            "pal-1", palletiser(), "current", 250, 13, (payload("gripper", mass=1.5),), background=0.012, plans=TWICE,
        ),
        RobotCase(
            "pal-2", palletiser(), "torque", 500, 20, (joint_compliance("elbow", stiffness=14500.0, zeta=0.04),),
            plans=("multisine", "chirp", "multisine"), seconds=10.0, scale=(0.3, 0.12, 0.26), speed=(4.5, 4.5, 4.5),
        ),
    )  # fmt: skip


def boom_cases() -> tuple[RobotCase, ...]:
    """The boom: a target that arrives late, and friction that grows with the load beside an encoder that is offset."""
    both = load_dependent_friction("stick", limit_0=1.5, mu=0.13), position_offset("boom", offset=0.07)
    return (
        RobotCase(
            "boom-1", boom(), "servo", 125, 14, (actuator_delay("boom_servo", samples=2.5, rate=125),), background=0.025,
            seconds=14.0, speed=(1.5, 1.5, 1.5), position_noise=3e-4,
        ),
        RobotCase("boom-2", boom(), "torque", 200, 19, both, seconds=14.0, velocities=True),
    )  # fmt: skip


def gantry_cases() -> tuple[RobotCase, ...]:
    """The gantry: nothing but small friction and encoder counts, and a belt that acts on two joints by the positions of both."""
    belt = belt_ripple(amplitude=11.0, pitch=0.09, phase=0.7, ratio=0.85)
    return (
        RobotCase(
            "gantry-1", gantry(), "torque", 200, 16, background=0.03, speed=(1.0, 1.0, 1.8), noise_stated=False, quantised=True,
        ),
        RobotCase(
            "gantry-2", gantry(), "torque", 500, 18, (belt,), background=0.007, seconds=10.0, speed=(1.0, 1.0, 1.8), velocities=True,
        ),
    )  # fmt: skip


def robot_cases() -> dict[str, RobotCase]:
    """All cases by their names."""
    groups = (boom_cases, gantry_cases, leg_cases, palletiser_cases, scara_cases)
    return {case.name: case for group in groups for case in group()}
