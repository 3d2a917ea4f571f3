"""The nominal model of a robot as an MJCF, and how well the dynamics here agree with MuJoCo's on it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from robot_case_sets import differences_from_mujoco

from bench.arrays import Array
from third_robots_cases.dynamics import (
    GRAVITY,
    joint_forces,
    mass_matrix,
    place,
    room_to_move,
    room_to_place,
)
from third_robots_cases.plant import nominal_plant
from third_robots_cases.robots import Drive, Link, Robot

HEAD = """  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
"""


def actuator_name(link: Link, drive: Drive) -> str:
    """Name of the actuator of a link's joint."""
    return f"{link.joint}_{'servo' if drive == 'servo' else 'motor'}"


def mjcf(robot: Robot, drive: Drive) -> str:
    """The model of a robot, with a site at the tip of each body, and actuators for a kind of drive."""
    bodies = "".join(_body(link, "  " * (k + 2)) for k, link in enumerate(robot.links))
    actuators = "".join(_actuator(link, drive) for link in robot.links)
    return (
        f'<mujoco model="{robot.name}">\n{HEAD}{bodies}    {"</body>" * len(robot.links)}\n  </worldbody>\n'
        f"  <actuator>\n{actuators}  </actuator>\n</mujoco>\n"
    )


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{x:.8g}" for x in values)


def _body(link: Link, indent: str) -> str:
    """The opening of a body with what it holds; the next body of the chain goes into it."""
    tip = _numbers(link.tip)
    kind = ' type="slide"' if link.kind == "slide" else ""
    inertia = f'mass="{link.mass:.8g}" fullinertia="{_numbers(link.inertia)}"'
    joint = f'name="{link.joint}"{kind} axis="{_numbers(link.axis)}" range="{_numbers(link.travel)}"'
    return (
        f'{indent}<body name="{link.body}" pos="{_numbers(link.origin)}"><inertial pos="{_numbers(link.com)}" {inertia}/>'
        f'<joint {joint} armature="{link.armature:.8g}" damping="{link.damping:.8g}"/>'
        f'<geom type="capsule" fromto="0 0 0 {tip}" size="0.03"/><site name="{link.body}_tip" pos="{tip}"/>\n'
    )


def _actuator(link: Link, drive: Drive) -> str:
    names = f'name="{actuator_name(link, drive)}" joint="{link.joint}"'
    if drive == "servo":
        kp, kv, limit = link.servo
        return f'    <position {names} kp="{kp:.8g}" kv="{kv:.8g}" forcerange="{-limit:.8g} {limit:.8g}"/>\n'
    gear = link.motor.gear if drive == "current" else 1.0
    largest = link.motor.limit / gear
    return f'    <motor {names} gear="{gear:.8g}" forcerange="{-largest:.5g} {largest:.5g}"/>\n'


def against_mujoco(robot: Robot, drive: Drive, *, states: int = 5) -> float:
    """Largest difference of mass matrix and bias of the nominal model from MuJoCo's, see `differences_from_mujoco`."""
    plant, n = nominal_plant(robot, drive), len(robot.links)
    placed, moved = room_to_place(n), room_to_move(n)

    def dynamics(q: Array, v: Array) -> tuple[Array, Array]:
        links, bias = np.zeros((n, n)), np.zeros(n)
        place(q, plant.chain, placed)
        mass_matrix(plant.chain, placed, moved, links)
        joint_forces(v, np.zeros(n), GRAVITY, plant.chain, placed, moved, bias)
        return links + np.diag(plant.drives.armature), bias

    return differences_from_mujoco(mjcf(robot, drive), dynamics, states=states)
