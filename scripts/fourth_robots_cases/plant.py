"""The parameters of a robot, nominal and drawn within what is stated of them, and the machine they make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from fourth_robots_cases.dynamics import Chain
from fourth_robots_cases.machine import Cogging, Friction, Hose, Machine, Passive, Servos, Stop, Transmission
from fourth_robots_cases.robots import Robot

RELATIVE_STD = {
    "mass": 0.03,
    "damping": 0.25,
    "armature": 0.10,
    "kp": 0.05,
    "kv": 0.05,
    "gear": 0.04,
    "stiffness": 0.03,
}
"""Relative standard uncertainties of the parameters of links and joints, in the order in which they are drawn."""
FARTHEST = 1.7
"""Most standard uncertainties by which they deviate; a draw beyond is put there."""
FARTHEST_OF_BODY = 1.5
"""The same for the further parameter of a body."""
COORDINATES = {"com_x": 0, "com_z": 2}
"""Coordinates of a centre of mass by the names of their parameters."""


class Parameters(NamedTuple):
    """Parameters of a robot; each (n) where nothing else is said."""

    mass: Array
    """[kg]."""
    inertia: Array
    """Principal moments [kg m^2] (n, 3)."""
    com: Array
    """Centres of mass [m] (n, 3)."""
    armature: Array
    """[kg m^2 or kg]."""
    damping: Array
    """[N m s/rad or N s/m]."""
    stiffness: Array
    """[N m/rad]."""
    kp: Array
    """[N m/rad or N/m]."""
    kv: Array
    """[N m s/rad or N s/m]."""
    gear: Array
    """Torque at the joint per unit of what a measured current or torque reads [N m/A or 1]."""


def nominal_parameters(robot: Robot) -> Parameters:
    """The parameters as the description of a robot has them."""
    links = robot.links
    return Parameters(
        mass=np.array([link.mass for link in links], float),
        inertia=np.array([link.inertia for link in links], float),
        com=np.array([link.com for link in links], float),
        armature=np.array([link.armature for link in links], float),
        damping=np.array([link.damping for link in links], float),
        stiffness=np.array([link.spring.stiffness for link in links], float),
        kp=np.array([link.servo.kp for link in links], float),
        kv=np.array([link.servo.kv for link in links], float),
        gear=np.array([link.gear for link in links], float),
    )


def drawn_parameters(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Parameters that differ from the nominal ones within what is stated of them.

    Inertias do not go with the masses. A robot that is driven by torques has what they read drawn like torques per current.
    """
    nominal = nominal_parameters(robot)
    drawn = {name: values.copy() for name, values in nominal._asdict().items()}
    for name, std in RELATIVE_STD.items():
        deviation = np.clip(rng.standard_normal(len(robot.links)), -FARTHEST, FARTHEST)
        drawn[name] = drawn[name] * (1 + std * deviation)
    if robot.uncertain is not None:
        quantity, body, std = robot.uncertain
        k = robot.bodies.index(body)
        deviation = std * np.clip(rng.standard_normal(), -FARTHEST_OF_BODY, FARTHEST_OF_BODY)
        if quantity == "inertia":
            drawn["inertia"][k] *= 1 + deviation
        else:
            drawn["com"][k, COORDINATES[quantity]] += deviation
    return Parameters(**drawn)


def chain_of(robot: Robot, parameters: Parameters) -> Chain:
    """Links and joints of a robot with parameters."""
    links = robot.links
    return Chain(
        origin=np.array([link.origin for link in links], float),
        axis=np.array([link.direction for link in links], float),
        slide=np.array([link.slide for link in links]),
        mass=parameters.mass,
        com=parameters.com,
        inertia=parameters.inertia,
    )


def machine_of(robot: Robot, parameters: Parameters, friction: Array) -> Machine:
    """A robot with parameters and with dry friction of limits [N m or N] (n), in which nothing else is wrong.

    A controller is not limited.
    """
    links, n = robot.links, len(robot.links)
    rest = np.array([link.spring.rest for link in links], float)
    limit = np.array([link.servo.limit for link in links], float)

    def none() -> Array:
        return np.zeros(n)

    return Machine(
        chain=chain_of(robot, parameters),
        passive=Passive(parameters.armature, parameters.damping, parameters.stiffness, rest),
        servos=Servos(parameters.kp, parameters.kv, limit),
        friction=Friction(friction.astype(float), friction.astype(float), np.ones(n)),
        transmission=Transmission(np.zeros(n, np.bool_), none(), none(), none()),
        cogging=Cogging(none(), none(), none()),
        stop=Stop(none(), none(), none(), np.ones(n)),
        hose=Hose(np.zeros(3), 0.0, 0.0, 0.0),
    )
