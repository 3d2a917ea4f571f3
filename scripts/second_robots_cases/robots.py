"""Nominal robots: their links, drives, sensors and ranges of motion.

Masses, inertias and gains are of the size of commercial machines of the kind, but describe no particular product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Vector = tuple[float, float, float]
TURN = 2 * np.pi / 4096
"""One count of an encoder of 4096 counts a turn [rad]."""
UNITS = {"rad": 1.0, "deg": 180 / np.pi, "mm": 1000.0}
"""Units of logged positions, and how many of them make one radian or metre."""


@dataclass(frozen=True)
class Servo:
    """A position servo: torque = kp (target - position) - kv velocity, within a limit.

    Attributes:
        kp: Proportional gain [N m/rad or N/m].
        kv: Velocity gain [N m s/rad or N s/m].
        limit: Largest torque or force [N m or N].
        delay: Stated delay of the target [s].
    """

    kp: float
    kv: float
    limit: float
    delay: float = 0.0


@dataclass(frozen=True)
class Motor:
    """A motor that is commanded a torque or a current.

    Attributes:
        gear: Torque or force at the joint per unit of the command.
        limit: Largest command.
    """

    gear: float
    limit: float


@dataclass(frozen=True)
class Link:
    """A body, the joint by which its parent carries it, and the drive of that joint.

    Attributes:
        body: Name of the body.
        joint: Name of the joint.
        kind: Of the joint.
        axis: Unit axis of the joint in the frame of the parent.
        origin: Position of the joint in the frame of the parent [m].
        mass: Mass [kg].
        com: Centre of mass in the frame of the body [m].
        inertia: Principal inertias about the centre of mass, along the axes of the body [kg m^2].
        tip: End of the body, where the next one or a payload is attached [m].
        damping: Viscous friction [N m s/rad or N s/m].
        armature: Rotor inertia, reflected to the joint [kg m^2 or kg].
        drive: Drive of the joint.
        travel: Range of the joint [rad or m].
        radius: Of the capsule by which the body is drawn [m].
    """

    body: str
    joint: str
    kind: Literal["hinge", "slide"]
    axis: Vector
    origin: Vector
    mass: float
    com: Vector
    inertia: Vector
    tip: Vector
    damping: float
    armature: float
    drive: Servo | Motor
    travel: tuple[float, float]
    radius: float = 0.02


@dataclass(frozen=True)
class TorqueLog:
    """The measured torques or currents of a robot whose drives are commanded such, and the controller that commands them.

    Attributes:
        quantity: What is logged.
        unit: Its unit.
        noise: Its white noise, one for each joint.
        bandwidth: Bandwidth of the computed-torque controller [Hz].
        gears_uncertain: Whether the torque per unit of the command is known only within a stated uncertainty.
    """

    quantity: Literal["torque", "current"]
    unit: str
    noise: tuple[float, ...]
    bandwidth: float
    gears_uncertain: bool


@dataclass(frozen=True)
class Robot:
    """A robot as its maker describes it, and how it is moved and measured.

    Attributes:
        name: Of the model.
        rate: Samples a second.
        links: From the base to the tip.
        centre: Middle of the motion of each joint [rad or m].
        amplitude: Its largest distance from the middle [rad or m].
        resolution: One count of each encoder [rad or m].
        noise: Noise of each position before it is quantised [rad or m].
        units: Unit in which each position is logged.
        highest_frequency: Highest frequency of its multisines [Hz].
        torque: Log of torques or currents; none where the drives are position servos.
    """

    name: str
    rate: int
    links: tuple[Link, ...]
    centre: tuple[float, ...]
    amplitude: tuple[float, ...]
    resolution: tuple[float, ...]
    noise: tuple[float, ...]
    units: tuple[str, ...]
    highest_frequency: float
    torque: TorqueLog | None = None


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def pan_tilt_head(kp: tuple[float, float] = (14.0, 12.0), camera_x: float = 0.045) -> Robot:
    """A camera on a pan-tilt head with position servos of given gains [N m/rad]; the camera's centre of mass is `camera_x` [m] ahead."""
    links = (
        Link(
            "yoke", "pan", "hinge", Z, (0, 0, 0.15), 0.9, (0.012, 0, 0.05), (0.0022, 0.0019, 0.0021), (0, 0, 0.12),
            damping=0.12, armature=0.006, drive=Servo(kp[0], 0.35, 6), travel=(-2.5, 2.5),
        ),
        Link(
            "camera", "tilt", "hinge", Y, (0, 0, 0.12), 1.4, (camera_x, 0.006, 0.018), (0.0021, 0.0034, 0.0031), (0.14, 0, 0.02),
            damping=0.10, armature=0.005, drive=Servo(kp[1], 0.30, 6), travel=(-1.2, 1.2),
        ),
    )  # fmt: skip
    return Robot(
        "pan_tilt_head", 100, links, centre=(0.1, -0.1), amplitude=(1.2, 0.7), resolution=(TURN, TURN), noise=(4e-4, 4e-4),
        units=("deg", "deg"), highest_frequency=1.8,
    )  # fmt: skip


def two_link() -> Robot:
    """A vertical arm of two links with torque-controlled direct drives."""
    links = (
        Link(
            "upper_link", "shoulder", "hinge", Y, (0, 0, 1.1), 3.1, (0.002, 0, -0.16), (0.036, 0.036, 0.003), (0, 0, -0.36),
            damping=0.45, armature=0.055, drive=Motor(1.0, 80), travel=(-2, 2), radius=0.035,
        ),
        Link(
            "fore_link", "elbow", "hinge", Y, (0, 0.05, -0.36), 1.7, (0.003, 0, -0.14), (0.014, 0.014, 0.001), (0, 0, -0.31),
            damping=0.16, armature=0.018, drive=Motor(1.0, 30), travel=(-2.4, 2.4), radius=0.028,
        ),
    )  # fmt: skip
    return Robot(
        "two_link", 250, links, centre=(0.35, 0.4), amplitude=(0.9, 1.0), resolution=(TURN / 9, TURN / 9), noise=(1.2e-4, 1.2e-4),
        units=("rad", "rad"), highest_frequency=2.2, torque=TorqueLog("torque", "N m", (0.012, 0.006), 2.2, gears_uncertain=False),
    )  # fmt: skip


def scara() -> Robot:
    """A SCARA robot of four axes with geared motors, of which the currents are commanded and measured."""
    links = (
        Link(
            "arm_1", "axis1", "hinge", Z, (0, 0, 0.32), 5.2, (0.15, 0, 0.01), (0.02, 0.06, 0.06), (0.28, 0, 0),
            damping=2.2, armature=0.35, drive=Motor(6.5, 12), travel=(-2.2, 2.2), radius=0.05,
        ),
        Link(
            "arm_2", "axis2", "hinge", Z, (0.28, 0, 0.05), 3.4, (0.09, 0.004, 0.03), (0.012, 0.028, 0.028), (0.22, 0, 0),
            damping=1.1, armature=0.16, drive=Motor(4.2, 10), travel=(-2.4, 2.4), radius=0.04,
        ),
        Link(
            "quill", "lift", "slide", Z, (0.22, 0, 0), 1.1, (0, 0, -0.03), (0.004, 0.004, 0.0008), (0, 0, -0.2),
            damping=60.0, armature=9.0, drive=Motor(85.0, 6), travel=(-0.15, 0.15), radius=0.015,
        ),
        Link(
            "flange", "roll", "hinge", Z, (0, 0, -0.2), 0.5, (0.035, 0, -0.02), (0.0006, 0.0009, 0.0009), (0.07, 0, -0.03),
            damping=0.06, armature=0.012, drive=Motor(0.9, 6), travel=(-3, 3),
        ),
    )  # fmt: skip
    return Robot(
        "scara", 200, links, centre=(0.2, 0.5, 0.0, 0.3), amplitude=(0.8, 0.9, 0.08, 1.3),
        resolution=(TURN / 50, TURN / 50, 0.02 / 4096, TURN / 11), noise=(4e-5, 4e-5, 6e-6, 2e-4), units=("rad", "rad", "mm", "rad"),
        highest_frequency=2.2, torque=TorqueLog("current", "A", (0.004, 0.004, 0.004, 0.004), 2.0, gears_uncertain=True),
    )  # fmt: skip


def hopper_leg() -> Robot:
    """A leg of hip, knee and ankle with position servos, hung from a fixed hip."""
    links = (
        Link(
            "thigh", "hip", "hinge", Y, (0.1, 0, 0.75), 1.6, (0.004, 0, -0.085), (0.0085, 0.0088, 0.0012), (0, 0, -0.22),
            damping=0.30, armature=0.012, drive=Servo(75.0, 1.5, 35), travel=(-1.2, 1.6), radius=0.03,
        ),
        Link(
            "shank", "knee", "hinge", Y, (0, 0.03, -0.22), 0.8, (0.003, 0, -0.10), (0.0042, 0.0043, 0.0004), (0, 0, -0.22),
            damping=0.25, armature=0.012, drive=Servo(60.0, 1.2, 35), travel=(-2.0, 0.9),
        ),
        Link(
            "foot", "ankle", "hinge", Y, (0, 0, -0.22), 0.35, (0.045, 0, -0.03), (0.0002, 0.0007, 0.0007), (0.11, 0, -0.04),
            damping=0.10, armature=0.004, drive=Servo(25.0, 0.4, 12), travel=(-1.0, 1.0), radius=0.015,
        ),
    )  # fmt: skip
    return Robot(
        "hopper_leg", 200, links, centre=(0.45, -0.55, 0.1), amplitude=(0.5, 0.55, 0.5), resolution=(TURN / 6,) * 3,
        noise=(3e-4,) * 3, units=("rad",) * 3, highest_frequency=2.0,
    )  # fmt: skip


def bench_arm() -> Robot:
    """A desktop arm of five hobby servos."""
    links = (
        Link(
            "column", "base_yaw", "hinge", Z, (0, 0, 0.06), 0.24, (0.012, 0, 0.022), (0.00014, 0.00014, 0.00012), (0.02, 0, 0.055),
            damping=0.24, armature=0.022, drive=Servo(17.5, 0.32, 3.4), travel=(-1.6, 1.6), radius=0.03,
        ),
        Link(
            "link_a", "shoulder", "hinge", Y, (0.02, 0, 0.055), 0.15, (0.01, 0.001, 0.065), (0.00021, 0.00022, 0.00004),
            (0.02, 0, 0.125), damping=0.30, armature=0.024, drive=Servo(18.2, 0.34, 3.4), travel=(-1.2, 1.2),
        ),
        Link(
            "link_b", "elbow", "hinge", Y, (0.02, 0, 0.125), 0.12, (0.062, -0.001, 0), (0.00003, 0.00019, 0.00019), (0.135, 0, 0),
            damping=0.28, armature=0.021, drive=Servo(16.4, 0.30, 3.4), travel=(-1.4, 1.6),
        ),
        Link(
            "wrist_block", "wrist", "hinge", Y, (0.135, 0, 0), 0.085, (0.024, 0, 0.002), (0.00002, 0.00004, 0.00004), (0.055, 0, 0),
            damping=0.22, armature=0.019, drive=Servo(16.9, 0.29, 3.4), travel=(-1.4, 1.7),
        ),
        Link(
            "gripper", "roll", "hinge", X, (0.055, 0, 0), 0.11, (0.04, 0.004, 0.001), (0.00003, 0.0001, 0.0001), (0.10, 0.012, 0),
            damping=0.19, armature=0.017, drive=Servo(16.0, 0.28, 3.4), travel=(-1.7, 1.7),
        ),
    )  # fmt: skip
    return Robot(
        "bench_arm", 50, links, centre=(0, 0.05, 0.2, 0.2, 0), amplitude=(0.9, 0.55, 0.7, 0.8, 1.1), resolution=(TURN,) * 5,
        noise=(4e-4,) * 5, units=("rad",) * 5, highest_frequency=1.2,
    )  # fmt: skip


def gantry() -> Robot:
    """A gantry of two linear axes and a swivelling tool, with position servos whose targets arrive one sample late, as stated."""
    screw = 0.04 / 4096 * 2
    links = (
        Link(
            "bridge", "x", "slide", X, (0, 0, 0.8), 7.5, (0, 0.02, 0), (0.3, 0.05, 0.3), (0, 0.3, 0),
            damping=28.0, armature=2.4, drive=Servo(9000.0, 280.0, 600, 0.008), travel=(-0.4, 0.4), radius=0.03,
        ),
        Link(
            "carriage", "y", "slide", Y, (0, 0, 0.05), 3.2, (0.01, 0, -0.02), (0.012, 0.012, 0.01), (0, 0, -0.1),
            damping=19.0, armature=1.6, drive=Servo(6500.0, 170.0, 400, 0.008), travel=(-0.3, 0.3), radius=0.03,
        ),
        Link(
            "tool", "swivel", "hinge", Y, (0.02, 0, -0.1), 0.9, (0.012, 0, -0.11), (0.005, 0.005, 0.0007), (0, 0, -0.22),
            damping=0.11, armature=0.009, drive=Servo(24.0, 0.55, 15, 0.008), travel=(-1.3, 1.3),
        ),
    )  # fmt: skip
    return Robot(
        "gantry", 125, links, centre=(0, 0, 0.1), amplitude=(0.22, 0.17, 0.7), resolution=(screw, screw, TURN),
        noise=(3e-5, 3e-5, 4e-4), units=("mm", "mm", "deg"), highest_frequency=2.5,
    )  # fmt: skip
