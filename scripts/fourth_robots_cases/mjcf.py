"""The nominal model of a robot as an MJCF, and how well the dynamics here agree with MuJoCo's on it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from robot_case_sets import differences_from_mujoco

from bench.arrays import Array
from fourth_robots_cases.dynamics import mass_matrix_and_bias
from fourth_robots_cases.plant import chain_of, nominal_parameters
from fourth_robots_cases.robots import Drive, Link, Robot

HEAD = """  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
"""
ENDINGS: dict[Drive, str] = {"position": "servo", "velocity": "drive", "current": "motor", "torque": "motor"}
"""Of the names of actuators."""


def actuator_name(link: Link, drive: Drive) -> str:
    """Name of the actuator of a link's joint."""
    return f"{link.joint}_{ENDINGS[drive] if link.driven else 'none'}"


def mjcf(robot: Robot) -> str:
    """The model of a robot, with a site at the tip of each body, and with its actuators."""
    bodies = "".join(_body(link, "  " * (k + 2)) for k, link in enumerate(robot.links))
    actuators = "".join(f"    {_actuator(link, robot.drive)}\n" for link in robot.links)
    return (
        f'<mujoco model="{robot.name}">\n{HEAD}{bodies}    {"</body>" * len(robot.links)}\n  </worldbody>\n'
        f"  <actuator>\n{actuators}  </actuator>\n</mujoco>\n"
    )


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{x:.17g}" for x in values)


def _body(link: Link, indent: str) -> str:
    """The opening of a body with what it holds; the next body of the chain goes into it."""
    kind = "slide" if link.slide else "hinge"
    spring = link.spring
    springs = (
        f' stiffness="{spring.stiffness:.17g}" springref="{spring.rest:.17g}"' if spring.stiffness else ""
    )
    joint = f'<joint name="{link.joint}" type="{kind}" axis="{_numbers(link.direction)}"'
    return (
        f'{indent}<body name="{link.body}" pos="{_numbers(link.origin)}">\n'
        f'{indent}  <inertial pos="{_numbers(link.com)}" mass="{link.mass:.17g}" diaginertia="{_numbers(link.inertia)}"/>\n'
        f'{indent}  {joint} armature="{link.armature:.17g}" damping="{link.damping:.17g}"{springs}/>\n'
        f'{indent}  <site name="{link.body}_tip" pos="{_numbers(link.tip)}"/>\n'
    )


def _actuator(link: Link, drive: Drive) -> str:
    names = f'name="{actuator_name(link, drive)}" joint="{link.joint}"'
    kp, kv, limit = link.servo
    if not link.driven or drive == "torque":
        return f"<motor {names}/>"
    if drive == "current":
        return f'<motor {names} gear="{link.gear:g}"/>'
    gains = f'kp="{kp:g}" kv="{kv:g}"' if drive == "position" else f'kv="{kv:g}"'
    return f'<{drive} {names} {gains} forcerange="{-limit:g} {limit:g}"/>'


def against_mujoco(robot: Robot, *, states: int = 5) -> float:
    """Largest difference of mass matrix and bias of the nominal model from MuJoCo's, see `differences_from_mujoco`."""
    parameters = nominal_parameters(robot)
    chain = chain_of(robot, parameters)

    def dynamics(q: Array, v: Array) -> tuple[Array, Array]:
        matrix, bias = mass_matrix_and_bias(q, v, chain)
        return matrix + np.diag(parameters.armature), bias

    return differences_from_mujoco(mjcf(robot), dynamics, states=states)
