"""Fits over a growing horizon: the beginnings of the records first, then more and more of them.

A motion between stops, or with friction that holds now and then, is sensitive: what a parameter changes grows along the record, and the
cost of a long free run is a range of local minima, so narrow that a descent from anywhere ends in one of them. Over the first periods
the cost is smooth. What is found there is near enough to the minimum over twice as many, and so on to the whole record.

References:
    A. H. Ribeiro, K. Tiels, J. Umenberger, T. B. Schon, L. A. Aguirre, On the smoothness of nonlinear system identification,
    Automatica 121 (2020) 109158 (how the cost grows rough with the length of a simulation).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bench.arrays import Array
from bench.discrepancy.fitting.fits import Search, Task
from bench.discrepancy.fitting.goodness_of_fit import key_of, leaves_much, near
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.numerics.threads import in_threads


def lengthen(search: Search, size: int, candidates: Sequence[Placed]) -> None:
    """Fit hypotheses over growing beginnings of the records, where none explains enough; the worse half is left out at each step.

    They are the foremost of a size, and the best smaller one with each of the plain effects, which a screening along a motion that is
    not the true one may have passed over.

    Args:
        search: Fits so far; better ones take their places.
        size: Number of effects.
        candidates: Effects at their places.
    """
    problem = search.problem
    if not _sensible(problem) or not _leaves_too_much(problem, search.ranked()[0]):
        return
    if not problem.deadline.allows("beginnings of the records"):
        return
    settings = problem.settings.search
    tasks = list(_tasks(search, size, candidates))
    for placed in (placed for hypothesis, _ in tasks for placed in hypothesis):
        problem.scales_of(placed)  # kept: those of the whole records
    longest = [len(record) for record in problem.records]
    for part in settings.horizons.parts if tasks else ():
        samples = [max(round(part * n), min(settings.horizons.shortest, n)) for n in longest]
        if samples != longest:
            beginning = problem.beginnings(samples)
            left = sorted((f for f in _over(beginning, tasks) if np.isfinite(f.cost)), key=lambda f: f.cost)
            if not left or not _too_sensitive(beginning, left[0], search):
                return
            most = max(settings.horizons.hypotheses, len(left) // 2)
            tasks = [(f.hypothesis, f.vector) for f in left[:most]]
    search.fit_all(
        lambda task: fit(problem, task[0], start=task[1], iterations=settings.thorough),
        tasks[: settings.horizons.hypotheses],
    )


def _over(beginning: Problem, tasks: Sequence[Task]) -> list[Fit]:
    """Fits of tasks to the beginnings of the records."""
    iterations = beginning.settings.search.thorough
    return in_threads(
        lambda task: fit(beginning, task[0], start=task[1], iterations=iterations, exact=False), tasks
    )


def _tasks(search: Search, size: int, candidates: Sequence[Placed]) -> Iterator[Task]:
    """The foremost hypotheses of a size, and the best smaller one beside each of the plain effects, each from the grids of its effects."""
    problem, settings = search.problem, search.problem.settings.search
    told = [f for f in search.ranked(size) if np.isfinite(f.cost) and _told_by_beginnings(f.hypothesis)]
    foremost = told[: settings.horizons.hypotheses]
    for fitted in foremost:
        yield fitted.hypothesis, np.array([fitted.vector, *_begun_anew(problem, fitted)])
    known = {key_of(f.hypothesis) for f in foremost}
    base = next((f for f in search.ranked(size - 1) if size == 1 or _told_by_beginnings(f.hypothesis)), None)
    for placed in candidates if base is not None else ():
        hypothesis = (*base.hypothesis, placed)
        free = sum(not p.fixed for p in placed.effect.parameters)
        plain = (
            free <= settings.plain.parameters and not placed.effect.rare and _told_by_beginnings((placed,))
        )
        if plain and len(key_of(hypothesis)) == size and key_of(hypothesis) not in known:
            still = base.vector.copy()
            still[: len(problem.nominal)] = 0.0
            yield (
                hypothesis,
                np.array([np.append(v, eta) for v in (base.vector, still) for eta in placed.effect.grid()]),
            )


def _sensible(problem: Problem) -> bool:
    """Whether a beginning of a record is a record: a free run from rest, whose start has no parameters of its own."""
    return not (
        problem.driven
        or problem.windowed
        or len(problem.nominal) > problem.n_physical
        or any(record.periodic for record in problem.records)
    )


def _told_by_beginnings(hypothesis: Hypothesis) -> bool:
    """Whether there are effects and all of them forces that one record tells, without a course over its time."""
    return bool(hypothesis) and all(
        p.effect.site == "joint" and p.effect.of_record is None and p.effect.schedule is None
        for p in hypothesis
    )


def _leaves_too_much(problem: Problem, best: Fit) -> bool:
    """Whether the best explanation is off by more than its noise, or by more than right models are where their error weighs."""
    return leaves_much(problem, best) if problem.error is not None else not near(best)


def _too_sensitive(beginning: Problem, fitted: Fit, search: Search) -> bool:
    """Whether the best fit over the whole records misses their beginning by far more than a fit over that does: not if it only lacks
    something, which the beginning lacks as well."""
    told = (f for f in search.ranked() if not f.hypothesis or _told_by_beginnings(f.hypothesis))
    whole = next(told)
    residual = beginning.residual(whole.hypothesis, whole.vector)
    missed = float(residual @ residual) - fitted.n_residuals
    return fitted.chi2 - fitted.n_residuals < beginning.settings.search.horizons.missed * missed


def _begun_anew(problem: Problem, fitted: Fit) -> Iterator[Array]:
    """The grid of each effect beside the others as they are, the nominal model as stated: it may have moved to undo what was wrong."""
    still = np.zeros(len(problem.nominal))
    _, etas = problem.split(fitted.hypothesis, fitted.vector)
    for i, placed in enumerate(fitted.hypothesis):
        for eta in placed.effect.grid():
            yield np.concatenate([still, *etas[:i], eta, *etas[i + 1 :]])
