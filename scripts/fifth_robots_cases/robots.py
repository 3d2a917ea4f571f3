"""The seven nominal robots: links, joints and drives.

Sizes are those of machines of the kind, but of no particular product. Bodies are boxes with products of inertia.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from fourth_robots_cases import robots
from fourth_robots_cases.robots import Servo, Spring, Vector, X, Y, Z

BACK_X, BACK_Y = (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)
SERVO = "HS7"
"""Type of the servos of the leg of the hexapod."""


class Control(NamedTuple):
    """Feedback of a controller or an outer loop, which is not stated."""

    gain: float = 0.0
    """Of the position, in units of what is commanded."""
    rate_gain: float = 0.0
    """Of the velocity likewise."""


NO_CONTROL = Control()
"""What joints on position servos have."""


class DcMotor(NamedTuple):
    """A motor on a voltage that follows a position."""

    constant: float
    """Torque per current [N m/A]."""
    resistance: float
    """Of its winding [ohm]."""
    voltage: float
    """Largest voltage [V]."""


class Uncertain(NamedTuple):
    """How well a quantity is known at all joints, bodies or drives of a robot."""

    quantity: str
    """Its name in nominal.json."""
    share: float
    """Standard uncertainty over the value."""
    alike: str | None = None
    """Type of part whose numbers are off together."""
    each: float = 0.0
    """Standard deviation of one part from its type, over the value."""


@dataclass(frozen=True, kw_only=True)
class Link(robots.Link):
    """A body, the joint that carries it on the body before it, and what drives that joint.

    Attributes:
        skew: Products xy, xz and yz of inertia over the smallest moment.
        frictionloss: Dry friction that is stated [N m].
        control: Feedback of what commands the drive.
    """

    skew: Vector = (0.0, 0.0, 0.0)
    frictionloss: float = 0.0
    control: Control = NO_CONTROL

    @property
    def full_inertia(self) -> list[float]:
        """Moments xx, yy, zz and products xy, xz, yz about the centre of mass [kg m^2] (6)."""
        return [*self.inertia, *(share * min(self.inertia) for share in self.skew)]


@dataclass(frozen=True, kw_only=True)
class Robot(robots.Robot):
    """A robot as its maker describes it.

    Attributes:
        timestep: Of the model [s].
        ending: Of the names of its actuators.
        known: How well its quantities are known, in the order in which they are drawn.
        motor: The DC motor of its servos, if that is told.
    """

    links: tuple[Link, ...]
    timestep: float
    ending: str
    known: tuple[Uncertain, ...]
    motor: DcMotor | None = None

    @property
    def actuators(self) -> list[str]:
        """Names of the actuators."""
        return [f"{joint}_{self.ending}" for joint in self.joints]


def box(mass: float, x: float, y: float, z: float) -> Vector:
    """Moments of inertia [kg m^2] of a box of a mass [kg] and edges [m]."""
    return mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y)


def known(**shares: float) -> tuple[Uncertain, ...]:
    """Standard uncertainties over the values, by quantity."""
    return tuple(Uncertain(quantity, share) for quantity, share in shares.items())


def hexleg(frictionloss: float) -> Robot:
    """A leg of a hexapod on hobby servos, with dry friction [N m] that is stated."""
    servo = {"servo": Servo(kp=13.0), "damping": 0.05, "armature": 0.0058, "frictionloss": frictionloss}
    links = (
        Link(
            body="coxa_link", joint="coxa", axis=Z, origin=(0, 0, 0.12), mass=0.105, com=(0.031, 0.002, -0.004),
            inertia=box(0.105, 0.06, 0.04, 0.035), skew=(0.05, -0.1, 0), tip=(0.052, 0, 0), **servo,
        ),
        Link(
            body="femur_link", joint="femur", axis=BACK_Y, origin=(0.052, 0, 0), mass=0.128, com=(0.046, -0.001, 0.003),
            inertia=box(0.128, 0.11, 0.035, 0.03), skew=(0, 0.12, 0), tip=(0.085, 0, 0), **servo,
        ),
        Link(
            body="tibia_link", joint="tibia", axis=BACK_Y, origin=(0.085, 0, 0), mass=0.094, com=(0.006, 0.0, -0.061),
            inertia=box(0.094, 0.02, 0.025, 0.15), skew=(0, 0.2, 0.05), tip=(0.012, 0, -0.138), **servo,
        ),
    )  # fmt: skip
    alike = (
        Uncertain("kp", 0.25, SERVO, 0.06),
        Uncertain("damping", 0.4, SERVO, 0.12),
        Uncertain("armature", 0.2, SERVO, 0.04),
        Uncertain("frictionloss", 0.4, SERVO, 0.15),
    )
    return Robot(
        name="hexleg", drive="position", links=links, timestep=0.002, ending="servo",
        known=(*known(mass=0.04), *alike), motor=DcMotor(0.9, 4.0, 7.4),
    )  # fmt: skip


def gantry() -> Robot:
    """A gantry with a head that yaws and pitches."""
    links = (
        Link(
            body="bridge", joint="x", axis=X, slide=True, origin=(0, 0, 1.2), mass=6.4, com=(0.01, 0.03, 0.05),
            inertia=box(6.4, 0.2, 0.4, 0.12), tip=(0, 0, -0.1), damping=18, armature=1.5, gear=41.0,
            control=Control(5000 / 41, 380 / 41),
        ),
        Link(
            body="ram", joint="z", axis=Z, slide=True, origin=(0.02, 0, -0.1), mass=2.9, com=(0, 0.01, -0.12),
            inertia=box(2.9, 0.07, 0.07, 0.4), tip=(0, 0, -0.32), damping=22, armature=1.2, gear=36.0,
            control=Control(5000 / 36, 260 / 36),
        ),
        Link(
            body="yoke", joint="yaw", axis=Z, origin=(0, 0, -0.32), mass=0.85, com=(0.012, 0.006, -0.05),
            inertia=box(0.85, 0.1, 0.12, 0.09), skew=(0.04, 0.06, 0), tip=(0.0, 0, -0.09), damping=0.06, armature=0.012,
            gear=1.15, control=Control(26 / 1.15, 1.3 / 1.15),
        ),
        Link(
            body="head", joint="pitch", axis=Y, origin=(0, 0, -0.09), mass=1.15, com=(0.074, 0.004, -0.012),
            inertia=box(1.15, 0.2, 0.07, 0.07), skew=(0.03, -0.08, 0), tip=(0.19, 0, -0.01), damping=0.05, armature=0.008,
            gear=0.92, control=Control(26 / 0.92, 1.1 / 0.92),
        ),
    )  # fmt: skip
    return Robot(
        name="gantry", drive="current", links=links, timestep=0.001, ending="motor",
        known=known(mass=0.03, damping=0.25, armature=0.1, gear=0.03),
    )  # fmt: skip


def pantilt() -> Robot:
    """A head that pans and tilts a camera that is mounted off its axes."""
    links = (
        Link(
            body="fork", joint="pan", axis=Z, origin=(0, 0, 0.3), mass=1.5, com=(0.018, -0.006, 0.07),
            inertia=box(1.5, 0.1, 0.2, 0.16), skew=(0, 0.1, 0.04), tip=(0, 0, 0.14), damping=0.25, armature=0.035,
            servo=Servo(kv=5.5), control=Control(3.0),
        ),
        Link(
            body="camera", joint="tilt", axis=BACK_Y, origin=(0, 0, 0.14), mass=2.3, com=(0.085, 0.007, 0.031),
            inertia=box(2.3, 0.24, 0.12, 0.1), skew=(0.05, 0.1, 0), tip=(0.2, 0, 0.03), damping=0.3, armature=0.03,
            servo=Servo(kv=6.5), control=Control(3.0),
        ),
    )  # fmt: skip
    return Robot(
        name="pantilt", drive="velocity", links=links, timestep=0.002, ending="drive",
        known=known(mass=0.03, damping=0.25, armature=0.1, kv=0.08),
    )  # fmt: skip


def exoleg() -> Robot:
    """A leg of an exoskeleton that hangs."""
    links = (
        Link(
            body="thigh", joint="hip", axis=BACK_Y, origin=(0, 0.1, 1.0), mass=3.6, com=(0.012, 0.01, -0.19),
            inertia=box(3.6, 0.12, 0.1, 0.44), skew=(0, 0.05, 0), tip=(0, 0, -0.42), damping=0.9, armature=0.09,
            control=Control(320, 26),
        ),
        Link(
            body="shank", joint="knee", axis=BACK_Y, origin=(0, 0, -0.42), mass=2.3, com=(0.006, 0.0, -0.17),
            inertia=box(2.3, 0.1, 0.09, 0.4), skew=(0, -0.04, 0), tip=(0, 0, -0.40), damping=0.7, armature=0.07,
            control=Control(220, 13),
        ),
        Link(
            body="foot", joint="ankle", axis=BACK_Y, origin=(0, 0, -0.40), mass=0.95, com=(0.055, 0.0, -0.045),
            inertia=box(0.95, 0.26, 0.1, 0.06), skew=(0, -0.1, 0), tip=(0.14, 0, -0.07), damping=0.35, armature=0.03,
            control=Control(70, 2.6),
        ),
    )  # fmt: skip
    return Robot(
        name="exoleg", drive="torque", links=links, timestep=0.001, ending="motor",
        known=known(mass=0.03, damping=0.3, armature=0.1),
    )  # fmt: skip


def springarm() -> Robot:
    """An arm whose shoulder has a spring beside its motor."""
    links = (
        Link(
            body="turret", joint="yaw", axis=Z, origin=(0, 0, 0.2), mass=2.6, com=(0.01, 0.015, 0.05),
            inertia=box(2.6, 0.16, 0.16, 0.16), tip=(0.04, 0, 0.1), damping=0.5, armature=0.06, control=Control(70, 9),
        ),
        Link(
            body="upper", joint="shoulder", axis=BACK_Y, origin=(0.04, 0, 0.1), mass=1.9, com=(0.15, 0.012, 0.006),
            inertia=box(1.9, 0.38, 0.07, 0.07), skew=(0.02, 0.05, 0), tip=(0.35, 0, 0), damping=0.6, armature=0.06,
            spring=Spring(24.0, 0.45), control=Control(110, 11),
        ),
        Link(
            body="forearm", joint="elbow", axis=BACK_Y, origin=(0.35, 0, 0), mass=1.15, com=(0.125, -0.006, 0.0),
            inertia=box(1.15, 0.31, 0.06, 0.06), skew=(0.03, 0.04, 0), tip=(0.31, 0, 0), damping=0.3, armature=0.025,
            control=Control(40, 2.6),
        ),
    )  # fmt: skip
    return Robot(
        name="springarm", drive="torque", links=links, timestep=0.002, ending="motor",
        known=known(mass=0.03, damping=0.3, armature=0.1, stiffness=0.04),
    )  # fmt: skip


def shoulder() -> Robot:
    """Shoulder and elbow of a humanoid."""
    links = (
        Link(
            body="collar", joint="pitch", axis=BACK_Y, origin=(0, -0.15, 1.3), mass=0.7, com=(0.0, -0.035, 0.004),
            inertia=box(0.7, 0.08, 0.09, 0.08), tip=(0, -0.06, 0), damping=0.6, armature=0.07, gear=9.0,
            control=Control(110 / 9, 8 / 9),
        ),
        Link(
            body="cuff", joint="roll", axis=BACK_X, origin=(0, -0.06, 0), mass=0.8, com=(0.006, -0.01, -0.05),
            inertia=box(0.8, 0.08, 0.08, 0.1), skew=(0, 0.05, 0), tip=(0, 0, -0.1), damping=0.6, armature=0.07, gear=9.0,
            control=Control(110 / 9, 8 / 9),
        ),
        Link(
            body="humerus", joint="yaw", axis=Z, origin=(0, 0, -0.1), mass=1.25, com=(0.004, 0.006, -0.085),
            inertia=box(1.25, 0.08, 0.08, 0.2), skew=(0, 0.04, 0.03), tip=(0, 0, -0.17), damping=0.3, armature=0.03,
            gear=6.2, control=Control(45 / 6.2, 1.9 / 6.2),
        ),
        Link(
            body="lower_arm", joint="elbow", axis=BACK_Y, origin=(0, 0, -0.17), mass=1.05, com=(0.014, 0.004, -0.12),
            inertia=box(1.05, 0.07, 0.06, 0.28), skew=(0, -0.06, 0), tip=(0.02, 0, -0.27), damping=0.25, armature=0.022,
            gear=6.2, control=Control(42 / 6.2, 1.6 / 6.2),
        ),
    )  # fmt: skip
    return Robot(
        name="shoulder", drive="current", links=links, timestep=0.001, ending="drive",
        known=known(mass=0.03, damping=0.3, armature=0.1, gear=0.04),
    )  # fmt: skip


def surgwrist() -> Robot:
    """The wrist of a surgical instrument, of grams."""
    links = (
        Link(
            body="shaft", joint="roll", axis=X, origin=(0, 0, 0.5), mass=0.18, com=(-0.05, 0.001, 0.0005),
            inertia=box(0.18, 0.2, 0.02, 0.02), tip=(0.05, 0, 0), damping=0.028, armature=5e-4, servo=Servo(2.4, limit=1.2),
        ),
        Link(
            body="knuckle", joint="pitch", axis=Y, origin=(0.05, 0, 0), mass=0.034, com=(0.009, 0, 0.0004),
            inertia=box(0.034, 0.025, 0.012, 0.012), tip=(0.018, 0, 0), damping=0.024, armature=4e-4,
            servo=Servo(1.9, limit=1.0),
        ),
        Link(
            body="palm", joint="yaw", axis=Z, origin=(0.018, 0, 0), mass=0.028, com=(0.010, 0.0006, 0),
            inertia=box(0.028, 0.022, 0.012, 0.012), tip=(0.016, 0, 0), damping=0.024, armature=4e-4,
            servo=Servo(1.9, limit=1.0),
        ),
        Link(
            body="jaw", joint="grip", axis=Z, origin=(0.016, 0, 0), mass=0.016, com=(0.012, 0.001, 0),
            inertia=box(0.016, 0.03, 0.006, 0.006), skew=(0.1, 0, 0), tip=(0.028, 0.002, 0), damping=0.014, armature=2e-4,
            servo=Servo(1.2, limit=0.6),
        ),
    )  # fmt: skip
    return Robot(
        name="surgwrist", drive="position", links=links, timestep=0.001, ending="drive",
        known=known(mass=0.03, damping=0.25, armature=0.1, kp=0.08),
    )  # fmt: skip
