"""The state of a search for explanations: fitted hypotheses, how they rank, and fits carried on to their end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of, near, posterior, sticks
from bench.discrepancy.fitting.map_fit import Fit, fit, free_entries, laplace
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.numerics.least_squares import (
    differences,
)
from bench.discrepancy.numerics.threads import in_threads

Task = tuple[Hypothesis, np.ndarray]
"""Effects, and the vector or vectors that a fit of them starts from."""


@dataclass
class Search:
    """What an attribution has found so far, for one problem.

    Attributes:
        problem: Records and priors.
        fits: Fitted hypotheses by their set of keys.
        converged: Keys of the fits carried on to convergence.
        started: Where fits have begun.
        first: Refined starts of single effects.
    """

    problem: Problem
    fits: dict[frozenset, Fit] = field(default_factory=dict)
    converged: set[frozenset] = field(default_factory=set)
    started: set[tuple] = field(default_factory=set)
    first: list[Point] = field(default_factory=list)

    def start(self, base: Hypothesis, point: Point) -> bool:
        """Note that a fit begins here; False where one has begun so near before."""
        spread = [p.std for p in point.placed.effect.parameters]
        place = tuple(int(x) for x in np.round(point.eta / spread / self.problem.settings.search.same))
        mark = (key_of((*base, point.placed)), point.placed.key, place)
        if mark in self.started:
            return False
        self.started.add(mark)
        return True

    def add(self, fitted: Fit) -> None:
        """Keep a fit if it is the best of its hypothesis, unless times move in it by less than those of any log are uncertain by."""
        if not _tells(self.problem, fitted):
            return
        key = key_of(fitted.hypothesis)
        if key not in self.fits or fitted.cost < self.fits[key].cost:
            self.fits[key] = fitted

    def fit_all(self, fit_of: Callable[[Task], Fit], tasks: Iterable[Task]) -> list[Fit]:
        """Fits of tasks, while there is time; all of them are kept.

        Args:
            fit_of: Fits one.
            tasks: What is fitted; all of it before the deadline of the problem.
        """
        deadline = self.problem.deadline
        found = in_threads(lambda task: fit_of(task) if deadline.allows("further fits") else None, tasks)
        fits = [fitted for fitted in found if fitted is not None]
        for fitted in fits:
            self.add(fitted)
        return fits

    def ranked(self, size: int | None = None) -> list[Fit]:
        """Fits by decreasing posterior, of one number of effects or of all."""
        chosen = [f for f in self.fits.values() if size is None or len(f.hypothesis) == size]
        return sorted(chosen, key=lambda f: -posterior(f))


def _tells(problem: Problem, fitted: Fit) -> bool:
    """Whether every effect of times is more than the clocks of any log are uncertain by."""
    _, etas = problem.split(fitted.hypothesis, fitted.vector)
    return all(
        placed.effect.tells is None
        or placed.effect.tells(
            placed.effect.values(eta, problem.scales_of(placed)), problem.scales_of(placed)
        )
        for placed, eta in zip(fitted.hypothesis, etas, strict=True)
    )


def carry_on(search: Search, size: int, *, most: int) -> None:
    """Carry the fits of one size that may still become the best on to convergence."""
    settings = search.problem.settings.search
    for share in (settings.hopeless, 0.0):
        ranked = [f for f in search.ranked(size) if np.isfinite(f.cost)]
        if not ranked:
            return
        limit = 1.5 * bool(share) + share * (ranked[0].reduced - 1.0)
        chosen = [
            f
            for f in ranked[:most]
            if key_of(f.hypothesis) not in search.converged
            and (f.reduced < limit or posterior(f) > posterior(ranked[0]) - settings.within_reach)
        ]
        converge(search, [(f.hypothesis, f.vector) for f in chosen])


def converge(
    search: Search,
    tasks: Sequence[Task],
    *,
    limit: float | None = None,
) -> None:
    """Fit hypotheses from starts to convergence, but for those that cannot come near a cost: that of the best of their size."""

    sizes = {len(hypothesis) for hypothesis, _ in tasks}
    limits = {size: limit_of(search, size) if limit is None else limit for size in sizes}

    def thorough(task: Task) -> Fit:
        return fit(
            search.problem,
            task[0],
            start=task[1],
            iterations=search.problem.settings.search.thorough,
            limit=limits[len(task[0])],
        )

    for fitted in search.fit_all(thorough, tasks):
        search.converged.add(key_of(fitted.hypothesis))


def integrate_finer(search: Search) -> None:
    """Halve the integration steps while the best fit tells the difference, and fit the best ones again.

    The steps are chosen for smooth laws. Where one switches, an error of the integration may stand out of the noise of a good
    record, and one more effect would be found, or a law of more parameters preferred, that does nothing but undo it.

    Args:
        search: Fits so far; its problem is integrated in finer steps from here on.
    """
    settings = search.problem.settings.search
    problem, best = search.problem, search.ranked()[0]
    if problem.driven or problem.windowed:
        return
    refinement, coarse = problem.refinement, problem.residual(best.hypothesis, best.vector)
    before = np.inf
    while problem.refinement < settings.finest:
        fine = problem.finer(2 * problem.refinement).residual(best.hypothesis, best.vector)
        change = float(np.sum((fine - coarse) ** 2))
        if not settings.integrated < change < settings.converging * before:
            break
        problem.refinement, coarse, before = 2 * problem.refinement, fine, change
    if problem.refinement == refinement:
        return
    for fitted in [f for f in search.ranked() if near(f)][: settings.restarts.restarted]:
        search.fits[key_of(fitted.hypothesis)] = fit(
            problem, fitted.hypothesis, start=fitted.vector, iterations=settings.thorough
        )


def limit_of(search: Search, size: int) -> float:
    """Cost beyond which a fit of so many effects is of no more interest."""
    best = min((f.cost for f in search.fits.values() if len(f.hypothesis) == size), default=np.inf)
    return best + search.problem.settings.search.sight + max(best - search.problem.n_residuals, 0.0)


def multistart(search: Search) -> None:
    """Fit hypotheses near the best again, from draws about where they ended, if friction sticks in them (multistart).

    Whether a slider stops at a reversal is ill-conditioned, so the cost has many local minima: a descent ends in the first of them,
    some tens above the deepest one, and which of two laws has found the deeper one says nothing of the laws.

    Args:
        search: Fits so far; better ones take their places.
    """
    settings = search.problem.settings.search
    best = search.ranked()[0]
    if not consistent(best) and best.chi2 - best.n_residuals > 2.0 * settings.restarts.begun_again:
        return  # no local minimum is that deep: whatever explains the records is not among these
    both_stick = sticks(best)
    reach = settings.restarts.reach if both_stick else settings.within_reach
    for fitted in [f for f in search.ranked() if near(f) and sticks(f)][: settings.restarts.restarted]:
        begun = _beside_the_best(search, fitted) if both_stick else fitted
        behind = posterior(search.ranked()[0]) - posterior(begun)
        if behind < reach:
            _from_posterior(search, begun, 2.0 * behind)


def _beside_the_best(search: Search, fitted: Fit) -> Fit:
    """The better of a fit and the same begun with the nominal parameters of the best one, which may have left local minima behind."""
    settings = search.problem.settings.search
    best, n = search.ranked()[0], len(search.problem.nominal)
    if fitted is best or posterior(best) - posterior(fitted) > settings.restarts.begun_again:
        return fitted
    start = np.concatenate([best.vector[:n], fitted.vector[n:]])
    again = fit(search.problem, fitted.hypothesis, start=start, iterations=settings.thorough)
    search.add(again)
    return min(fitted, again, key=lambda f: f.cost)


def _from_posterior(search: Search, fitted: Fit, behind: float) -> None:
    """Fit one hypothesis from draws of its posterior, while rounds like the last one could make up the cost by which it is `behind`."""
    settings = search.problem.settings.search
    problem, hypothesis = search.problem, fitted.hypothesis
    mean, std, low, high = problem.prior(hypothesis)
    free = free_entries(problem, hypothesis)
    rng = np.random.default_rng(0)

    def cost(vector: Array) -> float:
        residual = problem.residual(hypothesis, vector)
        return float(residual @ residual + np.sum(((vector - mean) / std) ** 2))

    def again_from(start: Array) -> Fit:
        return fit(problem, hypothesis, start=start, iterations=settings.thorough)

    idle = 0
    for further in reversed(range(settings.restarts.rounds)):
        fitted = _past_local_minima(fitted, problem, free)
        spread = np.linalg.cholesky(fitted.covariance[np.ix_(free, free)])
        draws = np.repeat(fitted.vector[None], settings.restarts.draws, axis=0)
        draws[:, free] += (
            rng.standard_normal((settings.restarts.draws, len(free)))
            @ spread.T
            * np.resize(settings.restarts.scales, (settings.restarts.draws, 1))
        )
        draws = np.clip(draws, low, high)
        best = draws[np.argsort(in_threads(cost, draws))[: settings.restarts.followed]]
        again = min(in_threads(again_from, best), key=lambda f: f.cost)
        gained = fitted.cost - again.cost
        idle = idle + 1 if gained < settings.restarts.gain else 0
        fitted = min(fitted, again, key=lambda f: f.cost)
        behind -= max(gained, 0.0)
        if idle == settings.restarts.in_vain or behind > further * max(gained, settings.restarts.gain):
            break
    search.fits[key_of(hypothesis)] = _past_local_minima(fitted, problem, free)


def _past_local_minima(fitted: Fit, problem: Problem, free: NDArray[np.int64]) -> Fit:
    """A fit whose precision and evidence are not those of the local minimum that it lies in: by coarse differences."""
    settings = fitted.settings.numerics
    _, std, _, high = problem.prior(fitted.hypothesis)
    changes = differences(
        problem.residual_near(fitted.hypothesis, fitted.vector),
        fitted.vector,
        problem.residual(fitted.hypothesis, fitted.vector),
        free=free,
        steps=settings.differences[1] * std[free],
        high=high[free],
    )
    if changes is None:
        return fitted
    curvature = np.eye(len(free)) + changes.T @ changes / settings.differences[1] ** 2
    precision, evidence = laplace(problem, fitted.hypothesis, fitted.cost, curvature, free)
    return replace(fitted, precision=precision, log_evidence=evidence)
