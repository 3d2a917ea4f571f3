"""Search for what is missing from an articulated model: effects at all places are screened, the most promising fitted, one by one.

A screened effect is one run (or a few, over a grid) of the joints that it changes. The change that it makes, less what the nominal
parameters could do as well, is regressed on the residuals: what that takes away is what the effect promises.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_search.fitting import (
    ArticulatedFit,
    Others,
    fit,
    free_entries,
    own_entries,
    refitted,
)
from bench.discrepancy.articulated_search.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.screening import Screened, by_effect, screen
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


def complete(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> bool:
    """Whether no joint keeps more than the noise, and no nominal parameter is strained for it."""
    # the mean square of n residuals is known to sqrt(2 / n)
    noise = (1.0 + settings.noise_known) ** 2 + settings.sure * np.sqrt(2.0 / found.count)
    far = np.abs(found.vector[: len(problem.nominal)]) > settings.strained
    return bool(np.all(found.reduced <= noise) and not far.any())


def _strained(problem: ArticulatedProblem, base: ArticulatedFit, settings: SearchSettings) -> set[int]:
    """Joints one of whose nominal parameters a fit has moved too far."""
    return {p.joint for p, x in zip(problem.nominal, base.vector, strict=False) if abs(x) > settings.strained}


def _untouched(problem: ArticulatedProblem, base: ArticulatedFit) -> ArticulatedFit:
    """A fit with the nominal parameters as stated."""
    vector = base.vector.copy()
    vector[: len(problem.nominal)] = 0.0
    return ArticulatedFit.at(problem, base.hypothesis, vector)


def nominal_fit(problem: ArticulatedProblem) -> ArticulatedFit:
    """The nominal model alone, with the scales of the joints that it leaves."""
    vector = np.zeros(len(problem.nominal))
    return refitted(problem, (), vector, scale=ArticulatedFit.at(problem, (), vector).scale)


def search(
    problem: ArticulatedProblem,
    candidates: Sequence[PlacedOnJoint],
    *,
    settings: SearchSettings | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> list[ArticulatedFit]:
    """All fitted hypotheses: the one that nothing is worth adding to or taking from, then the likeliest first."""
    settings, judged = settings or problem.settings.articulated.search, problem.settings.articulated.judgement
    progress("nominal model")
    current = nominal_fit(problem)
    found, dropped = [current], set[tuple[str, str]]()
    for count in range(1, 2 * settings.most + 1):
        if not problem.deadline.allows(f"a search for effect {count}"):
            break
        taken = {placed.key for placed in current.hypothesis} | dropped
        rest = [c for c in candidates if c.key not in taken]
        best, fits = _round(
            problem, current, rest, settings, lambda text, n=count: progress(f"effect {n}: {text}")
        )
        found += fits
        # to what is complete, the judgement adds nothing but what is certain
        whole = complete(problem, current, judged)
        least = judged.certain if whole else settings.worth
        if best is None or best.log_posterior < current.log_posterior + least:
            break
        problem = problem.settled(best.hypothesis, best.vector)
        current, fits = without_idle(problem, best, settings)
        found += fits
        dropped |= {placed.key for placed in best.hypothesis} - {placed.key for placed in current.hypothesis}
        if len(current.hypothesis) == settings.most:
            break
    found += _predecessors(problem, current, found)
    return sorted(found, key=lambda f: (f is not current, -f.log_posterior))


def without_idle(
    problem: ArticulatedProblem, found: ArticulatedFit, settings: SearchSettings
) -> tuple[ArticulatedFit, list[ArticulatedFit]]:
    """A fit without the effects that its last one has made superfluous, and all fits made for that.

    What was taken first may have stood in for what was found later: it stays if without it the explanation loses what a further effect
    has to add.
    """
    made: list[ArticulatedFit] = []
    for placed in found.hypothesis[:-1]:
        if not problem.deadline.allows("whether the first effects are still needed"):
            break
        shorter = tuple(other for other in found.hypothesis if other.key != placed.key)
        kept = [*range(len(problem.nominal))]
        at = len(problem.nominal)
        for other in found.hypothesis:
            more = range(at, at + len(other.effect.parameters))
            kept += more if other.key != placed.key else ()
            at = more.stop
        start, scale = found.vector[kept], found.scale
        within = float(np.sum(found.chi2 / scale**2)) + _surprise(problem, found) + 2.0 * settings.sight
        new = fit(problem, shorter, start, scale=scale, iterations=settings.iterations, limit=within)
        if new.log_posterior > found.log_posterior - settings.sight:
            new = refitted(problem, shorter, new.vector, scale=new.scale)
        made.append(new)
        if new.log_posterior > found.log_posterior - settings.worth and sound(problem, new):
            found = new
    return found, made


def _surprise(problem: ArticulatedProblem, found: ArticulatedFit) -> float:
    """Misfit of the prior at a fit: the sum of squared deviations."""
    mean, std, _, _ = problem.prior(found.hypothesis)
    return float(np.sum(((found.vector - mean) / std)[free_entries(problem, found.hypothesis)] ** 2))


def _predecessors(
    problem: ArticulatedProblem, best: ArticulatedFit, found: Sequence[ArticulatedFit]
) -> list[ArticulatedFit]:
    """Fits with the first effects of a fit alone, where there is none among those found."""
    out = []
    for size in range(1, len(best.hypothesis)):
        first = best.hypothesis[:size]
        if all(f.hypothesis != first for f in found):
            vector = best.vector[: problem.size(first)]
            scale = ArticulatedFit.at(problem, first, vector).scale
            out.append(refitted(problem, first, vector, scale=scale))
    return out


def _round(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    candidates: Sequence[PlacedOnJoint],
    settings: SearchSettings,
    progress: Callable[[str], None],
) -> tuple[ArticulatedFit | None, list[ArticulatedFit]]:
    """One effect more: screened and fitted where runs forget, the best of them fitted again as they are.

    Returns:
        The best, all joints free, and all that were fitted as they are.
    """
    first: list[ArticulatedFit] = []
    ground = base
    for level in settings.softening:
        soft = problem.softened(level)
        ground = refitted(soft, base.hypothesis, ground.vector, scale=_scale_of(soft, ground))
        if first:
            if problem.deadline.over:
                break
            others = Others.of(soft, ground)
            first = [_again(soft, ground, others, f) for f in first]
            continue
        progress("screening")
        points = screen(soft, ground, candidates)
        if _strained(
            soft, ground, settings
        ):  # what stands in for the missing hides it; also from what was stated
            points += screen(soft, _untouched(soft, ground), candidates)
        progress("fits")
        first = _fits(soft, ground, by_effect(points, settings.starts), settings)
        if soft is problem:  # servos hold every joint: nothing forgets more than it does anyway
            break
    others = Others.of(problem, base)
    first = [f for f in first if sound(problem, f)] or first
    finalists = sorted(first, key=lambda f: -f.log_posterior)[: settings.finalists]
    fits = [f for f in (_again(problem, base, others, one) for one in finalists) if sound(problem, f)]
    fits = [_where_links_are(problem, f) for f in fits]
    if not fits:
        return None, fits
    best = max(fits, key=lambda f: f.log_posterior)
    settled = problem.settled(best.hypothesis, best.vector)
    whole = refitted(settled, best.hypothesis, best.vector, scale=best.scale)
    return whole, [*(f for f in fits if f is not best), whole]


def _where_links_are(problem: ArticulatedProblem, found: ArticulatedFit) -> ArticulatedFit:
    """A fit once more with the links of its elastic joints where it has them: what the other joints feel is part of the explanation."""
    settled = problem.settled(found.hypothesis, found.vector)
    return (
        found if settled is problem else refitted(settled, found.hypothesis, found.vector, scale=found.scale)
    )


def _again(
    problem: ArticulatedProblem, base: ArticulatedFit, others: Others, found: ArticulatedFit
) -> ArticulatedFit:
    """A fit once more in another problem, on the joints that its last effect changes; the other joints as a fit there has them."""
    active = problem.reached(found.hypothesis[len(base.hypothesis) :])
    vector = found.vector.copy()
    for j in (j for j in range(len(problem.joints)) if j not in active):
        own = own_entries(problem, base.hypothesis, j)
        vector[own] = base.vector[own]
    scale = _scale_of(problem, replace(found, vector=vector))
    return refitted(problem, found.hypothesis, vector, scale=scale, others=others)


def _beside(
    problem: ArticulatedProblem, found: ArticulatedFit, others: Others, settings: SearchSettings
) -> ArticulatedFit:
    """A fit whose last effect is periodic, with the next whole numbers of periods in a turn for as long as they are likelier.

    Over the range of a joint two neighbouring numbers differ by a fraction of a period, which a phase and a wrong gain of the encoder make
    up for; screened one at a time, with what else is missing still in the residuals, they are hardly told apart.
    """
    names = [p.name for p in found.hypothesis[-1].effect.parameters]
    if PERIODS not in names:
        return found
    placed, first = found.hypothesis[-1], len(found.vector) - len(names)
    sine, cosine, at = (first + names.index(name) for name in ("sine", "cosine", PERIODS))
    grid = placed.effect.parameters[names.index(PERIODS)].grid
    while True:
        starts = []
        for n in (found.vector[at] + d for d in (-2, -1, 1, 2)):
            if n in grid:
                # the same torque in the middle of the range: A sin(n q + phase)
                turn = (found.vector[at] - n) * placed.scales.middle
                vector = found.vector.copy()
                vector[sine] = found.vector[sine] * np.cos(turn) - found.vector[cosine] * np.sin(turn)
                vector[cosine] = found.vector[sine] * np.sin(turn) + found.vector[cosine] * np.cos(turn)
                vector[at] = n
                starts.append(vector)
        new = fit(
            problem, found.hypothesis, np.array(starts), scale=found.scale, iterations=settings.iterations, others=others,
        )  # fmt: skip
        if new.log_posterior <= found.log_posterior + settings.rise:
            return found
        found = new


PERIODS = "periods_per_turn"
"""Whole number among the parameters of a periodic effect."""


def sound(problem: ArticulatedProblem, found: ArticulatedFit) -> bool:
    """Whether a fit is finite and no parameter of its effects sits at a bound."""
    settings = problem.settings.articulated
    if not (np.isfinite(found.log_posterior) and np.isfinite(found.vector).all()):
        return False
    at = len(problem.nominal)
    for placed in found.hypothesis:
        for p in placed.effect.parameters:
            low, high = p.bounds
            inside = low + settings.at_bound < found.vector[at] < high - settings.at_bound
            if not (inside or p.fixed or p.name in BOUNDED):
                return False
            at += 1
    return True


BOUNDED = ("motor_share", "position")
"""Parameters whose bounds are physical: a share is at most one, a stop lies where the joint goes."""


def _scale_of(problem: ArticulatedProblem, found: ArticulatedFit) -> Array:
    """Scale (n_joints,) of the residuals of a fit's model in a problem, at least one."""
    joints = range(len(problem.joints))
    left = in_threads(
        lambda j: float(np.sum(problem.residual(j, found.hypothesis, found.vector) ** 2)), joints
    )
    return np.sqrt(np.maximum(np.array(left) / problem.count, 1.0))


def _fits(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    points: Sequence[Sequence[Screened]],
    settings: SearchSettings,
) -> list[ArticulatedFit]:
    """Fits of the most promising effects on top of a fit, on the joints that they change."""
    others = Others.of(problem, base)
    out: list[ArticulatedFit] = []
    gained, swapped = 0.0, 0
    strained = _strained(problem, base, settings)
    for k, mine in enumerate(points):
        if out and not problem.deadline.allows("fits of effects that promise less"):
            break
        hopeful = k < settings.fitted and mine[0].gain >= settings.hope * gained
        if not (k < settings.least or hopeful):
            # where a number of the model was moved too far, numbers that may be wrong instead are tried, whatever they promise
            instead = mine[0].placed.effect.number and mine[0].placed.joint in strained
            if not instead or swapped == settings.fitted:
                continue
            swapped += 1
        hypothesis: JointHypothesis = (*base.hypothesis, mine[0].placed)
        # nominal parameters that stood in for what was missing are also tried where they were stated, and fitted from there:
        # a start of less misfit need not be the nearer one
        untouched = np.concatenate([np.zeros(len(problem.nominal)), base.vector[len(problem.nominal) :]])
        starts = [
            np.array([np.concatenate([point.start, point.eta]) for point in mine]),
            np.array([np.concatenate([at, point.eta]) for point in mine for at in (base.vector, untouched)]),
        ]
        new = max(
            (
                fit(
                    problem,
                    hypothesis,
                    start,
                    scale=base.scale,
                    iterations=settings.iterations,
                    others=others,
                )
                for start in (starts if strained else [np.vstack(starts)])
            ),
            key=lambda f: f.log_posterior,
        )
        new = refitted(problem, hypothesis, new.vector, scale=new.scale, others=others)
        new = _beside(problem, new, others, settings)
        out.append(new)
        gained = max(gained, 2.0 * (new.log_posterior - base.log_posterior))
    return out
