"""The six nominal robots: links, joints and drives.

Sizes are those of machines of the kind, but of no particular product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

Vector = tuple[float, float, float]
Drive = Literal["position", "velocity", "current", "torque"]
"""How a robot is driven: by servos that follow positions or rates, or by a controller whose currents or torques are measured."""


class Servo(NamedTuple):
    """A position servo, torque = kp (goal - position) - kv velocity, or a velocity servo, torque = kv (goal - velocity)."""

    kp: float = 0.0
    """Proportional gain [N m/rad or N/m]; zero in a velocity servo."""
    kv: float = 0.0
    """Velocity gain [N m s/rad or N s/m]."""
    limit: float = 1e9
    """Largest torque or force [N m or N]."""


class Spring(NamedTuple):
    """A spring at a joint that carries weight: torque = -stiffness (position - rest)."""

    stiffness: float = 0.0
    """[N m/rad]; zero where there is none."""
    rest: float = 0.0
    """Position at which it is free [rad]."""


NO_SERVO, NO_SPRING = Servo(), Spring()
"""What joints have where nothing else is said."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A body, the joint that carries it on the body before it, and what drives that joint.

    Attributes:
        body: Name of the body.
        joint: Name of the joint.
        origin: Position of the joint in the frame of the body before [m].
        axis: Axis of the joint in that frame, of any length.
        slide: Whether the joint is a slide; a hinge otherwise.
        mass: Mass [kg].
        com: Centre of mass in the frame of the body [m].
        inertia: Principal moments about the centre of mass, along the axes of the body [kg m^2].
        armature: Rotor inertia, reflected to the joint [kg m^2 or kg].
        damping: Viscous friction [N m s/rad or N s/m].
        tip: Far end of the body [m].
        servo: The servo; without gains where a robot has none.
        spring: The spring at the joint.
        gear: Torque at the joint per unit of the current [N m/A].
        driven: Whether anything drives the joint.
    """

    body: str
    joint: str
    origin: Vector
    axis: Vector
    slide: bool = False
    mass: float
    com: Vector
    inertia: Vector
    armature: float
    damping: float
    tip: Vector
    servo: Servo = NO_SERVO
    spring: Spring = NO_SPRING
    gear: float = 1.0
    driven: bool = True

    @property
    def direction(self) -> list[float]:
        """Unit vector along the axis (3)."""
        axis = np.array(self.axis, float)
        return (axis / np.linalg.norm(axis)).tolist()


class BodyParameter(NamedTuple):
    """A parameter of one body that is uncertain besides those that all bodies have."""

    quantity: Literal["inertia", "com_x", "com_z"]
    """Moment about the lateral axis, or a coordinate of the centre of mass."""
    body: str
    std: float
    """Standard uncertainty: of an inertia over its value, of a coordinate [m]."""


@dataclass(frozen=True)
class Robot:
    """A robot as its maker describes it.

    Attributes:
        name: Of the model.
        drive: How it is driven.
        links: From the base to the tip.
        uncertain: A further uncertain parameter, if there is one.
    """

    name: str
    drive: Drive
    links: tuple[Link, ...]
    uncertain: BodyParameter | None = None

    @property
    def has_servos(self) -> bool:
        """Whether servos follow goals that are logged; otherwise currents or torques are measured."""
        return self.drive in ("position", "velocity")

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return [link.joint for link in self.links]

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies."""
        return [link.body for link in self.links]


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def finger() -> Robot:
    """A finger of a gripper: sideways about a leaning axis, then two flexions."""
    links = (
        Link(
            body="knuckle", joint="splay", origin=(0, 0, 0.05), axis=(0.34, 0, 0.94), mass=0.045, com=(0.012, 0.002, 0.001),
            inertia=(9e-6, 1.4e-5, 1.3e-5), armature=3.6e-4, damping=0.004, tip=(0.026, 0, 0), servo=Servo(2.4, 0.045, 0.7),
        ),
        Link(
            body="proximal", joint="flex", origin=(0.026, 0, 0), axis=Y, mass=0.085, com=(0.029, -0.001, 0.003),
            inertia=(1.1e-5, 4.2e-5, 4.0e-5), armature=4.2e-4, damping=0.0045, tip=(0.056, 0, 0), servo=Servo(2.6, 0.05, 0.8),
        ),
        Link(
            body="distal", joint="curl", origin=(0.056, 0, 0), axis=Y, mass=0.041, com=(0.021, 0.001, -0.002),
            inertia=(4e-6, 1.3e-5, 1.25e-5), armature=2.4e-4, damping=0.0028, tip=(0.046, 0, -0.004),
            servo=Servo(1.5, 0.026, 0.45),
        ),
    )  # fmt: skip
    return Robot("finger", "position", links)


def crane() -> Robot:
    """A camera crane: column that pans, boom with counterweight, head that hangs."""
    links = (
        Link(
            body="column", joint="pan", origin=(0, 0, 1.2), axis=Z, mass=14.0, com=(0.01, 0, 0.06), inertia=(0.25, 0.25, 0.3),
            armature=3.5, damping=6.0, tip=(0, 0, 0.18), servo=Servo(kv=165.0, limit=600.0),
        ),
        Link(
            body="boom", joint="lift", origin=(0, 0, 0.18), axis=Y, mass=39.0, com=(-0.27, 0.0, -0.012),
            inertia=(0.4, 33.0, 33.2), armature=4.2, damping=8.0, tip=(1.9, 0, 0), servo=Servo(kv=230.0, limit=700.0),
        ),
        Link(
            body="head", joint="tilt", origin=(1.9, 0, 0), axis=Y, mass=5.6, com=(0.045, 0.004, -0.085),
            inertia=(0.06, 0.075, 0.05), armature=0.06, damping=0.28, tip=(0.2, 0, -0.12), servo=Servo(kv=7.5, limit=60.0),
        ),
    )  # fmt: skip
    return Robot("crane", "velocity", links, BodyParameter("inertia", "boom", 0.05))


def wrist() -> Robot:
    """A wrist on a level forearm: twist about it, bend, and spin of the flange with a lopsided tool."""
    links = (
        Link(
            body="fork", joint="twist", origin=(0, 0, 0.4), axis=X, mass=1.55, com=(0.045, 0.012, 0.016),
            inertia=(0.0024, 0.0041, 0.0038), armature=0.034, damping=0.16, tip=(0.12, 0, 0), gear=5.2,
        ),
        Link(
            body="cross", joint="bend", origin=(0.12, 0, 0), axis=Y, mass=1.15, com=(0.05, 0.006, -0.009),
            inertia=(0.0011, 0.0026, 0.0027), armature=0.026, damping=0.13, tip=(0.085, 0, 0), gear=4.6,
        ),
        Link(
            body="flange", joint="spin", origin=(0.085, 0, 0), axis=X, mass=0.92, com=(0.085, 0.024, 0.031),
            inertia=(0.0016, 0.0031, 0.0029), armature=0.011, damping=0.05, tip=(0.17, 0.02, 0.03), gear=2.4,
        ),
    )  # fmt: skip
    return Robot("wrist", "current", links, BodyParameter("com_x", "flange", 0.003))


def balanced() -> Robot:
    """An arm of two joints whose weight springs carry."""
    links = (
        Link(
            body="thigh_arm", joint="raise", origin=(0, 0, 0.9), axis=Y, mass=3.3, com=(0.19, 0.004, 0.012),
            inertia=(0.006, 0.052, 0.051), armature=0.16, damping=0.55, tip=(0.44, 0, 0), spring=Spring(21.0, -0.9),
        ),
        Link(
            body="second_arm", joint="unfold", origin=(0.44, 0, 0), axis=Y, mass=1.9, com=(0.17, -0.003, 0.01),
            inertia=(0.003, 0.028, 0.027), armature=0.07, damping=0.3, tip=(0.4, 0, 0), spring=Spring(6.5, -0.5),
        ),
    )  # fmt: skip
    return Robot("balanced", "torque", links)


def stage() -> Robot:
    """A cart on a belt, and a pendulum that nothing drives."""
    links = (
        Link(
            body="cart", joint="slide", origin=(0, 0, 0.6), axis=X, slide=True, mass=2.7, com=(0.0, 0, 0.01),
            inertia=(0.01, 0.012, 0.012), armature=1.3, damping=9.0, tip=(0, 0, 0), servo=Servo(5200.0, 215.0, 400.0),
        ),
        Link(
            body="bob", joint="pivot", origin=(0, 0.03, -0.05), axis=Y, mass=0.62, com=(0.004, 0, -0.31),
            inertia=(0.011, 0.0112, 0.0006), armature=2e-5, damping=0.0028, tip=(0, 0, -0.42), driven=False,
        ),
    )  # fmt: skip
    return Robot("stage", "position", links, BodyParameter("com_z", "bob", 0.004))


def ankle() -> Robot:
    """An ankle whose foot is fixed, with the shank and a weight above it."""
    links = (
        Link(
            body="talus", joint="pitch", origin=(0, 0, 0.09), axis=Y, mass=0.7, com=(0.01, 0.003, 0.012),
            inertia=(0.0012, 0.001, 0.0012), armature=0.19, damping=1.3, tip=(0, 0, 0.035), servo=Servo(430.0, 21.0, 140.0),
        ),
        Link(
            body="shank", joint="roll", origin=(0, 0, 0.035), axis=(0.97, 0, 0.24), mass=9.2, com=(0.012, -0.005, 0.31),
            inertia=(0.48, 0.47, 0.04), armature=0.15, damping=1.1, tip=(0, 0, 0.55), servo=Servo(390.0, 19.0, 120.0),
        ),
    )  # fmt: skip
    return Robot("ankle", "position", links)
