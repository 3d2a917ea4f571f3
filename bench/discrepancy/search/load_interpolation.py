"""How the loads ran between their samples, where nobody said so.

Straight lines are taken first. A load that holds a good part of its power near half the sample rate and is read the wrong
way is another load, and the catalogue spends a cross-talk, a flexible base or a delay on it. So where anything is missing, the
other readings are tried: one that takes away what it takes further effects to take away, or that leaves far less beside as
many, is worth a search of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.acquisition import INTERPOLATIONS
from bench.discrepancy.case.case import Case
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.search.explanation import Explanation

STATED = "load_interpolation"
"""Option of a case that says it; where it is given, nothing is looked for."""
IN_WORDS = {
    "linear": "along straight lines",
    "band_limited": "as the band-limited signal through them",
    "zero_order_hold": "held from one to the next",
}


def promising_readings(case: Case, explanations: Sequence[Explanation]) -> Iterator[Case]:
    """The case with other readings of its loads that may explain the records better.

    Args:
        case: A case; for one that states how its loads are to be read, or has none, there are no others.
        explanations: Its explanations, the best first.
    """
    best = explanations[0]
    if STATED in case.options or best.parts[0][0].driven:
        return
    nested = list(_nested(explanations))
    for reading in INTERPOLATIONS:
        if reading != case.load_interpolation:
            read = replace(case, options={**case.options, STATED: reading})
            if any(_promises(read, smaller, best) for smaller in nested):
                yield read


def _nested(explanations: Sequence[Explanation]) -> Iterator[Explanation]:
    """The likeliest explanations of fewer effects than the best one, those of fewest first, and the best one if it leaves something."""
    best = explanations[0]
    for size in range(len(best.hypothesis)):
        ranked = [e for e in explanations if len(e.hypothesis) == size]
        if ranked:
            yield max(ranked, key=lambda e: e.log_posterior)
    if not (best.consistent and best.scaled):
        yield best


def _promises(read: Case, smaller: Explanation, best: Explanation) -> bool:
    """Whether the effects of an explanation, fitted in another reading, leave little enough for a search in it."""
    settings = smaller.settings.search
    noise = sum(fitted.n_residuals for _, fitted in best.parts) if best.scaled else 0
    limit = smaller.chi2 - settings.readings.instead * (smaller.chi2 - best.chi2)
    if smaller is best:
        limit = noise + settings.readings.better * (best.chi2 - noise)
    parts = [(_read(read, problem), problem, fitted) for problem, fitted in smaller.parts]
    able = 0.0
    for problem, before, fitted in parts:
        residual, changed = (p.residual(fitted.hypothesis, fitted.vector) for p in (before, problem))
        if not (np.isfinite(changed).all() and np.isfinite(residual).all()):
            return False
        # at the optimum the residual is orthogonal to all that parameters could do about the change
        able += 2.0 * float(residual @ (residual - changed))
    if able < settings.readings.likely * (smaller.chi2 - limit):
        return False
    fits = (
        fit(problem, f.hypothesis, start=f.vector, iterations=settings.thorough, limit=limit, exact=False)
        for problem, _, f in parts
    )
    return sum(found.chi2 for found in fits) < limit


def _read(case: Case, problem: Problem) -> Problem:
    """A problem of the same records and structure whose loads are read as a case says."""
    bins = {data.record.name: data.n_bins for data in problem.data}
    return Problem(
        case, problem.structure, problem.records, bins=bins, error=problem.error, settings=problem.settings
    )


def reading_notes(told: Case, read: Case) -> tuple[str, ...]:
    """What became of the reading of a case, in words."""
    if told.load_interpolation == read.load_interpolation:
        return ()
    return (
        f"nothing is said of the loads between their samples: read {IN_WORDS[read.load_interpolation]} they explain the records "
        f"better than {IN_WORDS[told.load_interpolation]}; if they ran so, say it in nominal.json: "
        f'"{STATED}": "{read.load_interpolation}"',
    )
