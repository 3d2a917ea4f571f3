"""Explanations whose free run of a judging record diverges at their estimate and not within its uncertainty.

A softening spring near its limit lets go for a hair more. Parameters that were never shown the limit put it anywhere within their
uncertainty, and most of what they may be follows the record. Nothing is chosen by how well: of the draws that stay finite the one that
explains the records for identification best is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.fitting.map_fit import Fit, free_entries
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.search.explanation import Explanation


def diverges(explanation: Explanation, records: Sequence[CaseRecord]) -> bool:
    """Whether a free run of some records is not finite."""
    runs = (explanation.predict(record) for record in records)
    return not all(np.isfinite(samples).all() for run in runs for samples in run.values())


def steadied(
    explanation: Explanation, records: Sequence[CaseRecord], rng: np.random.Generator
) -> Explanation | None:
    """The likeliest of some draws about an explanation whose free runs stay finite; None where none does.

    Args:
        explanation: Fitted.
        records: Records that its free runs have to get through.
        rng: For the draws.
    """
    found: list[tuple[float, Explanation]] = []
    for _ in range(explanation.settings.judgement.steady_draws):
        parts = tuple((problem, _drawn(problem, fitted, rng)) for problem, fitted in explanation.parts)
        drawn = Explanation(parts)
        cost = sum(fitted.cost for _, fitted in parts)
        if np.isfinite(cost) and not diverges(drawn, records):
            found.append((cost, drawn))
    return min(found, key=lambda pair: pair[0])[1] if found else None


def _drawn(problem: Problem, fitted: Fit, rng: np.random.Generator) -> Fit:
    mean, std, low, high = problem.prior(fitted.hypothesis)
    free = free_entries(problem, fitted.hypothesis)
    covariance = fitted.covariance[np.ix_(free, free)]
    vector: Array = fitted.vector.copy()
    vector[free] += np.linalg.cholesky(0.5 * (covariance + covariance.T)) @ rng.standard_normal(len(free))
    vector = np.clip(vector, low, high)
    residual = problem.residual(fitted.hypothesis, vector)
    chi2 = float(residual @ residual)
    cost = chi2 + float(np.sum(((vector[free] - mean[free]) / std[free]) ** 2))
    return replace(fitted, vector=vector, chi2=chi2, cost=cost)
