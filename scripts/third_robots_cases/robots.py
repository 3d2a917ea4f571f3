"""The five nominal robots: links, drives and ranges of motion.

Sizes are those of machines of the kind, but of no particular product. Every robot can be driven by position servos, by torques or by
currents; a case chooses one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

Vector = tuple[float, float, float]
Drive = Literal["servo", "torque", "current"]
"""How a robot is driven, and which commands its log shows."""


class Servo(NamedTuple):
    """A position servo: torque = kp (target - position) - kv velocity, within a limit."""

    kp: float
    """Proportional gain [N m/rad or N/m]."""
    kv: float
    """Velocity gain [N m s/rad or N s/m]."""
    limit: float
    """Largest torque or force [N m or N]."""


class Motor(NamedTuple):
    """A motor that is commanded a torque, or a current through a gear."""

    limit: float
    """Largest torque or force at the joint [N m or N]."""
    gear: float = 1.0
    """Torque at the joint per unit of the current [N m/A]; used where currents are logged."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A body, the joint that carries it on the body before it, and the drives that this joint can have.

    Attributes:
        joint: Name of the joint.
        body: Name of the body.
        kind: Of the joint.
        axis: Unit axis of the joint in the frame of the body before.
        origin: Position of the joint in the frame of the body before [m].
        mass: Mass [kg].
        com: Centre of mass in the frame of the body [m].
        inertia: xx, yy, zz, xy, xz and yz about the centre of mass, along the axes of the body [kg m^2].
        tip: Far end of the body, where a payload sits [m].
        armature: Rotor inertia, reflected to the joint [kg m^2 or kg].
        damping: Viscous friction [N m s/rad or N s/m].
        travel: Range of the joint [rad or m].
        servo: Position servo.
        motor: Motor that takes torques or currents.
    """

    joint: str
    body: str
    kind: Literal["hinge", "slide"] = "hinge"
    axis: Vector
    origin: Vector
    mass: float
    com: Vector
    inertia: tuple[float, float, float, float, float, float]
    tip: Vector
    armature: float
    damping: float
    travel: tuple[float, float]
    servo: Servo
    motor: Motor


@dataclass(frozen=True)
class Robot:
    """A robot as its maker describes it, and how it is moved.

    Attributes:
        name: Of the model.
        links: From the base to the tip.
        centre: Middle of the motion of each joint [rad or m].
        amplitude: Largest distance from it [rad or m].
        lowest, highest: Band of its motions [Hz].
        spacing: Time from one move to the next, where it moves from point to point [s].
    """

    name: str
    links: tuple[Link, ...]
    centre: tuple[float, ...]
    amplitude: tuple[float, ...]
    lowest: float
    highest: float
    spacing: float

    def index(self, name: str) -> int:
        """Index of the link that has a joint, a body or a servo of a name.

        Raises:
            ValueError: There is none.
        """
        names = [(link.joint, link.body, f"{link.joint}_servo") for link in self.links]
        found = [k for k, own in enumerate(names) if name in own]
        if not found:
            raise ValueError(f"'{self.name}' has no joint, body or servo '{name}', but {names}")
        return found[0]


X, Y, Z, MINUS_Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)
TILT = np.radians(35)
"""Angle between the wrist axis of the gantry and the vertical [rad]."""


def boom() -> Robot:
    """An excavator-like chain of boom, stick and bucket, which moves in a vertical plane."""
    links = (
        Link(
            joint="boom", body="boom_arm", axis=MINUS_Y, origin=(0.15, 0, 0.45), mass=24.0, com=(0.52, 0, 0.06),
            inertia=(0.25, 2.6, 2.6, 0, -0.05, 0), tip=(1.1, 0, 0), armature=12.0, damping=40.0, travel=(-0.4, 1.2),
            servo=Servo(40000, 2450, 2500), motor=Motor(1500),
        ),
        Link(
            joint="stick", body="stick_arm", axis=MINUS_Y, origin=(1.1, 0, 0), mass=11.0, com=(0.30, 0, 0.02),
            inertia=(0.06, 0.62, 0.60, 0, 0, 0), tip=(0.75, 0, 0), armature=3.0, damping=12.0, travel=(-2.4, 0.2),
            servo=Servo(6000, 300, 700), motor=Motor(450),
        ),
        Link(
            joint="curl", body="bucket", axis=MINUS_Y, origin=(0.75, 0, 0), mass=6.5, com=(0.17, 0, -0.05),
            inertia=(0.09, 0.12, 0.10, 0, 0.01, 0), tip=(0.35, 0, -0.05), armature=0.6, damping=3.0, travel=(-1.8, 0.9),
            servo=Servo(700, 30, 160), motor=Motor(110),
        ),
    )  # fmt: skip
    return Robot("boom3", links, (0.42, -1.25, -0.45), (0.30, 0.50, 0.60), 0.12, 0.75, spacing=1.6)


def hung_leg() -> Robot:
    """A leg of thigh and shank, hung at its hip."""
    links = (
        Link(
            joint="hip", body="thigh", axis=MINUS_Y, origin=(0, 0.09, 1.0), mass=6.2, com=(0.01, 0.005, -0.16),
            inertia=(0.085, 0.083, 0.016, 0, 0.002, 0), tip=(0, 0, -0.38), armature=0.12, damping=1.2, travel=(-0.8, 1.4),
            servo=Servo(900, 45, 140), motor=Motor(120),
        ),
        Link(
            joint="knee", body="shank", axis=Y, origin=(0, 0, -0.38), mass=3.4, com=(0.02, 0, -0.20),
            inertia=(0.055, 0.054, 0.006, 0, 0.003, 0), tip=(0.03, 0, -0.36), armature=0.08, damping=0.8, travel=(-0.1, 2.2),
            servo=Servo(180, 8, 90), motor=Motor(80),
        ),
    )  # fmt: skip
    return Robot("leg2", links, (0.22, 0.75), (0.38, 0.50), 0.25, 1.5, spacing=1.1)


def gantry() -> Robot:
    """A gantry of three slides with a wrist whose axis leans by 35 degrees."""
    links = (
        Link(
            joint="x", body="beam", kind="slide", axis=X, origin=(0, 0, 1.2), mass=14.0, com=(0, 0.05, 0),
            inertia=(0.9, 0.12, 0.9, 0, 0, 0), tip=(0, 0.1, 0.05), armature=6.0, damping=60.0, travel=(-0.6, 0.6),
            servo=Servo(14000, 950, 600), motor=Motor(600),
        ),
        Link(
            joint="y", body="carriage", kind="slide", axis=Y, origin=(0, 0.1, 0.05), mass=6.0, com=(0.01, 0, 0.02),
            inertia=(0.05, 0.06, 0.05, 0, 0, 0), tip=(0.08, 0, 0), armature=4.0, damping=40.0, travel=(-0.6, 0.6),
            servo=Servo(9000, 600, 400), motor=Motor(400),
        ),
        Link(
            joint="z", body="ram", kind="slide", axis=Z, origin=(0.08, 0, 0), mass=4.5, com=(0, 0, -0.2),
            inertia=(0.12, 0.12, 0.01, 0, 0, 0), tip=(0, 0, -0.45), armature=5.0, damping=50.0, travel=(-0.4, 0.4),
            servo=Servo(9000, 450, 400), motor=Motor(400),
        ),
        Link(
            joint="wrist", body="head", axis=(float(np.sin(TILT)), 0, float(np.cos(TILT))), origin=(0, 0, -0.45), mass=2.2,
            com=(0.03, 0.06, -0.05), inertia=(0.012, 0.010, 0.011, 0.001, 0, 0.002), tip=(0.04, 0.10, -0.09), armature=0.03,
            damping=0.25, travel=(-2.5, 2.5), servo=Servo(40, 1.7, 20), motor=Motor(15),
        ),
    )  # fmt: skip
    return Robot("gantry4", links, (0.02, -0.03, 0.0, 0.3), (0.22, 0.22, 0.13, 1.0), 0.3, 1.6, spacing=1.1)


def slide_scara() -> Robot:
    """A SCARA robot with a vertical ball-screw slide and a tool that rolls."""
    links = (
        Link(
            joint="j1", body="inner", axis=Z, origin=(0, 0, 0.35), mass=9.0, com=(0.17, 0, 0.02),
            inertia=(0.03, 0.16, 0.17, 0, 0, 0), tip=(0.35, 0, 0), armature=1.1, damping=4.0, travel=(-2.2, 2.2),
            servo=Servo(2600, 150, 120), motor=Motor(160),
        ),
        Link(
            joint="j2", body="outer", axis=Z, origin=(0.35, 0, 0), mass=6.5, com=(0.12, 0.01, 0.06),
            inertia=(0.03, 0.09, 0.09, 0, 0.004, 0), tip=(0.30, 0, 0.05), armature=0.5, damping=2.0, travel=(-2.4, 2.4),
            servo=Servo(740, 37, 60), motor=Motor(70),
        ),
        Link(
            joint="lift", body="quill", kind="slide", axis=Z, origin=(0.30, 0, 0.05), mass=1.6, com=(0, 0, -0.05),
            inertia=(0.009, 0.009, 0.0006, 0, 0, 0), tip=(0, 0, -0.15), armature=8.0, damping=60.0, travel=(-0.2, 0.2),
            servo=Servo(9500, 450, 250), motor=Motor(250),
        ),
        Link(
            joint="roll", body="tool", axis=Z, origin=(0, 0, -0.15), mass=1.2, com=(0.05, 0.02, -0.06),
            inertia=(0.003, 0.004, 0.004, 0, 0, 0), tip=(0.08, 0.02, -0.08), armature=0.02, damping=0.12, travel=(-3.0, 3.0),
            servo=Servo(30, 1.2, 12), motor=Motor(12),
        ),
    )  # fmt: skip
    return Robot("scara4", links, (0.2, 0.9, -0.02, -0.3), (0.65, 0.70, 0.07, 1.1), 0.2, 1.2, spacing=1.05)


def palletiser() -> Robot:
    """A palletiser-like chain of turret, lower arm, upper arm and gripper, with geared motors."""
    links = (
        Link(
            joint="yaw", body="turret", axis=Z, origin=(0, 0, 0.45), mass=35.0, com=(0.05, 0, 0.20),
            inertia=(0.9, 0.95, 0.7, 0, -0.03, 0), tip=(0.15, 0, 0.35), armature=9.0, damping=30.0, travel=(-2.5, 2.5),
            servo=Servo(14000, 900, 900), motor=Motor(900, 45.0),
        ),
        Link(
            joint="shoulder", body="lower", axis=Y, origin=(0.15, 0, 0.35), mass=18.0, com=(0.01, 0.02, 0.34),
            inertia=(1.0, 1.0, 0.12, 0, 0, 0), tip=(0, 0, 0.75), armature=10.0, damping=35.0, travel=(-0.9, 1.3),
            servo=Servo(20000, 1200, 1200), motor=Motor(1200, 48.0),
        ),
        Link(
            joint="elbow", body="upper", axis=Y, origin=(0, 0, 0.75), mass=12.0, com=(0.36, -0.01, 0.03),
            inertia=(0.08, 0.75, 0.74, 0, 0.01, 0), tip=(0.80, 0, -0.08), armature=4.0, damping=14.0, travel=(-1.2, 1.5),
            servo=Servo(7000, 420, 600), motor=Motor(600, 30.0),
        ),
        Link(
            joint="swivel", body="gripper", axis=Z, origin=(0.80, 0, -0.08), mass=4.5, com=(0.03, 0.02, -0.12),
            inertia=(0.03, 0.028, 0.02, 0, 0.002, 0), tip=(0.09, 0.03, -0.20), armature=0.15, damping=0.9, travel=(-2.8, 2.8),
            servo=Servo(130, 7, 60), motor=Motor(60, 5.0),
        ),
    )  # fmt: skip
    return Robot("pal4", links, (0.1, 0.15, 0.10, 0.2), (0.55, 0.35, 0.42, 0.9), 0.15, 1.1, spacing=1.5)
