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

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.discrepancy.case import Case
from bench.errors import BenchError

if TYPE_CHECKING:
    from bench.discrepancy.fit import Fit

RIVALS = 3
"""Effects that the screening likes best and that are fitted."""
ITERATIONS, LAST = 6, 25
"""Iterations of each, and of the best of them and of the nominal model."""


def detectability(pure: Case, true: Mapping[str, float], truth: Collection[str]) -> dict[str, Any]:
    """Expected log odds of the truth against "none" and against its nearest rival.

    Args:
        pure: The case with its stated noise and next to none in the records.
        true: True parameters by name.
        truth: Names of the withheld effects.

    Returns:
        ``log_odds_none``, ``log_odds_rival`` and ``rival``; infinite values are given as 1e9. Empty where the fits fail: a
        case is made of the truth, and what the diagnosis cannot do with it is no reason to leave it out.
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
        p
        for p in placements(pure, structure, CATALOGUE)
        if p.effect.name not in truth and (coupling or p.effect.n_coordinates == 1)
    ]
    starts: dict[tuple[str, str, str], Any] = {}
    for point in Screen(problem, candidates).ranked():
        starts.setdefault(point.placed.key, point)
    fits: list[Fit] = [
        fit(problem, (point.placed,), start=np.concatenate([start, point.eta]), iterations=ITERATIONS)
        for point in list(starts.values())[:RIVALS]
    ]
    rival = min(fits, key=lambda f: f.cost, default=nothing)
    rival = fit(problem, rival.hypothesis, start=rival.vector, iterations=LAST)
    return {
        "log_odds_none": _odds(nothing, cost),
        "log_odds_rival": min(_odds(rival, cost), _odds(nothing, cost)),
        "rival": rival.hypothesis[0].effect.name if rival.hypothesis else "none",
    }


def _odds(fitted: Fit, cost: float) -> float:
    return float(min(0.5 * (fitted.cost - cost), 1e9))
