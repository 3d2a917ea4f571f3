"""Errors of free runs of records, record by record."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_search.problem import ArticulatedProblem


def errors_of(problem: ArticulatedProblem, hypothesis: JointHypothesis, vector: Array) -> Array:
    """RMS errors (n_records, n_joints) [rad or m] of free runs of a problem's records, one joint at a time."""
    runs = FreeRuns(problem.settled(hypothesis, vector))
    motions = runs.problem.motions(hypothesis, vector)
    joints = range(len(problem.joints))
    return np.array(
        [[np.sqrt(np.mean(runs.errors(j, hypothesis, vector, m) ** 2)) for j in joints] for m in motions]
    )


def over_travel(problem: ArticulatedProblem, errors: Array) -> Array:
    """Errors (n_records, n_joints) over the travel of the joints in a problem's case."""
    return np.asarray(errors / FreeRuns(problem).sizes)
