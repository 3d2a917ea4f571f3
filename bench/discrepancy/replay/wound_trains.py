"""How far elastic drives are wound up along the judging records: what no encoder shows where a window begins.

The diagnosis has it from a run that the encoder corrects at every sample, and judges by windows that begin with it. So do applied models:
what the free run before a window left of it is off by that run's own error, most where a play is open.
"""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.application.applying import Findings
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, placed_eta
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.model import ArticulatedModel

Wound = dict[str, list[Array]]
"""Joint to the deflection of its train and its rate (n, 2), in every judging record."""


def wound_trains(case: Case, model: ArticulatedModel, findings: Findings) -> Wound:
    """Deflections of the trains of elastic drives, as found.

    Args:
        case: The case, its channels bound to joints and actuators.
        model: The nominal model.
        findings: What was found, of the engine of articulated models.
    """
    trains = {effect.name for effect in CATALOGUE if effect.train}
    if not any(effect.name in trains for effect in findings.effects):
        return {}
    problem = ArticulatedProblem.of(case, model, case.validation)
    hypothesis, vector = _fit(problem, findings)
    problem = problem.settled(hypothesis, vector)
    motions, out = problem.motions(hypothesis, vector), Wound()
    for placed in hypothesis:
        if placed.effect.train:
            runs = [problem.innovations(placed.joint, hypothesis, vector, one) for one in motions]
            if all(np.isfinite(innovations).all() for innovations, _ in runs):
                name = problem.joints[placed.joint].name
                out[name] = [states[:, 2:] - states[:, :2] for _, states in runs]
    return out


def _fit(problem: ArticulatedProblem, findings: Findings) -> tuple[JointHypothesis, Array]:
    """Hypothesis and vector of what was found, as far as the catalogue of a problem has it."""
    moved = {estimate.name: estimate.shift_in_std for estimate in findings.nominal}
    # what parts of one type have in common is told with each part
    vector = [
        moved.get(entry.name, 0.0) * float(np.hypot(entry.std, entry.together)) / entry.std
        for entry in problem.nominal
    ]
    known = {placed.key: placed for placed in placements(problem, CATALOGUE)}
    hypothesis = []
    for effect in findings.effects:
        placed = known.get((effect.name, effect.where))
        if placed is not None:
            hypothesis.append(placed)
            vector += placed_eta(placed, {name: e.value for name, e in effect.parameters.items()})
    return tuple(hypothesis), np.array(vector)
