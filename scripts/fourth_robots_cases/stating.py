"""What the maker of a robot states of it: the nominal.json of a case."""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.arrays import Array
from fourth_robots_cases.cases import RobotCase
from fourth_robots_cases.mjcf import actuator_name
from fourth_robots_cases.plant import COORDINATES, RELATIVE_STD
from fourth_robots_cases.recording import command_headings
from fourth_robots_cases.robots import Link, Robot


def nominal_document(case: RobotCase, torque_std: Array) -> dict[str, Any]:
    """Rig, rate, parameters with their uncertainties, and channels.

    Args:
        case: The case.
        torque_std: Standard deviation of the noise of currents or torques [A or N m] (n).
    """
    held = {"load_interpolation": "zero_order_hold"} if case.robot.has_servos else {}
    channels = {"time": {"unit": "s"}, **_commands(case, torque_std), **_positions(case)}
    return {
        "rig": "model.xml",
        "sample_rate_hz": float(case.rate),
        **held,
        "parameters": _parameters(case.robot),
        "channels": channels,
    }


def _parameters(robot: Robot) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}

    def state(key: str, value: float, std: float, unit: str) -> None:
        found[key] = {"value": float(value), "std": _digits(std, 6), "unit": unit}

    def relative(name: str, place: str, value: float, unit: str) -> None:
        if value:
            state(f"{name}:{place}", value, RELATIVE_STD[name] * value, unit)

    for link in robot.links:
        relative("mass", link.body, link.mass, "kg")
    if robot.uncertain is not None:
        quantity, body, std = robot.uncertain
        link = robot.links[robot.bodies.index(body)]
        if quantity == "inertia":
            state(f"{quantity}:{body}", link.inertia[1], std * link.inertia[1], "kg m^2")
        else:
            state(f"{quantity}:{body}", link.com[COORDINATES[quantity]], std, "m")
    for link in robot.links:
        actuator, rate_unit = actuator_name(link, robot.drive), "N s/m" if link.slide else "N m s/rad"
        relative("damping", link.joint, link.damping, rate_unit)
        relative("armature", link.joint, link.armature, "kg" if link.slide else "kg m^2")
        relative("stiffness", link.joint, link.spring.stiffness, "N m/rad")
        relative("kp", actuator, link.servo.kp, "N/m" if link.slide else "N m/rad")
        relative("kv", actuator, link.servo.kv, rate_unit)
        if robot.drive == "current":
            relative("gear", actuator, link.gear, "N m/A")
    return found


def _commands(case: RobotCase, torque_std: Array) -> dict[str, dict[str, Any]]:
    found, drive = {}, case.robot.drive
    for j, (heading, link) in enumerate(zip(command_headings(case.robot), case.robot.links, strict=True)):
        channel: dict[str, Any] = {"actuator": actuator_name(link, drive)}
        if not link.driven:
            channel |= {"unit": "N m", "role": "measured", "noise_std": 0.0}
        elif case.robot.has_servos:
            unit = _unit(case, link) if drive == "position" else "rad/s"
            channel |= {"unit": unit, "role": "command", "noise_std": 0.0}
        else:
            channel |= {"unit": "A" if drive == "current" else "N m", "role": "measured"}
            if case.stated is not None:
                channel["noise_std"] = _digits(case.stated * torque_std[j], 4)
        found[heading] = channel
    return found


def _positions(case: RobotCase) -> dict[str, dict[str, Any]]:
    found, unit = {}, 180 / np.pi if case.degrees else 1.0
    for link, std, count in zip(case.robot.links, case.position_noise, case.encoder_counts, strict=True):
        channel: dict[str, Any] = {
            "unit": _unit(case, link),
            "joint": link.joint,
            "quantity": "position",
            "side": case.side,
        }
        if case.stated is not None:
            channel["noise_std"] = _digits(case.stated * std * unit, 4)
        if count is not None:
            channel["resolution"] = _digits(count, 10)
        found[link.joint] = channel
    return found


def _unit(case: RobotCase, link: Link) -> str:
    """Unit of the positions of a link's joint in the log."""
    if link.slide:
        return "m"
    return "deg" if case.degrees else "rad"


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")
