"""Whether the units of a case fit their quantities, and one another.

A unit that does not fit is refused here, with the remedy, before it can become a diagnosis that makes no sense.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from bench.discrepancy.nominal_schema import PARAMETERS
from bench.errors import UnitError
from bench.recording.units import conversion

if TYPE_CHECKING:
    from bench.discrepancy.case import Case

MOTION = {
    "displacement": ("axial", "m"), "velocity": ("axial", "m/s"), "acceleration": ("axial", "m/s^2"),
    "rotation": ("torsional", "rad"), "angular_velocity": ("torsional", "rad/s"),
    "angular_acceleration": ("torsional", "rad/s^2"),
}  # fmt: skip
LOADS = {"force": ("axial", "N"), "torque": ("torsional", "N m")}
CONSTANTS = {
    ("mass", "axial"): ("kg",), ("inertia", "torsional"): ("kg m^2", "kg m^2/rad^2", "kg m^2/rad"),
    ("stiffness", "axial"): ("N/m",), ("stiffness", "torsional"): ("N m/rad", "N m"),
    ("damping", "axial"): ("N s/m",), ("damping", "torsional"): ("N m s/rad", "N m s"),
}  # fmt: skip
"""Kind of a nominal parameter and its axis, to the SI units it may have."""
MISMATCH = 1e-3
"""Relative difference of two conversion factors beyond which units do not belong together."""


def check_units(case: Case) -> None:
    """Check that the units of a case fit their quantities, and one another.

    A model in N, mm and s has its stiffness in N/mm and its mass in tonnes. With position and load in given units, all
    constants of an axis have one and the same factor to SI, and so have position, velocity and acceleration.

    Args:
        case: The case. Rigs of the user's own are not checked: only they know what their parameters are.

    Raises:
        UnitError: A unit does not fit its quantity, or two do not belong together.
    """
    if case.rig not in PARAMETERS:
        return
    motion: dict[str, tuple[str, str, float]] = {}
    loads: dict[str, tuple[str, str, float]] = {}
    for channel in case.channels:
        base = channel.name.rstrip("0123456789").rstrip("_")
        for table, seen in ((MOTION, motion), (LOADS, loads)):
            if base not in table or not channel.unit:
                continue
            axis, expected = table[base]
            factor = _factor(f"channel '{channel.name}'", channel.unit, (expected,))
            first = seen.setdefault(axis, (channel.name, channel.unit, factor))
            if abs(factor / first[2] - 1.0) > MISMATCH:
                raise UnitError(
                    f"'{channel.name}' is in {channel.unit} and '{first[0]}' in {first[1]}, which do not belong together "
                    f"(a factor of {factor / first[2]:.6g}); convert one of the columns"
                )
    for parameter in case.parameters:
        if not parameter.unit:
            continue
        axis = "torsional" if "torsional" in parameter.name or "inertia" in parameter.name else "axial"
        kind = next((k for k, a in CONSTANTS if a == axis and k in parameter.name), None)
        if kind is None:
            continue
        factor = _factor(f"parameter '{parameter.name}'", parameter.unit, CONSTANTS[kind, axis])
        if axis not in motion or axis not in loads:
            continue
        wanted = loads[axis][2] / motion[axis][2]
        if abs(factor / wanted - 1.0) > MISMATCH:
            raise UnitError(
                f"'{parameter.name}' is in {parameter.unit}, but '{loads[axis][0]}' in {loads[axis][1]} and "
                f"'{motion[axis][0]}' in {motion[axis][1]} ask for {wanted:.6g} times {CONSTANTS[kind, axis][0]}: "
                f"multiply its value and std by {factor / wanted:.6g}, or convert the columns"
            )


def _factor(what: str, unit: str, expected: tuple[str, ...]) -> float:
    """Factor of a unit to the first of the SI units that it fits."""
    for si in expected:
        with contextlib.suppress(UnitError):
            return conversion(unit, si)[0]
    raise UnitError(f"{what} is in {unit}; a unit such as {expected[0]} is expected")
