"""`mujoco.sysid` as a diagnosis: fitted to every candidate effect in turn, the best chosen by its BIC.

It gets every help: the diagnosis's catalogue with its priors, bounds and starting grids; the laws as native callbacks in the
MuJoCo model, MuJoCo's own friction constraint where it has one; the residuals whitened against the noise of a measured
force too (a plain weighting would take that for an effect); loads centred over each step; a model builder that writes
into a compiled model; the scaling by the Jacobian, with which it is quickest.

Every candidate is fitted whole, which takes minutes with one degree of freedom. On the joint, with a hundred candidates, sixteen
nominal parameters and half a second a free run, it would take 100 minutes a case. Where time is limited candidates go through heats
therefore: the nominal parameters held at their best fit without an effect, on the record of which that leaves most, integrated by
the semi-implicit Euler scheme; the best ones freely on that record; the best of these freely on all records, by Runge-Kutta as
ever. A heat that runs out of its time keeps what each fit has reached.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from benchmarks.sysid_candidate import Candidate

FIRST = 6
"""Iterations of the first fit of a candidate, from the best point of its grid."""
CARRIED = 4
"""Candidates that are carried on, by the BIC of their first fits."""
LAST = 20
"""Further iterations of those."""
ALONE = 0.1
"""Part of a limited time by which the nominal model is fitted."""
HEATS = ((0.45, 3, 8), (0.6, 4, 2))
"""Of the heats before the last: the part of the time by which each ends, its iterations, and how many candidates stay."""


Entry = tuple[Candidate, Array, float]
"""A candidate, the vector its fit has reached and the cost there."""


def diagnose(
    case: Case, *, catalogue: Sequence[Effect] = CATALOGUE, seconds: float = np.inf
) -> tuple[Placed | None, Any]:
    """The candidate with the best BIC, None for the nominal model, and its free run of a record.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        seconds: Time that the fits may take.
    """
    from absl import logging

    logging.set_verbosity(logging.ERROR)  # it warns of every start at a bound
    mujoco.set_mju_user_warning(lambda text: None)  # and MuJoCo of every candidate that diverges
    try:
        return _best(case, catalogue, seconds)
    finally:
        mujoco.set_mju_user_warning(None)


def _best(case: Case, catalogue: Sequence[Effect], seconds: float) -> tuple[Placed | None, Any]:
    began = time.perf_counter()
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    nothing = Candidate(problem, None)
    asked = [effect for effect in catalogue if effect.site != "read off"]  # which only the diagnosis can read
    others = [Candidate(problem, placed) for placed in placements(case, structure, asked)]
    if np.isfinite(seconds):
        fitted = _in_heats(nothing, others, began, seconds)
    else:
        head = np.zeros(len(problem.nominal))
        fitted = _by_bic([(c, *c.fit(c.best_start(head), FIRST)) for c in [nothing, *others]])
        fitted[:CARRIED] = [(c, *c.fit(vector, LAST)) for c, vector, _ in fitted[:CARRIED]]
    best, vector, _ = _by_bic(fitted)[0]
    return best.placed, lambda record: best.predict(vector, record)


def _by_bic(entries: Sequence[Entry]) -> list[Entry]:
    return sorted(entries, key=lambda entry: entry[0].bic(entry[2]))


def _in_heats(nothing: Candidate, others: Sequence[Candidate], began: float, seconds: float) -> list[Entry]:
    """The candidates of the last heat, fitted to all records, and the nominal model alone."""
    everything = nothing.heard
    alone = nothing.fit(nothing.mean, LAST, began + ALONE * seconds)
    worst = max(everything, key=lambda index: nothing.misfit(alone[0], index))
    left = [(c, alone[0]) for c in others]
    for number, (share, iterations, stay) in enumerate(HEATS):
        for candidate, _ in left:
            candidate.enter(held=number == 0, heard=[worst])
        if number == 0:
            left = [(c, c.best_start(head)) for c, head in left]
        deadline = began + share * seconds
        found = _by_bic([(c, *c.fit(start, iterations, deadline)) for c, start in left])
        left = [(c, vector) for c, vector, _ in found[:stay]]
    fitted = [(nothing, *alone)]
    for i, (candidate, start) in enumerate(left):
        candidate.enter(held=False, heard=everything)
        now = time.perf_counter()
        deadline = now + max(began + seconds - now, 0.0) / (len(left) - i)
        fitted.append((candidate, *candidate.fit(start, LAST, deadline)))
    return fitted
