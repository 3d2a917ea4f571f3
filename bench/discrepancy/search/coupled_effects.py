"""Explanations that hold an effect which couples groups of degrees of freedom: the two axes of a joint."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.model.placements import placements
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.candidates import (
    about,
    leading,
    passed_over,
    refined,
    tells_motion,
)
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.extension import faint_starts, first_fit
from bench.discrepancy.search.rivals import reduce_best

Keys = Collection[tuple[str, str, str]]


def coupled_fits(
    kept: Search,
    catalogue: Sequence[Effect],
    most: int,
    progress: Callable[[str], None],
    deeper: Callable[[Fit], bool] = lambda alone: True,
) -> bool:
    """Search explanations that hold an effect which couples the groups.

    Args:
        kept: Search on all degrees of freedom; couplings that it holds alone already are not fitted again.
        catalogue: Effects to consider.
        most: Largest number of effects.
        progress: Called with a line of text at every stage.
        deeper: Whether the best coupling alone is worth a search for other effects beside it.

    Returns:
        Whether other effects were searched beside a coupling.
    """
    progress("effects that couple the degrees of freedom")
    problem = kept.problem
    candidates = [p for p in placements(problem.case, problem.structure, catalogue) if not p.effect.rare]
    forces = [p for p in candidates if p.effect.site == "joint"]
    screen = Screen(problem, forces)
    coupling = {p.key for p in forces if p.effect.n_coordinates > 1}
    if not kept.fits:
        _alone(kept, screen, coupling)
    deep = bool(kept.fits) and deeper(kept.ranked()[0])
    if deep:
        screen.add([p for p in candidates if p.effect.site != "joint"])
    size = 1
    while deep and size < most and _one_more(kept, screen, coupling, progress):
        size += 1
    return deep


def _alone(kept: Search, screen: Screen, coupling: Keys) -> None:
    """Fit every coupling alone."""
    points = refined(screen, screen.ground(), [p for p in screen.ranked() if p.placed.key in coupling])
    zero = np.zeros(len(kept.problem.nominal))
    # all starts: which one leads to the deepest minimum, a gain along the measured motion does not tell
    converge(kept, [((p.placed,), np.append(zero, p.eta)) for p in points])


def _one_more(kept: Search, screen: Screen, coupling: Keys, progress: Callable[[str], None]) -> bool:
    """Fit one more effect beside the best hypothesis; whether that has brought it far enough for another."""
    settings = kept.problem.settings
    base = kept.ranked()[0]
    if len(base.hypothesis) > 1 and base.reduced > settings.search.coupled.hopeless_third:
        return False
    if not any(placed.key in coupling for placed in base.hypothesis):
        return False  # the groups' own searches know more of such
    progress(f"{names(base.hypothesis)}, chi-squared {base.reduced:.3g}")
    along, local, ground = _ground(screen, base)
    solved = local.ranked(base, ground)
    if base.reduced > settings.search.coupled.hopeless_coupling:
        solved = [p for p in solved if p.placed.key in coupling]
    points = refined(local, ground, solved) + local.inertia_points(base, ground)
    worth = _worth(sorted(points, key=lambda p: -p.gain), base, ground, coupling)
    if not worth:
        return False

    def extended(point: Point) -> Fit:
        starts = local.starts(point, ground, base)
        if point.placed.effect.site == "joint":
            faint = faint_starts(base, point.placed, point.eta, settings.search.coupled.faint)
            starts = np.vstack([starts, faint])
        return first_fit(kept.problem, (*base.hypothesis, point.placed), starts)

    least = settings.screening.trusted * worth[0].gain if along else settings.screening.worth_a_fit
    chosen = leading(worth, settings.search.coupled.trials, least, starts=1, settings=kept.problem.settings)
    chosen += passed_over(
        solved, chosen, settings.search.coupled.trials, least, settings=kept.problem.settings
    )
    trials = sorted(in_threads(extended, chosen), key=lambda f: f.cost)
    some = trials[
        : settings.search.coupled.converged_pairs
        if len(base.hypothesis) == 1
        else settings.search.coupled.converged_beyond
    ]
    converge(kept, [(f.hypothesis, f.vector) for f in some])
    reduce_best(kept)
    best = kept.ranked()[0]
    return best is not base and best.reduced - 1.0 <= settings.search.stalled * (base.reduced - 1.0)


def _ground(screen: Screen, base: Fit) -> tuple[bool, Screen, Ground]:
    """What a base leaves, along its free run or the measured motion: whether the former, the screening there, and what is left.

    A free run that misses the noise by far still tells the motion better than accelerations, twice integrated, if it leaves less.
    """
    if not tells_motion(base, screen.problem):
        local = about(screen, base, explained=False)
        ground = local.ground(base)
        if float(np.sum(ground.left**2)) < base.chi2:
            return False, local, ground
    local = about(screen, base, explained=True)
    return True, local, local.ground(base, simulated=True)


def _worth(points: Sequence[Point], base: Fit, ground: Ground, coupling: Keys) -> list[Point]:
    """Points that are worth a fit beside a base; only couplings where none promises to explain the records."""
    settings = base.settings
    worth = [
        p
        for p in points
        if p.gain > max(settings.screening.worth_a_fit, settings.search.immaterial * base.n_residuals)
    ]
    alone = float(np.sum(ground.left**2))
    if (
        alone - max((p.gain for p in worth), default=0.0)
        > settings.search.coupled.hopeless_pair * base.n_residuals
    ):
        worth = [
            p for p in worth if p.placed.key in coupling and alone - p.gain < settings.search.stalled * alone
        ]
    return worth
