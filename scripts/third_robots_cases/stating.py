"""What the maker of a robot states of it: the nominal.json of a case."""

from __future__ import annotations

from typing import Any

from third_robots_cases import plant
from third_robots_cases.cases import RobotCase
from third_robots_cases.mjcf import actuator_name
from third_robots_cases.plant import Plant
from third_robots_cases.recording import Noise, command_columns, counts
from third_robots_cases.robots import Link


def nominal_document(case: RobotCase, true: Plant, noise: Noise) -> dict[str, Any]:
    """Rig, rate, parameters with their uncertainties, and channels.

    Args:
        case: The case.
        true: The robot as it is, by whose torques per current the noise of currents is stated.
        noise: Standard deviations of the noise.
    """
    channels = {"time": {"unit": "s"}, **_commands(case, true, noise), **_motions(case, noise)}
    if not case.noise_stated:
        for channel in channels.values():
            channel.pop("noise_std", None)
    document = {
        "rig": "model.xml",
        "sample_rate_hz": float(case.rate),
        "parameters": _parameters(case),
        "channels": channels,
    }
    return document | ({"load_interpolation": "zero_order_hold"} if case.drive == "servo" else {})


def _parameters(case: RobotCase) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}

    def state(key: str, value: float, std: float, unit: str) -> None:
        found[key] = {"value": float(value), "std": std * value, "unit": unit}

    for link in case.robot.links:
        state(f"mass:{link.body}", link.mass, plant.MASS, "kg")
    for link in case.robot.links:
        slide, actuator = link.kind == "slide", actuator_name(link, case.drive)
        state(f"damping:{link.joint}", link.damping, plant.DAMPING, "N s/m" if slide else "N m s/rad")
        state(f"armature:{link.joint}", link.armature, plant.ARMATURE, "kg" if slide else "kg m^2")
        if case.drive == "servo":
            state(f"kp:{actuator}", link.servo.kp, plant.KP, "N/m" if slide else "N m/rad")
        if case.drive == "current":
            state(f"gear:{actuator}", link.motor.gear, plant.GEAR, "N m/A")
    return found


def _commands(case: RobotCase, true: Plant, noise: Noise) -> dict[str, dict[str, Any]]:
    found = {}
    for k, (column, link) in enumerate(zip(command_columns(case), case.robot.links, strict=True)):
        if case.drive == "servo":
            unit, role, std = _unit(link), "command", 0.0
        elif case.drive == "torque":
            unit, role, std = "N" if link.kind == "slide" else "N m", "measured", float(noise.torque[k])
        else:
            unit, role, std = "A", "measured", float(noise.torque[k] / true.ratio[k])
        actuator = actuator_name(link, case.drive)
        found[column] = {"unit": unit, "role": role, "actuator": actuator, "noise_std": std}
    return found


def _motions(case: RobotCase, noise: Noise) -> dict[str, dict[str, Any]]:
    found = {}
    quantities = [("position", "", noise.position)]
    if case.velocities:
        quantities.append(("velocity", "/s", noise.velocity))
    for quantity, per, std in quantities:
        for k, (link, count) in enumerate(zip(case.robot.links, counts(case), strict=True)):
            channel = {
                "unit": _unit(link) + per,
                "joint": link.joint,
                "quantity": quantity,
                "side": case.side,
            }
            rounded = {"resolution": count} if quantity == "position" and count is not None else {}
            found[f"{link.joint}_{quantity}"] = {**channel, "noise_std": float(std[k]), **rounded}
    return found


def _unit(link: Link) -> str:
    return "m" if link.kind == "slide" else "rad"
