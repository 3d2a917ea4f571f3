"""Attribution: which effects, out of the catalogue, explain the records.

Screening proposes, output-error fits decide, and hypotheses are compared by their evidence. Effects are added one at
a time as long as the residuals do not look like noise: to the best few hypotheses so far, the screening conditioned on each.
An effect that a larger hypothesis does not need any more loses to the smaller one by its Occam factor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from bench.discrepancy.case import Case
from bench.discrepancy.effect import Effect
from bench.discrepancy.fit import Fit, fit
from bench.discrepancy.problem import Hypothesis, Placed, Problem
from bench.discrepancy.screen import Point, Screen
from bench.discrepancy.structure import Structure

THREADS = 2
QUICK = 4
"""Iterations of a first fit; the best are carried on to convergence."""
LOG_PRIOR_EFFECT = -3.4
"""Log prior odds of one more effect: about one in the number of effects of the catalogue."""
SIGNIFICANT = 4.0
"""Standard deviations by which chi-squared may exceed its expectation before a hypothesis counts as refuted."""
IMMATERIAL = 0.002
"""Relative improvement of chi-squared that one more effect has to pay for, since the smoothing of stick-slip and the
interpolation of loads are themselves only as good as that; records of extreme signal-to-noise ratio would else name trifles."""
WORTH_A_FIT = 25.0
"""Screened gain in chi-squared from which one more effect could overcome its prior and its Occam factor."""
HOPELESS = 3.0
"""A first fit that leaves more than this many times the excess of the best one is not carried on."""
SHORT = 0.2
"""Effects whose screened gain is less than this part of the best one are not fitted."""
STALLED = 0.7
"""If one more effect leaves more than this part of the excess of chi-squared, a further one is not tried."""
MODEL_ERROR = 0.02
"""Relative excess of chi-squared that is laid to the smoothing and integration of the diagnosis itself."""


@dataclass
class Search:
    """What an attribution has found so far, for one problem.

    Attributes:
        problem: Records and priors.
        fits: Fitted hypotheses by their set of keys.
        converged: Keys of the fits carried on to convergence.
    """

    problem: Problem
    fits: dict[frozenset, Fit] = field(default_factory=dict)
    converged: set[frozenset] = field(default_factory=set)

    def add(self, fitted: Fit) -> None:
        """Keep a fit if it is the best of its hypothesis."""
        key = key_of(fitted.hypothesis)
        if key not in self.fits or fitted.cost < self.fits[key].cost:
            self.fits[key] = fitted

    def ranked(self, size: int | None = None) -> list[Fit]:
        """Fits by decreasing posterior, of one number of effects or of all."""
        chosen = [f for f in self.fits.values() if size is None or len(f.hypothesis) == size]
        return sorted(chosen, key=lambda f: -posterior(f))


def key_of(hypothesis: Hypothesis) -> frozenset:
    """Key of a hypothesis, regardless of the order of its effects."""
    return frozenset(placed.key for placed in hypothesis)


def posterior(fitted: Fit) -> float:
    """Log posterior of a hypothesis up to a constant."""
    tolerance = 0.5 * IMMATERIAL * fitted.n_residuals
    return fitted.log_evidence + (LOG_PRIOR_EFFECT - tolerance) * len(fitted.hypothesis)


def consistent(fitted: Fit) -> bool:
    """Whether the residuals of a fit are as small as the stated noise lets them be."""
    spread = np.sqrt(2.0 / fitted.n_residuals)
    return fitted.reduced < 1.0 + SIGNIFICANT * spread + MODEL_ERROR


def placements(case: Case, structure: Structure, catalogue: Iterable[Effect]) -> list[Placed]:
    """Return every effect of a catalogue at every place of a structure where it can sit."""
    out: list[Placed] = []
    for effect in catalogue:
        for place in structure.places:
            if effect.site == "joint" and len(place.rows) == effect.n_coordinates:
                out.append(Placed(effect, place))
            if len(place.rows) != 1:
                continue
            out += [Placed(effect, place, target) for target in _targets(case, effect, structure, place)]
    return out


def _targets(case: Case, effect: Effect, structure: Structure, place) -> list[str]:
    if effect.site == "inertia":
        names = {"mass": place.mass, "stiffness": (place.stiffness,), "damping": (place.damping,)}[
            effect.quantity
        ]
        return [name for name in names if name in structure.parameters]
    dofs = np.abs(place.rows).sum(axis=0) > 0
    if effect.site == "actuator":
        commanded = [name for name in structure.loads if case.channel(name).role == "command"]
        return [
            name
            for name in commanded
            if np.abs(structure.inputs[dofs, structure.loads.index(name)]).sum() > 0
        ]
    if effect.site == "sensor":
        order = {"position": 0, "velocity": 1, "acceleration": 2}[effect.quantity]
        return [o.channel for o in structure.observers if o.order == order and np.abs(o.row[dofs]).sum() > 0]
    return []


def attribute(
    problem: Problem,
    candidates: Sequence[Placed],
    *,
    most: int = 3,
    progress: Callable[[str], None] = lambda text: None,
    prepared: tuple[Search, Screen, list[Point]] | None = None,
) -> Search:
    """Search the hypotheses of up to `most` effects.

    Args:
        problem: Records and priors.
        candidates: Effects at their places.
        most: Largest number of effects.
        progress: Called with a line of text at every stage.
        prepared: What `prepare` returned for the same arguments, where it was called before.

    Returns:
        All fits made.
    """
    with ThreadPoolExecutor(THREADS) as pool:
        search, screen, points = prepared or prepare(problem, candidates, pool.map)
        nothing = search.ranked(0)[0]
        progress(f"nominal model: chi-squared {nothing.reduced:.3g} of its expectation")
        at_ease = consistent(nothing) and nothing.cost - nothing.chi2 < len(problem.nominal) + WORTH_A_FIT / 2
        if at_ease and (not points or points[0].gain < WORTH_A_FIT):
            return search
        _extend(search, screen, [nothing], pool, seconds=7)
        for size in range(1, most):
            best = search.ranked()[0]
            progress(
                f"{len(best.hypothesis)} effect(s): {names(best.hypothesis)}, chi-squared {best.reduced:.3g}"
            )
            if consistent(best):
                points = screen.ranked(best) if len(best.hypothesis) == size else []
                if not points or points[0].gain < WORTH_A_FIT:
                    break
                _extend(search, screen, [best], pool, seconds=6)
                reduce_best(search, pool)
                continue
            ranked = search.ranked(size)
            if not ranked or ranked[0].reduced - 1.0 > STALLED * (search.ranked(size - 1)[0].reduced - 1.0):
                break
            _extend(search, screen, ranked[: 4 - size], pool, seconds=6 - size)
            reduce_best(search, pool)
    return search


def prepare(
    problem: Problem, candidates: Sequence[Placed], each: Callable = map
) -> tuple[Search, Screen, list[Point]]:
    """Fit the nominal model and screen the catalogue: the cheap part of an attribution.

    Args:
        problem: Records and priors.
        candidates: Effects at their places.
        each: Maps a function over items, in threads where wanted.
    """
    search = Search(problem)
    search.add(fit(problem, (), start=np.zeros(len(problem.nominal))))
    screen = Screen(problem, candidates, each)
    return search, screen, screen.ranked()


def names(hypothesis: Hypothesis) -> str:
    """Readable names of a hypothesis."""
    return (
        " + ".join(p.effect.name + (f" ({p.place.name})" if p.place.name else "") for p in hypothesis)
        or "nothing"
    )


def _extend(
    search: Search, screen: Screen, bases: Sequence[Fit], pool: ThreadPoolExecutor, *, seconds: int
) -> None:
    """Add one effect to every base: screen, fit quickly, carry the best on."""
    problem = search.problem
    tasks: list[tuple[Hypothesis, np.ndarray]] = []
    size = len(bases[0].hypothesis) + 1
    for base in bases:
        points = screen.ranked(base if base.hypothesis else None)
        for placed, etas in _starts(points, seconds):
            for eta in etas:
                tasks.append(
                    ((*base.hypothesis, placed), np.concatenate([base.vector * bool(base.hypothesis), eta]))
                )
        own = {placed.key for placed in base.hypothesis}
        for placed in screen.inertia:
            if placed.key not in own:
                tasks.append(((*base.hypothesis, placed), np.concatenate([base.vector, [0.0]])))

    def quick(task: tuple[Hypothesis, np.ndarray]) -> Fit:
        return fit(
            problem,
            task[0],
            start=task[1],
            iterations=QUICK if task[0][-1].effect.site == "joint" else 3 * QUICK,
        )

    for fitted in pool.map(quick, tasks):
        search.add(fitted)
    ranked = [f for f in search.ranked(size) if np.isfinite(f.cost)]
    carried = [
        f
        for f in ranked[:4]
        if key_of(f.hypothesis) not in search.converged
        and f.reduced < 1.5 + HOPELESS * (ranked[0].reduced - 1.0)
    ]
    for fitted in pool.map(lambda f: fit(problem, f.hypothesis, start=f.vector, iterations=20), carried):
        search.add(fitted)
        search.converged.add(key_of(fitted.hypothesis))


def reduce_best(search: Search, pool: ThreadPoolExecutor) -> None:
    """Strike each effect in turn from the best hypothesis, the fit starting from what the others have become."""
    best = search.ranked()[0]
    if len(best.hypothesis) < 2:
        return
    tasks = []
    n = len(search.problem.nominal)
    _, etas = search.problem.split(best.hypothesis, best.vector)
    for i in range(len(best.hypothesis)):
        rest = best.hypothesis[:i] + best.hypothesis[i + 1 :]
        tasks.append(
            (rest, np.concatenate([best.vector[:n], *(eta for j, eta in enumerate(etas) if j != i)]))
        )
    for fitted in pool.map(lambda task: fit(search.problem, task[0], start=task[1], iterations=20), tasks):
        search.add(fitted)


def _starts(points: Sequence[Point], count: int) -> list[tuple[Placed, list[np.ndarray]]]:
    """Best `count` effects of a screening, with their best one or two starts."""
    grouped: dict[tuple[str, str, str], tuple[Placed, list[np.ndarray]]] = {}
    for point in points:
        if point.gain < SHORT * points[0].gain:
            break
        _, etas = grouped.setdefault(point.placed.key, (point.placed, []))
        if len(etas) < (1 if point.placed.effect.site != "joint" else 2):
            etas.append(point.eta)
    return list(grouped.values())[:count]
