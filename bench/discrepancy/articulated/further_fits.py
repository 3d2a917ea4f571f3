"""Fits that are made beside those of a search before anything is named: without an effect, with a plainer law, with a rival of it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from itertools import pairwise

import numpy as np

from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_judgement.judgement import keys_of, without_each
from bench.discrepancy.articulated_judgement.predicted_errors import PredictedErrors
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import exchanged, shortened, steps, takes_the_place
from bench.discrepancy.multibody.nominal_parameters import twins


def without_the_idle(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    predicted: Callable[[ArticulatedFit], PredictedErrors],
) -> ArticulatedFit:
    """An explanation without effects that another one has made idle: fitted without one, the judging records are left no larger.

    Only what was fitted anyway is asked, and no effect at parts of one type, which the others of its kind bear out, nor a number without
    which a nominal parameter is where it is not believed.

    Args:
        problem: Records for identification.
        fits: All fitted hypotheses.
        final: What would be named.
        predicted: What a fit predicts of the judging records.
    """

    def left(found: ArticulatedFit) -> float:
        return float(np.mean(predicted(found).excess))

    while len(final.hypothesis) > 1:
        rests = zip(final.hypothesis, without_each(fits, final), strict=True)
        asked = [
            rest
            for placed, rest in rests
            if rest is not None
            and not twins(problem.nominal, placed.joint)
            and not takes_the_place(problem, rest, final)
        ]
        best = min(asked, key=left, default=None)
        if best is None or left(best) > left(final):
            return final
        final = best
    return final


def without_some(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    rungs: Sequence[ArticulatedFit],
    predictions: Sequence[PredictedErrors],
) -> list[ArticulatedFit]:
    """An explanation without each effect whose step does not tell what it closes, where none was made, while there is time.

    The first effect at a part of a type sets right the numbers that all parts have in common, and its step takes off what others miss
    besides. A step that left more than there was has moved numbers at other joints, which a later step set right.
    """
    final, out = rungs[-1], list[ArticulatedFit]()
    for k, placed in enumerate(final.hypothesis if len(final.hypothesis) > 1 else ()):
        at = next(i for i, rung in enumerate(rungs) if len(rung.hypothesis) > k)
        told = np.mean(predictions[at].excess) < np.mean(predictions[at - 1].excess)
        rest = keys_of(final) - {placed.key}
        if (told and not twins(problem.nominal, placed.joint)) or any(keys_of(f) == rest for f in fits):
            continue
        if not problem.deadline.allows("what comes back without each effect"):
            break
        out.append(shortened(problem, final, (placed,)))
    return out


def with_dry_friction(
    problem: ArticulatedProblem,
    candidates: Sequence[PlacedOnJoint],
    final: ArticulatedFit,
    among: Collection[tuple[str, str]],
) -> list[ArticulatedFit]:
    """An explanation with dry friction in the place of each law of several parameters at a joint that has none, while there is time.

    It is what joints have most, and what a law with more to fit imitates first; the search may never have held the two side by side.

    Args:
        problem: Records for identification.
        candidates: Effects at places.
        final: What would be named.
        among: Names and places of the effects that are asked about.
    """
    dry = {p.joint: p for p in candidates if p.effect.name == "coulomb_friction"}
    taken = {placed.joint for placed in final.hypothesis if placed.effect.name == "coulomb_friction"}
    out, ends = [], [0, *steps(problem, final.hypothesis)]
    for start, end in pairwise(ends):
        laws = [p for p in final.hypothesis[start:end] if p.effect.site == "joint" and p.effect.free > 1]
        if not {p.key for p in laws} <= set(among):
            continue
        if not laws or not {p.joint for p in laws} <= dry.keys() - taken:
            continue
        if not problem.deadline.allows("dry friction in the place of what is named"):
            break
        out.append(exchanged(problem, final, laws, [dry[p.joint] for p in laws]))
    return out


def faint_frictions(
    hypothesis: JointHypothesis,
    predictions: Sequence[PredictedErrors],
    without: Sequence[PredictedErrors | None],
    small: float,
) -> set[tuple[str, str]]:
    """Names and places of frictions that contain dry friction and close next to nothing.

    Laws of friction are off by a part of themselves on real joints. A friction whose power on the judging records is less than such a
    part of the discrepancy owes its form to what little noise is not as it was stated.

    Args:
        hypothesis: Effects of an explanation.
        predictions: Of the nominal model first, and of the explanation last.
        without: Of the explanation without one effect after the other; None where it was never fitted so.
        small: Part, an amplitude.
    """
    least = float(np.mean(predictions[-1].excess)) + small**2 * float(np.mean(predictions[0].excess))
    return {
        placed.key
        for placed, rest in zip(hypothesis, without, strict=True)
        if "coulomb_friction" in placed.effect.contains
        and rest is not None
        and float(np.mean(rest.excess)) < least
    }


def rivals_beside(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    before: ArticulatedFit,
    plain: ArticulatedFit,
) -> list[ArticulatedFit]:
    """What could not be told from an effect beside the law that was simplified, fitted beside the simpler one, while there is time."""
    out = list[ArticulatedFit]()
    near, own = problem.settings.articulated.judgement.rival, keys_of(before)
    for f in fits:
        lost = [p for p in before.hypothesis if p.key not in keys_of(f)]
        gained = [p for p in f.hypothesis if p.key not in own]
        if not len(lost) == len(gained) == 1 or before.log_posterior - f.log_posterior > near:
            continue
        keys = keys_of(plain) - {lost[0].key} | {gained[0].key}
        if lost[0].key not in keys_of(plain) or any(keys_of(other) == keys for other in (*fits, *out)):
            continue
        if not problem.deadline.allows("rivals beside the simpler law"):
            break
        out.append(exchanged(problem, plain, lost, gained))
    return out
