"""A case in the units of its model, which whatever simulates it works in, and what its channels were declared in."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from bench.discrepancy.case.case import Case, NominalParameter
from bench.discrepancy.case.mjcf_units import expected_units
from bench.discrepancy.case.rig_units import in_coherent_units
from bench.discrepancy.case.unit_conversion import conversion_of, converted
from bench.discrepancy.model.mjcf_file import idle_parts, rig_of
from bench.rig import Rig
from bench.rig.bodies import BODIES


class DeclaredUnit(NamedTuple):
    """What a channel of a case was declared in.

    Attributes:
        unit: Its unit.
        factor: A number in the unit of the model over the same in this one.
    """

    unit: str
    factor: float


def in_model_units(case: Case, rig: Rig | None = None) -> tuple[Case, tuple[str, ...]]:
    """A case in the units of its model, and what was converted, in words; one that is in them stays as it is.

    Parameters of joints that were held or are followed change nothing in it, and are left out.

    Args:
        case: As read.
        rig: Its own MJCF, where it was read before.

    Raises:
        UnitError: A declared unit is unknown, or of another dimension than the model says.
        ModelError: The model cannot be read.
    """
    if not case.rig.endswith(".xml"):
        return in_coherent_units(case)
    case, idle = _without_idle(case)
    own, said = converted(case, *expected_units(case, rig or rig_of(case)))
    return own, (*said, *idle)


def _without_idle(case: Case) -> tuple[Case, tuple[str, ...]]:
    """A case without the parameters of joints that were held or are followed, which change nothing, and what is said of them."""
    idle, kept, notes = idle_parts(case), list[NominalParameter](), list[str]()
    for parameter in case.parameters:
        kind, _, target = parameter.name.partition(":")
        if target in idle and kind not in BODIES:
            notes.append(f"'{parameter.name}' changes nothing: its joint is {idle[target]}")
        else:
            kept.append(parameter)
    return replace(case, parameters=tuple(kept)), tuple(notes)


def declared_units(case: Case) -> dict[str, DeclaredUnit]:
    """Units that the channels of a case on an MJCF were declared in, by name; the model's own where none was.

    Args:
        case: As read.

    Raises:
        UnitError: As `in_model_units`.
    """
    expected, _ = expected_units(case, rig_of(case))
    found = {
        c.name: conversion_of("channel", c.name, c.unit, expected[c.name])
        for c in case.channels
        if c.name in expected
    }
    return {
        c.name: DeclaredUnit(done.declared, done.factor)
        if (done := found.get(c.name))
        else DeclaredUnit(c.unit, 1.0)
        for c in case.channels
    }
