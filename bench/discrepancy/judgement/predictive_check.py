"""Posterior predictive check: an explanation that fits the records it was found on and fails on those it was not shown.

Several wrong laws together can imitate a missing one within the motion of a record; at another amplitude they fall apart. How far
a right explanation may be off on other records is told by the uncertainty of its parameters: what it was barely shown in
identification, a stop touched once, say, it predicts poorly without being wrong. So is one that makes much of the noise of a measured
load: a softening spring near its limit. And so is one whose free run comes by a jump between two motions, which the smallest difference
decides: it is no more wrong than its parameters if others explain the records of both kinds together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.prediction.validation_discrepancy import coordinates, noise_level
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.search.explanation import Explanation


def contradicted(case: Case, problem: Problem, best: Explanation, rng: np.random.Generator) -> bool:
    """Whether the judging records refute an explanation.

    Not asked where their free run does not start from rest, nor of prescribed motions, whose reversals are known to a sample only.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom.
        best: The explanation.
        rng: For the draws.
    """
    return fails(case, problem, best, rng) and not _explains_all(best, case.validation)


def fails(case: Case, problem: Problem, best: Explanation, rng: np.random.Generator) -> bool:
    """Whether an explanation misses the judging records by more than noise and its parameters' uncertainty; as `contradicted`."""
    settings = problem.settings.judgement
    records = case.validation
    if problem.driven or problem.windowed or not problem.noise_stated or any(in_motion(r) for r in records):
        return False
    runs = [best.predict(record) for record in records]
    drawn: list[list[dict[str, Array]]] = []
    for _, channels in coordinates(problem.structure):

        def judged(values, channels=channels) -> Array:
            return np.concatenate([sum(sign * v[c] for c, sign in channels) for v in values])

        simulated = judged(runs)
        error = _rms(simulated - judged([record.values for record in records]))
        floor = noise_level(problem, channels, records)
        if not np.isfinite(error):
            return True
        if error <= settings.contradicted * floor:
            continue
        if not drawn:
            others = [_drawn(best, rng) for _ in range(settings.check_draws)]
            drawn = [[other.predict(problem.with_load_noise(r, rng)) for r in records] for other in others]
        spread = _rms(np.concatenate([judged(other) - simulated for other in drawn]))
        if error > settings.contradicted * np.hypot(floor, spread):
            return True
    return False


def _explains_all(best: Explanation, records: Sequence[CaseRecord]) -> bool:
    """Whether the laws of an explanation, fitted to the judging records as well, bring all records down to their noise."""
    for problem, fitted in best.parts:
        wider = problem.beside(records)
        if not consistent(
            fit(wider, fitted.hypothesis, start=fitted.vector, iterations=best.settings.search.thorough)
        ):
            return False
    return True


def _drawn(best: Explanation, rng: np.random.Generator) -> Explanation:
    """An explanation whose parameters are drawn from their posterior, for records with noise drawn on their loads."""

    def moved(problem: Problem, fitted: Fit) -> tuple[Problem, Fit]:
        _, _, low, high = problem.prior(fitted.hypothesis)
        away = np.linalg.solve(
            np.linalg.cholesky(fitted.precision).T, rng.standard_normal(len(fitted.vector))
        )
        return problem.forgetful(), replace(fitted, vector=np.clip(fitted.vector + away, low, high))

    return Explanation(tuple(moved(*part) for part in best.parts))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))
