"""Attribution: which effects, out of the catalogue, explain the records.

Screening proposes, output-error fits decide, and hypotheses are compared by their evidence. Effects are added one at
a time as long as the residuals do not look like noise: to the best few hypotheses so far and to those that promise most together
with another effect, the screening conditioned on each. What promised most and was not kept by its fit makes room for the next.
An effect that a larger hypothesis does not need any more loses to the smaller one by its Occam factor. In the end every effect
of the best hypothesis is challenged by those that do nearly as well along the motion it explains, each fitted from several
starts, so that no flexible law wins because a simpler one was fitted carelessly.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case import Case
from bench.discrepancy.effect import Effect
from bench.discrepancy.fit import Fit, fit
from bench.discrepancy.grid_points import Point
from bench.discrepancy.placed import FROM, Hypothesis, Placed
from bench.discrepancy.problem import Problem
from bench.discrepancy.screen import Ground, Screen
from bench.discrepancy.search import (
    IMMATERIAL,
    SAME,
    SIGHT,
    THOROUGH,
    THREADS,
    Search,
    Task,
    carry_on,
    consistent,
    converge,
    integrate_finer,
    key_of,
    limit_of,
    names,
    near,
    shake,
    sticks,
)
from bench.discrepancy.structure import Structure

QUICK = 6
"""Iterations of a first fit; the best are carried on to convergence."""
WORTH_A_FIT = 25.0
"""Screened gain in chi-squared from which one more effect could overcome its prior and its Occam factor."""
NOTICEABLE = 15.0
"""Screened gain from which the first effect is fitted: noise alone lets the best of the catalogue gain so much in few cases."""
SHORT = 0.15
"""Effects whose screened gain is less than this part of the best one are not fitted."""
TRUSTED = 0.5
"""The same part where one more effect is screened about a free run that follows the motion: gains are what they seem then."""
LEVELS = (-2.0, -1.0, 0.0, 1.0)
"""Sizes of contacts that are simulated on their grid, in prior standard deviations from their mean."""
SIMULATED = 2
"""Starts of each that are fitted."""
REFINED_EFFECTS = 12
"""Effects whose grid points are refined along the measured motion."""
REFINED_STARTS = 3
"""Grid points refined of each."""
APART = 0.8
"""Distance of starts of an effect, in prior standard deviations of its grid parameters."""
NEARLY = 0.9
"""Further starts of an effect are worth a fit if they gain this part of what its best one does."""
LEFT = 0.02
"""Part of a named effect's gain along the motion that a challenger may lack, besides twice what the effect leaves."""
STALLED = 0.7
"""If one more effect leaves more than this part of the excess of chi-squared, a further one is not tried."""
CONSIDERED, PROMISED = 12, 2
"""Hypotheses that are asked what they promise together with one more effect, and those that are extended for that alone."""
UNPROMISING = 0.25
"""Part of the excess of a base that one more effect must promise to take away, or none is fitted beside it."""

OTHER_AXIS = {
    "displacement": "rotation",
    "rotation": "displacement",
    "velocity": "angular_velocity",
    "angular_velocity": "velocity",
    "acceleration": "angular_acceleration",
    "angular_acceleration": "acceleration",
}
"""Channels of the joint rig that one sensor measures along its two axes."""

Prepared = tuple[Search, Screen, list[Point]]
"""A search before its first step: the nominal model fitted, the catalogue screened, its grid points by decreasing gain."""


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
        channels = [
            o.channel for o in structure.observers if o.order == order and np.abs(o.row[dofs]).sum() > 0
        ]
        return _pickups(case, structure, channels) if effect.pickup else channels
    return []


def _pickups(case: Case, structure: Structure, channels: Sequence[str]) -> list[str]:
    """Cross-talk into response channels: from the loads on their structure, and from the same sensor's other axis."""
    if case.rig == "damper":  # what the force channel picks up from the displacement is a stiffness
        return []
    out = []
    for channel in channels:
        kind, _, number = channel.rpartition("_")
        across = f"{OTHER_AXIS[kind]}_{number}" if kind in OTHER_AXIS else ""
        sources = [*structure.loads, across] if case.has(across) else structure.loads
        out += [f"{channel}{FROM}{source}" for source in sources]
    return out


def attribute(
    problem: Problem,
    candidates: Sequence[Placed],
    *,
    most: int = 3,
    progress: Callable[[str], None] = lambda text: None,
    prepared: Prepared | None = None,
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
        if _at_ease(nothing, problem):
            points = about(screen, nothing, explained=True).ranked()
            if not points or points[0].gain < NOTICEABLE:
                return search
        _extend(search, screen, [nothing], pool, count=8)
        if not consistent(search.ranked()[0]) and all(o.order > 0 for o in problem.structure.observers):
            _simulated(search, candidates, pool)
        rare = [p for p in candidates if p.effect.rare]
        if rare and not consistent(search.ranked()[0]):
            progress("rarer effects")
            screen.add(rare, pool.map)
            _extend(search, screen, [nothing], pool, count=6, among={p.key for p in rare})
        for size in range(1, most):
            if near(search.ranked()[0]):
                integrate_finer(search, pool)
            best = search.ranked()[0]
            progress(
                f"{len(best.hypothesis)} effect(s): {names(best.hypothesis)}, chi-squared {best.reduced:.3g}"
            )
            if consistent(best):
                if len(best.hypothesis) != size or not _promising(screen, best):
                    break
                _extend(search, screen, [best], pool, count=4)
                reduce_best(search, pool)
                continue
            ranked = search.ranked(size)
            if not ranked or ranked[0].reduced - 1.0 > STALLED * (search.ranked(size - 1)[0].reduced - 1.0):
                break
            _extend(search, screen, worth_extending(search, screen, size, 4 - size), pool, count=6 - size)
            reduce_best(search, pool)
        best = search.ranked()[0]
        if problem.noise_stated and near(best):
            progress(f"rivals of {names(best.hypothesis)}")
            challenge(search, screen, pool)
            shake(search, pool)
    return search


def worth_extending(search: Search, screen: Screen, size: int, most: int) -> list[Fit]:
    """Hypotheses beside which one more effect is searched: the best ones, and those that promise most together with another effect.

    Alone, a flexible law is bent to what two forces do, and the one that was right about half of it lies far behind.

    Args:
        search: Fits so far.
        screen: Screening of the same problem.
        size: Number of effects of the hypotheses.
        most: Number of the best ones.

    Returns:
        The hypotheses by decreasing posterior.
    """
    problem, ranked = search.problem, search.ranked(size)

    def promised(base: Fit) -> float:
        ground = screen.ground(base)
        points = screen.ranked(base, ground)[:1]
        return float(np.sum(ground.left**2)) - sum(point.gain for point in points)

    far = [f for f in ranked[:CONSIDERED] if np.isfinite(f.cost) and not followed(f, problem)]
    chosen = ranked[:most] + sorted(far, key=promised)[:PROMISED]
    return [f for f in ranked if any(f is own for own in chosen)]


def _promising(screen: Screen, best: Fit) -> bool:
    """Whether one more effect could still be in the residual of a hypothesis that is down to the noise."""
    screen = about(screen, best, explained=True)
    ground = screen.ground(best, simulated=True)
    points = screen.ranked(best, ground)[:1] + screen.inertia_points(best, ground)[:1]
    return max((p.gain for p in points), default=0.0) > max(WORTH_A_FIT, IMMATERIAL * best.n_residuals)


def _at_ease(fitted: Fit, problem: Problem) -> bool:
    """Whether a hypothesis explains the records without nominal parameters far off their values."""
    return consistent(fitted) and fitted.cost - fitted.chi2 < len(problem.nominal) + WORTH_A_FIT / 2


def followed(base: Fit, problem: Problem) -> bool:
    """Whether one more effect is best screened along the free run of a base, since that tells the motion better than the records.

    Where friction sticks it is not, unless all is explained: a small force more moves the stops, which no linear response does.
    The nominal model alone is asked whether it is at ease with what it leaves.
    """
    if not base.hypothesis:
        return _at_ease(base, problem)
    return consistent(base) or (near(base) and not sticks(base))


def about(screen: Screen, base: Fit, *, explained: bool) -> Screen:
    """The screening that tells what a base lacks: about its free run where that follows the motion, else about the measured one."""
    spoilt = any(placed.effect.site == "sensor" for placed in base.hypothesis)
    return screen.beside(base, simulated=explained) if spoilt or explained else screen


def prepare(problem: Problem, candidates: Sequence[Placed], each: Callable = map) -> Prepared:
    """Fit the nominal model and screen the catalogue: the cheap part of an attribution.

    Args:
        problem: Records and priors.
        candidates: Effects at their places.
        each: Maps a function over items, in threads where wanted.
    """
    search = Search(problem)
    search.add(fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=THOROUGH))
    screen = Screen(problem, [p for p in candidates if not p.effect.rare], each)
    return search, screen, screen.ranked()


class _Offers(NamedTuple):
    """What a screening offers beside a base; the screening itself is large, and let go.

    Attributes:
        base: Fitted hypothesis.
        tasks: Fits of what promises most.
        spare: Further starts and their fits, for the case that those do not keep what they promise.
    """

    base: Fit
    tasks: list[Task]
    spare: list[tuple[Point, Task]]


def _extend(
    search: Search,
    screen: Screen,
    bases: Sequence[Fit],
    pool: ThreadPoolExecutor,
    *,
    count: int,
    among: Collection[tuple[str, str, str]] = (),
) -> None:
    """Add one effect to every base, of those `among` where some are given: screen, refine, fit quickly, carry the best on."""
    size = len(bases[0].hypothesis) + 1
    offers = [_offers(search, screen, base, pool, count=count, among=among) for base in bases]
    limit = limit_of(search, size)

    def fit_all(tasks: Iterable[Task]) -> None:
        for fitted in pool.map(lambda task: first_fit(search.problem, *task, limit=limit), tasks):
            search.add(fitted)

    fit_all(task for found in offers for task in found.tasks)
    for base, _, spare in offers:
        kept = _kept(search, base)
        fit_all(task for p, task in spare if p.gain > kept and search.start(base.hypothesis, p))
    carry_on(search, pool, size, most=4)


def _offers(
    search: Search,
    screen: Screen,
    base: Fit,
    pool: ThreadPoolExecutor,
    *,
    count: int,
    among: Collection[tuple[str, str, str]],
) -> _Offers:
    """Screen one more effect beside a base, of those `among` where some are given."""
    problem = search.problem
    named = base if base.hypothesis else None
    along = followed(base, problem)
    local = about(screen, base, explained=along)
    ground = local.ground(named, simulated=named is not None and along)
    solved = [p for p in local.ranked(named, ground) if not among or p.placed.key in among]
    points = refined(local, ground, solved, pool)
    if not named:
        search.first = sorted([*search.first, *points] if among else points, key=lambda p: -p.gain)
    inertia = [] if among else local.inertia_points(base, ground)
    most = max((p.gain for p in [*points, *inertia]), default=0.0)
    excess = base.chi2 - base.n_residuals
    if named and problem.noise_stated and not consistent(base) and most < UNPROMISING * excess:
        return _Offers(base, [], [])

    def task(point: Point) -> Task:
        return (*base.hypothesis, point.placed), local.starts(point, ground, named)

    # a screening can promise more than there is
    most = min(most, max(excess, WORTH_A_FIT))
    short = (TRUSTED if named and along else SHORT) * most
    chosen = leading(points, count, short)
    if not among:
        chosen += passed_over(solved, chosen, count, WORTH_A_FIT)
    begun = {point.placed.key for point in chosen}
    rest = [p for p in points if p.placed.key not in begun] if named and along else []
    spare = [(p, task(p)) for p in leading(rest, count, WORTH_A_FIT, starts=1)]
    tasks = [task(p) for p in chosen if search.start(base.hypothesis, p)]
    least = min(short, WORTH_A_FIT) if consistent(base) else short
    tasks += [
        ((*base.hypothesis, p.placed), np.append(base.vector, p.eta)) for p in inertia if p.gain > least
    ]
    return _Offers(base, tasks, spare)


def _kept(search: Search, base: Fit) -> float:
    """How much one more effect has taken from the cost of a base so far: what was promised may not have been kept."""
    own = key_of(base.hypothesis)
    size = len(base.hypothesis) + 1
    best = min(
        (f.cost for key, f in search.fits.items() if len(key) == size and own < key), default=base.cost
    )
    return base.cost - best


def first_fit(problem: Problem, hypothesis: Hypothesis, start: np.ndarray, *, limit: float = np.inf) -> Fit:
    """A few iterations with one more effect, the last one; of channels and inertia, which the screening begins farther off, more.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        start: Start vector (n,), or several (k, n).
        limit: Cost that has to be within sight, see `minimise`.
    """
    iterations = QUICK if hypothesis[-1].effect.site == "joint" else 2 * QUICK
    return fit(problem, hypothesis, start=start, iterations=iterations, exact=False, limit=limit)


def _simulated(search: Search, candidates: Sequence[Placed], pool: ThreadPoolExecutor) -> None:
    """Fit contacts from the best of their grid by free runs.

    Where only velocities or accelerations are measured, the middle of the motion is unknown, and a stop that shifts it is screened
    at the wrong place. Contacts have few shapes and cost little to simulate.
    """
    problem = search.problem
    still = np.zeros(len(problem.nominal))
    tasks: list[Task] = []
    for placed in candidates:
        effect = placed.effect
        if effect.rare or not _contact(effect):
            continue
        size = effect.parameters[0]
        starts = [
            np.concatenate([still, [size.mean + level * size.std], eta[1:]])
            for eta in effect.grid()
            for level in LEVELS
        ]

        def cost(start: np.ndarray, placed: Placed = placed) -> float:
            residual = problem.residual((placed,), start)
            return float(residual @ residual)

        costs = np.array(list(pool.map(cost, starts)))
        tasks += [((placed,), starts[i]) for i in np.argsort(costs)[:SIMULATED] if np.isfinite(costs[i])]
    converge(search, pool, tasks)


def _contact(effect: Effect) -> bool:
    """Whether an effect is a force of the displacement with a position to be found."""
    return (
        effect.family == "stiffness" and any(p.grid for p in effect.parameters) and effect.rate_bound is None
    )


def passed_over(solved: Sequence[Point], chosen: Sequence[Point], count: int, least: float) -> list[Point]:
    """Starts of forces with nothing but their size to be found that are not among the chosen ones.

    They are cheap to fit, and never to be lost to a law of seven parameters because their gain along a badly known motion was small.
    """
    begun = {point.placed.key for point in chosen}
    simplest = [p for p in solved if _plain(p.placed.effect) and p.placed.key not in begun]
    return leading(simplest, count, least, starts=1)


def _plain(effect: Effect) -> bool:
    return effect.site == "joint" and effect.n_coordinates == 1 and len(effect.parameters) == 1


def challenge(search: Search, screen: Screen, pool: ThreadPoolExecutor, *, rounds: int = 3) -> None:
    """Fit the rivals of every effect of the best hypothesis, and that effect itself, from several starts.

    The rivals are screened along the free run of that hypothesis where it follows the motion: a run driven through accelerations
    alone knows its middle, which no record told. What a rival makes superfluous is struck.

    Args:
        search: Fits so far; the new ones are added.
        screen: Screening of the same problem.
        pool: Threads.
        rounds: A rival that wins is challenged in turn, so many times at most.
    """
    challenged: set[frozenset] = set()
    n = len(search.problem.nominal)
    for _ in range(rounds):
        best = search.ranked()[0]
        if not best.hypothesis or key_of(best.hypothesis) in challenged:
            return
        challenged.add(key_of(best.hypothesis))
        _, etas = search.problem.split(best.hypothesis, best.vector)
        along = followed(best, search.problem)
        tasks = []
        for i, placed in enumerate(best.hypothesis):
            rest = best.hypothesis[:i] + best.hypothesis[i + 1 :]
            vector = np.concatenate([best.vector[:n], *(eta for j, eta in enumerate(etas) if j != i)])
            base = replace(best, hypothesis=rest, vector=vector)
            points, alone = search.first, search.ranked(0)[0].chi2
            if rest or along:
                local = screen.beside(best, simulated=True) if along else about(screen, base, explained=False)
                named = base if rest else None
                ground = local.ground(named)
                alone = float(np.sum(ground.left**2))
                points = refined(local, ground, local.ranked(named, ground), pool)
            own = max((p.gain for p in points if p.placed.key == placed.key), default=np.inf)
            left = max(alone - own, search.problem.n_residuals)
            for point in leading(points, 5, own - left - LEFT * own, starts=REFINED_STARTS):
                if search.start(rest, point):
                    tasks.append(((*rest, point.placed), np.concatenate([vector, point.eta])))
                    continue
                # begun before, but perhaps left after a few iterations because a more flexible law was ahead by then
                begun = search.fits.get(key_of((*rest, point.placed)))
                known = begun is not None and any(begun.vector is start for _, start in tasks)
                if begun is not None and not known and key_of(begun.hypothesis) not in search.converged:
                    tasks.append((begun.hypothesis, begun.vector))
        converge(search, pool, tasks)
        carry_on(search, pool, len(best.hypothesis), most=6)
        reduce_best(search, pool)


def reduce_best(search: Search, pool: ThreadPoolExecutor) -> None:
    """Strike each effect in turn from the best hypothesis: is it still needed beside what the others have become?"""
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
    converge(search, pool, tasks, limit=best.cost + SIGHT)


def refined(screen: Screen, ground: Ground, points: Sequence[Point], pool: ThreadPoolExecutor) -> list[Point]:
    """Refine the leading grid points of the leading effects along the measured motion; by decreasing gain.

    Args:
        screen: Screening.
        ground: What the base leaves.
        points: Solved grid points by decreasing gain.
        pool: Threads.
    """
    chosen: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        if point.gain < 0.5 * SHORT * points[0].gain:
            break
        if point.placed.key not in chosen and len(chosen) == REFINED_EFFECTS:
            continue
        starts = chosen.setdefault(point.placed.key, [])
        if len(starts) < REFINED_STARTS and all(_apart(point, other) > APART for other in starts):
            starts.append(point)
    tasks = [point for starts in chosen.values() for point in starts]
    return sorted(pool.map(lambda point: screen.refine(point, ground), tasks), key=lambda p: -p.gain)


def _apart(point: Point, other: Point) -> float:
    """Distance of two starts of an effect in the parameters that have a grid."""
    return max(
        (
            abs(a - b) / p.std
            for a, b, p in zip(point.eta, other.eta, point.placed.effect.parameters, strict=True)
            if p.grid
        ),
        default=0.0,
    )


def leading(points: Sequence[Point], count: int, least: float, starts: int = 2) -> list[Point]:
    """Starts of the `count` effects of largest gain: the best of each, and further ones that are nearly as good."""
    grouped: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        if point.gain < least:
            break
        if point.placed.key not in grouped and len(grouped) == count:
            continue
        own = grouped.setdefault(point.placed.key, [])
        if not own or (
            len(own) < starts
            and point.gain > NEARLY * own[0].gain
            and all(_apart(point, other) > SAME for other in own)
        ):
            own.append(point)
    return [point for own in grouped.values() for point in own]
