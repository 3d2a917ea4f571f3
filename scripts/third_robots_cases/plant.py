"""The simulated robot: nominal from its description, drawn within what is stated of it, or with faults."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from third_robots_cases.dynamics import Chain, inverse_dynamics, link_inertia
from third_robots_cases.machine import Belt, Drives, Gear, Machine
from third_robots_cases.robots import Drive, Robot

MASS, DAMPING, ARMATURE, KP, GEAR = 0.03, 0.25, 0.10, 0.05, 0.04
"""Stated relative standard uncertainties of the nominal parameters."""
NEAREST, FARTHEST = 0.6, 1.35
"""Every parameter deviates by so many of these standard uncertainties, at least and at most, to either side."""
BANDWIDTH = 3.5
"""Bandwidth of the feedback of a robot that is driven by torques or currents [Hz]."""
VELOCITY_FEEDBACK = 1.4
"""Its velocity feedback over inertia and angular bandwidth: twice the damping ratio."""


@dataclass
class Plant:
    """All that the simulation knows of a robot; faults change it in place, so that each variant is a copy of its own.

    Attributes:
        robot: Its description.
        chain: Links and joints.
        drives: Drives and friction.
        gear: An elastic or loose gear.
        belt: A belt over two slides.
        ratio: Torque per unit of the current [N m/A]; ones where no currents are logged (n).
        offset: What the log adds to each position [rad or m]; the feedback does not see it (n).
    """

    robot: Robot
    chain: Chain
    drives: Drives
    gear: Gear
    belt: Belt
    ratio: Array
    offset: Array

    def copied(self) -> Plant:
        """A copy that shares no array with this plant."""
        return deepcopy(self)

    @property
    def machine(self) -> Machine:
        """What moves of it."""
        return Machine(self.chain, self.drives, self.gear, self.belt)

    def rigid_torque(self, q: Array, v: Array, a: Array) -> Array:
        """Torques or forces (n_samples, n) of a motion (n_samples, n) with rotors and viscous friction, all gears rigid."""
        q, v, a = (np.ascontiguousarray(x) for x in (q, v, a))
        links = inverse_dynamics(q, v, a, self.chain)
        return links + self.drives.armature * a + self.drives.damping * v


def nominal_plant(robot: Robot, drive: Drive) -> Plant:
    """The robot as its model describes it, without dry friction; where it has no servos, with the feedback of its controller."""
    links, n = robot.links, len(robot.links)
    chain = Chain(
        slide=np.array([link.kind == "slide" for link in links]),
        axis=np.array([link.axis for link in links], float),
        origin=np.array([link.origin for link in links], float),
        com=np.array([link.com for link in links], float),
        mass=np.array([link.mass for link in links], float),
        inertia=np.array([_tensor(*link.inertia) for link in links], float),
    )
    armature = np.array([link.armature for link in links], float)
    servo = drive == "servo"
    if servo:
        gain = np.array([link.servo.kp for link in links], float)
        kv = np.array([link.servo.kv for link in links], float)
    else:
        inertia = np.diag(link_inertia(np.array(robot.centre), chain)) + armature
        omega = 2 * np.pi * BANDWIDTH
        gain, kv = inertia * omega * omega, inertia * VELOCITY_FEEDBACK * omega
    drives = Drives(
        servo=servo,
        gain=gain,
        kv=kv,
        limit=np.array([link.servo.limit if servo else link.motor.limit for link in links], float),
        delay=np.zeros(n),
        armature=armature,
        damping=np.array([link.damping for link in links], float),
        coulomb=np.zeros(n),
        load_friction=np.zeros(n),
    )
    ratio = np.array([link.motor.gear if drive == "current" else 1.0 for link in links], float)
    return Plant(robot, chain, drives, Gear(-1, 0.0, 0.0, 0.0), Belt(0.0, 1.0, 0.0, 0.0), ratio, np.zeros(n))


def drawn_plant(rng: np.random.Generator, robot: Robot, drive: Drive) -> Plant:
    """A robot whose parameters differ from the nominal ones within what is stated of them.

    Inertias about the centres of mass go with the masses; the gains of servos and the torques per current deviate where a robot has them.
    """
    plant, n = nominal_plant(robot, drive), len(robot.links)
    mass, damping, armature, kp, gear = (_deviation(rng, n) for _ in range(5))
    nominal = plant.chain.mass.copy()
    plant.chain.mass[:] = nominal * (1 + MASS * mass)
    plant.chain.inertia[:] *= (plant.chain.mass / nominal)[:, None, None]
    plant.drives.damping[:] *= 1 + DAMPING * damping
    plant.drives.armature[:] *= 1 + ARMATURE * armature
    if drive == "servo":
        plant.drives.gain[:] *= 1 + KP * kp
    elif drive == "current":
        plant.ratio[:] *= 1 + GEAR * gear
    return plant


def _deviation(rng: np.random.Generator, n: int) -> Array:
    """Deviations (n) in standard uncertainties."""
    sign = rng.choice([-1, 1], n)
    return sign * rng.uniform(NEAREST, FARTHEST, n)


def _tensor(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> list[list[float]]:
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
