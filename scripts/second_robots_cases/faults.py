"""What is wrong with a robot: each function here makes a fault, which changes a plant in place.

The equations by which a fault acts stand in `stepping`; joints and bodies are given by their index from the base.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bench.arrays import Array
from second_robots_cases.plant import GRAVITY, Plant
from second_robots_cases.robots import Vector
from second_robots_cases.stepping import Hose

Fault = Callable[[Plant], None]
"""Changes a plant in place."""


def nothing(plant: Plant) -> None:
    """No fault."""


def friction(
    coulomb: Sequence[float], *, viscous: float | Sequence[float] = 0.0, load: float | Sequence[float] = 0.0
) -> Fault:
    """More friction: Coulomb [N m or N], viscous [N m s/rad or N s/m] and per unit of the drive torque [-], each (n)."""

    def fault(plant: Plant) -> None:
        plant.drives.coulomb[:] += coulomb
        plant.drives.damping[:] += viscous
        plant.drives.load_friction[:] += load

    return fault


def elastic_joint(joint: int, *, stiffness: float, damping: float, half_clearance: float = 0.0) -> Fault:
    """An elastic transmission [N m/rad, N m s/rad], with play [rad] or without; the rotor and its sensor are on the motor side."""

    def fault(plant: Plant) -> None:
        transmission = plant.transmission
        transmission.elastic[joint] = True
        transmission.stiffness[joint] = stiffness
        transmission.damping[joint] = damping
        transmission.half_clearance[joint] = half_clearance

    return fault


def payload(body: int, mass: float, at: Vector) -> Fault:
    """A point mass [kg] at a point of a body [m], which moves its centre of mass and adds to its inertia (parallel axes)."""

    def fault(plant: Plant) -> None:
        chain = plant.chain
        own, com, point = chain.mass[body], chain.com[body].copy(), np.array(at, float)
        common = (own * com + mass * point) / (own + mass)
        chain.inertia[body] = (
            chain.inertia[body] + _point_inertia(own, com - common) + _point_inertia(mass, point - common)
        )
        chain.mass[body] = own + mass
        chain.com[body] = common

    return fault


def _point_inertia(mass: float, d: Array) -> Array:
    """Inertia (3, 3) of a point mass at a distance (3) [kg m^2]."""
    return mass * (d @ d * np.eye(3) - np.outer(d, d))


def servo_gain(joint: int, factor: float) -> Fault:
    """A proportional gain that is a factor of what it should be; the velocity gain is right."""

    def fault(plant: Plant) -> None:
        plant.drives.gain[joint] *= factor

    return fault


def saturation(joint: int, limit: float) -> Fault:
    """A drive that gives no more than a limit [N m or N]."""

    def fault(plant: Plant) -> None:
        plant.drives.limit[joint] = limit

    return fault


def delay(joint: int, seconds: float) -> Fault:
    """A target that reaches its servo after a delay [s], the stated one included."""

    def fault(plant: Plant) -> None:
        plant.drives.delay[joint] = seconds

    return fault


def rotor(joint: int, armature: float) -> Fault:
    """A reflected rotor inertia [kg m^2 or kg] other than the stated one."""

    def fault(plant: Plant) -> None:
        plant.drives.armature[joint] = armature

    return fault


def encoder_offset(joint: int, offset: float) -> Fault:
    """An encoder that reads too much [rad or m], in the log and in the feedback."""

    def fault(plant: Plant) -> None:
        plant.offset[joint] = offset

    return fault


def tilted_base(x: float, y: float) -> Fault:
    """A base that is tilted [rad]: in its frame gravity is g (sin y, sin x cos y, -cos x cos y).

    This is the base turned by -x about its x axis and by y about its y axis, in the right-handed sense: R = Ry(y) Rx(-x).
    """

    def fault(plant: Plant) -> None:
        down = [np.sin(y), np.sin(x) * np.cos(y), -np.cos(x) * np.cos(y)]
        plant.chain.gravity[:] = GRAVITY * np.array(down)

    return fault


def hose_to_room(
    body: int, *, anchor: Vector, attached: Vector, stiffness: float, free_length: float
) -> Fault:
    """A hose from a point of the room to a point of a body [m], with a stiffness [N/m] beyond its free length [m]."""

    def fault(plant: Plant) -> None:
        plant.hose = Hose(True, np.array(anchor), np.array(attached), body, stiffness, free_length)

    return fault
