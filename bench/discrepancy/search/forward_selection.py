"""Forward selection: which effects, out of the catalogue, explain the records.

Screening proposes, output-error fits decide, and hypotheses are compared by their evidence. Effects are added one at
a time as long as the residuals do not look like noise: to the best few hypotheses so far and to those that promise most together
with another effect, the screening conditioned on each. What promised most and was not kept by its fit makes room for the next.
Where nothing explains enough, the motion may be too sensitive for a free run over whole records, and hypotheses are fitted over
beginnings of them first (`horizons`). An effect that a larger hypothesis does not need any more loses to the smaller one by its Occam
factor. In the end every effect of the best hypothesis is challenged by those that do nearly as well along the motion it explains, each
fitted from several starts, so that no flexible law wins because a simpler one was fitted carelessly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from bench.discrepancy.effects.read_off import HARMONIC, TIMED
from bench.discrepancy.fitting.fits import Search, integrate_finer, multistart
from bench.discrepancy.fitting.goodness_of_fit import (
    complexity,
    consistent,
    free_parameters,
    leaves_much,
    names,
    near,
)
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.screening.candidates import (
    about,
    tells_motion,
)
from bench.discrepancy.screening.score_test import lack_of_fit
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.extension import contacts, extend, read_off
from bench.discrepancy.search.horizons import lengthen
from bench.discrepancy.search.rivals import challenge, divide, reduce_best, simplify
from bench.discrepancy.unscreened.analogue_lag import with_analogue_lag
from bench.discrepancy.unscreened.fine_cogging import COGGING, fine_cogging
from bench.discrepancy.unscreened.harmonic_force import with_harmonic_force
from bench.discrepancy.unscreened.scheduled import with_schedules
from bench.discrepancy.unscreened.sensor_hum import with_hum
from bench.discrepancy.unscreened.soft_friction import soften, stand_in
from bench.discrepancy.unscreened.timed_force import with_timed_force

Prepared = tuple[Search, Screen, list[Point]]
"""A search before its first step: the nominal model fitted, the catalogue screened, its grid points by decreasing gain."""
Teeth = Callable[[], tuple[Placed, Array] | None]
"""Cogging as the records show it, read off them when it is first asked for (`fine_cogging`)."""


def attribute(
    problem: Problem,
    candidates: Sequence[Placed],
    *,
    most: int = 3,
    progress: Callable[[str], None] = lambda text: None,
    prepared: Prepared | None = None,
    deadline: Deadline = NEVER,
) -> Search:
    """Search the hypotheses of up to `most` effects.

    Args:
        problem: Records and priors.
        candidates: Effects at their places.
        most: Largest number of effects.
        progress: Called with a line of text at every stage.
        prepared: What `prepare` returned for the same arguments, where it was called before.
        deadline: When no further stage is begun.

    Returns:
        All fits made.
    """
    settings = problem.settings.search
    search, screen, points = prepared or prepare(problem, candidates)
    nothing = search.ranked(0)[0]
    progress(f"nominal model: chi-squared {nothing.reduced:.3g} of its expectation")
    if tells_motion(nothing, problem):
        points = about(screen, nothing, explained=True).ranked()
        if not points or points[0].gain < settings.noticeable:
            with_hum(search, _read_off(candidates))  # which no motion tells of
            return search
    teeth = cache(lambda: fine_cogging(problem))
    _single(search, screen, candidates, progress, deadline, teeth)
    for size in range(1, most):
        if not consistent(search.ranked()[0]) and not deadline.allows(f"{size + 1} effects together"):
            break
        if near(search.ranked()[0]):
            integrate_finer(search)
        best = search.ranked()[0]
        progress(
            f"{len(best.hypothesis)} effect(s): {names(best.hypothesis)}, chi-squared {best.reduced:.3g}"
        )
        bases = _bases(search, screen, size, best=best, nothing=nothing)
        if not bases:
            break
        extend(search, screen, bases, count=4 if consistent(best) else 6 - size)
        _with_variants(search, size + 1)
        _with_fine_cogging(search, screen, candidates, size + 1, teeth)
        if HARMONIC in _read_off(candidates):
            with_harmonic_force(search, size + 1)
        with_hum(search, _read_off(candidates), size + 1)
        lengthen(search, size + 1, candidates)
        reduce_best(search)
    best = search.ranked()[0]
    challenged = problem.scaled and near(best) and _worth_challenging(best, problem)
    if not problem.scaled:
        simplify(search, candidates, settings.simplified)
    elif (
        not challenged and len(best.hypothesis) > 1 and deadline.allows("plainer relatives of what was found")
    ):
        simplify(search, candidates, 1)
    elif challenged and deadline.allows("rivals of what was found, from further starts"):
        progress(f"rivals of {names(best.hypothesis)}")
        challenge(search, screen, rounds=3 if problem.error is None else 1)
        _with_variants(search, len(search.ranked()[0].hypothesis))
        if problem.error is None:
            multistart(search)
        else:
            divide(search, screen, candidates)
    return search


def _single(
    search: Search,
    screen: Screen,
    candidates: Sequence[Placed],
    progress: Callable[[str], None],
    deadline: Deadline,
    teeth: Teeth,
) -> None:
    """Fit single effects: the common ones, then the rarer ones and those that no screening holds where these leave something."""
    nothing = search.ranked(0)[0]
    extend(search, screen, [nothing], count=8)
    _with_variants(search, 1)
    if not consistent(search.ranked()[0]) and all(o.order > 0 for o in search.problem.structure.observers):
        contacts(search, candidates)
    rare = [p for p in candidates if p.effect.rare]
    if rare and not consistent(search.ranked()[0]) and deadline.allows("rarer effects"):
        progress("rarer effects")
        screen.add(rare)
        extend(search, screen, [nothing], count=6, among={p.key for p in rare})
        _with_fine_cogging(search, screen, candidates, 1, teeth)
    stand_in(search)
    lengthen(search, 1, candidates)
    if deadline.allows("forces from outside and friction that follows a channel"):
        asked = _read_off(candidates)
        if TIMED in asked:
            with_timed_force(search)
        if HARMONIC in asked:
            with_harmonic_force(search)
        with_hum(search, asked)
        with_schedules(search, asked)


def _with_variants(search: Search, size: int) -> None:
    """Fit what no screening tells from effects of the foremost hypotheses of a size: friction that creeps, a lag that is analogue."""
    soften(search, size)
    with_analogue_lag(search, size)


def _with_fine_cogging(
    search: Search, screen: Screen, candidates: Sequence[Placed], size: int, teeth: Teeth
) -> None:
    """Fit cogging of a pitch that no grid holds, where it is asked for and nothing explains the records yet."""
    asked = any(p.effect.name == COGGING for p in candidates)
    if asked and not consistent(search.ranked()[0]) and (found := teeth()) is not None:
        read_off(search, screen, size, *found)


def _read_off(candidates: Sequence[Placed]) -> set[str]:
    """Names of the effects that are read off the records, of those that are asked for."""
    return {p.effect.name for p in candidates if p.effect.site == "read off"}


def _bases(search: Search, screen: Screen, size: int, *, best: Fit, nothing: Fit) -> list[Fit]:
    """Hypotheses of `size` effects beside which one more is searched; none where it would tell no more than `best` does."""
    problem, settings = search.problem, search.problem.settings.search
    if not consistent(best):
        ranked = search.ranked(size)
        excess = search.ranked(size - 1)[0].reduced - 1.0
        if not ranked or ranked[0].reduced - 1.0 > settings.stalled * excess:
            return []
        return worth_extending(search, screen, size, 4 - size)
    if len(best.hypothesis) != size:
        return []
    # what is down to the noise and lacks a force all the same may be neither of two effects
    lacks = not (problem.windowed or problem.error) and lack_of_fit(problem, best).significant(
        nothing.chi2 - best.chi2, effects=settings.several
    )
    plain = _plain_bases(search, best)
    if not lacks and not plain and not _promising(screen, best) and not _weighed_by_itself(problem, best):
        return []
    return worth_extending(search, screen, size, 4 - size) if lacks else plain or [best]


def _worth_challenging(best: Fit, problem: Problem) -> bool:
    """Whether rivals of a hypothesis are worth further starts.

    Where the error of the model weighs, few samples do not tell them apart by their last digits: those of a single effect are, unless
    the error is a guess yet and what is found serves for no more than a better one.
    """
    return problem.error is None or (len(best.hypothesis) == 1 and not problem.error.crude)


def _weighed_by_itself(problem: Problem, fitted: Fit) -> bool:
    """Whether what a hypothesis leaves is how it is weighed, and more than a right model leaves: that is consistent by construction."""
    return problem.error is not None and not problem.windowed and leaves_much(problem, fitted)


def worth_extending(search: Search, screen: Screen, size: int, most: int) -> list[Fit]:
    """Hypotheses beside which one more effect is searched: the best ones, and those that promise most together with another effect.

    Alone, a flexible law is bent to what two forces do, and the one that was right about half of it lies far behind. Of variants of
    one hypothesis the best will do: a further effect shows beside each of them, and the variants are fitted again with it.

    Args:
        search: Fits so far.
        screen: Screening of the same problem.
        size: Number of effects of the hypotheses.
        most: Number of the best ones.

    Returns:
        The hypotheses by decreasing posterior.
    """
    settings = search.problem.settings.search
    problem, best = search.problem, dict[frozenset[tuple[str, str]], Fit]()
    for fitted in search.ranked(size):
        best.setdefault(frozenset((p.effect.name, p.place.name) for p in fitted.hypothesis), fitted)
    ranked = list(best.values())

    def promised(base: Fit) -> float:
        ground = screen.ground(base)
        points = screen.ranked(base, ground)[:1]
        return float(np.sum(ground.left**2)) - sum(point.gain for point in points)

    far = [f for f in ranked[: settings.considered] if np.isfinite(f.cost) and not tells_motion(f, problem)]
    chosen = ranked[:most] + sorted(far, key=promised)[: settings.promised]
    return [f for f in ranked if any(f is own for own in chosen)]


def _plain_bases(search: Search, best: Fit) -> list[Fit]:
    """Plain effects beside which one more is searched because the best single effect is larger than two of them.

    Where the error of the model weighs, a law of many parameters soon explains enough, at values at which it is another one: one of
    backlash without play, say, whose asymmetry is that of friction beside a constant force.
    """
    settings = search.problem.settings.search
    largest = 2.0 * settings.plain.parameters + 2.0 * abs(settings.log_prior_effect)
    if (
        search.problem.error is None
        or len(best.hypothesis) != 1
        or complexity(best.hypothesis, settings=search.problem.settings.search) <= largest
    ):
        return []
    plain = [
        f
        for f in search.ranked(1)
        if free_parameters(f.hypothesis) <= settings.plain.parameters and np.isfinite(f.cost)
    ]
    return plain[: settings.plain.bases]


def _promising(screen: Screen, best: Fit) -> bool:
    """Whether one more effect could still be in the residual of a hypothesis that is down to the noise."""
    settings = screen.problem.settings
    screen = about(screen, best, explained=True)
    ground = screen.ground(best, simulated=True)
    points = screen.ranked(best, ground)[:1] + screen.inertia_points(best, ground)[:1]
    return max((p.gain for p in points), default=0.0) > max(
        settings.screening.worth_a_fit, settings.search.immaterial * best.n_residuals
    )


def prepare(problem: Problem, candidates: Sequence[Placed]) -> Prepared:
    """Fit the nominal model and screen the catalogue: the cheap part of a search.

    Args:
        problem: Records and priors.
        candidates: Effects at their places.
    """
    search = Search(problem)
    search.add(
        fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=problem.settings.search.thorough)
    )
    screen = Screen(problem, [p for p in candidates if not p.effect.rare])
    return search, screen, screen.ranked()
