"""The nominal model of a robot as an MJCF, and how well the dynamics here agree with MuJoCo's on it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from robot_case_sets import differences_from_mujoco

from bench.arrays import Array
from fifth_robots_cases.dynamics import mass_matrix_and_bias
from fifth_robots_cases.plant import chain_of, nominal_parameters
from fifth_robots_cases.robots import Link, Robot


def mjcf(robot: Robot) -> str:
    """The model of a robot, with a site at the tip of each body, and with its actuators."""
    count = len(robot.links)
    bodies = "".join(_body(link, "  " * (j + 2)) for j, link in enumerate(robot.links))
    ends = "".join("  " * (j + 2) + "</body>\n" for j in reversed(range(count)))
    drives = "".join(f"    {_actuator(robot, j)}\n" for j in range(count))
    return (
        f'<mujoco model="{robot.name}">\n  <compiler angle="radian" inertiafromgeom="false"/>\n'
        f'  <option timestep="{_number(robot.timestep)}" integrator="implicitfast" gravity="0 0 -9.81"/>\n'
        f'  <default><geom contype="0" conaffinity="0"/></default>\n  <worldbody>\n{bodies}{ends}'
        f"  </worldbody>\n  <actuator>\n{drives}  </actuator>\n</mujoco>\n"
    )


def _number(value: float) -> str:
    return f"{float(value):.10g}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(x) for x in values)


def _body(link: Link, indent: str) -> str:
    """The opening of a body with what it holds; the next body of the chain goes into it."""
    extra, spring, inner = "", link.spring, f"{indent}  "
    if spring.stiffness:
        extra += f' stiffness="{_number(spring.stiffness)}" springref="{_number(spring.rest)}"'
    if link.frictionloss:
        extra += f' frictionloss="{_number(link.frictionloss)}"'
    kind, tip = "slide" if link.slide else "hinge", _numbers(link.tip)
    joint = f'name="{link.joint}" type="{kind}" axis="{_numbers(link.axis)}"'
    inertial = (
        f'pos="{_numbers(link.com)}" mass="{_number(link.mass)}" fullinertia="{_numbers(link.full_inertia)}"'
    )
    return (
        f'{indent}<body name="{link.body}" pos="{_numbers(link.origin)}">\n{inner}<inertial {inertial}/>\n'
        f'{inner}<joint {joint} damping="{_number(link.damping)}" armature="{_number(link.armature)}"{extra}/>\n'
        f'{inner}<geom type="capsule" fromto="0 0 0 {tip}" size="0.01"/>\n'
        f'{inner}<site name="{link.body}_tip" pos="{tip}"/>\n'
    )


def _actuator(robot: Robot, j: int) -> str:
    link = robot.links[j]
    names, (kp, kv, limit) = f'name="{robot.actuators[j]}" joint="{link.joint}"', link.servo
    if robot.motor is not None:
        constant, resistance, voltage = robot.motor
        damping = _number(constant**2 / resistance)
        return (
            f'<dcmotor {names} motorconst="{_number(constant)}" resistance="{_number(resistance)}" input="pos" '
            f'controller="{_number(kp)} 0 {damping} 0 0 {_number(voltage)}"/>'
        )
    if not robot.has_servos:
        return f'<motor {names} gear="{_number(link.gear)}"/>'
    gains = f'kp="{_number(kp)}" kv="{_number(kv)}"' if robot.drive == "position" else f'kv="{_number(kv)}"'
    limited = f' forcerange="{_number(-limit)} {_number(limit)}"' if limit < 1e5 else ""
    return f"<{robot.drive} {names} {gains}{limited}/>"


def against_mujoco(robot: Robot, *, states: int = 5) -> float:
    """Largest difference of mass matrix and bias of the nominal model from MuJoCo's, see `differences_from_mujoco`."""
    parameters = nominal_parameters(robot)
    chain = chain_of(robot, parameters["mass"])

    def dynamics(q: Array, v: Array) -> tuple[Array, Array]:
        matrix, bias = mass_matrix_and_bias(q, v, chain)
        return matrix + np.diag(parameters["armature"]), bias

    return differences_from_mujoco(mjcf(robot), dynamics, states=states)
