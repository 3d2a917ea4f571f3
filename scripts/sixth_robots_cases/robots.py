"""What a robot is: bodies, joints and drives as its maker states them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Vector = tuple[float, float, float]
Kind = Literal["torque", "position", "velocity"]
"""What the command of a drive is."""


@dataclass(frozen=True)
class Drive:
    """A drive as stated.

    Attributes:
        name: Of the actuator.
        kind: What the command is.
        kp, kv: Gains of a servo on position [N m/rad or N/m] and speed [N m s/rad or N s/m].
        kp_std, kv_std: Their standard uncertainties; certain where zero.
        limit: Torque at which it saturates by its data sheet [N m or N]; none where zero.
        gains: Of the controller around it, on position and speed; not stated.
        type_: Type of the servo; those of one type are off by the same.
        each: Standard deviation of the gain of one servo from that of its type [N m/rad].
    """

    name: str
    kind: Kind
    kp: float = 0.0
    kv: float = 0.0
    kp_std: float = 0.0
    kv_std: float = 0.0
    limit: float = 0.0
    gains: tuple[float, float] = (0.0, 0.0)
    type_: str = ""
    each: float = 0.0


@dataclass(frozen=True)
class Part:
    """A body, the joint that carries it and the drive that moves it; the joint hangs on the part before.

    Attributes:
        body, joint: Names.
        axis, pos: Of the joint, in the body before it [m].
        mass, com, inertia: Of the body [kg, m, kg m^2]; moments about its centre of mass along its own axes.
        armature, damping: Of the joint [kg m^2 or kg, N m s/rad or N s/m].
        drive: What moves it.
        rated: Torque or force that the drive works with [N m or N], by which faint friction and noise are sized.
        slide: Whether the joint is a slide.
    """

    body: str
    joint: str
    axis: Vector
    pos: Vector
    mass: float
    com: Vector
    inertia: Vector
    armature: float
    damping: float
    drive: Drive
    rated: float
    slide: bool = False


@dataclass(frozen=True)
class Robot:
    """A robot on a fixed base.

    Attributes:
        name: Of its MJCF.
        parts: From the base to the tip.
        mass_std, armature_std, damping_std: Standard uncertainties of what is stated, over the values.
    """

    name: str
    parts: tuple[Part, ...]
    mass_std: float = 0.02
    armature_std: float = 0.08
    damping_std: float = 0.25

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return [part.joint for part in self.parts]

    def index(self, joint: str) -> int:
        """Row of a joint."""
        return self.joints.index(joint)
