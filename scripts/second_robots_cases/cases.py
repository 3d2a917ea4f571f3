"""The fourteen cases: which robot, what is wrong with it, how it is moved, and what its maker states.

README.md in this folder tells of each case what is right to say of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Literal

from second_robots_cases.faults import (
    Fault,
    delay,
    elastic_joint,
    encoder_offset,
    friction,
    hose_to_room,
    nothing,
    payload,
    rotor,
    saturation,
    servo_gain,
    tilted_base,
)
from second_robots_cases.references import Plan
from second_robots_cases.robots import (
    Robot,
    bench_arm,
    gantry,
    hopper_leg,
    pan_tilt_head,
    scara,
    two_link,
)


@dataclass(frozen=True)
class PlantedEffect:
    """An effect that is really there, by the names of the diagnosis.

    Attributes:
        name: Of the effect.
        where: Joint, body or actuator.
        parameters: True values in SI units.
    """

    name: str
    where: str
    parameters: Mapping[str, float | bool | Sequence[float]]


@dataclass(frozen=True)
class RobotCase:
    """A case before it is simulated.

    Attributes:
        name: Of its folder; it also seeds the random numbers of the case.
        robot: The robot.
        fault: What is wrong with it.
        effects: The same by the names of the diagnosis.
        kind: One effect, two, one that the catalogue of the diagnosis lacks (foreign), or none.
        coulomb: Coulomb friction of each joint that is there besides [N m or N].
        equivalent: Effects that cannot be told from the true one.
        plans: Motions of the two records for identification and of the one for validation.
        highest_frequency: Of the multisines [Hz]; that of the robot where zero.
        step: Time step of the integration [s].
        noise_stated: Whether the noise is stated.
        hold_stated: Whether it is stated that commands are held over a sample.
        motor_side: Whether the encoders are stated to be on the motor side.
        alike: Type of the servos, of which it is stated that they deviate together; none where empty.
        delay_stated: Whether the delays of the drives are among the uncertain parameters.
    """

    name: str
    robot: Robot
    fault: Fault
    effects: tuple[PlantedEffect, ...]
    coulomb: tuple[float, ...]
    kind: Literal["single", "double", "foreign", "none"] = "single"
    _: KW_ONLY
    equivalent: tuple[str, ...] = ()
    plans: tuple[Plan, Plan, Plan] = ("multisine", "moves", "multisine")
    highest_frequency: float = 0.0
    step: float = 1e-4
    noise_stated: bool = True
    hold_stated: bool = True
    motor_side: bool = False
    alike: str = ""
    delay_stated: bool = False


def _effect(name: str, where: str, **parameters: float | bool | Sequence[float]) -> tuple[PlantedEffect]:
    return (PlantedEffect(name, where, parameters),)


def pan_tilt_cases() -> tuple[RobotCase, ...]:
    """The camera head: a stiff bearing, and a base that is not level."""
    return (
        RobotCase(
            "ptz-1", pan_tilt_head(), friction((0.30, 0.0)), _effect("coulomb_friction", "pan", limit=0.30), (0.0, 0.012),
            plans=("multisine", "moves", "sines"), noise_stated=False,
        ),
        RobotCase(
            "ptz-2", pan_tilt_head(kp=(9.0, 9.0), camera_x=0.09), tilted_base(0.17, -0.12),
            _effect("base_tilt", "base", tilt_x_rad=0.17, tilt_y_rad=-0.12), (0.006, 0.008), "foreign",
        ),
    )  # fmt: skip


def two_link_cases() -> tuple[RobotCase, ...]:
    """The vertical arm: friction at both joints, friction that grows with the torque, an encoder that is offset."""
    both = (
        *_effect("coulomb_friction", "shoulder", limit=1.1), *_effect("damping_error", "shoulder", added=0.95),
        *_effect("coulomb_friction", "elbow", limit=0.45), *_effect("damping_error", "elbow", added=0.50),
    )  # fmt: skip
    return (
        RobotCase(
            "vee-1", two_link(), friction((1.1, 0.45), viscous=(0.95, 0.50)), both, (0.0, 0.0), "double",
        ),
        RobotCase(
            "vee-2", two_link(), friction((0.15, 0.0), load=(0.13, 0.0)),
            _effect("load_dependent_friction", "shoulder", limit_0=0.15, mu=0.13, of_actuator=1), (0.0, 0.03),
            noise_stated=False, hold_stated=False,
        ),
        RobotCase(
            "vee-3", two_link(), encoder_offset(0, 0.095), _effect("position_offset", "shoulder", offset=0.095), (0.10, 0.03),
            plans=("moves", "multisine", "multisine"),
        ),
    )  # fmt: skip


def scara_cases() -> tuple[RobotCase, ...]:
    """The SCARA robot: an elastic gear, a rotor that is larger than stated, a hose from the room to the arm."""
    anchor, attached = (-0.12, 0.28, 0.55), (0.20, 0.0, 0.06)
    hose = hose_to_room(1, anchor=anchor, attached=attached, stiffness=32.0, free_length=0.30)
    return (
        RobotCase(
            "scar-1", scara(), elastic_joint(1, stiffness=170.0, damping=0.25),
            _effect("joint_compliance", "axis2", stiffness=170.0, damping=0.25), (0.25, 0.0, 0.9, 0.02),
            motor_side=True, highest_frequency=4.0,
        ),
        RobotCase(
            "scar-2", scara(), rotor(1, 0.16 * 2.7),
            _effect("armature_error", "axis2", added=0.16 * 1.7, relative_error=1.7), (0.25, 0.06, 0.9, 0.02),
            noise_stated=False, hold_stated=False, highest_frequency=2.5,
        ),
        RobotCase(
            "scar-3", scara(), hose,
            _effect("hose_to_the_room", "arm_2", stiffness=32.0, free_length=0.30, anchor=anchor, attached=attached),
            (0.25, 0.06, 0.9, 0.02), "foreign",
        ),
    )  # fmt: skip


def leg_cases() -> tuple[RobotCase, ...]:
    """The leg: play in the gear of the knee, a hip that is too weak."""
    return (
        RobotCase(
            "hop-1", hopper_leg(), elastic_joint(1, stiffness=1200.0, damping=0.8, half_clearance=0.05),
            _effect("backlash", "knee", half_clearance=0.05, stiffness=1200.0, contact_damping=0.8), (0.03, 0.0, 0.01),
            step=5e-5, motor_side=True,
        ),
        RobotCase(
            "hop-2", hopper_leg(), saturation(0, 3.2), _effect("actuator_saturation", "hip_servo", limit=3.2), (0.0, 0.05, 0.02),
            plans=("moves", "multisine", "moves"), noise_stated=False, highest_frequency=2.2,
        ),
    )  # fmt: skip


def bench_arm_cases() -> tuple[RobotCase, ...]:
    """The desktop arm: a payload that the model lacks, one servo that is too soft."""
    return (
        RobotCase(
            "dsk-1", bench_arm(), payload(4, 0.16, (0.10, 0.012, 0.0)),
            _effect("mass_error", "gripper", payload=0.16, at_x=0.10, at_y=0.012, at_z=0.0, at_site=True),
            (0.010, 0.012, 0.010, 0.006, 0.005), plans=("multisine", "moves", "moves"), noise_stated=False, alike="SV-90",
        ),
        RobotCase(
            "dsk-2", bench_arm(), servo_gain(2, 0.62), _effect("servo_gain_error", "elbow_servo", relative_error=-0.38),
            (0.010, 0.008, 0.0, 0.006, 0.005),
        ),
    )  # fmt: skip


def gantry_cases() -> tuple[RobotCase, ...]:
    """The gantry: a target that arrives late, and nothing wrong at all."""
    return (
        RobotCase(
            "gan-1", gantry(), delay(1, 0.036), _effect("actuator_delay", "y_servo", delay_s=0.028), (1.5, 0.0, 0.008),
            equivalent=("position_delay", "position_delay@y"), noise_stated=False, delay_stated=True,
        ),
        RobotCase("gan-2", gantry(), nothing, (), (0.0, 0.0, 0.0), "none"),
    )  # fmt: skip


def robot_cases() -> dict[str, RobotCase]:
    """All cases by their names."""
    groups = (pan_tilt_cases, two_link_cases, scara_cases, leg_cases, bench_arm_cases, gantry_cases)
    return {case.name: case for group in groups for case in group()}
