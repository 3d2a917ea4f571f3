"""What a fit of an articulated model has to be for its effects to be named at all: finite, within its bounds, and physical."""

from __future__ import annotations

import numpy as np

from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.multibody.joint_forces import Slot

BOUNDED = ("motor_share", "position")
"""Parameters whose bounds are physical: a share is at most one, a stop lies where the joint goes."""


def sound(problem: ArticulatedProblem, found: ArticulatedFit) -> bool:
    """Whether a fit is finite, no parameter of its effects sits at a bound, and its effects do what they are called for.

    Args:
        problem: Records and priors.
        found: The fit.
    """
    settings = problem.settings.articulated
    if not (np.isfinite(found.log_posterior) and np.isfinite(found.vector).all()):
        return False
    etas = problem.etas(found.hypothesis, found.vector)
    if not all(p.effect.works(eta, p.scales) for p, eta in zip(found.hypothesis, etas, strict=True)):
        return False
    at = len(problem.nominal)
    for placed in found.hypothesis:
        for p in placed.effect.parameters:
            low, high = p.bounds
            inside = low + settings.at_bound < found.vector[at] < high - settings.at_bound
            if not (inside or p.fixed or p.name in BOUNDED):
                return False
            at += 1
    return all(_dissipates(problem, found, k) for k in range(len(found.hypothesis)))


def _dissipates(problem: ArticulatedProblem, found: ArticulatedFit, k: int) -> bool:
    """Whether a joint whose damping is called wrong by effect `k` of a fit is not driven by it, by more than the fit is unsure of.

    A drive that is late feeds a motion as a negative damping does, and no joint has one.
    """
    placed = found.hypothesis[k]
    if placed.effect.name != "damping_error":
        return True
    at = problem.size(found.hypothesis[:k])
    most = found.vector.copy()
    most[at] += problem.settings.articulated.judgement.sure * np.sqrt(found.covariance[at, at])
    p = problem.slots(placed.joint, found.hypothesis, most, on_link=False)
    return bool(p[Slot.DAMPING] >= 0.0)
