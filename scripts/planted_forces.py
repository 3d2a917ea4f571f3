"""Forces that follow no law of the catalogue, and the rigs they are planted in."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from bench.discrepancy import Case
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.motion.observer import Observer
from bench.laws.base import kernel


@kernel
def gap_force(t, q, v, z, theta, f):
    """Spring beyond a clearance on both sides."""
    x = abs(q[0]) - theta[1]
    if x > 0.0:
        f[0] += math.copysign(theta[0] * x, q[0])


@kernel
def stop_force(t, q, v, z, theta, f):
    """Spring beyond a position on one side."""
    if q[0] > theta[1]:
        f[0] += theta[0] * (q[0] - theta[1])


@kernel
def window_force(t, q, v, z, theta, f):
    """Viscous damping within a window of displacement."""
    if abs(q[0]) < theta[1]:
        f[0] += theta[0] * v[0]


@kernel
def slow_force(t, q, v, z, theta, f):
    """Friction that vanishes above a velocity."""
    if abs(v[0]) < theta[1]:
        f[0] += theta[0] * math.tanh(20.0 * v[0] / theta[1])


@kernel
def fast_force(t, q, v, z, theta, f):
    """Drag above a velocity."""
    x = abs(v[0]) - theta[1]
    if x > 0.0:
        f[0] += math.copysign(theta[0] * x, v[0])


@kernel
def corner_force(t, q, v, z, theta, f):
    """Drag on the way out beyond a displacement."""
    if q[0] > theta[1] and v[0] > 0.0:
        f[0] += theta[0] * (q[0] - theta[1])


@kernel
def pulse_force(t, q, v, z, theta, f):
    """Half-sine push in a window of time."""
    s = (t - theta[1]) / theta[2]
    if 0.0 < s < 1.0:
        f[0] += theta[0] * math.sin(math.pi * s)


class PlantedForce(NamedTuple):
    """A planted force.

    Attributes:
        law: Kernel; theta[0] is its strength, theta[1] where it begins.
        begins: Smallest and largest beginning, as a part of the largest displacement or velocity.
        over: "displacement", "velocity" or "time".
    """

    law: Any
    begins: tuple[float, float]
    over: str


KINDS = {
    "gap": PlantedForce(gap_force, (0.3, 0.7), "displacement"),
    "one_sided_stop": PlantedForce(stop_force, (0.1, 0.6), "displacement"),
    "window_damping": PlantedForce(window_force, (0.15, 0.4), "displacement"),
    "low_speed_friction": PlantedForce(slow_force, (0.15, 0.4), "velocity"),
    "high_speed_drag": PlantedForce(fast_force, (0.3, 0.6), "velocity"),
    "outward_drag": PlantedForce(corner_force, (0.1, 0.5), "displacement"),
    "time_pulse": PlantedForce(pulse_force, (0.2, 0.7), "time"),
}


class HostRig(NamedTuple):
    """A rig to plant forces in.

    Attributes:
        name: Name.
        parameters: True values and the uncertainties of the nominal ones.
        channels: Response channels.
        loads: Load channels.
        build: Structure of a case of this rig.
        places: Where forces are planted.
    """

    name: str
    parameters: dict[str, tuple[float, float]]
    channels: tuple[str, ...]
    loads: tuple[str, ...]
    build: Callable[[Case], Structure]
    places: tuple[str, ...]


def _chain(case: Case) -> Structure:
    """Three masses in a row, each tied to the one before it, the first to ground, all driven at the last."""
    names = tuple(p.name for p in case.parameters)
    rows = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    stacks = {kind: np.zeros((len(names), 3, 3)) for kind in ("mass", "damping", "stiffness")}
    for i in range(3):
        stacks["mass"][names.index(f"mass_{i + 1}"), i, i] = 1.0
        for kind in ("damping", "stiffness"):
            stacks[kind][names.index(f"{kind}_{i + 1}")] = np.outer(rows[i], rows[i])
    eye = np.eye(3)
    observers = tuple(
        Observer(f"{what}_{i + 1}", order, eye[i])
        for what, order in (("displacement", 0), ("acceleration", 2))
        for i in range(3)
    )
    places = tuple(
        Place(
            f"spring_{i + 1}",
            rows[i][None, :],
            "m",
            "N",
            (f"mass_{i + 1}",),
            f"stiffness_{i + 1}",
            f"damping_{i + 1}",
        )
        for i in range(3)
    )
    return Structure(
        ("x1", "x2", "x3"), names, stacks["mass"], stacks["damping"], stacks["stiffness"], eye[:, 2:], ("force",),
        observers, places,
    )  # fmt: skip


RIGS = (
    HostRig(
        "sdof",
        {"mass": (3.0, 0.03), "damping": (3.8, 0.6), "stiffness": (1900.0, 57.0)},
        ("displacement", "acceleration"), ("force",), structure_of, ("",),
    ),
    HostRig(
        "joint",
        {
            **{f"mass_{b}": (m, 0.01 * m) for b, m in ((1, 4.0), (2, 6.0))},
            **{f"inertia_{b}": (m, 0.01 * m) for b, m in ((1, 0.05), (2, 0.08))},
            **{f"mount_stiffness_axial_{b}": (k, 0.03 * k) for b, k in ((1, 900.0), (2, 2500.0))},
            **{f"mount_stiffness_torsional_{b}": (k, 0.03 * k) for b, k in ((1, 12.0), (2, 30.0))},
            **{f"mount_damping_axial_{b}": (4.0, 0.4) for b in (1, 2)},
            **{f"mount_damping_torsional_{b}": (0.05, 0.005) for b in (1, 2)},
            "joint_stiffness_axial": (1500.0, 45.0), "joint_stiffness_torsional": (20.0, 0.6),
            "joint_damping_axial": (5.0, 0.75), "joint_damping_torsional": (0.06, 0.009),
        },
        ("displacement_1", "displacement_2", "rotation_1", "rotation_2", "acceleration_1", "angular_acceleration_1"),
        ("force", "torque"), structure_of, ("axial", "torsional"),
    ),
    HostRig(
        "chain",
        {
            **{f"mass_{i}": (2.0, 0.02) for i in (1, 2, 3)},
            **{f"stiffness_{i}": (4000.0, 80.0) for i in (1, 2, 3)},
            **{f"damping_{i}": (6.0, 0.6) for i in (1, 2, 3)},
        },
        tuple(f"{what}_{i}" for what in ("displacement", "acceleration") for i in (1, 2, 3)),
        ("force",), _chain, ("spring_1", "spring_2", "spring_3"),
    ),
)  # fmt: skip
