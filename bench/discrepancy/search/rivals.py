"""Backward elimination: the effects of the best hypothesis against their nearest rivals, and whether each of them is still needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.fits import Search, Task, carry_on, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.screening.candidates import (
    about,
    leading,
    refined,
    tells_motion,
)
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.extension import each_beside

PLAINER = {"hysteresis": "friction", "damping": "friction"}
"""Families whose laws become those of another one at the limits of their parameters."""


def challenge(search: Search, screen: Screen, *, rounds: int = 3) -> None:
    """Fit the rivals of every effect of the best hypothesis, and that effect itself, from several starts.

    The rivals are screened along the free run of that hypothesis where it follows the motion: a run driven through accelerations
    alone knows its middle, which no record told. What a rival makes superfluous is eliminated.

    Args:
        search: Fits so far; the new ones are added.
        screen: Screening of the same problem.
        rounds: A rival that wins is challenged in turn, so many times at most; once where nothing explains the records.
    """
    settings = search.problem.settings
    challenged: set[frozenset] = set()
    for _ in range(rounds):
        best = search.ranked()[0]
        known = not best.hypothesis or key_of(best.hypothesis) in challenged
        # which of several insufficient explanations comes nearest is not worth minutes
        if known or (challenged and not consistent(best)):
            return
        challenged.add(key_of(best.hypothesis))
        along = tells_motion(best, search.problem)
        tasks = []
        for i, placed in enumerate(best.hypothesis):
            rest, vector = _without(i, best, search.problem)
            base = replace(best, hypothesis=rest, vector=vector)
            points, alone = search.first, search.ranked(0)[0].chi2
            if rest or along:
                local = screen.beside(best, simulated=True) if along else about(screen, base, explained=False)
                named = base if rest else None
                ground = local.ground(named)
                alone = float(np.sum(ground.left**2))
                points = refined(local, ground, local.ranked(named, ground))
            own = max((p.gain for p in points if p.placed.key == placed.key), default=np.inf)
            left = max(alone - own, search.problem.n_residuals)
            for point in leading(
                points,
                5,
                own - left - settings.search.challenger_lacks * own,
                starts=settings.screening.refined_starts,
                settings=search.problem.settings,
            ):
                if search.start(rest, point):
                    tasks.append(((*rest, point.placed), np.concatenate([vector, point.eta])))
                    continue
                # begun before, but perhaps left after a few iterations because a more flexible law was ahead by then
                begun = search.fits.get(key_of((*rest, point.placed)))
                known = begun is not None and any(begun.vector is start for _, start in tasks)
                if begun is not None and not known and key_of(begun.hypothesis) not in search.converged:
                    tasks.append((begun.hypothesis, begun.vector))
            tasks += _alike(placed, rest, vector, search, screen)
        converge(search, tasks, limit=best.cost + settings.search.sight)
        carry_on(search, len(best.hypothesis), most=6)
        reduce_best(search)


def _alike(
    placed: Placed, rest: Hypothesis, vector: np.ndarray, search: Search, screen: Screen
) -> Iterator[Task]:
    """Fits of every other error of one number in place of one: a gain of a sensor is as good as one of the load, or of a mass.

    The screening, whose base may have moved its parameters to do the same, ranks them by chance.
    """
    if not _of_one_number(placed.effect):
        return
    known = {own.key for own in (*rest, placed)}
    for other in (*screen.signals, *screen.inertia):
        hypothesis = (*rest, other)
        new = other.key not in known and key_of(hypothesis) not in search.converged
        if new and _of_one_number(other.effect):
            yield hypothesis, np.append(vector, 0.0)


def _of_one_number(effect: Effect) -> bool:
    return effect.site != "joint" and len(effect.parameters) == 1 and effect.parameters[0].signed


def simplify(search: Search, candidates: Sequence[Placed], most: int) -> None:
    """Fit simpler relatives of the effects of the foremost hypotheses in their stead.

    Where nothing is down to the noise, whatever has most parameters comes foremost, and a law with one may never have been tried
    beside the others: it is for whoever weighs them to say whether the further parameters are worth it.

    Args:
        search: Fits so far; the new ones are added.
        candidates: Effects at their places.
        most: How many hypotheses.
    """
    tasks: dict[frozenset, Task] = {}
    for fitted in search.ranked()[:most]:
        for i, placed in enumerate(fitted.hypothesis):
            rest, vector = _without(i, fitted, search.problem)
            for other in candidates:
                key = key_of((*rest, other))
                new = len(key) == len(fitted.hypothesis) and key not in search.converged
                if new and _simpler(other, placed):
                    starts = np.array([np.append(vector, eta) for eta in other.effect.grid()])
                    tasks.setdefault(key, ((*rest, other), starts))
    converge(search, list(tasks.values()))


def divide(search: Search, screen: Screen, candidates: Sequence[Placed]) -> None:
    """Fit two laws of one parameter each, a simpler relative and what is missing beside it, in the place of one of three or more.

    Where the error of the model decides, a law with a curve to bend may stand in for a sum of two that are as common: friction that falls
    with the velocity for dry friction and drag. Nothing else asks for the two, since the one leaves no more than models do.

    Args:
        search: Fits so far; the new ones are added.
        screen: Screening of the same problem.
        candidates: Effects at their places.
    """
    best = search.ranked()[0]
    plain = {p.key for p in candidates if _of_one_force(p.effect)}
    bases: dict[frozenset, Fit] = {}
    for i, placed in enumerate(best.hypothesis):
        if sum(not p.fixed for p in placed.effect.parameters) < 3:
            continue
        rest, _ = _without(i, best, search.problem)
        for other in (p for p in candidates if _of_one_force(p.effect) and _simpler(p, placed)):
            key = key_of((*rest, other))
            if key in search.fits and key not in bases:
                bases[key] = search.fits[key]
    if bases:
        each_beside(search, screen, list(bases.values()), plain)


def _of_one_force(effect: Effect) -> bool:
    """Whether an effect is a common force of one parameter, the same in every record and at every time."""
    steady = not effect.variant and effect.of_record is None and effect.schedule is None
    return effect.site == "joint" and len(effect.parameters) == 1 and steady and not effect.rare


def _simpler(other: Placed, placed: Placed) -> bool:
    """Whether an effect is a relative at the same place with fewer parameters."""
    free, fewer = (sum(not p.fixed for p in e.effect.parameters) for e in (placed, other))
    same = (other.effect.site, other.place.name) == (placed.effect.site, placed.place.name)
    families = {placed.effect.family, PLAINER.get(placed.effect.family, "")}
    return same and other.effect.family in families and fewer < free


def reduce_best(search: Search) -> None:
    """Strike each effect in turn from the best hypothesis: is it still needed beside what the others have become?"""
    best = search.ranked()[0]
    if len(best.hypothesis) < 2:
        return
    tasks = [_without(i, best, search.problem) for i in range(len(best.hypothesis))]
    converge(search, tasks, limit=best.cost + search.problem.settings.search.sight)


def _without(i: int, best: Fit, simulator: Simulator) -> tuple[Hypothesis, np.ndarray]:
    """A hypothesis without its effect i, and the vector (n,) of what stays."""
    _, etas = simulator.split(best.hypothesis, best.vector)
    rest = best.hypothesis[:i] + best.hypothesis[i + 1 :]
    return rest, np.concatenate([best.vector[: len(simulator.nominal)], *etas[:i], *etas[i + 1 :]])
