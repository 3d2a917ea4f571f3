"""Search for what is missing from an articulated model: effects at all places are screened, the most promising fitted, one by one.

A screened effect is one run (or a few, over a grid) of the joints that it changes. The change that it makes, less what the nominal
parameters could do as well, is regressed on the residuals: what that takes away is what the effect promises.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, fit, free_entries, refitted
from bench.discrepancy.articulated_search.joint_rounds import round_of
from bench.discrepancy.articulated_search.orders import roughly
from bench.discrepancy.articulated_search.placements import apart
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.rounds import (
    best_of,
    freed,
    grounds_of,
    parted,
    quiet,
    strained,
)
from bench.discrepancy.articulated_search.screening import by_effect, screen
from bench.discrepancy.articulated_search.soundness import sound
from bench.discrepancy.multibody.nominal_parameters import twins
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


def complete(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> bool:
    """Whether no joint keeps more than the noise, and no nominal parameter is strained for it."""
    far = np.abs(found.vector[: len(problem.nominal)]) > settings.strained
    return bool(quiet(found, settings).all() and not far.any())


_NOMINAL: WeakKeyDictionary[ArticulatedProblem, ArticulatedFit] = WeakKeyDictionary()
"""Fits of the nominal model, kept for as long as their problem: its steps, its noise and the search all ask for one."""


def nominal_fit(problem: ArticulatedProblem) -> ArticulatedFit:
    """The nominal model alone, with the scales of the joints that it leaves."""
    if problem not in _NOMINAL:
        vector = roughly(problem)
        scale = ArticulatedFit.at(problem, (), vector).scale
        _NOMINAL[problem] = refitted(problem, (), vector, scale=scale)
    return _NOMINAL[problem]


def believable(problem: ArticulatedProblem, found: ArticulatedFit) -> ArticulatedFit:
    """A fit whose nominal parameters go no further out than is believed, the others fitted beside them; itself where they do not.

    What a fit moves together, a mass and what holds it up, is not held back one by one: that is worse than what was stated.
    """
    most, n = problem.settings.articulated.judgement.strained, len(problem.nominal)
    if not np.any(np.abs(found.vector[:n]) > most):
        return found
    vector = found.vector.copy()
    vector[:n] = np.clip(vector[:n], -most, most)
    near = replace(problem, reach=most)
    return refitted(
        near, found.hypothesis, vector, scale=ArticulatedFit.at(near, found.hypothesis, vector).scale
    )


Misled = Callable[[ArticulatedProblem, ArticulatedFit, ArticulatedFit], bool]
"""Takes a problem, a fit and the one before it to whether it is worse at what neither was fitted to."""


class Searched(NamedTuple):
    """What a search found.

    Attributes:
        problem: The one in which all is fitted, softened where runs that nothing corrects lose a play (`parted`).
        fits: All fitted hypotheses, the one that the search ended with first, then the likeliest first.
        given_up: Those that lost effects which what was found later had made superfluous, as they were before.
    """

    problem: ArticulatedProblem
    fits: list[ArticulatedFit]
    given_up: list[ArticulatedFit]


def search(
    problem: ArticulatedProblem,
    candidates: Sequence[PlacedOnJoint],
    *,
    settings: SearchSettings | None = None,
    misled: Misled = lambda problem, before, after: False,
    progress: Callable[[str], None] = lambda text: None,
) -> Searched:
    """All fitted hypotheses: the one that nothing is worth adding to or taking from, then the likeliest first.

    Args:
        problem: Records and priors.
        candidates: Effects at places.
        settings: Of the search.
        misled: Whether a fit predicts other records worse for sure than the one before it: the search ends there, but for its first round.
        progress: Called with a line of text at every stage.
    """
    settings = settings or problem.settings.articulated.search
    progress("nominal model")
    asked, current = problem, nominal_fit(problem)
    found, dropped, given_up = [current], set[tuple[str, str]](), list[ArticulatedFit]()
    for count in range(1, 2 * settings.most + 1):
        if not problem.deadline.allows(f"a search for effects (round {count})"):
            break
        rest = _open(current, candidates, dropped, settings)
        best, fits, corrected = round_of(
            problem, current, rest, settings, lambda text, n=count: progress(f"round {n}: {text}")
        )
        if corrected is not None and parted(problem, fits, corrected, settings):
            return search(corrected.problem, candidates, settings=settings, misled=misled, progress=progress)
        found += fits
        least = current.log_posterior + _needed(problem, current, settings)
        if best is None or best.log_posterior < least or not _material(problem, found[0], current, best):
            eased = _eased(problem, current, rest, settings)
            if eased is None:
                break
            current, found = eased, [*found, eased]
            continue
        problem = problem.settled(best.hypothesis, best.vector)
        before, added = current, len(best.hypothesis) - len(current.hypothesis)
        current, fits = without_idle(problem, best, settings, added=added)
        found += fits
        idle = {placed.key for placed in best.hypothesis} - {placed.key for placed in current.hypothesis}
        given_up += [before] if idle else []
        dropped |= idle
        progress(f"round {count}: " + ", ".join(f"{p.effect.name} ({p.where})" for p in current.hypothesis))
        # one effect of two may predict worse than none, what follows something that helped does not
        if before.hypothesis and misled(problem, before, current):
            eased = _eased(problem, current, _open(current, candidates, dropped, settings), settings)
            if eased is not None and not misled(problem, before, eased):
                current, found = eased, [*found, eased]
                continue
            progress(f"round {count}: makes the judging records worse, no further one")
            break
    for end in (current, *given_up):
        found += predecessors(problem, end, found)
    return Searched(asked, sorted(found, key=lambda f: (f is not current, -f.log_posterior)), given_up)


def _needed(problem: ArticulatedProblem, found: ArticulatedFit, settings: SearchSettings) -> float:
    """Log posterior that a further effect has to add to a fit: to what is complete, the judgement adds nothing but what is certain."""
    judged = problem.settings.articulated.judgement
    return judged.certain if complete(problem, found, judged) else settings.worth


def _material(
    problem: ArticulatedProblem, nominal: ArticulatedFit, before: ArticulatedFit, after: ArticulatedFit
) -> bool:
    """Whether a round takes what counts off what some joint keeps beyond noise, its power or its misfit, or completes the explanation."""
    judged = problem.settings.articulated.judgement
    fits = (nominal, before, after)
    power = (np.maximum(f.reduced - 1.0, 0.0) for f in fits)
    misfit = (f.beyond_noise for f in fits)
    return complete(problem, after, judged) or any(
        bool(np.any(old - new > judged.small * first)) for first, old, new in (power, misfit)
    )


def _eased(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    candidates: Sequence[PlacedOnJoint],
    settings: SearchSettings,
) -> ArticulatedFit | None:
    """A fit with a wrong number named instead of a nominal parameter that no judgement believes, where that is the likelier of the two.

    A fit may move what was stated as far as the records ask; what it predicts is judged with the parameter no further out than is
    believed, beside which nothing else that is right is seen to help.
    """
    far = strained(problem, current, problem.settings.articulated.judgement.strained)
    instead = [c for c in candidates if c.effect.number and far.intersection(c.joints)]
    if not instead or not problem.deadline.allows("wrong numbers in the place of nominal parameters"):
        return None
    grounds = grounds_of(problem, current, settings)
    best = freed(problem, best_of(problem, current, grounds, instead, settings, lambda text: None)).best
    if best is None or best.log_posterior < current.log_posterior + settings.worth:
        return None
    return best if len(best.hypothesis) > len(current.hypothesis) else None


def takes_the_place(problem: ArticulatedProblem, before: ArticulatedFit, after: ArticulatedFit) -> bool:
    """Whether a fit names a number instead of a nominal parameter that no judgement believes, and is likelier by it.

    Args:
        problem: Records and priors.
        before: A fit without that number.
        after: The fit.
    """
    known = {placed.key for placed in before.hypothesis}
    numbers = [p for p in after.hypothesis if p.effect.number and p.key not in known]
    if not numbers:
        return False
    settings = problem.settings.articulated
    beyond = settings.judgement.strained
    eased = strained(problem, before, beyond) - strained(problem, after, beyond)
    likelier = after.log_posterior - before.log_posterior >= settings.search.worth
    return likelier and any(eased.intersection(placed.joints) for placed in numbers)


def _open(
    current: ArticulatedFit,
    candidates: Sequence[PlacedOnJoint],
    dropped: Collection[tuple[str, str]],
    settings: SearchSettings,
) -> list[PlacedOnJoint]:
    """Candidates that a fit may still be given: not taken, not dropped, at joints with fewer effects than are named of one."""
    taken = {placed.key for placed in current.hypothesis} | set(dropped)
    full = Counter(placed.joint for placed in current.hypothesis)
    free = [c for c in candidates if c.key not in taken and full[c.joint] < settings.most]
    return apart(free, current.hypothesis)


def without_idle(
    problem: ArticulatedProblem, found: ArticulatedFit, settings: SearchSettings, *, added: int = 1
) -> tuple[ArticulatedFit, list[ArticulatedFit]]:
    """A fit without the effects that its last ones, `added` of them, have made superfluous, and all fits made for that.

    What was taken first may have stood in for what was found later: it stays if without it the explanation loses what a further effect
    has to add.
    """
    made: list[ArticulatedFit] = []
    for placed in found.hypothesis[:-added]:
        if not problem.deadline.allows("whether the first effects are still needed"):
            break
        shorter, start = _without(problem, found, (placed,))
        scale = found.scale
        within = float(np.sum(found.chi2 / scale**2)) + _surprise(problem, found) + 2.0 * settings.sight
        new = fit(problem, shorter, start, scale=scale, iterations=settings.iterations, limit=within)
        if new.log_posterior > found.log_posterior - settings.sight:
            new = refitted(problem, shorter, new.vector, scale=new.scale)
        made.append(new)
        least = _needed(problem, new, settings)
        if new.log_posterior > found.log_posterior - least and sound(problem, new):
            found = new
    return found, made


def _without(
    problem: ArticulatedProblem, found: ArticulatedFit, dropped: Collection[PlacedOnJoint]
) -> tuple[JointHypothesis, Array]:
    """The hypothesis of a fit without some of its effects, and its vector without their entries."""
    keys = {placed.key for placed in dropped}
    stays = [placed.key not in keys for placed in found.hypothesis]
    etas = problem.etas(found.hypothesis, found.vector)
    left = [eta for eta, stay in zip(etas, stays, strict=True) if stay]
    hypothesis = tuple(placed for placed, stay in zip(found.hypothesis, stays, strict=True) if stay)
    return hypothesis, np.concatenate([found.vector[: len(problem.nominal)], *left])


def shortened(
    problem: ArticulatedProblem, found: ArticulatedFit, dropped: Collection[PlacedOnJoint]
) -> ArticulatedFit:
    """A fit once more without some of its effects."""
    hypothesis, start = _without(problem, found, dropped)
    return refitted(problem, hypothesis, start, scale=ArticulatedFit.at(problem, hypothesis, start).scale)


def taken_out(
    problem: ArticulatedProblem, found: ArticulatedFit, dropped: Collection[PlacedOnJoint]
) -> ArticulatedFit:
    """A fit without some of its effects, all else as it is: not fitted."""
    return ArticulatedFit.at(problem, *_without(problem, found, dropped))


def exchanged(
    problem: ArticulatedProblem,
    found: ArticulatedFit,
    lost: Collection[PlacedOnJoint],
    gained: Sequence[PlacedOnJoint],
) -> ArticulatedFit:
    """A fit once more with some of its effects exchanged for others.

    Those begin as large as a screening on top of what stays says, or as large as is expected of them, whichever fits better: a friction
    that is expected much larger than it is holds a joint that moves, and a fit does not find back from there.
    """
    rest, stays = _without(problem, found, lost)
    hypothesis = (*rest, *gained)
    screened = {
        mine[0].placed.key: mine[0].eta
        for mine in by_effect(screen(problem, ArticulatedFit.at(problem, rest, stays), gained), 1)
    }
    expected = {p.key: np.array([q.mean for q in p.effect.parameters]) for p in gained}
    begins = [
        ArticulatedFit.at(problem, hypothesis, np.concatenate([stays, *(etas[p.key] for p in gained)]))
        for etas in (expected, expected | screened)
    ]
    begin = min(begins, key=lambda f: float(f.misfit.sum()) + _surprise(problem, f))
    return refitted(problem, hypothesis, begin.vector, scale=begin.scale)


def _surprise(problem: ArticulatedProblem, found: ArticulatedFit) -> float:
    """Misfit of the prior at a fit: the sum of squared deviations."""
    mean, std, _, _ = problem.prior(found.hypothesis)
    return float(np.sum(((found.vector - mean) / std)[free_entries(problem, found.hypothesis)] ** 2))


def steps(problem: ArticulatedProblem, hypothesis: JointHypothesis) -> list[int]:
    """How many effects there are after each step of an explanation; effects of one kind at parts of one type are one choice."""
    ends = list[int]()
    for k, placed in enumerate(hypothesis):
        before = hypothesis[k - 1] if k else placed
        of_kind = before.effect.name == placed.effect.name
        if of_kind and before.joint in twins(problem.nominal, placed.joint):
            ends.pop()
        ends.append(k + 1)
    return ends


def predecessors(
    problem: ArticulatedProblem, best: ArticulatedFit, found: Sequence[ArticulatedFit]
) -> list[ArticulatedFit]:
    """Fits with the first steps of a fit alone, where there is none among those found."""
    out = []
    for size in steps(problem, best.hypothesis)[:-1]:
        first = best.hypothesis[:size]
        if all(f.hypothesis != first for f in found):
            vector = best.vector[: problem.size(first)]
            scale = ArticulatedFit.at(problem, first, vector).scale
            out.append(refitted(problem, first, vector, scale=scale))
    return out
