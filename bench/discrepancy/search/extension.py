"""One more effect beside a hypothesis: screened, refined along the motion, fitted in a few iterations, the best carried on."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.fits import Search, Task, carry_on, converge, limit_of
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.candidates import (
    about,
    leading,
    passed_over,
    refined,
    tells_motion,
)
from bench.discrepancy.screening.linear_amplitudes import fainter
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen


class Offers(NamedTuple):
    """What a screening offers beside a base; the screening itself is large, and let go.

    Attributes:
        base: Fitted hypothesis.
        tasks: Fits of what promises most.
        spare: Further starts and their fits, for the case that those do not keep what they promise.
    """

    base: Fit
    tasks: list[Task]
    spare: list[tuple[Point, Task]]


def extend(
    search: Search,
    screen: Screen,
    bases: Sequence[Fit],
    *,
    count: int,
    among: Collection[tuple[str, str, str]] = (),
) -> None:
    """Add one effect to every base, of those `among` where some are given: screen, refine, fit quickly, carry the best on."""
    size = len(bases[0].hypothesis) + 1
    offers = [_offers(search, screen, base, count=count, among=among) for base in bases]
    limit = limit_of(search, size)

    def fit_all(tasks: Iterable[Task]) -> None:
        search.fit_all(lambda task: first_fit(search.problem, *task, limit=limit), tasks)

    fit_all(task for found in offers for task in found.tasks)
    fit_all(task for found in offers for task in begun_faint(search, found))
    for base, _, spare in offers:
        kept = _kept(search, base)
        fit_all(task for p, task in spare if p.gain > kept and search.start(base.hypothesis, p))
    carry_on(search, size, most=4)


def _offers(
    search: Search,
    screen: Screen,
    base: Fit,
    *,
    count: int,
    among: Collection[tuple[str, str, str]],
) -> Offers:
    """Screen one more effect beside a base, of those `among` where some are given."""
    settings = search.problem.settings
    problem = search.problem
    along = tells_motion(base, problem)
    named, local, ground = _beside(search, screen, base)
    solved = [p for p in local.ranked(named, ground) if not among or p.placed.key in among]
    points = refined(local, ground, solved)
    if not named:
        search.first = sorted([*search.first, *points] if among else points, key=lambda p: -p.gain)
    inertia = [] if among else local.inertia_points(base, ground)
    most = max((p.gain for p in [*points, *inertia]), default=0.0)
    excess = base.chi2 - base.n_residuals
    if named and problem.scaled and not consistent(base) and most < settings.search.unpromising * excess:
        return Offers(base, [], [])

    def task(point: Point) -> Task:
        return (*base.hypothesis, point.placed), local.starts(point, ground, named)

    # a screening can promise more than there is
    most = min(most, max(excess, settings.screening.worth_a_fit))
    short = (settings.screening.trusted if named and along else settings.screening.short) * most
    chosen = leading(points, count, short, settings=search.problem.settings)
    if not among:
        chosen += passed_over(
            solved, chosen, count, settings.screening.worth_a_fit, settings=search.problem.settings
        )
    begun = {point.placed.key for point in chosen}
    rest = [p for p in points if p.placed.key not in begun] if named and along else []
    spare = [
        (p, task(p))
        for p in leading(
            rest, count, settings.screening.worth_a_fit, starts=1, settings=search.problem.settings
        )
    ]
    tasks = [task(p) for p in chosen if search.start(base.hypothesis, p)]
    least = min(short, settings.screening.worth_a_fit) if consistent(base) else short
    tasks += [
        ((*base.hypothesis, p.placed), np.append(base.vector, p.eta)) for p in inertia if p.gain > least
    ]
    return Offers(base, tasks, spare)


def begun_faint(search: Search, offers: Offers) -> Iterator[Task]:
    """Fits of effects that left more than their base does, from the base and a faint effect: more is never worse, if fitted well.

    At the size that a screening promises along one motion, friction or a stop may make another one, which no small step leads away from.
    Where noise decides, three laws that are fitted so well soon imitate what no catalogue holds.
    """
    base = offers.base
    n = len(base.vector)
    weighed = base.hypothesis and search.problem.error is not None
    for hypothesis, starts in offers.tasks if weighed else ():
        placed, known = hypothesis[-1], search.fits.get(key_of(hypothesis))
        if placed.effect.site != "joint" or (known is not None and known.cost < base.cost):
            continue
        parts = search.problem.settings.search.faint
        yield (
            hypothesis,
            np.vstack([faint_starts(base, placed, eta, parts) for eta in np.atleast_2d(starts)[:, n:]]),
        )


def faint_starts(base: Fit, placed: Placed, eta: np.ndarray, parts: Sequence[float]) -> np.ndarray:
    """Starts (k, n) of a fit of one more effect: a base as it is, and parts (k,) of the effect's force with the parameters `eta`."""
    return np.array([np.append(base.vector, fainter(placed, eta, part)) for part in parts])


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
    settings = problem.settings.search
    iterations = settings.quick if hypothesis[-1].effect.site == "joint" else 2 * settings.quick
    return fit(problem, hypothesis, start=start, iterations=iterations, exact=False, limit=limit)


def read_off(search: Search, screen: Screen, size: int, placed: Placed, eta: Array) -> None:
    """Fit one more effect beside the best hypothesis that is one fewer, from parameters that were read off the records."""
    bases = (f for f in search.ranked(size - 1) if all(p.key != placed.key for p in f.hypothesis))
    if (base := next(bases, None)) is None:
        return
    named, local, ground = _beside(search, screen, base)
    point = local.refine(Point(placed, 0.0, eta), ground)
    converge(search, [((*base.hypothesis, placed), local.starts(point, ground, named))])


def each_beside(
    search: Search, screen: Screen, bases: Sequence[Fit], among: Collection[tuple[str, str, str]]
) -> None:
    """Fit every effect of `among` beside every base, whatever a screening promises of it, from where it is most."""
    tasks: list[Task] = []
    for base in bases:
        named, local, ground = _beside(search, screen, base)
        best: dict[tuple[str, str, str], Point] = {}
        for point in local.ranked(named, ground):
            if point.placed.key in among:
                best.setdefault(point.placed.key, point)
        tasks += [((*base.hypothesis, p.placed), local.starts(p, ground, named)) for p in best.values()]
    converge(search, tasks)


def _beside(search: Search, screen: Screen, base: Fit) -> tuple[Fit | None, Screen, Ground]:
    """A base unless it is the nominal model alone, the screening about it, and what it leaves."""
    named, along = base if base.hypothesis else None, tells_motion(base, search.problem)
    local = about(screen, base, explained=along)
    return named, local, local.ground(named, simulated=named is not None and along)


def contacts(search: Search, candidates: Sequence[Placed]) -> None:
    """Fit contacts from the best of their grid by free runs.

    Where only velocities or accelerations are measured, the middle of the motion is unknown, and a stop that shifts it is screened
    at the wrong place. Contacts have few shapes and cost little to simulate.
    """
    settings = search.problem.settings.search
    problem = search.problem
    still = np.zeros(len(problem.nominal))
    tasks: list[Task] = []
    for placed in candidates:
        effect = placed.effect
        if effect.rare or effect.site != "joint" or not _contact(effect):
            continue
        size = effect.parameters[0]
        starts = [
            np.concatenate([still, [size.mean + level * size.std], eta[1:]])
            for eta in effect.grid()
            for level in settings.contact_levels
        ]

        def cost(start: np.ndarray, placed: Placed = placed) -> float:
            residual = problem.residual((placed,), start)
            return float(residual @ residual)

        costs = np.array(in_threads(cost, starts))
        tasks += [
            ((placed,), starts[i])
            for i in np.argsort(costs)[: settings.contact_starts]
            if np.isfinite(costs[i])
        ]
    converge(search, tasks)


def _contact(effect: Effect) -> bool:
    """Whether an effect is a force of the displacement with a position to be found."""
    return (
        effect.family == "stiffness" and any(p.grid for p in effect.parameters) and effect.rate_bound is None
    )
