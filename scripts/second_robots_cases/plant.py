"""The simulated robot: nominal from its description, perturbed within the stated uncertainties, or with a fault."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from second_robots_cases.dynamics import Chain
from second_robots_cases.robots import Robot, Servo
from second_robots_cases.stepping import Drives, Hose, Transmission

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
MASS, DAMPING, ARMATURE, KP, GEAR = 0.03, 0.25, 0.10, 0.05, 0.04
"""Stated relative standard uncertainties of the nominal parameters."""
ALIKE_KP = 0.10
"""That of the gains of servos of one type, which deviate together."""
EACH_KP, EACH_DAMPING, EACH_ARMATURE = 0.03, 0.08, 0.04
"""Stated relative scatter of servos of one type about their common deviation."""
CLIPPED = 1.6
"""Deviations are drawn from a normal distribution and clipped at so many standard deviations."""


@dataclass
class Plant:
    """All that the simulation knows of a robot; faults change it in place, so that each variant is a copy of its own.

    Attributes:
        chain: Bodies and joints.
        drives: Drives and friction.
        transmission: Elasticity and play between rotors and links.
        hose: A hose between the robot and the room.
        offset: Error of each encoder, which the controller sees too [rad or m] (n).
    """

    chain: Chain
    drives: Drives
    transmission: Transmission
    hose: Hose
    offset: Array

    def copied(self) -> Plant:
        """A copy that shares no array with this plant."""
        return deepcopy(self)


def nominal_plant(robot: Robot) -> Plant:
    """The robot as its model describes it, without Coulomb friction."""
    links, n = robot.links, len(robot.links)
    servo = [link.drive if isinstance(link.drive, Servo) else None for link in links]
    gears = [1.0 if isinstance(link.drive, Servo) else link.drive.gear for link in links]
    chain = Chain(
        hinge=np.array([link.kind == "hinge" for link in links]),
        axis=np.array([link.axis for link in links], float),
        origin=np.array([link.origin for link in links], float),
        com=np.array([link.com for link in links], float),
        mass=np.array([link.mass for link in links], float),
        inertia=np.array([np.diag(link.inertia) for link in links], float),
        gravity=np.array([0.0, 0.0, -GRAVITY]),
    )
    drives = Drives(
        armature=np.array([link.armature for link in links], float),
        damping=np.array([link.damping for link in links], float),
        coulomb=np.zeros(n),
        load_friction=np.zeros(n),
        servo=np.array([one is not None for one in servo]),
        gain=np.array([one.kp if one else gear for one, gear in zip(servo, gears, strict=True)], float),
        kv=np.array([one.kv if one else 0.0 for one in servo], float),
        limit=np.array([link.drive.limit * gear for link, gear in zip(links, gears, strict=True)], float),
        delay=np.array([one.delay if one else 0.0 for one in servo], float),
    )
    rigid = Transmission(np.zeros(n, bool), np.zeros(n), np.zeros(n), np.zeros(n))
    no_hose = Hose(False, np.zeros(3), np.zeros(3), 0, 0.0, 1.0)
    return Plant(chain, drives, rigid, no_hose, np.zeros(n))


def drawn(rng: np.random.Generator, std: float, n: int) -> Array:
    """Factors (n) about one, of a relative standard deviation before they are clipped."""
    return 1 + std * np.clip(rng.standard_normal(n), -CLIPPED, CLIPPED)


def perturbed_plant(rng: np.random.Generator, robot: Robot, *, alike: bool) -> Plant:
    """A robot whose parameters differ from the nominal ones within what is stated of them.

    Masses, damping, rotor inertias and gains are drawn; inertias about the centres of mass stay as they are, whatever the masses.

    Args:
        rng: Source of the deviations.
        robot: Its description.
        alike: Whether its servos are of one type and deviate together: gains by -7.5 %, damping by 13 %, rotor inertias by -6 %.
    """
    nominal, n = nominal_plant(robot), len(robot.links)
    plant = nominal.copied()
    drives = plant.drives
    plant.chain.mass[:] *= drawn(rng, MASS, n)
    drives.damping[:] *= drawn(rng, DAMPING, n)
    drives.armature[:] *= drawn(rng, ARMATURE, n)
    if alike:
        drives.gain[:] *= (1 - 0.075) * drawn(rng, EACH_KP, n)
        drives.damping[:] = nominal.drives.damping * 1.13 * drawn(rng, EACH_DAMPING, n)
        drives.armature[:] = nominal.drives.armature * 0.94 * drawn(rng, EACH_ARMATURE, n)
    elif robot.torque is None:
        drives.gain[:] *= drawn(rng, KP, n)
    else:
        drives.gain[:] *= drawn(rng, GEAR if robot.torque.gears_uncertain else 0.0, n)
    return plant
