"""How well records can tell an effect at all: expected log odds at the truth, from the records without their noise.

Half the chi-squared that a wrong explanation leaves in noise-free records, its parameters fitted, is the log odds by which
noisy ones are expected to refute it (up to the Occam factors, a few units). Two of them go into the answer of a
sealed case: against *none*, the nominal model re-estimated within its uncertainty, and against the nearest rival, the best
other single effect of the catalogue. A diagnosis cannot be right more often than these numbers let it, and the
scoring reports its bands.

The fits are those of the diagnosis, at noise-free data. Few rivals are fitted, each from one start: the odds against the nearest
rival are an upper bound, and a small value is certain while a large one is not.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.discrepancy.case import Case
from bench.errors import BenchError

if TYPE_CHECKING:
    from bench.discrepancy.fit import Fit
    from bench.discrepancy.grid_points import Point

RIVALS = 6
"""Effects that the screening likes best and that are fitted."""
ITERATIONS, LAST = 8, 25
"""Iterations of each, and of the best of them and of the nominal model."""


def detectability(pure: Case, true: Mapping[str, float], truth: Collection[str]) -> dict[str, Any]:
    """Expected log odds of the truth against "none" and against its nearest rival.

    Args:
        pure: The case with its stated noise and next to none in the records.
        true: True parameters by name.
        truth: Names of the withheld effects.

    Returns:
        ``log_odds_none``, ``log_odds_rival`` and ``rival``, and for two effects ``log_odds_one``, against the better of them alone;
        infinite values are given as 1e9. Empty where the fits fail: a case is made of the truth, and what the diagnosis cannot do
        with it is no reason to leave it out.
    """
    try:
        return _odds_of(pure, true, truth)
    except (BenchError, np.linalg.LinAlgError):
        return {}


def _odds_of(pure: Case, true: Mapping[str, float], truth: Collection[str]) -> dict[str, Any]:
    # the diagnosis is imported where it is asked: a maker that was told to leave this out runs without it
    from bench.discrepancy.attribute import placements  # noqa: PLC0415
    from bench.discrepancy.catalogue import CATALOGUE  # noqa: PLC0415
    from bench.discrepancy.fit import fit  # noqa: PLC0415
    from bench.discrepancy.problem import Problem  # noqa: PLC0415
    from bench.discrepancy.screen import Screen  # noqa: PLC0415
    from bench.discrepancy.structure import structure_of  # noqa: PLC0415

    structure = structure_of(pure)
    problem = Problem(pure, structure, pure.identification)
    away = [
        (true[name] - problem.nominal[i]) / problem.spread[i] for i, name in enumerate(structure.parameters)
    ]
    cost = float(np.sum(np.square(away)))
    start = np.zeros(len(problem.nominal))
    nothing = fit(problem, (), start=start, iterations=LAST)
    coupling = len(structure.groups()) > 1 and any(e.n_coordinates > 1 for e in CATALOGUE if e.name in truth)
    candidates = [
        p for p in placements(pure, structure, CATALOGUE) if coupling or p.effect.n_coordinates == 1
    ]
    starts: dict[tuple[str, str, str], Any] = {}
    for point in Screen(problem, candidates).ranked():
        starts.setdefault(point.placed.key, point)

    def best_of(points: Iterable[Point]) -> Fit:
        fits = [
            fit(problem, (p.placed,), start=np.concatenate([start, p.eta]), iterations=ITERATIONS)
            for p in points
        ]
        best = min(fits, key=lambda f: f.cost, default=nothing)
        return fit(problem, best.hypothesis, start=best.vector, iterations=LAST)

    rival = best_of(islice((p for p in starts.values() if p.placed.effect.name not in truth), RIVALS))
    odds = {
        "log_odds_none": _odds(nothing, cost),
        "log_odds_rival": min(_odds(rival, cost), _odds(nothing, cost)),
        "rival": rival.hypothesis[0].effect.name if rival.hypothesis else "none",
    }
    if len(truth) > 1:
        alone = best_of(p for p in starts.values() if p.placed.effect.name in truth)
        odds["log_odds_one"] = min(_odds(alone, cost), _odds(nothing, cost))
    return odds


def _odds(fitted: Fit, cost: float) -> float:
    return float(min(0.5 * (fitted.cost - cost), 1e9))
