"""The nominal model of a robot as an MJCF, and how well the dynamics here agree with MuJoCo's on it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from robot_case_sets import differences_from_mujoco

from bench.arrays import Array
from second_robots_cases.dynamics import bias_force, mass_matrix, pose_of
from second_robots_cases.plant import nominal_plant
from second_robots_cases.robots import Link, Robot, Servo

TIMESTEP = 0.001
"""Time step of the nominal models [s]."""
HEAD = f"""  <compiler angle="radian" autolimits="true"/>
  <option timestep="{TIMESTEP}" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
"""


def mjcf(robot: Robot) -> str:
    """The model of a robot, with a site at the tip of each body."""
    n = len(robot.links)
    bodies = "".join(_body(link, "  " * (k + 2)) for k, link in enumerate(robot.links))
    ends = "".join("  " * (k + 2) + "</body>\n" for k in reversed(range(n)))
    drives = "".join(_actuator(link) for link in robot.links)
    return (
        f'<mujoco model="{robot.name}">\n{HEAD}{bodies}{ends}  </worldbody>\n'
        f"  <actuator>\n{drives}  </actuator>\n</mujoco>\n"
    )


def actuator_name(link: Link) -> str:
    """Name of the actuator of a link's joint."""
    return f"{link.joint}_{'servo' if isinstance(link.drive, Servo) else 'motor'}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{x:.6g}" for x in values)


def _body(link: Link, indent: str) -> str:
    """The opening of a body with what it holds; the next body of the chain goes into it."""
    tip = _numbers(link.tip)
    joint = (
        f'name="{link.joint}" type="{link.kind}" axis="{_numbers(link.axis)}" range="{_numbers(link.travel)}"'
    )
    return (
        f'{indent}<body name="{link.body}" pos="{_numbers(link.origin)}">\n'
        f'{indent}  <joint {joint} damping="{link.damping:g}" armature="{link.armature:g}"/>\n'
        f'{indent}  <inertial pos="{_numbers(link.com)}" mass="{link.mass:g}" diaginertia="{_numbers(link.inertia)}"/>\n'
        f'{indent}  <geom type="capsule" fromto="0 0 0 {tip}" size="{link.radius:g}" mass="0"/>\n'
        f'{indent}  <site name="{link.body}_tip" pos="{tip}"/>\n'
    )


def _actuator(link: Link) -> str:
    drive, names = link.drive, f'name="{actuator_name(link)}" joint="{link.joint}"'
    if not isinstance(drive, Servo):
        return f'    <motor {names} gear="{drive.gear:g}" ctrlrange="-{drive.limit:g} {drive.limit:g}"/>\n'
    gains = f'kp="{drive.kp:g}" kv="{drive.kv:g}" forcerange="-{drive.limit:g} {drive.limit:g}"'
    samples = max(2, round(drive.delay / TIMESTEP) + 2)
    late = f' delay="{drive.delay:g}" nsample="{samples}"' if drive.delay else ""
    return f"    <position {names} {gains}{late}/>\n"


def against_mujoco(robot: Robot, *, states: int = 5) -> float:
    """Largest difference of mass matrix and bias of the nominal model from MuJoCo's, see `differences_from_mujoco`."""
    plant = nominal_plant(robot)

    def dynamics(q: Array, v: Array) -> tuple[Array, Array]:
        pose = pose_of(q, plant.chain)
        matrix = mass_matrix(plant.chain, pose) + np.diag(plant.drives.armature)
        return matrix, bias_force(v, plant.chain, pose)

    return differences_from_mujoco(mjcf(robot), dynamics, states=states)
