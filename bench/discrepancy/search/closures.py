"""Nonparametric closures: free models of a force that no catalogued effect explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.screening.candidates import leading
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.explanation import Explanation


def close(best: Explanation, nothing: Explanation, closures: Sequence[Effect]) -> tuple[Explanation, str]:
    """Add nonparametric closures to an explanation while they pay.

    Args:
        best: The best catalogued explanation.
        nothing: The nominal model alone.
        closures: Free models of a missing force.

    Returns:
        The closed explanation, and the names of the closures used.
    """
    settings = best.settings.search
    parts, used = [], []
    for (problem, fitted), lacks in zip(best.parts, best.lacking(nothing), strict=True):
        current = fitted
        if lacks or not consistent(fitted) or problem.error is not None:
            candidates = placements(problem.case, problem.structure, closures)
            screen = Screen(problem, candidates)
            current = fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=settings.thorough)
            if fitted.reduced - 1.0 < settings.helpful * (current.reduced - 1.0):
                current = fitted
            for _ in range(settings.closures):
                closed = _closed(problem, screen, current)
                if closed is None:
                    break
                current = closed
                used.append(closed.hypothesis[-1].effect.name)
                if consistent(current) and not lacks:
                    break
        parts.append((problem, current))
    return Explanation(tuple(parts)), " + ".join(dict.fromkeys(used))


def _closed(problem: Problem, screen: Screen, current: Fit) -> Fit | None:
    """One more closure on top of a fit: of those that the screening likes best the first that pays; None where none does."""
    settings = problem.settings.search
    own = {placed.key for placed in current.hypothesis}
    for point in leading(
        [p for p in screen.ranked(current) if p.placed.key not in own],
        settings.closures_tried,
        0.0,
        starts=1,
        settings=problem.settings,
    ):
        start = np.concatenate([current.vector, point.eta])
        closed = fit(problem, (*current.hypothesis, point.placed), start=start, iterations=12)
        idle = not consistent(current) and closed.reduced - 1.0 > settings.stalled * (current.reduced - 1.0)
        if not idle and closed.log_evidence > current.log_evidence:
            return closed
    return None
