"""The nominal model of a robot as an MJCF, and how well the dynamics here agree with MuJoCo's on it."""

from __future__ import annotations

import numpy as np
from robot_case_sets import differences_from_mujoco

from bench.arrays import Array
from sixth_robots_cases.dynamics import mass_matrix_and_bias
from sixth_robots_cases.plant import machine_of
from sixth_robots_cases.robots import Part, Robot, Vector


def mjcf(robot: Robot) -> str:
    """The model of a robot as it is stated, with its actuators."""
    lines = [
        f'<mujoco model="{robot.name}">',
        '  <compiler angle="radian" autolimits="true"/>',
        '  <option timestep="0.0005" gravity="0 0 -9.81" integrator="implicitfast"/>',
        "  <worldbody>",
    ]
    for depth, p in enumerate(robot.parts):
        pad = "    " + "  " * depth
        lines += [
            f'{pad}<body name="{p.body}" pos="{_text(p.pos)}">',
            f'{pad}  <inertial pos="{_text(p.com)}" mass="{p.mass:g}" diaginertia="{_text(p.inertia)}"/>',
            f'{pad}  <joint name="{p.joint}" type="{"slide" if p.slide else "hinge"}" axis="{_text(p.axis)}" '
            f'damping="{p.damping:g}" armature="{p.armature:g}"/>',
        ]
    lines += ["    " + "  " * depth + "</body>" for depth in reversed(range(len(robot.parts)))]
    lines += ["  </worldbody>", "  <actuator>"]
    lines += ["    " + _actuator(p) for p in robot.parts]
    return "\n".join([*lines, "  </actuator>", "</mujoco>", ""])


def _actuator(part: Part) -> str:
    d = part.drive
    limit = f' forcerange="{-d.limit:g} {d.limit:g}"' if d.limit else ""
    if d.kind == "torque":
        return f'<motor name="{d.name}" joint="{part.joint}"{limit}/>'
    if d.kind == "position":
        return f'<position name="{d.name}" joint="{part.joint}" kp="{d.kp:g}" kv="{d.kv:g}"{limit}/>'
    return f'<velocity name="{d.name}" joint="{part.joint}" kv="{d.kv:g}"{limit}/>'


def _text(vector: Vector) -> str:
    return " ".join(f"{x:g}" for x in vector)


def against_mujoco(robot: Robot, *, states: int = 5) -> float:
    """Largest difference of mass matrix and bias of the nominal model from MuJoCo's, see `differences_from_mujoco`."""
    nominal = machine_of(robot, {})

    def dynamics(q: Array, v: Array) -> tuple[Array, Array]:
        matrix, bias = mass_matrix_and_bias(nominal, q, v)
        return matrix + np.diag(nominal.armature), bias

    return differences_from_mujoco(mjcf(robot), dynamics, states=states)
