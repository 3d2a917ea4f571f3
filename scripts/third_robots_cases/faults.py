"""What is wrong with a robot: each function here makes a fault, which tells its name and changes a plant in place.

The equations by which a fault acts stand in `stepping`. Names are those of the diagnosis, where it has one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from bench.arrays import Array
from third_robots_cases.dynamics import link_inertia
from third_robots_cases.machine import Belt, Gear
from third_robots_cases.plant import Plant

FACES = 30000.0, 20.0
"""Stiffness [N m/rad] and damping [N m s/rad] of the faces of a gap."""


@dataclass(frozen=True)
class Fault:
    """A fault that is planted.

    Attributes:
        name: Of the effect.
        where: Joint, body or servo.
        parameters: True values, in SI units.
        act: Changes a plant in place, at the joint of an index.
        named: Whether `name` is one of the diagnosis; otherwise the fault is foreign to it.
    """

    name: str
    where: str
    parameters: Mapping[str, float]
    act: Callable[[Plant, int], None] = field(repr=False)
    named: bool = True

    def into(self, plant: Plant) -> None:
        """Change a plant in place."""
        self.act(plant, plant.robot.index(self.where) if self.where else 0)


def coulomb_friction(joint: str, *, limit: float) -> Fault:
    """Dry friction of a limit [N m or N]."""

    def act(plant: Plant, j: int) -> None:
        plant.drives.coulomb[j] += limit

    return Fault("coulomb_friction", joint, {"limit": limit}, act)


def load_dependent_friction(joint: str, *, limit_0: float, mu: float) -> Fault:
    """Dry friction of a limit limit_0 + mu times the torque that the gear carries to the links [N m]."""

    def act(plant: Plant, j: int) -> None:
        plant.drives.coulomb[j] += limit_0
        plant.drives.load_friction[j] = mu

    return Fault("load_dependent_friction", joint, {"limit_0": limit_0, "mu": mu}, act)


def backlash(joint: str, *, gap: float) -> Fault:
    """A gear with a gap of a full width [rad] between stiff faces that push and never pull."""

    def act(plant: Plant, j: int) -> None:
        plant.gear = Gear(j, *FACES, gap)

    return Fault("backlash", joint, {"gap": gap}, act)


def joint_compliance(joint: str, *, stiffness: float, zeta: float) -> Fault:
    """A gear of a stiffness [N m/rad], damped by a ratio `zeta` of the mode of the links against a locked rotor."""

    def act(plant: Plant, j: int) -> None:
        inertia = link_inertia(np.array(plant.robot.centre), plant.chain)[j, j]
        damping = 2 * zeta * np.sqrt(stiffness * inertia)
        plant.gear = Gear(j, stiffness, float(damping), 0.0)

    return Fault("joint_compliance", joint, {"stiffness": stiffness, "zeta": zeta}, act)


def payload(body: str, *, mass: float) -> Fault:
    """A point mass [kg] at the tip of a body, which moves its centre of mass and adds to its inertia (parallel axes)."""

    def act(plant: Plant, j: int) -> None:
        chain, point = plant.chain, np.array(plant.robot.links[j].tip, float)
        own, com = chain.mass[j], chain.com[j].copy()
        common = (own * com + mass * point) / (own + mass)
        chain.inertia[j] += own * _steiner(com - common) + mass * _steiner(point - common)
        chain.com[j] = common
        chain.mass[j] = own + mass

    return Fault("mass_error", body, {"mass": mass}, act)


def _steiner(d: Array) -> Array:
    """Inertia (3, 3) of a unit point mass at a distance (3) [m^2]."""
    return d @ d * np.eye(3) - np.outer(d, d)


def actuator_delay(servo: str, *, samples: float, rate: float) -> Fault:
    """A target that reaches its servo late by a number of samples, at a rate [Hz]; the feedback in the servo is on time."""

    def act(plant: Plant, j: int) -> None:
        plant.drives.delay[j] = samples / rate

    return Fault("actuator_delay", servo, {"samples": samples}, act)


def servo_gain_error(servo: str, *, factor: float) -> Fault:
    """A proportional gain that is a factor of what was drawn for it; the velocity gain is as stated."""

    def act(plant: Plant, j: int) -> None:
        plant.drives.gain[j] *= factor

    return Fault("servo_gain_error", servo, {"factor": factor}, act)


def actuator_saturation(servo: str, *, limit: float) -> Fault:
    """A servo that gives no more than a limit [N m or N], whatever its stated range."""

    def act(plant: Plant, j: int) -> None:
        plant.drives.limit[j] = limit

    return Fault("actuator_saturation", servo, {"limit": limit}, act)


def position_offset(joint: str, *, offset: float) -> Fault:
    """A logged position that reads too much [rad or m]; the feedback sees the true one."""

    def act(plant: Plant, j: int) -> None:
        plant.offset[j] = offset

    return Fault("position_offset", joint, {"offset": offset}, act)


def belt_ripple(*, amplitude: float, pitch: float, phase: float, ratio: float) -> Fault:
    """A belt over the first two slides, which ripples with the sum of their positions; see `machine.Belt` for its numbers."""

    def act(plant: Plant, j: int) -> None:
        plant.belt = Belt(amplitude, pitch, phase, ratio)

    parameters = {"amplitude": amplitude, "pitch": pitch, "phase": phase, "ratio": ratio}
    return Fault("belt ripple over x + y", "", parameters, act, named=False)
