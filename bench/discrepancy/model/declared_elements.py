"""The elements that a case declares as parts of its nominal model (`case.elements`), put into its structure.

Some parameters of the bench's rigs stand for an element: ``slip_stiffness`` beside ``coulomb`` makes the friction an elastic slip (a
Jenkins element), ``force_offset`` is a constant force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.elements import law_of
from bench.discrepancy.model.nominal_laws import NominalElement
from bench.discrepancy.model.structure import Place, Structure
from bench.errors import ParameterError, UnknownNameError
from bench.laws import LAWS, ForceLaw


def with_elements(structure: Structure, case: Case) -> Structure:
    """A structure with the elements that a case declares; their uncertain parameters become parameters of the structure.

    Raises:
        UnknownNameError: An element is at a place that the structure has not.
        ParameterError: A value is out of the bounds of the law.
    """
    added = [_declared(element, structure, case) for element in case.options.get("elements", [])]  # pyrefly: ignore[not-iterable]
    one = next((p for p in structure.places if len(p.rows) == 1), None)
    frictions, given = structure.frictions, {p.name for p in case.parameters}
    if one is not None and case.rig in {"sdof", "damper"}:
        if "slip_stiffness" in given:
            if "coulomb" not in given:
                raise ParameterError(
                    "'slip_stiffness' is given without 'coulomb', the force at which it slips; add it"
                )
            frictions = ()
            added.append(
                _element(LAWS["jenkins"], one, {"stiffness": "slip_stiffness", "limit": "coulomb"}, {})
            )
        if "force_offset" in given:
            added.append(_element(LAWS["constant_force"], one, {"F0": "force_offset"}, {}))
    if not added:
        return structure
    new = [n for e in added for n in e.parameters if n and n not in structure.parameters]
    empty = np.zeros((len(new), len(structure.dofs), len(structure.dofs)))
    mass, damping, stiffness = (
        np.concatenate([stack, empty]) for stack in (structure.mass, structure.damping, structure.stiffness)
    )
    return replace(
        structure, parameters=(*structure.parameters, *dict.fromkeys(new)), mass=mass, damping=damping, stiffness=stiffness,
        frictions=frictions, elements=tuple(added), springs=tuple(structure.springs),
    )  # fmt: skip


def _declared(element: Any, structure: Structure, case: Case) -> NominalElement:
    law, name = law_of(element, case.folder or case.name)
    places = {place.name: place for place in structure.places if len(place.rows) == 1}
    wanted = element.get("place", next(iter(places)) if len(places) == 1 else "")
    if wanted not in places and len(places) == 1 and wanted in structure.dofs:
        wanted = next(iter(places))
    if wanted not in places:
        raise UnknownNameError(f"place of the element '{name}'", str(wanted), places)
    entries = element.get("parameters", {})
    free = {key: f"{name}.{key}" for key, entry in entries.items() if isinstance(entry, dict)}
    return _element(
        law, places[wanted], free, {key: float(x) for key, x in entries.items() if key not in free}
    )


def _element(
    law: ForceLaw, place: Place, free: Mapping[str, str], exact: Mapping[str, float]
) -> NominalElement:
    values = law.theta(None, **exact)[len(law.header) :]
    return NominalElement(
        law, place.rows[0], tuple(free.get(name, "") for name in law.parameter_names), values
    )
