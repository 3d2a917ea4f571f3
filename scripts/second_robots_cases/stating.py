"""What the maker of a robot states of it: the nominal.json of a case."""

from __future__ import annotations

from typing import Any

from second_robots_cases import plant
from second_robots_cases.cases import RobotCase
from second_robots_cases.mjcf import actuator_name
from second_robots_cases.recording import command_columns, factors, position_columns, position_noise
from second_robots_cases.robots import Link, Servo

DELAY_STD = 0.001
"""Stated uncertainty of the delay of a drive [s]."""


def nominal_document(case: RobotCase) -> dict[str, Any]:
    """Rig, rate, parameters with their uncertainties, and channels."""
    document = {
        "rig": "model.xml",
        "sample_rate_hz": case.robot.rate,
        "parameters": _parameters(case),
        "channels": {"time": {"unit": "s"}, **_commands(case), **_positions(case)},
    }
    return document | ({"load_interpolation": "zero_order_hold"} if case.hold_stated else {})


def _parameters(case: RobotCase) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for link in case.robot.links:
        std = round(plant.MASS * link.mass, 6)
        found[f"mass:{link.body}"] = {"value": link.mass, "std": std, "unit": "kg"}
    for link in case.robot.links:
        found |= _joint_parameters(case, link)
    return found


def _joint_parameters(case: RobotCase, link: Link) -> dict[str, dict[str, Any]]:
    slide, drive = link.kind == "slide", link.drive
    found: dict[str, dict[str, Any]] = {}

    def state(key: str, value: float, std: float, each: float, unit: str) -> None:
        alike = {"alike": case.alike, "each": round(each * value, 6)} if case.alike else {}
        found[key] = {"value": value, "std": round(std * value, 6), **alike, "unit": unit}

    damping, inertia = ("N s/m", "kg") if slide else ("N m s/rad", "kg m^2")
    state(f"damping:{link.joint}", link.damping, plant.DAMPING, plant.EACH_DAMPING, damping)
    state(f"armature:{link.joint}", link.armature, plant.ARMATURE, plant.EACH_ARMATURE, inertia)
    if isinstance(drive, Servo):
        std, unit = plant.ALIKE_KP if case.alike else plant.KP, "N/m" if slide else "N m/rad"
        state(f"kp:{actuator_name(link)}", drive.kp, std, plant.EACH_KP, unit)
        if case.delay_stated:
            found[f"delay:{actuator_name(link)}"] = {"value": drive.delay, "std": DELAY_STD, "unit": "s"}
    elif case.robot.torque and case.robot.torque.gears_uncertain:
        std, unit = plant.GEAR * drive.gear, "N/A" if slide else "N m/A"
        found[f"gear:{actuator_name(link)}"] = {"value": drive.gear, "std": std, "unit": unit}
    return found


def _commands(case: RobotCase) -> dict[str, dict[str, Any]]:
    robot, found = case.robot, {}
    for k, (column, link) in enumerate(zip(command_columns(robot), robot.links, strict=True)):
        unit, role = (robot.torque.unit, "measured") if robot.torque else (robot.units[k], "command")
        channel: dict[str, Any] = {"unit": unit, "role": role, "actuator": actuator_name(link)}
        if robot.torque is None:
            channel["noise_std"] = 0
        elif case.noise_stated:
            channel["noise_std"] = robot.torque.noise[k]
        found[column] = channel
    return found


def _positions(case: RobotCase) -> dict[str, dict[str, Any]]:
    robot, found = case.robot, {}
    noise, factor = position_noise(robot), factors(robot)
    for k, (column, link) in enumerate(zip(position_columns(robot), robot.links, strict=True)):
        channel: dict[str, Any] = {"unit": robot.units[k], "joint": link.joint, "quantity": "position"}
        channel["resolution"] = float(f"{robot.resolution[k] * factor[k]:.6g}")
        if case.noise_stated:
            channel["noise_std"] = float(f"{noise[k] * factor[k]:.4g}")
        if case.motor_side:
            channel["side"] = "motor"
        found[column] = channel
    return found
