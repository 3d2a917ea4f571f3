"""What may stand in ``nominal.json``: entries of the right kind, numbers in range, units that belong together.

A number of the wrong kind or a unit that does not fit is refused here, with the place and the remedy, before it can become
a diagnosis that makes no sense.
"""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.errors import FileFormatError, ParameterError, UnitError
from bench.recording.units import check_unit, conversion

if TYPE_CHECKING:
    from bench.discrepancy.case.case import Case

EXAMPLE = '{"value": 2.1, "std": 0.02, "unit": "kg"}'
MISNOMERS = {
    "parameter": {"sigma": "std", "uncertainty": "std", "stdev": "std", "nominal": "value"},
    "channel": {"noise": "noise_std", "std": "noise_std", "sigma": "noise_std", "units": "unit"},
}
"""Keys that people write, and those that are meant."""
MOTION = {
    "displacement": ("axial", "m"), "velocity": ("axial", "m/s"), "acceleration": ("axial", "m/s^2"),
    "rotation": ("torsional", "rad"), "angle": ("torsional", "rad"), "angular_velocity": ("torsional", "rad/s"),
    "angular_acceleration": ("torsional", "rad/s^2"),
}  # fmt: skip
PRESCRIBED = (
    ("displacement", "angle", "rotation"),
    ("velocity", "angular_velocity"),
    ("acceleration", "angular_acceleration"),
)
"""Names of the channels of a prescribed motion, by their order: linear, rotary."""
LOADS = {"force": ("axial", "N"), "torque": ("torsional", "N m")}
CONSTANTS = {
    ("mass", "axial"): ("kg",), ("inertia", "torsional"): ("kg m^2", "kg m^2/rad^2", "kg m^2/rad"),
    ("stiffness", "axial"): ("N/m",), ("stiffness", "torsional"): ("N m/rad", "N m"),
    ("damping", "axial"): ("N s/m",), ("damping", "torsional"): ("N m s/rad", "N m s"),
}  # fmt: skip
"""Kind of a nominal parameter and its axis, to the SI units it may have."""
RIGS = ("sdof", "joint", "damper")
MISMATCH = 1e-3
"""Relative difference of two conversion factors beyond which units do not belong together."""


def check_document(document: Any, path: Path) -> None:
    """Check the entries of a ``nominal.json``.

    Args:
        document: What the file holds.
        path: The file, for messages.

    Raises:
        FileFormatError: An entry is missing or of the wrong kind.
        ParameterError: A number is outside its range.
    """
    if not isinstance(document, dict):
        raise FileFormatError(
            f"'{path}' holds {_kind(document)}; an object with rig, parameters and channels is expected"
        )
    for key in ("rig", "parameters", "channels"):
        if key not in document:
            raise FileFormatError(f"'{path}' has no entry '{key}'; expected rig, parameters and channels")
    if not isinstance(document["rig"], str):
        raise FileFormatError(
            f"'{path}': rig is {_kind(document['rig'])}; a name or the path of an MJCF file is expected"
        )
    for key in ("parameters", "channels"):
        if not isinstance(document[key], dict):
            raise FileFormatError(
                f"'{path}': {key} is {_kind(document[key])}; an object, name by name, is expected"
            )
    for name, entry in document["parameters"].items():
        _check_parameter(name, entry, path, document["rig"] in RIGS)
    if not [name for name in document["channels"] if name != "time"]:
        raise FileFormatError(f"'{path}' names no channel besides time; name the loads and the responses")
    for name, entry in document["channels"].items():
        _check_channel(name, entry, path)
    if "sample_rate_hz" in document and not _number(document["sample_rate_hz"]) > 0.0:
        raise FileFormatError(
            f"'{path}': sample_rate_hz is {document['sample_rate_hz']!r}; a number above zero [Hz] is expected"
        )


def _check_parameter(name: str, entry: Any, path: Path, known_rig: bool) -> None:
    if not isinstance(entry, dict) or "value" not in entry:
        _point_out(entry, "parameter", name, path)
        raise FileFormatError(f"'{path}': parameter '{name}' is {entry!r}; expected for instance {EXAMPLE}")
    _point_out(entry, "parameter", name, path)
    value, std = _number(entry["value"]), _number(entry.get("std", 0.0))
    if not math.isfinite(value):
        raise FileFormatError(
            f"'{path}': the value of '{name}' is {entry['value']!r}; a finite number is expected"
        )
    if not (math.isfinite(std) and std >= 0.0):
        raise ParameterError(
            f"'{path}': the std of '{name}' is {entry['std']!r}; its one-sigma uncertainty is expected, zero or more"
        )
    _check_unit_text(entry.get("unit", ""), f"parameter '{name}'", path)
    inertial = name.startswith(("mass", "inertia"))
    if known_rig and (value < 0.0 or (inertial and value == 0.0)):
        raise ParameterError(
            f"'{path}': '{name}' is {value:g}; {'a positive number' if inertial else 'zero or more'} is expected: "
            "check its sign"
        )


def _check_channel(name: str, entry: Any, path: Path) -> None:
    if not isinstance(entry, dict):
        raise FileFormatError(
            f"'{path}': channel '{name}' is {entry!r}; expected for instance "
            '{"unit": "m", "noise_std": 2e-5}'
        )
    _point_out(entry, "channel", name, path)
    _check_unit_text(entry.get("unit", ""), f"channel '{name}'", path)
    noise = entry.get("noise_std")
    if noise is not None and not (math.isfinite(_number(noise)) and _number(noise) >= 0.0):
        raise ParameterError(
            f"'{path}': noise_std of '{name}' is {noise!r}; a number from zero up is expected, "
            "or leave it out where it is not known"
        )


def _check_unit_text(unit: Any, where: str, path: Path) -> None:
    if not isinstance(unit, str):
        raise FileFormatError(f"'{path}': the unit of {where} is {unit!r}; text such as \"N/m\" is expected")
    if unit:
        try:
            check_unit(unit)
        except UnitError as error:
            raise UnitError(f"'{path}', {where}: {error}") from None


def _point_out(entry: Any, kind: str, name: str, path: Path) -> None:
    if not isinstance(entry, dict):
        return
    for wrong, right in MISNOMERS[kind].items():
        if wrong in entry and right not in entry:
            raise FileFormatError(
                f"'{path}': {kind} '{name}' has an entry '{wrong}'; did you mean '{right}'?"
            )


def _kind(value: Any) -> str:
    return "nothing" if value is None else f"a {type(value).__name__}"


def _number(value: Any) -> float:
    """The value as a float; NaN where it is no number."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan


def check_units(case: Case) -> None:
    """Check that the units of a case fit their quantities, and one another.

    A model in N, mm and s has its stiffness in N/mm and its mass in tonnes. With position and load in given units, all
    constants of an axis have one and the same factor to SI, and so have position, velocity and acceleration.

    Args:
        case: The case. Rigs of the user's own are not checked: only they know what their parameters are.

    Raises:
        UnitError: A unit does not fit its quantity, or two do not belong together.
    """
    if case.rig not in RIGS:
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
        rotary = "torsional" in parameter.name or "inertia" in parameter.name or "axial" not in motion | loads
        axis = "torsional" if rotary and "torsional" in motion | loads else "axial"
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
