"""What is wrong with a robot: how it changes the machine, and how it is told in the answer.

Names are those of the diagnosis, where it has one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from bench.arrays import Array
from sixth_robots_cases.machine import Machine
from sixth_robots_cases.robots import Robot, Vector


@dataclass(frozen=True)
class Effects:
    """What is missing from the model, by joint or body.

    Attributes:
        train: Stiffness [N m/rad], damping [N m s/rad] and clearance [rad] between a motor and its link.
        delay: Time by which a drive gets its command late [s].
        limit: Torque at which a drive really saturates [N m].
        friction: Dry friction, background included [N m].
        tilt: Angles by which the base is turned about x, then about y [deg].
        mass: Added at the centre of mass of a body [kg].
        cogging: Amplitude [N], pitch [m] and phase [rad] of a force along a joint.
        spin: Angular momentum of a wheel in the last body, in its frame [N m s].
    """

    train: Mapping[str, Vector] = field(default_factory=dict)
    delay: Mapping[str, float] = field(default_factory=dict)
    limit: Mapping[str, float] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)
    tilt: tuple[float, float] = (0.0, 0.0)
    mass: Mapping[str, float] = field(default_factory=dict)
    cogging: Mapping[str, Vector] = field(default_factory=dict)
    spin: Vector = (0.0, 0.0, 0.0)


def with_effects(machine: Machine, robot: Robot, effects: Effects) -> Machine:
    """A machine with what is missing put in."""
    bodies = [part.body for part in robot.parts]
    own = Machine._make(np.array(values) for values in machine)
    for joint, row in effects.train.items():
        i = robot.index(joint)
        own.train[i] = row
        if row[2] > 0.0:
            own.link_friction[i] = own.friction[i]
    for column, given in (
        (own.delay, effects.delay),
        (own.limit, effects.limit),
        (own.friction, effects.friction),
    ):
        for joint, value in given.items():
            column[robot.index(joint)] = value
    for body, value in effects.mass.items():
        own.mass[bodies.index(body)] += value
    for joint, row in effects.cogging.items():
        own.cogging[robot.index(joint)] = row
    return own._replace(gravity=leaning(effects.tilt), spin=np.array(effects.spin))


def leaning(tilt: tuple[float, float]) -> Array:
    """Gravity [m/s^2] (3) in the frame of a base that is turned about x, then about y [deg]."""
    x, y = np.radians(tilt)
    return 9.81 * np.array([np.cos(x) * np.sin(y), -np.sin(x), -np.cos(x) * np.cos(y)])


def listed(effects: Effects, robot: Robot) -> list[dict[str, Any]]:
    """Names, places and parameters of the effects, as the answer tells them."""
    drives = {part.joint: part.drive.name for part in robot.parts}
    found: list[dict[str, Any]] = []

    def tell(name: str, where: str, **parameters: Any) -> None:
        found.append({"name": name, "where": where, "parameters": parameters})

    for joint, (stiffness, damping, gap) in effects.train.items():
        if gap > 0.0:
            tell("backlash", joint, gap=gap, stiffness=stiffness, damping=damping)
        else:
            tell("joint_compliance", joint, stiffness=stiffness, damping=damping)
    for joint, late in effects.delay.items():
        tell("actuator_delay", drives[joint], late=late)
    for joint, limit in effects.limit.items():
        tell("actuator_saturation", drives[joint], limit=limit)
    for joint, coulomb in effects.friction.items():
        tell("coulomb_friction", joint, coulomb=coulomb)
    if any(effects.tilt):
        tell("base_tilt", "base", about_x_deg=effects.tilt[0], about_y_deg=effects.tilt[1])
    for body, mass in effects.mass.items():
        tell("mass_error", body, mass=mass)
    for joint, (amplitude, pitch, phase) in effects.cogging.items():
        tell("cogging", joint, amplitude=amplitude, pitch=pitch, phase=phase)
    if any(effects.spin):
        tell("rotor", robot.parts[-1].body, momentum=list(effects.spin))
    return found


def kind_of(effects: Effects, robot: Robot) -> Literal["single", "double", "foreign", "none"]:
    """Class of a case: how many effects it has, or foreign where the diagnosis has no name for one."""
    if any(effects.spin):
        return "foreign"
    return ("none", "single", "double")[len(listed(effects, robot))]
