"""Effects at their places, at the size that changes a response by a stated part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.discrepancy.articulated_effects import hypothesis
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE as JOINTS
from bench.discrepancy.articulated_search import problem
from bench.discrepancy.articulated_search.placements import placements as placements_on_joints
from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.judgement.posterior import named_effect
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.precheck import information, joint_information
from bench.discrepancy.precheck.joints import admitted_joints
from bench.discrepancy.precheck.settings import CheckSettings
from bench.discrepancy.verdict import Estimate, NamedEffect
from bench.errors import ParameterError, UnknownNameError


@dataclass(frozen=True)
class PlacingSettings:
    """Numbers of `bench.discrepancy.rehearsal.placing`."""

    linear: tuple[str, ...] = ("coulomb_friction", "gap", "cubic_stiffness", "quadratic_damping")
    """What is rehearsed on a linear structure where nobody says: one effect of each family of forces."""
    articulated: tuple[str, ...] = ("coulomb_friction", "joint_compliance", "backlash", "actuator_delay")
    """The same on an arm: what drives are known for."""


SETTINGS = PlacingSettings()


class EffectSite(NamedTuple):
    """An effect at a place.

    Attributes:
        name: The effect.
        where: The place.
        aliases: Names by which a verdict may call the place.
        at: Part of a response to the effect that changes it by as much; None where none does.
    """

    name: str
    where: str
    aliases: frozenset[str]
    at: Callable[[float], NamedEffect | None]

    @property
    def label(self) -> str:
        """Name and place."""
        return f"{self.name}:{self.where}" if self.where else self.name


def sites(case: Case, wanted: Sequence[str], *, articulated: bool) -> list[EffectSite]:
    """Where effects are put.

    Args:
        case: Records of the nominal model, whose motion says how large an effect of a size is.
        wanted: ``NAME`` for every place, or ``NAME:PLACE``; one effect of each family where empty.
        articulated: Which engine the case is for.

    Raises:
        UnknownNameError: There is no such effect or place.
        ParameterError: The case cannot be diagnosed at all.
    """
    found = _of_joints(case) if articulated else _of_structure(case)
    default = SETTINGS.articulated if articulated else SETTINGS.linear
    asked = wanted or tuple(name for name in default if any(site.name == name for site in found))
    out: list[EffectSite] = []
    for text in asked:
        name, _, where = text.partition(":")
        mine = [site for site in found if site.name == name]
        if not mine:
            raise UnknownNameError("effect of this case", name, sorted({site.name for site in found}))
        chosen = [site for site in mine if not where or where in site.aliases]
        if not chosen:
            raise UnknownNameError(f"place of '{name}'", where, [site.where for site in mine])
        out += chosen
    return out


def _of_structure(case: Case) -> list[EffectSite]:
    told, _ = admitted(case, anyway=True)
    structural = Problem(told, structure_of(told), told.identification)
    settings = CheckSettings()
    # what sits in a record or follows a clock of its own is nothing that a model can hold
    chosen = [e for e in CATALOGUE if e.site != "record" and e.variant == ""]

    def site(placed) -> EffectSite:  # type: ignore[no-untyped-def]
        def at(size: float) -> NamedEffect | None:
            vector = information.at_size(structural, placed, size, settings)
            if vector is None:
                return None
            eta = vector[len(structural.nominal) :]
            return named_effect(structural, placed, eta, np.zeros(len(eta)), {})

        where = placed.place.site or placed.place.name or placed.target
        return EffectSite(placed.effect.name, where, frozenset({where, placed.place.name, placed.target}), at)

    placed = placements(told, structural.structure, chosen)
    return [site(p) for p in placed if not p.source and not p.effect.rare]


def _of_joints(case: Case) -> list[EffectSite]:
    own, model, said = admitted_joints(case)
    if own is None or model is None:
        raise ParameterError(f"the case cannot be rehearsed: {said[0]}")
    found = problem.ArticulatedProblem.of(own, model, own.identification)
    settings = CheckSettings()

    def site(placed: hypothesis.PlacedOnJoint) -> EffectSite:
        joint = found.joints[placed.joint]
        given = input_of(own, joint).unit

        def at(size: float) -> NamedEffect | None:
            vector = joint_information.at_size(found, placed, size, settings)
            if vector is None:
                return None
            values = hypothesis.placed_values(placed, vector[len(found.nominal) :])
            estimates = {
                p.name: Estimate(float(values[p.name]), 0.0, placed.effect.unit(p, joint.unit, given))
                for p in placed.effect.parameters
            }
            return NamedEffect(
                placed.effect.name, placed.where, 1.0, estimates, channel=joint.name, equation=placed.effect.equation
            )  # fmt: skip

        return EffectSite(placed.effect.name, placed.where, frozenset({placed.where, joint.name}), at)

    return [site(p) for p in placements_on_joints(found, JOINTS)]
