"""Explanations weighed by the error of the model, searched until the error that the best leaves is the one they were weighed by."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.likelihood.model_error import ModelInadequacy, crude_error, error_left
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import DiagnosisSettings

SearchByError = Callable[[Case, ModelInadequacy, Sequence[Explanation]], tuple[Case, list[Explanation]]]
"""Searches the explanations of a case, weighed by an error, beside those that are known; the case comes back with what they tell of it."""


def coarse_explanations(
    case: Case,
    search: SearchByError,
    known: Sequence[Explanation],
    deadline: Deadline = NEVER,
    *,
    settings: DiagnosisSettings,
) -> tuple[Case, list[Explanation]]:
    """Explanations of a case, weighed by the error of the model.

    Args:
        case: The case.
        search: How explanations are searched.
        known: Explanations by the stated noise; empty where none is stated.
        deadline: When no further estimate of the error is begun.
        settings: Thresholds of the diagnosis.
    """
    error = (
        _left(case, known)
        if known
        else crude_error(case, structure_of(case, settings=settings), settings.likelihood.error)
    )
    case, explanations = search(case, error, known)
    for _ in range(1, settings.judgement.error_rounds):
        settled = bool(known) and reference(explanations).reduced > settings.judgement.error_settled
        if settled or not deadline.allows("a further estimate of the error of the model"):
            break
        known, weighed, error = explanations, error, _left(case, explanations)
        if not weighed.crude and _same(weighed, error):
            break
        case, explanations = search(case, error, known)
    return case, explanations


def _same(error: ModelInadequacy, other: ModelInadequacy) -> bool:
    """Whether two errors weigh residuals alike, so that a search would find what is known.

    Those of records in windows are one number. A spectrum is the variance of so many independent samples an octave, itself known to no
    better than their number tells; a tenth of that is no other error.
    """
    if error.scale != other.scale or error.power.keys() != other.power.keys():
        return False
    alike = 0.1 * np.sqrt(2.0 / error.settings.samples)
    pairs = [(own, other.power[key]) for key, own in error.power.items()]
    return all(
        len(a) == len(b) and float(np.mean(np.abs(a - b) / np.maximum(np.maximum(a, b), 1e-300))) < alike
        for a, b in pairs
    )


def reference(explanations: Sequence[Explanation]) -> Explanation:
    """The explanation of few effects that leaves least."""
    return min(
        (
            e
            for e in explanations
            if len(e.hypothesis) <= explanations[0].settings.judgement.reference_effects
        ),
        key=lambda e: e.chi2,
    )


def _left(case: Case, explanations: Sequence[Explanation]) -> ModelInadequacy:
    """The error that the best of some explanations leaves."""
    structure, best = structure_of(case, settings=explanations[0].settings), reference(explanations)
    problem = Problem(case, structure, case.identification, settings=explanations[0].settings)
    if problem.windowed:
        before = best.parts[0][0].error
        return ModelInadequacy({}, max(best.reduced * (1.0 if before is None else before.scale), 1.0))
    return error_left(problem.data, structure, best.predict, problem.settings.likelihood.error)
