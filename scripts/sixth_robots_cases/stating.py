"""What the maker of a robot states of it: the nominal.json of a case."""

from __future__ import annotations

import math
from typing import Any

from sixth_robots_cases.cases import RobotCase
from sixth_robots_cases.plant import Stated, stated
from sixth_robots_cases.recording import SCALES, load_heading, position_heading, unit_of
from sixth_robots_cases.robots import Part

SHARES = {"right": 1.0, "half": 0.5, "none": 0.0}
"""Noise as it is stated over what it is, by what is said of it; not stated where zero."""


def nominal_document(case: RobotCase) -> dict[str, Any]:
    """Rig, parameters with their uncertainties, and channels."""
    return {
        "rig": f"{case.robot.name}.xml",
        "load_interpolation": "zero_order_hold",
        "parameters": {name: _parameter(one) for name, one in stated(case.robot).items()},
        "channels": {"time": {"unit": "s"}, **_loads(case), **_positions(case)},
    }


def _parameter(one: Stated) -> dict[str, Any]:
    told = {"value": _digits(one.value, 6), "std": _digits(one.std, 4), "unit": one.unit}
    return told | ({"alike": one.alike, "each": one.each} if one.alike else {})


def _loads(case: RobotCase) -> dict[str, dict[str, Any]]:
    lab, found = case.laboratory, {}
    for part in case.robot.parts:
        channel: dict[str, Any] = {
            "role": lab.role,
            "actuator": part.drive.name,
            "unit": _load_unit(case, part),
        }
        if lab.role == "command":
            channel["noise_std"] = 0
        elif SHARES[lab.said]:
            channel["noise_std"] = SHARES[lab.said] * lab.load_noise * part.rated
        found[load_heading(part)] = channel
    return found


def _load_unit(case: RobotCase, part: Part) -> str:
    if part.drive.kind == "position":
        return unit_of(case, part)
    if part.drive.kind == "velocity":
        return "m/s" if part.slide else "rad/s"
    return "N" if part.slide else "N m"


def _positions(case: RobotCase) -> dict[str, dict[str, Any]]:
    lab, found = case.laboratory, {}
    for part, noise, step in zip(case.robot.parts, lab.noise, lab.steps, strict=True):
        unit = unit_of(case, part)
        channel: dict[str, Any] = {"unit": unit, "joint": part.joint, "quantity": "position"}
        if SHARES[lab.said]:
            std = SHARES[lab.said] * SCALES[unit] * math.hypot(noise, step / 12**0.5)
            channel["noise_std"] = _digits(std, 3)
        if step:
            channel["resolution"] = _digits(SCALES[unit] * step, 6)
        found[position_heading(part)] = channel
    return found


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")
