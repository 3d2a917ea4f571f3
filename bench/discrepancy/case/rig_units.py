"""What the channels and parameters of the bench's own rigs are measured in, by their names."""

from __future__ import annotations

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.schema import CONSTANTS, LOADS, MOTION, RIGS, check_units
from bench.discrepancy.case.single_axis import turns
from bench.discrepancy.case.unit_conversion import Expectation, converted
from bench.errors import UnitError


def expected_units(case: Case) -> tuple[dict[str, Expectation], dict[str, Expectation]]:
    """What the channels and the parameters of a case on one of the bench's rigs are measured in."""
    rotary = case.rig != "joint" and turns(case)
    channels, parameters = {}, {}
    for channel in case.channels:
        base = channel.name.rstrip("0123456789").rstrip("_")
        base = "rotation" if base == "angle" else base
        unit = next((table[base][1] for table in (MOTION, LOADS) if base in table), "")
        if unit:
            channels[channel.name] = Expectation(
                (unit,), f"rig '{case.rig}' has {base.replace('_', ' ')} there"
            )
    for parameter in case.parameters:
        axial = not (rotary or "torsional" in parameter.name or "inertia" in parameter.name)
        axis = "axial" if axial else "torsional"
        name = "inertia" if rotary and parameter.name == "mass" else parameter.name
        units = next((u for (kind, a), u in CONSTANTS.items() if a == axis and kind in name), None)
        if parameter.name == "coulomb":
            units = ("N",) if axial else ("N m",)
        if units:
            parameters[parameter.name] = Expectation(units, f"it is a {parameter.name.replace('_', ' ')}")
    return channels, parameters


def in_coherent_units(case: Case) -> tuple[Case, tuple[str, ...]]:
    """A case on one of the bench's rigs in units that belong together, and what was converted for that.

    A coherent system of other units (N, mm, s and tonnes) stays as it is, so that results come in the user's own units.

    Raises:
        UnitError: A unit is unknown, or of another dimension than its quantity.
    """
    if case.rig not in RIGS:
        return case, ()
    channels, parameters = expected_units(case)
    si, said = converted(case, channels, parameters)
    try:
        check_units(case)
    except UnitError:
        return si, said
    return case, ()
