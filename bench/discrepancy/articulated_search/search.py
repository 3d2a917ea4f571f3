"""Search for what is missing from an articulated model: effects at all places are screened, the most promising fitted, one by one.

A screened effect is one run (or a few, over a grid) of the joints that it changes. The change that it makes, less what the nominal
parameters could do as well, is regressed on the residuals: what that takes away is what the effect promises.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bench.discrepancy.articulated_search.fitting import ArticulatedFit, fit, free_entries, refitted
from bench.discrepancy.articulated_search.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.rounds import parted, round_of, sound
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


def complete(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> bool:
    """Whether no joint keeps more than the noise, and no nominal parameter is strained for it."""
    # the mean square of n residuals is known to sqrt(2 / n)
    noise = (1.0 + settings.noise_known) ** 2 + settings.sure * np.sqrt(2.0 / found.count)
    far = np.abs(found.vector[: len(problem.nominal)]) > settings.strained
    return bool(np.all(found.reduced <= noise) and not far.any())


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
) -> tuple[ArticulatedProblem, list[ArticulatedFit]]:
    """All fitted hypotheses: the one that nothing is worth adding to or taking from, then the likeliest first.

    Returns:
        The problem in which they are fitted, softened where runs that nothing corrects lose a play (`parted`), and the fits.
    """
    settings, judged = settings or problem.settings.articulated.search, problem.settings.articulated.judgement
    progress("nominal model")
    asked, current = problem, nominal_fit(problem)
    found, dropped = [current], set[tuple[str, str]]()
    for count in range(1, 2 * settings.most + 1):
        if not problem.deadline.allows(f"a search for effect {count}"):
            break
        taken = {placed.key for placed in current.hypothesis} | dropped
        rest = [c for c in candidates if c.key not in taken]
        best, fits, corrected = round_of(
            problem, current, rest, settings, lambda text, n=count: progress(f"effect {n}: {text}")
        )
        if corrected is not None and parted(problem, fits, corrected, settings):
            return search(corrected.problem, candidates, settings=settings, progress=progress)
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
    return asked, sorted(found, key=lambda f: (f is not current, -f.log_posterior))


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
