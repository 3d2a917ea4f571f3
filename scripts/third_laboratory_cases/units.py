"""Units of the channels, and what is told of those of oscillators and joint rigs."""

from __future__ import annotations

import math
from collections.abc import Mapping

from third_laboratory_cases.case import Channel, Parameter

MILLIMETRE, DEGREE = 1e3, math.degrees(1.0)
"""Values in that unit over those in SI units."""
MEASURED = {"role": "measured"}
PRESCRIBED = {"role": "prescribed"}


def schedule(unit: str, noise: float) -> Channel:
    """A channel with a scheduling signal."""
    return Channel("schedule", unit, noise, {"role": "scheduling"})


def load_on(actuator: str) -> dict[str, str]:
    """What is told of a channel that holds the measured load of an actuator."""
    return {**MEASURED, "actuator": actuator}


def of_joint(joint: str, quantity: str) -> dict[str, str]:
    """What is told of a channel that holds a quantity of a joint."""
    return {"joint": joint, "quantity": quantity}


def stroke(noise: float) -> Channel:
    """A displacement that a machine prescribes [mm]."""
    return Channel("displacement", "mm", noise, PRESCRIBED, MILLIMETRE)


def force(noise: float = 0.004) -> Channel:
    """A measured force [N]."""
    return Channel("load", "N", noise, MEASURED)


def displacement(noise: float = 0.004) -> Channel:
    """A displacement [mm]."""
    return Channel("displacement", "mm", noise, scale=MILLIMETRE)


def acceleration(noise: float = 0.01) -> Channel:
    """An acceleration [m/s^2]."""
    return Channel("acceleration", "m/s^2", noise)


def oscillator(
    mass: float = 0.01, damping: float = 0.15, stiffness: float = 0.02, *, body: str = "", joint: str = ""
) -> dict[str, Parameter]:
    """Parameters of an oscillator, by their stated standard deviations as fractions of the true values.

    Args:
        mass: Of its mass.
        damping: Of its damping.
        stiffness: Of its stiffness.
        body: Its body in an MJCF; none where empty.
        joint: Its joint there.
    """
    at_body, at_joint = (f":{name}" if name else "" for name in (body, joint))
    return {
        f"mass{at_body}": Parameter("mass", mass, "kg"),
        f"damping{at_joint}": Parameter("damping", damping, "N s/m"),
        f"stiffness{at_joint}": Parameter("stiffness", stiffness, "N/m"),
    }


def rotor(body: str, joint: str, *, inertia: float, damping: float, stiffness: float) -> dict[str, Parameter]:
    """Parameters of an oscillator that turns, alike."""
    return {
        f"inertia:{body}": Parameter("mass", inertia, "kg m^2"),
        f"damping:{joint}": Parameter("damping", damping, "N m s/rad"),
        f"stiffness:{joint}": Parameter("stiffness", stiffness, "N m/rad"),
    }


def component(
    relative: Mapping[str, float], stiffness: tuple[str, float] = ("N/m", 1.0)
) -> dict[str, Parameter]:
    """Parameters of a component, by their stated standard deviations; that of its stiffness with its unit and factor."""
    units = {"stiffness": stiffness, "damping": ("N s/m", 1.0), "coulomb": ("N", 1.0)}
    return {name: Parameter(name, share, *units[name]) for name, share in relative.items()}
