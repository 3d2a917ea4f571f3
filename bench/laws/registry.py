"""The catalogue: every force law by its name.

Laws whose size can be chosen (sliders of `iwan`, powers of `generalised_bouc_wen`) stand here with their
default size; `find_law` makes another size from the header, so that a stored element is found again by name
and header.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from bench.errors import ParameterError, UnknownNameError
from bench.files import json_values
from bench.laws.base import ForceLaw
from bench.laws.base_flexibility import BASE_FLEXIBILITY
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.bouc_wen_variants import (
    BOUC_WEN_DEGRADING,
    BOUC_WEN_PINCHING,
    GENERALISED_BOUC_WEN,
    generalised_bouc_wen_law,
)
from bench.laws.carried_mass import CARRIED_MASS
from bench.laws.constant_force import CONSTANT_FORCE
from bench.laws.coulomb import ASYMMETRIC_COULOMB, COULOMB
from bench.laws.coupling import AXIAL_TORSIONAL_JOINT, CROSS_STIFFNESS, GAP_COUPLING, PRINTED_COUPLING
from bench.laws.dahl import DAHL
from bench.laws.damping import ASYMMETRIC_DAMPING, LINEAR_DAMPING, POWER_LAW_DAMPING, QUADRATIC_DAMPING
from bench.laws.gap import ASYMMETRIC_GAP, GAP, ONE_SIDED_STOP
from bench.laws.harmonic_force import HARMONIC_FORCE
from bench.laws.jenkins import IWAN, JENKINS, iwan_law
from bench.laws.jenkins_backlash import JENKINS_BACKLASH
from bench.laws.linear import LINEAR
from bench.laws.lugre import ELASTOPLASTIC_FRICTION, LUGRE
from bench.laws.maxwell import MAXWELL
from bench.laws.memory import memory_law_of
from bench.laws.network import network_law_of
from bench.laws.normal_force_friction import (
    CONTROLLED_FRICTION,
    LOAD_DEPENDENT_FRICTION,
    TIME_VARYING_FRICTION,
)
from bench.laws.polynomial import polynomial_law_of
from bench.laws.soft_friction import SOFT_COULOMB
from bench.laws.stiffness import COGGING, CUBIC_STIFFNESS, QUADRATIC_STIFFNESS, STIFFNESS_DRIFT
from bench.laws.stribeck import STRIBECK
from bench.laws.timed_force import TIMED_FORCE, timed_force_law

LAWS: Mapping[str, ForceLaw] = MappingProxyType(
    {
        law.name: law
        for law in (
            LINEAR,
            GAP,
            ASYMMETRIC_GAP,
            ONE_SIDED_STOP,
            QUADRATIC_STIFFNESS,
            CUBIC_STIFFNESS,
            STIFFNESS_DRIFT,
            COGGING,
            CONSTANT_FORCE,
            TIMED_FORCE,
            HARMONIC_FORCE,
            LINEAR_DAMPING,
            ASYMMETRIC_DAMPING,
            QUADRATIC_DAMPING,
            POWER_LAW_DAMPING,
            MAXWELL,
            BASE_FLEXIBILITY,
            CARRIED_MASS,
            COULOMB,
            ASYMMETRIC_COULOMB,
            SOFT_COULOMB,
            STRIBECK,
            LOAD_DEPENDENT_FRICTION,
            TIME_VARYING_FRICTION,
            CONTROLLED_FRICTION,
            DAHL,
            LUGRE,
            ELASTOPLASTIC_FRICTION,
            JENKINS,
            JENKINS_BACKLASH,
            IWAN,
            BOUC_WEN,
            BOUC_WEN_DEGRADING,
            BOUC_WEN_PINCHING,
            GENERALISED_BOUC_WEN,
            CROSS_STIFFNESS,
            GAP_COUPLING,
            PRINTED_COUPLING,
            AXIAL_TORSIONAL_JOINT,
        )
    }
)
"""Every law by its name."""

_SIZED: Mapping[str, Callable[[int], ForceLaw]] = MappingProxyType(
    {"iwan": iwan_law, "timed_force": timed_force_law, "generalised_bouc_wen": generalised_bouc_wen_law}
)

MODELS: Mapping[str, Callable[[Sequence[float]], ForceLaw]] = MappingProxyType(
    {"polynomial": polynomial_law_of, "network": network_law_of, "memory": memory_law_of}
)
"""Laws of identified models: no default size, so not in `LAWS`; found by name and header."""


def find_law(name: str, header: Sequence[float] = ()) -> ForceLaw:
    """Return the law of that name, in the size its header asks for.

    Args:
        name: Name in `LAWS`.
        header: Size of a law that has one (`ForceLaw.header`); its default size where empty.

    Raises:
        UnknownNameError: No law has that name.
        ParameterError: The law has no such header.
    """
    if name in MODELS and header:
        return MODELS[name](header)
    if name not in LAWS:
        raise UnknownNameError("law", name, LAWS)
    law = LAWS[name]
    if tuple(header) in ((), law.header):
        return law
    if name not in _SIZED or len(header) != 1 or header[0] != int(header[0]):
        raise ParameterError(f"law '{name}' has the header {law.header}; {tuple(header)} came")
    return _SIZED[name](int(header[0]))


def describe(law: ForceLaw) -> dict[str, Any]:
    """Return the description of a law as JSON values, for documentation and reports.

    Infinite bounds are None, since JSON has no infinity. `documentation` is the text of the module that holds the law:
    its relatives, its range of validity, its references.
    """
    return {
        "name": law.name,
        "equation": law.equation,
        "reference": law.reference,
        "smoothness": law.smoothness,
        "states": list(law.states),
        "header": list(law.header),
        "n_coordinates": law.n_coordinates,
        "n_inputs": law.n_inputs,
        "parameters": [
            {
                "name": parameter.name,
                "unit": parameter.unit,
                "rotational_unit": parameter.unit if parameter.rotational is None else parameter.rotational,
                "default": parameter.default,
                "bounds": json_values(parameter.bounds),
                "description": parameter.description,
            }
            for parameter in law.parameters
        ],
        "documentation": sys.modules[law.force.__module__].__doc__ or "",
    }
