"""Units of channels: known to pint, of the dimension that the quantity asks for, converted at the border.

Angles are kept apart from pure numbers: a rotational speed is measured in rad/s or rpm, never in Hz, because a silent
factor of 2π is the commonest unit error in this field. Pint alone counts both as 1/s; here two units fit each other
only when their root units, radians included, are the same.

The SI units of the bench itself are recognised without loading pint, so that a simulation does not pay for it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from bench.errors import UnitError, UnknownNameError

SI_UNITS: dict[str, str] = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "rotation": "rad",
    "angle": "rad",
    "angular velocity": "rad/s",
    "angular acceleration": "rad/s^2",
    "torque": "N m",
    "stiffness": "N/m",
    "damping": "N s/m",
    "mass": "kg",
    "pressure": "Pa",
    "strain": "1",
    "energy": "J",
    "power": "W",
    "voltage": "V",
    "current": "A",
    "temperature": "K",
    "frequency": "Hz",
    "time": "s",
}
"""Quantities a channel may declare, and the SI unit of each."""


@dataclass(frozen=True)
class UnitsSettings:
    """Numbers of `bench.recording.units`."""

    longest: int = 64
    """Most characters of a unit; the longest of pint's own names has 40."""


SETTINGS = UnitsSettings()

_PLAIN = {"1", *SI_UNITS.values()}
_ALPHABET = re.compile(r"[\w\s*/^().·%°+-]*")
_POWER = re.compile(r"(?<=[\w)])(?:\^|\*\*)\s*[-+]?[0-9](?:\.[0-9]{1,2})?(?![\w.]|\s*(?:\^|\*\*))")
_SUPERSCRIPT = re.compile(r"[⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_DIGITS = str.maketrans("⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹", "-+0123456789")
_MEANT = {  # what engineers write, and what they mean by it
    ("force", "lb"): "lbf",
    ("force", "lbs"): "lbf",
    ("force", "kg"): "kgf",
    ("force", "g"): "gf",
    ("acceleration", "g"): "g_0",
    ("angular velocity", "Hz"): "turn/s",
    ("torque", "lb in"): "lbf in",
    ("torque", "lb ft"): "lbf ft",
    ("torque", "ft-lb"): "lbf ft",
}
_NAMES = (  # what pint lacks, or takes for something nobody measures with: its Nm counts yarn (m/g)
    "newton_meter = newton * meter = Nm",
    "newton_centimeter = newton * centimeter = Ncm",
    "newton_millimeter = newton * millimeter = Nmm",
    "newton_second = newton * second = Ns",
    "newton_meter_second = newton * meter * second = Nms",
    "revolution_of_a_shaft = turn = rev",
    "degree_per_second = degree / second = dps",
    "RPM = revolutions_per_minute",
    "gn = standard_gravity",
)
_READ_AS = (  # words of a unit that fit a mechanical quantity only as something else of the same name
    {"lb": "lbf", "lbs": "lbf", "pound": "lbf", "pounds": "lbf", "oz": "ozf"},
    {"g": "standard_gravity", "G": "standard_gravity", "mg": "millistandard_gravity"},
    {"mil": "thou", "mils": "thou"},
)
_WORD = re.compile(r"[^\W\d_]+")


@cache
def _registry() -> Any:
    import pint  # noqa: PLC0415  (0.6 s that a simulation in SI units need not pay)

    registry = pint.UnitRegistry(on_redefinition="ignore")
    for definition in _NAMES:
        registry.define(definition)
    return registry


@cache
def _parsed(unit: str) -> tuple[Any, str]:
    """The pint unit and its root units as text."""
    if len(unit) > SETTINGS.longest:  # pint's time grows with the square of a name's length
        raise UnitError(
            f"'{unit[:20]}…' has {len(unit)} characters; a unit has at most {SETTINGS.longest}, such as 'N m' or 'm/s^2'"
        )
    registry = _registry()
    try:
        text = _SUPERSCRIPT.sub(lambda match: "^" + match[0].translate(_DIGITS), unit)
        rest = _POWER.sub("", text)
        # only single powers of one digit, with no stray signs that pint passes over: it would compute 9^9^9^9 for hours
        if "^" in rest or "**" in rest or not _ALPHABET.fullmatch(text):
            raise ValueError(unit)
        parsed = registry.parse_units(text)
        return parsed, str(registry.get_root_units(parsed)[1])
    except Exception:
        # As broad as it stands: pint evaluates the text as a Python expression of units, so that typing errors surface as
        # AssertionError ("m/"), TokenError ("N m)"), TypeError ("m+1") and others that its documentation does not list.
        raise UnitError(
            f"unknown unit '{unit}'; expected a unit such as m, inch, N, lbf, kip, N m, deg, rad/s, m/s^2 or V, "
            "with products as 'N m', powers as 'm/s^2' and '1' for a pure number"
        ) from None


@cache
def check_unit(unit: str, quantity: str = "") -> None:
    """Check that a unit is known and fits a quantity.

    Args:
        unit: Unit as a pint expression; "1" for a pure number.
        quantity: One of `SI_UNITS`, or "" for a channel that declares none.

    Raises:
        UnitError: The unit is unknown, or its dimension is not that of the quantity.
        UnknownNameError: There is no such quantity.
    """
    if quantity and quantity not in SI_UNITS:
        raise UnknownNameError("quantity", quantity, SI_UNITS)
    expected = SI_UNITS.get(quantity)
    if unit == expected or (expected is None and unit in _PLAIN):
        return
    hint = f"; did you mean '{_MEANT[quantity, unit]}'?" if (quantity, unit) in _MEANT else ""
    try:
        root = _parsed(unit)[1]
    except UnitError as error:
        raise UnitError(f"{error}{hint}") from None
    if expected is not None and root != _parsed(expected)[1]:
        raise UnitError(
            f"unit '{unit}' does not fit the quantity '{quantity}', which takes {expected} or a unit of the same "
            f"dimension{hint}"
        )


@cache
def conversion(source: str, target: str) -> tuple[float, float]:
    """Slope and offset of ``x [target] = slope * x [source] + offset``.

    Args:
        source: Unit that the numbers are in.
        target: Unit that they are wanted in.

    Raises:
        UnitError: A unit is unknown, the two differ in dimension, or one of them is logarithmic (dB).
    """
    if source == target:
        return 1.0, 0.0
    (source_unit, source_root), (target_unit, target_root) = _parsed(source), _parsed(target)
    if source_root != target_root:
        raise UnitError(
            f"'{source}' cannot be converted to '{target}': the dimensions differ ({source_root} against {target_root})"
        )
    zero, one, two = (float(_registry().convert(x, source_unit, target_unit)) for x in (0.0, 1.0, 2.0))
    if abs((two - one) - (one - zero)) > 1e-9 * abs(one - zero):  # rounding of an offset unit is near 1e-15
        raise UnitError(
            f"'{source}' to '{target}' is a logarithmic conversion; give the channel in a linear unit"
        )
    return (one, 0.0) if zero == 0.0 else (one - zero, zero)


def _reworded(unit: str, words: dict[str, str]) -> str:
    return _WORD.sub(lambda match: words.get(match[0], match[0]), unit)


@cache
def read_as(unit: str, targets: tuple[str, ...]) -> tuple[str, str]:
    """The unit that is meant where a quantity is known: "g" of an acceleration is no gram, "lb" of a force no mass.

    Args:
        unit: Unit as it was written.
        targets: SI units of the quantity; several where it is written in more than one way ("N m/rad" and "N m").

    Returns:
        The unit to be used for it, which is `unit` itself where that fits, and the target that it fits.

    Raises:
        UnitError: The unit is unknown, or fits none of the targets in any reading.
    """
    candidates = [unit, *(_reworded(unit, words) for words in _READ_AS)]
    reason: UnitError | None = None
    for candidate in dict.fromkeys([*candidates, candidates[1].replace("-", " ")]):
        for target in targets:
            try:
                conversion(candidate, target)
            except UnitError as error:
                reason = reason or error
            else:
                return candidate, target
    assert reason is not None
    raise reason


@cache
def si_unit(unit: str, quantity: str = "") -> str:
    """SI unit of the same dimension as a unit: the one of the quantity where declared, else one named in `SI_UNITS`.

    Args:
        unit: Unit as a pint expression.
        quantity: One of `SI_UNITS`, or "".

    Raises:
        UnitError: The unit is unknown.
    """
    if quantity:
        return SI_UNITS[quantity]
    if unit in _PLAIN:
        return unit
    parsed, root = _parsed(unit)
    for known in ("1", *SI_UNITS.values()):
        if _parsed(known)[1] == root:
            return known
    return f"{_registry().Quantity(1.0, parsed).to_base_units().units:~C}"


@cache
def dimensions(unit: str) -> tuple[float, float, float]:
    """Powers of mass, length and time of a unit; angles, which have none, count as numbers.

    Args:
        unit: Unit as a pint expression.

    Raises:
        UnitError: The unit is unknown.
    """
    powers = _parsed(unit)[0].dimensionality
    mass, length, time = (float(powers.get(name, 0.0)) for name in ("[mass]", "[length]", "[time]"))
    return mass, length, time
