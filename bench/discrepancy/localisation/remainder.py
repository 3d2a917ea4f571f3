"""What an explanation leaves of the discrepancy, and where."""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.localise import left_by
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.verdict import Gap

KINDS = {"product": "displacement and velocity", "any": "displacement, velocity and memory"}
"""What the force of a free model depends on, where its name does not say it."""


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
        **free_force(final),
    }


def free_force(final: Explanation) -> dict[str, Any]:
    """What a free force would still gain on top of an explanation: which kind gains most, and what part of the residuals' power.

    The gain is that of the score test (`screening.score_test`): to first order, on the records for identification, what noise alone
    would gain taken off. Not asked of windows, whose motion is known as measured only.
    """
    if any(problem.windowed for problem, _ in final.parts):
        return {}
    best = max(final.lacks, key=lambda lack: lack.gain - lack.expected)
    gain = float(np.clip((best.gain - best.expected) / max(final.chi2, 1e-300), 0.0, 1.0))
    return {"free_force": KINDS.get(best.model, best.model), "free_force_gain": gain}
