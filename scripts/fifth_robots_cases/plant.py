"""The parameters of a robot, nominal and drawn within what is stated of them, and the machine they make."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from fourth_robots_cases.machine import Friction, Passive, Stop, Transmission

from bench.arrays import Array
from fifth_robots_cases.dynamics import Chain
from fifth_robots_cases.machine import MOTOR, POSITION, VELOCITY, VOLTAGE, Cogging, Machine, Servos
from fifth_robots_cases.robots import DcMotor, Link, Robot, Uncertain

FARTHEST = 1.5
"""Most standard uncertainties by which a parameter deviates; a draw beyond is put there."""
FARTHEST_OF_PART = 1.4
"""The same for a type of part, and for a part from its type."""
UNITS = {
    "mass": ("kg", "kg"),
    "damping": ("N m s/rad", "N s/m"),
    "armature": ("kg m^2", "kg"),
    "stiffness": ("N m/rad", "N/m"),
    "frictionloss": ("N m", "N"),
    "kp": ("N m/rad", "N/m"),
    "kv": ("N m s/rad", "N s/m"),
    "gear": ("N m/A", "N/A"),
}
"""Units of parameters at hinges and at slides."""
NO_MOTOR = DcMotor(1.0, 1.0, 0.0)
"""Where servos are no DC motors."""

Parameters = dict[str, Array]
"""By names of `UNITS`, each (n)."""


class Stated(NamedTuple):
    """A parameter that is stated with its uncertainty, in units of `UNITS`."""

    name: str
    """In nominal.json."""
    joint: int
    """Index of its joint."""
    value: float
    std: float
    """Standard uncertainty."""
    each: float
    """Standard deviation of a part from its type; zero where it is of none."""
    unit: str
    known: Uncertain
    """What is known of the quantity."""


def nominal_parameters(robot: Robot) -> Parameters:
    """The parameters as the description of a robot has them."""
    rows = [_parameters_of(link) for link in robot.links]
    return {name: np.array([row[name] for row in rows], float) for name in UNITS}


def _parameters_of(link: Link) -> dict[str, float]:
    return {
        "mass": link.mass,
        "damping": link.damping,
        "armature": link.armature,
        "stiffness": link.spring.stiffness,
        "frictionloss": link.frictionloss,
        "kp": link.servo.kp,
        "kv": link.servo.kv,
        "gear": link.gear,
    }


def stated(robot: Robot) -> Iterator[Stated]:
    """What is stated of a robot, in the order in which it is drawn; what is zero is not stated."""
    nominal = nominal_parameters(robot)
    for known in robot.known:
        quantity = known.quantity
        for j, link in enumerate(robot.links):
            value = float(nominal[quantity][j])
            if value:
                places = {"mass": link.body} | dict.fromkeys(("kp", "kv", "gear"), robot.actuators[j])
                name, unit = f"{quantity}:{places.get(quantity, link.joint)}", UNITS[quantity][link.slide]
                std, each = _four_digits(known.share * value), _four_digits(known.each * value)
                yield Stated(name, j, value, std, each, unit, known)


def drawn_parameters(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Parameters that differ from the nominal ones within what is stated of them; inertias do not go with the masses."""
    drawn, types = nominal_parameters(robot), {}
    for one in stated(robot):
        if one.known.alike is None:
            deviation = one.std * np.clip(rng.standard_normal(), -FARTHEST, FARTHEST)
        else:
            kind = one.known.alike, one.known.quantity
            if kind not in types:
                types[kind] = np.clip(rng.standard_normal(), -FARTHEST_OF_PART, FARTHEST_OF_PART)
            own = np.clip(rng.standard_normal(), -FARTHEST_OF_PART, FARTHEST_OF_PART)
            deviation = types[kind] * np.sqrt(one.std**2 - one.each**2) + one.each * own
        drawn[one.known.quantity][one.joint] = one.value + deviation
    return drawn


def _four_digits(value: float) -> float:
    return float(f"{value:.4g}")


def chain_of(robot: Robot, mass: Array) -> Chain:
    """Links and joints of a robot with masses [kg] (n) on a level base."""
    inertia = np.zeros((len(robot.links), 3, 3))
    for j, link in enumerate(robot.links):
        xx, yy, zz, xy, xz, yz = link.full_inertia
        inertia[j] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return Chain(
        gravity=np.array([0.0, 0.0, -9.81]),
        origin=np.array([link.origin for link in robot.links], float),
        axis=np.array([link.direction for link in robot.links], float),
        slide=np.array([link.slide for link in robot.links]),
        mass=mass,
        com=np.array([link.com for link in robot.links], float),
        inertia=inertia,
        rotor=np.zeros((len(robot.links), 3)),
    )


def machine_of(robot: Robot, parameters: Parameters, friction: Array) -> Machine:
    """A robot with parameters, and with dry friction [N m or N] (n) besides that of the parameters, in which nothing else is wrong."""
    n = len(robot.links)
    none, one = np.zeros(n), np.ones(n)
    dry = parameters["frictionloss"] + friction
    rest = np.array([link.spring.rest for link in robot.links], float)
    return Machine(
        chain=chain_of(robot, parameters["mass"]),
        passive=Passive(parameters["armature"], parameters["damping"], parameters["stiffness"], rest),
        servos=_servos(robot, parameters),
        friction=Friction(dry, dry, one),
        transmission=Transmission(np.zeros(n, np.bool_), none, none, none),
        cogging=Cogging(none, none, one, none),
        stop=Stop(none, none, none, one),
        late=none,
    )


def _servos(robot: Robot, parameters: Parameters) -> Servos:
    limit = np.array([link.servo.limit for link in robot.links], float)
    kind = {"position": POSITION, "velocity": VELOCITY}.get(robot.drive, MOTOR)
    return Servos(
        VOLTAGE if robot.motor else kind,
        parameters["gear"],
        parameters["kp"],
        parameters["kv"],
        limit,
        np.zeros(len(limit)),
        *(robot.motor or NO_MOTOR),
    )
