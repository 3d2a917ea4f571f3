"""Units of the channels, channels of a joint, and parameters of a rig with one degree of freedom."""

from __future__ import annotations

from third_laboratory_cases.case import Parameter
from third_laboratory_cases.units import of_joint

from fourth_laboratory_cases.case import Channel

MICROMETRE, KILONEWTON, GRAVITIES = 1e6, 1e-3, 1.0 / 9.80665
"""Values in that unit (g for the last) over those in SI units."""


def position(joint: str, unit: str, noise: float, scale: float) -> Channel:
    """A displacement or angle of a joint."""
    return Channel("displacement", unit, noise, of_joint(joint, "position"), scale)


def velocity(joint: str, unit: str, noise: float, scale: float) -> Channel:
    """A velocity of a joint."""
    return Channel("velocity", unit, noise, of_joint(joint, "velocity"), scale)


def acceleration(joint: str, unit: str, noise: float) -> Channel:
    """An acceleration of a joint."""
    return Channel("acceleration", unit, noise, of_joint(joint, "acceleration"))


def turning(body: str, joint: str, inertia: float, stiffness: float, damping: float) -> dict[str, Parameter]:
    """Parameters of a body that turns on a joint, with their relative standard deviations."""
    return {
        f"inertia:{body}": Parameter("mass", inertia, "kg m^2"),
        f"stiffness:{joint}": Parameter("stiffness", stiffness, "N m/rad"),
        f"damping:{joint}": Parameter("damping", damping, "N m s/rad"),
    }


def sliding(body: str, joint: str, mass: float, stiffness: float, damping: float) -> dict[str, Parameter]:
    """Parameters of a body that slides on a joint, with their relative standard deviations."""
    return {
        f"mass:{body}": Parameter("mass", mass, "kg"),
        f"stiffness:{joint}": Parameter("stiffness", stiffness, "N/m"),
        f"damping:{joint}": Parameter("damping", damping, "N s/m"),
    }


def oscillator(
    mass: float, stiffness: float, damping: float, unit: str = "N/m", scale: float = 1.0
) -> dict[str, Parameter]:
    """Parameters of the rig with one degree of freedom, with their relative standard deviations, the stiffness in some unit."""
    return {
        "mass": Parameter("mass", mass, "kg"),
        "stiffness": Parameter("stiffness", stiffness, unit, scale),
        "damping": Parameter("damping", damping, "N s/m"),
    }
