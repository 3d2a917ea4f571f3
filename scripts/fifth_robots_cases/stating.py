"""What the maker of a robot states of it: the nominal.json of a case."""

from __future__ import annotations

from typing import Any

from fourth_robots_cases.recording import command_headings

from fifth_robots_cases.cases import RobotCase
from fifth_robots_cases.plant import stated
from fifth_robots_cases.recording import position_headings
from fifth_robots_cases.robots import Robot

LOAD_UNITS = {"position": "rad", "velocity": "rad/s", "current": "A", "torque": "N m"}
"""Units of goals, currents and torques by the drive."""


def nominal_document(case: RobotCase) -> dict[str, Any]:
    """Rig, rate, parameters with their uncertainties, and channels."""
    document = {
        "rig": f"{case.robot.name}.xml",
        "sample_rate_hz": float(case.rate),
        "parameters": _parameters(case.robot),
        "channels": {"time": {"unit": "s"}, **_loads(case), **_motion(case)},
    }
    if case.held:
        document["load_interpolation"] = "zero_order_hold"
    if case.tells_motion:
        document["starts_in_motion"] = True
    return document


def _parameters(robot: Robot) -> dict[str, dict[str, Any]]:
    found = {}
    for one in stated(robot):
        found[one.name] = {"value": one.value, "std": one.std, "unit": one.unit}
        if one.known.alike is not None:
            found[one.name] |= {"alike": one.known.alike, "each": one.each}
    return found


def _loads(case: RobotCase) -> dict[str, dict[str, Any]]:
    robot, found = case.robot, {}
    for j, heading in enumerate(command_headings(robot)):
        role = "command" if robot.has_servos else "measured"
        channel: dict[str, Any] = {
            "unit": LOAD_UNITS[robot.drive],
            "role": role,
            "actuator": robot.actuators[j],
        }
        if case.load_noise is None:
            channel["noise_std"] = 0.0
        elif case.stated is not None:
            channel["noise_std"] = _digits(case.load_noise[j] * case.stated)
        found[heading] = channel
    return found


def _motion(case: RobotCase) -> dict[str, dict[str, Any]]:
    found = {}
    for j, (link, heading) in enumerate(zip(case.robot.links, position_headings(case), strict=True)):
        unit = "m" if link.slide else "rad"
        found[heading] = _encoder(case, link.joint, "position", unit, case.position_noise[j])
        found[heading]["resolution"] = case.counts[j]
        if case.speed_noise is not None:
            std = case.speed_noise[j]
            found[f"{link.joint}_speed"] = _encoder(case, link.joint, "velocity", f"{unit}/s", std)
    return found


def _encoder(case: RobotCase, joint: str, quantity: str, unit: str, std: float) -> dict[str, Any]:
    channel: dict[str, Any] = {"unit": unit, "joint": joint, "quantity": quantity, "side": case.side}
    if case.stated is not None:
        channel["noise_std"] = _digits(std * case.stated)
    return channel


def _digits(value: float) -> float:
    return float(f"{value:.3g}")
