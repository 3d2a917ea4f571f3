"""How far elastic drives are wound up along the judging records: what no encoder shows where a window begins.

The diagnosis has it from a run that the encoder corrects at every sample. A free run forgets its own guess slowly, and one through a play
never does, so applied models begin their windows with the same.
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
    """Deflections of the trains of elastic drives with the encoder at the motor, as found.

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
        if not placed.effect.train or motions[0].joints[placed.joint].on_link:
            continue
        states = [problem.innovations(placed.joint, hypothesis, vector, one)[1] for one in motions]
        if all(np.isfinite(one).all() for one in states):
            out[problem.joints[placed.joint].name] = [one[:, 2:] - one[:, :2] for one in states]
    return out


def _fit(problem: ArticulatedProblem, findings: Findings) -> tuple[JointHypothesis, Array]:
    """Hypothesis and vector of what was found, as far as the catalogue of a problem has it."""
    moved = {estimate.name: estimate.shift_in_std for estimate in findings.nominal}
    vector = [moved.get(f"{entry.kind}:{entry.target}", 0.0) for entry in problem.nominal]
    known = {placed.key: placed for placed in placements(problem, CATALOGUE)}
    hypothesis = []
    for effect in findings.effects:
        placed = known.get((effect.name, effect.where))
        if placed is not None:
            hypothesis.append(placed)
            vector += placed_eta(placed, {name: e.value for name, e in effect.parameters.items()})
    return tuple(hypothesis), np.array(vector)
