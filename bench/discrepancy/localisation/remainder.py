"""What an explanation leaves of the gap, and where."""

from __future__ import annotations

from typing import Any

from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.localise import left_by
from bench.discrepancy.search.explain import Explanation
from bench.discrepancy.verdict import Gap


def remainder(problem: Problem, final: Explanation, gap: Gap) -> dict[str, Any]:
    """What an explanation leaves: how large it is, and where most of it lies.

    Args:
        problem: Its problem on all degrees of freedom.
        final: The explanation behind `gap.after`.
        gap: The gap of the case.
    """
    place = left_by(problem, final)
    return {
        "nrmse": gap.after,
        "over_noise": gap.after / gap.noise_floor if gap.noise_floor > 0.0 else None,
        "of_before": gap.after / gap.before if gap.before > 0.0 else 0.0,
        **({} if place is None else place),
    }
