"""Orders of magnitude: where a fit of numbers begins of which no more than that is known.

From a gain that is fifty times too large a descent runs to the nearest minimum, in which damping makes up for some of it.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.numerics.threads import in_threads


def roughly(problem: ArticulatedProblem) -> Array:
    """Deviations (n_nominal,) of the nominal parameters, of those known to within a factor where the runs of their joints prefer them.

    What a type of parts has in common is tried together, for all of its joints; else what one joint has of its own.
    """
    vector = np.zeros(len(problem.nominal))
    grid = problem.settings.articulated.orders
    for joints, entries in _groups(problem).items():
        tried = []
        for point in product(grid, repeat=len(entries)):
            trial = vector.copy()
            trial[list(entries)] = point
            tried.append(trial)
        cost = in_threads(lambda trial, joints=joints: _cost(problem, joints, trial), tried)
        vector = tried[int(np.argmin(cost))]
    return vector


def _groups(problem: ArticulatedProblem) -> dict[tuple[int, ...], list[int]]:
    """Joints to the indices of what they have in common, or one has of its own, that is known to within a factor."""
    out: dict[tuple[int, ...], list[int]] = {}
    for i, entry in enumerate(problem.nominal):
        if entry.logarithmic and entry.common is None:
            out.setdefault(entry.joints, []).append(i)
    return out


def _cost(problem: ArticulatedProblem, joints: tuple[int, ...], vector: Array) -> float:
    """Twice the negative log posterior of the nominal model, as far as it is of these joints."""
    octaves = problem.octaves
    power = ((j, octaves.power(j, problem.residual(j, (), vector))) for j in joints)
    return sum(octaves.misfit(j, p) for j, p in power) + float(vector @ vector)
