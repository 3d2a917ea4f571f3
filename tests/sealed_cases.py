"""Cases that were sealed once, and fits of one effect, for tests of what went wrong with them."""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.discrepancy import BlindOptions, Case
from bench.discrepancy.blind.drawing import draw_case
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.truth.withheld_effects import RECIPES

LATER = {
    "saturating_spring", "hertz_contact", "hidden_resonator", "displacement_dependent_damping", "stress_softening",
    "position_dependent_friction", "unmeasured_load",
}  # fmt: skip
"""Foreign effects that cases are drawn from since seed 20261205."""


def sealed(seed: int, index: int) -> tuple[Case, dict[str, Any]]:
    """A case that was sealed once and diagnosed wrongly, and its answer."""
    rng = np.random.default_rng([int(np.random.default_rng([seed, 0]).integers(2**62)), index])
    rng.bytes(16)
    known = tuple(
        recipe.name
        for recipe in RECIPES
        if recipe.name != "carried_mass" and (seed >= 20261205 or recipe.name not in LATER)
    )
    return draw_case("sealed", rng, BlindOptions(effects=known, detectability=False))


def fitted(case: Case, name: str, start: list[float]) -> tuple[Problem, Fit]:
    """A case's problem and its explanation by one effect."""
    problem = Problem(case, structure_of(case), case.identification)
    placed = placements(case, problem.structure, [effect_named(name)])[0]
    vector = np.concatenate([np.zeros(len(problem.nominal)), start])
    return problem, fit(problem, (placed,), start=vector, iterations=30)
