"""One round of the search: every effect screened on top of a fit, and the most promising fitted, first where runs forget.

A run that nothing corrects remembers every error of a wrong model to its end; corrected a little at every sample, it forgets. Effects
are found there, and the best of them fitted again as the stated noise has it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.containing import begun_again
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, Others, fit, own_entries, refitted
from bench.discrepancy.articulated_search.periods import beside
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.screening import Screened, by_effect, screen
from bench.discrepancy.articulated_search.soundness import sound
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


class Corrected(NamedTuple):
    """Where runs forget, and the likeliest fit there."""

    problem: ArticulatedProblem
    best: ArticulatedFit


Grounds = list[tuple[ArticulatedProblem, ArticulatedFit]]
"""Problems where runs forget, and a fit in each."""


class Round(NamedTuple):
    """One effect more: the best, all that were fitted as they are, and what was found where runs forget."""

    best: ArticulatedFit | None
    fits: list[ArticulatedFit]
    corrected: Corrected | None


def grounds_of(problem: ArticulatedProblem, base: ArticulatedFit, settings: SearchSettings) -> Grounds:
    """Where runs forget, and a fit there, level by level; where servos hold every joint, nothing forgets more than it does anyway."""
    out, ground = [], base
    for level in settings.softening:
        soft = problem.softened(level)
        if out and soft is problem:
            break
        ground = refitted(soft, base.hypothesis, ground.vector, scale=scale_of(soft, ground))
        out.append((soft, ground))
    return out


def best_of(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    grounds: Grounds,
    candidates: Sequence[PlacedOnJoint],
    settings: SearchSettings,
    progress: Callable[[str], None],
    gained: float = 0.0,
    least: float = -np.inf,
) -> Round:
    """One effect more: screened and fitted where runs forget (`grounds_of`), the best of them fitted again as they are.

    Args:
        problem: Records and priors.
        base: What it is added to.
        grounds: Of the base.
        candidates: Effects.
        settings: Of the search.
        progress: Called with a line of text at every stage.
        gained: Twice the log posterior that others have gained already, to which what an effect promises is compared.
        least: Log posterior short of which a fit is not gone on with (`refitted`).
    """
    first: list[ArticulatedFit] = []
    corrected = None
    for soft, ground in grounds:
        if first:
            if problem.deadline.over:
                break
            others = Others.of(soft, ground)
            nearby = _plays(soft, ground, first, settings)
            first = in_threads(
                lambda f, soft=soft, ground=ground, others=others, nearby=nearby: _again(
                    soft, ground, others, f, nearby.get(f.hypothesis[-1].key, ())
                ),
                first,
            )
            corrected = Corrected(soft, max(first, key=lambda f: f.log_posterior))
            continue
        progress("screening")
        points = screen(soft, ground, candidates)
        if strained(
            soft, ground, settings.strained
        ):  # what stands in for the missing hides it; also from what was stated
            points += screen(soft, _untouched(soft, ground), candidates)
        # where runs forget, other log posteriors hold
        short_of = least if soft is problem else -np.inf
        told = by_effect(points, settings.starts, settings.plays if soft is problem else 0)
        first = _fits(soft, ground, told, settings, progress, gained, short_of)
    first = [f for f in first if sound(problem, f)] or first
    finalists = sorted(first, key=lambda f: -f.log_posterior)[: settings.finalists]
    if grounds[-1][0] is not problem:
        others = Others.of(problem, base)
        finalists = in_threads(lambda f: _again(problem, base, others, f, least=least), finalists)
    fits = in_threads(lambda f: _where_settled(problem, f), [f for f in finalists if sound(problem, f)])
    if not fits:
        return Round(None, fits, corrected)
    return Round(_simplest(problem, fits), fits, corrected)


def freed(problem: ArticulatedProblem, told: Round, least: float = -np.inf) -> Round:
    """A round whose best is fitted once more, all joints free and about the postures that it has.

    Args:
        problem: Records and priors.
        told: The round.
        least: Log posterior short of which it is fitted once (`refitted`).
    """
    if told.best is None:
        return told
    best = told.best
    settled = problem.settled(best.hypothesis, best.vector)
    whole = refitted(settled, best.hypothesis, best.vector, scale=best.scale, least=least)
    return told._replace(best=whole, fits=[*(f for f in told.fits if f is not best), whole])


def _simplest(problem: ArticulatedProblem, fits: Sequence[ArticulatedFit]) -> ArticulatedFit:
    """The likeliest fit; of several that are too wrong to be told apart the one whose last effect has the fewest parameters.

    Where a law is not the right one, a more general one fits a little better whatever is right.
    """
    judged = problem.settings.articulated.judgement
    best = max(fits, key=lambda f: f.log_posterior)
    if quiet(best, judged)[list(problem.reached(best.hypothesis[-1:]))].all():
        return best
    alike = [f for f in fits if f.log_posterior > best.log_posterior - judged.rival]
    return min(alike, key=lambda f: (f.hypothesis[-1].effect.free, -f.log_posterior))


def quiet(found: ArticulatedFit, settings: JudgementSettings) -> NDArray[np.bool_]:
    """Whether each joint (n_joints,) keeps no more than the noise."""
    # the mean square of n residuals is known to sqrt(2 / n)
    noise = (1.0 + settings.noise_known) ** 2 + settings.sure * np.sqrt(2.0 / found.octaves.count.sum(axis=1))
    return np.asarray(found.reduced <= noise)


def parted(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    corrected: Corrected,
    settings: SearchSettings,
) -> bool:
    """Whether a play explains the records where runs are corrected at every sample, and nothing does where they go by themselves.

    Every impact multiplies what was wrong before it: after some of them no run that hardly listens to the encoder is where the joint is,
    be the play the right one. What the two leave is compared by the likelihood of the logs, in which the softer run pays for what it hears.
    """
    if problem.softness or not any(placed.effect.play for placed in corrected.best.hypothesis):
        return False
    heard = corrected.problem.log_likelihood(corrected.best.chi2)
    told = (problem.log_likelihood(f.chi2) for f in fits)
    return heard > max(told, default=-np.inf) + settings.worth


def strained(problem: ArticulatedProblem, base: ArticulatedFit, beyond: float) -> set[int]:
    """Joints one of whose nominal parameters a fit has moved beyond some of its stated standard uncertainties."""
    out: set[int] = set()
    for k in np.flatnonzero(np.abs(base.vector[: len(problem.nominal)]) > beyond):
        out |= _at(problem, int(k))
    return out


def _at(problem: ArticulatedProblem, k: int) -> set[int]:
    """Joints of a nominal parameter: the one that carries its body, or those that it is about."""
    entry, carriers = problem.nominal[k], {joint.body: j for j, joint in enumerate(problem.joints)}
    return {carriers[entry.target]} if entry.target in carriers else set(entry.joints)


def _far_out(problem: ArticulatedProblem, base: ArticulatedFit, joint: int) -> float:
    """Squared deviations, in stated standard uncertainties, of the nominal parameters of a joint, summed."""
    mine = [k for k in range(len(problem.nominal)) if joint in _at(problem, k)]
    return float(np.sum(base.vector[mine] ** 2))


def _untouched(problem: ArticulatedProblem, base: ArticulatedFit) -> ArticulatedFit:
    """A fit with the nominal parameters as stated."""
    vector = base.vector.copy()
    vector[: len(problem.nominal)] = 0.0
    return ArticulatedFit.at(problem, base.hypothesis, vector)


def _where_settled(problem: ArticulatedProblem, found: ArticulatedFit) -> ArticulatedFit:
    """A fit once more about the postures that it has, see `ArticulatedProblem.settled`: they are part of the explanation."""
    settled = problem.settled(found.hypothesis, found.vector)
    return (
        found if settled is problem else refitted(settled, found.hypothesis, found.vector, scale=found.scale)
    )


def _plays(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    fits: Sequence[ArticulatedFit],
    settings: SearchSettings,
) -> dict[tuple[str, str], list[Array]]:
    """Starts of the plays among the last effects of some fits, as screened in this problem on top of a fit."""
    placed = [f.hypothesis[-1] for f in fits if f.hypothesis[-1].effect.play]
    found = by_effect(screen(problem, base, placed), settings.starts) if placed else []
    return {
        mine[0].placed.key: [np.concatenate([base.vector, point.eta]) for point in mine] for mine in found
    }


def _again(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    others: Others,
    found: ArticulatedFit,
    starts: Sequence[Array] = (),
    least: float = -np.inf,
) -> ArticulatedFit:
    """A fit once more in another problem, on the joints that its last effect changes; the other joints as a fit there has them.

    Further starts are tried besides where it was: of a play the softest runs tell little, and those that listen less have a minimum of
    their own at every clearance.
    """
    active = problem.reached(found.hypothesis[len(base.hypothesis) :])
    vector = found.vector.copy()
    for j in (j for j in range(len(problem.joints)) if j not in active):
        own = own_entries(problem, base.hypothesis, j)
        vector[own] = base.vector[own]
    scale = scale_of(problem, replace(found, vector=vector))
    return refitted(
        problem, found.hypothesis, np.vstack([vector, *starts]), scale=scale, others=others, least=least
    )


def scale_of(problem: ArticulatedProblem, found: ArticulatedFit) -> Array:
    """Scale (n_joints, n_octaves) of the residuals of a fit's model in a problem, at least one."""
    left = in_threads(
        lambda j: problem.octaves.power(j, problem.residual(j, found.hypothesis, found.vector)),
        range(len(problem.joints)),
    )
    return problem.octaves.scale(np.array(left))


def _begins(promised: Array, base: Array, untouched: Array, *, apart: bool) -> list[tuple[Array, ...]]:
    """Vectors of which the one of least misfit is gone on from, those that the screening promised on their own where they are `apart`."""
    return [(promised,), (base, untouched)] if apart else [(promised, base, untouched)]


def _fits(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    points: Sequence[Sequence[Screened]],
    settings: SearchSettings,
    progress: Callable[[str], None],
    gained: float,
    least: float,
) -> list[ArticulatedFit]:
    """Fits of the most promising effects on top of a fit, on the joints that they change."""
    others = Others.of(problem, base)
    out: list[ArticulatedFit] = []
    swapped = 0
    moved = strained(problem, base, settings.strained)
    for k, mine in enumerate(points):
        if out and not problem.deadline.allows("fits of effects that promise less"):
            break
        placed, promised = mine[0].placed, mine[0].gain
        hopeful = k < settings.fitted and promised >= settings.hope * gained
        if not (hopeful or k < settings.least):
            # where a number of the model was moved too far, numbers that may be wrong instead are tried: what one of them gains beyond
            # its promise is that the other comes back
            promised += _far_out(problem, base, placed.joint)
            instead = placed.effect.number and placed.joint in moved and promised >= settings.hope * gained
            if not instead or swapped == settings.fitted:
                continue
            swapped += 1
        progress(f"{placed.effect.name} ({placed.where})")
        hypothesis: JointHypothesis = (*base.hypothesis, placed)
        # nominal parameters that stood in for what was missing are also tried where they were stated, and fitted from there:
        # a start of less misfit need not be the nearer one
        untouched = np.concatenate([np.zeros(len(problem.nominal)), base.vector[len(problem.nominal) :]])
        # and every grid point may lie beside a minimum of its own: some steps from each tell which leads lower
        starts = [
            np.array([np.concatenate([at, point.eta]) for at in begins])
            for point in mine
            for begins in _begins(point.start, base.vector, untouched, apart=bool(moved))
        ]
        steps = settings.iterations if len(starts) == 1 else settings.tried

        def begun(start: Array, hypothesis=hypothesis, steps=steps) -> ArticulatedFit:
            return fit(problem, hypothesis, start, scale=base.scale, iterations=steps, others=others)

        def ended(start: Array, hypothesis=hypothesis, least=least) -> ArticulatedFit:
            return refitted(problem, hypothesis, start, scale=base.scale, others=others, least=least)

        # of a play whose runs never forget, the first steps from a clearance tell nothing of where it leads
        tried = in_threads(ended if len(mine) > settings.starts else begun, starts)
        first = max(tried, key=lambda f: f.log_posterior)
        new = refitted(problem, hypothesis, first.vector, scale=first.scale, others=others, least=least)
        # fitted once is held against fitted once: refits gain most where what is missing is large
        least = max(least, first.log_posterior - settings.sight)
        new = beside(problem, new, others, settings)
        out.append(new)
        gained = max(gained, 2.0 * (new.log_posterior - base.log_posterior))
    return begun_again(
        problem, out, lambda f, start: refitted(problem, f.hypothesis, start, scale=f.scale, others=others)
    )
