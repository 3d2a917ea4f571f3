"""Effects that contain simpler ones: a fit that ended above the simpler one's is begun again where that ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem

Refit = Callable[[ArticulatedFit, Array], ArticulatedFit]
"""A fit once more from another vector."""


def begun_again(
    problem: ArticulatedProblem, fits: Sequence[ArticulatedFit], refit: Refit
) -> list[ArticulatedFit]:
    """Fits whose last effects are alternatives, those again that lie above one that their last effect contains.

    A law of many parameters has minima of its own; none of them is worse than the law within it.
    """

    def settled(found: ArticulatedFit) -> ArticulatedFit:
        placed = found.hypothesis[-1]
        within = [
            simple
            for simple in fits
            if simple.hypothesis[-1].effect.name in placed.effect.contains
            and simple.hypothesis[-1].where == placed.where
            and simple.hypothesis[:-1] == found.hypothesis[:-1]
        ]
        best = max(within, key=lambda f: f.log_posterior, default=found)
        if best.log_posterior <= found.log_posterior:
            return found
        return max(found, refit(found, _embedded(problem, best, placed)), key=lambda f: f.log_posterior)

    return [settled(found) for found in fits]


def _embedded(problem: ArticulatedProblem, simple: ArticulatedFit, placed: PlacedOnJoint) -> Array:
    """The vector of a fit, its last effect written as one that contains it; what that has more is small, as far as its prior goes."""
    inner, eta = simple.hypothesis[-1], problem.etas(simple.hypothesis, simple.vector)[-1]
    values = placed.effect.contains[inner.effect.name](inner.effect.values(eta, inner.scales))
    own = [
        p.eta(values[p.name], placed.scales)
        if p.name in values
        else (p.mean if p.fixed or p.signed or p.scale == "velocity" else p.mean - 2.0 * p.std)
        for p in placed.effect.parameters
    ]
    return np.concatenate([simple.vector[: len(simple.vector) - len(eta)], own])
