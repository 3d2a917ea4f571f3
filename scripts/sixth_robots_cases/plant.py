"""Numbers of a robot: as they are stated, with their uncertainties, and as the compiled steps take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from sixth_robots_cases.machine import POSITION, TORQUE, VELOCITY, Machine
from sixth_robots_cases.robots import Part, Robot

KINDS = {"torque": TORQUE, "position": POSITION, "velocity": VELOCITY}
FAR = 1e9
"""A limit of torque that is never reached [N m or N]."""


@dataclass(frozen=True)
class Stated:
    """A stated parameter.

    Attributes:
        value: The nominal one.
        std: Its standard uncertainty.
        unit: Of both.
        alike: Type of part whose numbers are off together; empty where there is none.
        each: Standard deviation of one part from its type.
    """

    value: float
    std: float
    unit: str
    alike: str = ""
    each: float = 0.0


def stated(robot: Robot) -> dict[str, Stated]:
    """Parameters that a case states, by their names in nominal.json."""
    out: dict[str, Stated] = {}
    for p in robot.parts:
        turn = not p.slide
        out[f"mass:{p.body}"] = Stated(p.mass, robot.mass_std * p.mass, "kg")
        out[f"armature:{p.joint}"] = Stated(
            p.armature, robot.armature_std * p.armature, "kg m^2" if turn else "kg"
        )
        rate = "N m s/rad" if turn else "N s/m"
        out[f"damping:{p.joint}"] = Stated(p.damping, robot.damping_std * p.damping, rate)
        d = p.drive
        if d.kp_std:
            unit = "N m/rad" if turn else "N/m"
            out[f"kp:{d.name}"] = Stated(d.kp, d.kp_std, unit, d.type_, d.each)
        if d.kv_std:
            out[f"kv:{d.name}"] = Stated(d.kv, d.kv_std, rate)
    return out


def machine_of(robot: Robot, values: Mapping[str, float]) -> Machine:
    """A robot with given values of its stated parameters, nominal ones where none is given, and with nothing wrong."""
    parts, n = robot.parts, len(robot.parts)

    def column(key: str, name: str, otherwise: str) -> Array:
        return np.array(
            [
                values.get(
                    f"{key}:{p.drive.name if name == 'drive' else getattr(p, name)}", _of(p, otherwise)
                )
                for p in parts
            ]
        )

    return Machine(
        slide=np.array([p.slide for p in parts]),
        axis=np.array([p.axis for p in parts], float),
        pos=np.array([p.pos for p in parts], float),
        mass=column("mass", "body", "mass"),
        com=np.array([p.com for p in parts], float),
        inertia=np.array([p.inertia for p in parts], float),
        armature=column("armature", "joint", "armature"),
        damping=column("damping", "joint", "damping"),
        friction=np.zeros(n),
        link_friction=np.zeros(n),
        gravity=np.array([0.0, 0.0, -9.81]),
        spin=np.zeros(3),
        kind=np.array([KINDS[p.drive.kind] for p in parts]),
        kp=column("kp", "drive", "drive.kp"),
        kv=column("kv", "drive", "drive.kv"),
        limit=np.array([p.drive.limit or FAR for p in parts]),
        delay=np.zeros(n),
        cogging=np.zeros((n, 3)),
        train=np.zeros((n, 3)),
    )


def _of(part: Part, path: str) -> float:
    """A number of a part or, as `drive.kp`, of its drive."""
    return float(getattr(part.drive, path[6:]) if path.startswith("drive.") else getattr(part, path))
