"""An articulated model's records explained: by runs of its joints, or by their torque where runs tell nothing.

Runs of a model that is nearly right tell most. One without the friction of its gears runs away within half a second, and of a slow or badly
timed log the timing errors are larger than what friction makes of a run. There the torque along the measured motion is asked
(`bench.discrepancy.articulated_judgement.torque_error`), first or after runs have named nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bench.discrepancy.articulated.naming import left_of, verdict_of
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_judgement.judgement import (
    EffectKeys,
    PredictedErrors,
    alike,
    better,
    kept,
    keys_of,
    ladder,
    noise_floor,
    predict,
    simplest,
    without_each,
)
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem, along_motion
from bench.discrepancy.articulated_judgement.whiteness import Astray, Coloured, astray, coloured
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import (
    complete,
    exchanged,
    predecessors,
    search,
    shortened,
    steps,
)
from bench.discrepancy.multibody.nominal_parameters import twins
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings
from bench.discrepancy.verdict import Verdict


@dataclass(frozen=True, eq=False)
class Explained:
    """What the records say.

    Attributes:
        problem: Records for identification, as they were asked.
        judging: Records for judging, for free runs.
        fits: All fitted hypotheses, the likeliest first.
        final: The one behind the verdict.
        predictions: Of the ladder that leads to it.
        verdict: The verdict, without what is said of the case.
        alike: Explanations that predict the judging records as well.
    """

    problem: ArticulatedProblem
    judging: ArticulatedProblem
    fits: list[ArticulatedFit]
    final: ArticulatedFit
    predictions: Sequence[PredictedErrors]
    verdict: Verdict
    alike: Collection[EffectKeys]


@dataclass(frozen=True, eq=False)
class Question:
    """What records are explained with.

    Attributes:
        judging: Records for judging, for free runs.
        settings: Of the search.
        rng: For the bootstrap intervals.
        stated: Whether the noise of the responses is stated.
        progress: Called with a line of text at every stage.
    """

    judging: ArticulatedProblem
    settings: SearchSettings
    rng: np.random.Generator
    stated: bool
    progress: Callable[[str], None]


def explained(
    problem: ArticulatedProblem, candidates: Sequence[PlacedOnJoint], question: Question
) -> Explained:
    """Explain records by runs, by the torque where the model as stated runs away, and where runs have named nothing.

    Args:
        problem: Records for identification.
        candidates: Effects at places.
        question: What they are explained with.
    """
    away = _run_away(problem)
    found = None if away else _explained(problem, candidates, question)
    if found is not None and not _asks_torque(found):
        return found
    question.progress("the torque along the measured motion")
    by_torque = _explained(TorqueProblem.like(problem), along_motion(candidates), question)
    if found is not None and by_torque.verdict.verdict != "effect":
        return found
    told = _with_free_runs(by_torque)
    return replace(by_torque, verdict=replace(told, warnings=(*told.warnings, _words(away))))


def _explained(
    problem: ArticulatedProblem, candidates: Sequence[PlacedOnJoint], question: Question
) -> Explained:
    """Explain by runs, or by the torque of a `TorqueProblem`, whose explanations are never complete."""
    judged, rng = problem.settings.articulated.judgement, question.rng
    judges = dict[float, ArticulatedProblem]()

    def judge(of: ArticulatedProblem) -> ArticulatedProblem:
        if of.softness not in judges:
            judges[of.softness] = asked_as(of, question.judging.softened(of.softness))
        return judges[of.softness]

    def misled(of: ArticulatedProblem, before: ArticulatedFit, after: ArticulatedFit) -> bool:
        floor = np.zeros(len(of.joints))  # noise takes the same off both
        then, now = (predict(judge(of), fit, floor, judged) for fit in (before, after))
        return better(now, then, judged)

    problem, fits, given_up = search(
        problem, candidates, settings=question.settings, misled=misled, progress=question.progress
    )
    judging, judged_by = question.judging.softened(problem.softness), judge(problem)
    question.progress("judging records")
    climbed = kept(problem, judged_by, fits, judged)
    for earlier in given_up:  # of what was likelier later, the judging records may bear out less
        if not problem.deadline.allows("whether what the search gave up predicts better"):
            break
        other = kept(problem, judged_by, [earlier, *fits], judged)
        if better(climbed.predictions[climbed.last], other.predictions[other.last], judged):
            climbed = other
    fits, floor = [*fits, *climbed.fits], climbed.predictions[0].floor
    rungs = climbed.rungs[: climbed.last + 1]
    predictions, near = climbed.predictions[: len(rungs)], set[EffectKeys]()
    known = dict(zip(rungs, predictions, strict=True))

    def predicted(found: ArticulatedFit) -> PredictedErrors:
        if found not in known:
            known[found] = predict(judged_by, found, floor, judged)
        return known[found]

    left = _left(problem, judged_by, rungs[-1], predictions[-1], stated=question.stated)
    if not left.whole:
        fits += _with_dry_friction(problem, candidates, rungs[-1])
        near = alike(judged_by, fits, rungs[-1], predictions[-1], judged)
        plain = without_the_idle(problem, fits, simplest(fits, rungs[-1], near), predicted)
        if plain is not rungs[-1]:
            fits += predecessors(problem, plain, fits)
            fits += _rivals_beside(problem, fits, rungs[-1], plain)
            rungs = ladder(problem, [plain, *fits])
            predictions = [predicted(rung) for rung in rungs]
            left = _left(problem, judged_by, plain, predictions[-1], stated=question.stated)
            near = alike(judged_by, fits, plain, predictions[-1], judged)
    fits += _without_a_twin(problem, fits, rungs[-1])
    verdict = verdict_of(
        problem, fits, rungs, predict(judged_by, None, floor, judged), predictions,
        [None if rest is None else predicted(rest) for rest in without_each(fits, rungs[-1])], judged, rng,
        whole=left.whole, left=left_of(problem, rungs[-1], left.coloured, left.astray), alike=near,
    )  # fmt: skip
    return Explained(problem, judging, fits, rungs[-1], predictions, verdict, near)


def without_the_idle(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    predicted: Callable[[ArticulatedFit], PredictedErrors],
) -> ArticulatedFit:
    """An explanation without effects that another one has made idle: fitted without one, the judging records are left no larger.

    Only what was fitted anyway is asked, and no effect at parts of one type, which the others of its kind bear out.

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
        asked = [rest for p, rest in rests if rest is not None and not twins(problem.nominal, p.joint)]
        best = min(asked, key=left, default=None)
        if best is None or left(best) > left(final):
            return final
        final = best
    return final


def _without_a_twin(
    problem: ArticulatedProblem, fits: Sequence[ArticulatedFit], final: ArticulatedFit
) -> list[ArticulatedFit]:
    """An explanation without each effect at a part of a type, where none was made, while there is time.

    The first effect at such a part sets right the numbers that all parts have in common, and its step takes off what others miss besides:
    what each of them closes is told by what comes back without it alone.
    """
    out = []
    for placed in final.hypothesis if len(final.hypothesis) > 1 else ():
        rest = keys_of(final) - {placed.key}
        if not twins(problem.nominal, placed.joint) or any(keys_of(f) == rest for f in fits):
            continue
        if not problem.deadline.allows("what comes back without each effect"):
            break
        out.append(shortened(problem, final, (placed,)))
    return out


def _with_dry_friction(
    problem: ArticulatedProblem, candidates: Sequence[PlacedOnJoint], final: ArticulatedFit
) -> list[ArticulatedFit]:
    """An explanation with dry friction in the place of each law of several parameters at a joint that has none, while there is time.

    It is what joints have most, and what a law with more to fit imitates first; the search may never have held the two side by side.
    """
    dry = {p.joint: p for p in candidates if p.effect.name == "coulomb_friction"}
    taken = {placed.joint for placed in final.hypothesis if placed.effect.name == "coulomb_friction"}
    out, ends = [], [0, *steps(problem, final.hypothesis)]
    for start, end in pairwise(ends):
        laws = [p for p in final.hypothesis[start:end] if p.effect.site == "joint" and p.effect.free > 1]
        if not laws or not {p.joint for p in laws} <= dry.keys() - taken:
            continue
        if not problem.deadline.allows("dry friction in the place of what is named"):
            break
        out.append(exchanged(problem, final, laws, [dry[p.joint] for p in laws]))
    return out


def _rivals_beside(
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


class _Left(NamedTuple):
    """What an explanation leaves of the judging records, and whether that is noise alone."""

    coloured: Coloured | None
    astray: Astray | None
    whole: bool


def _left(
    problem: ArticulatedProblem,
    judging: ArticulatedProblem,
    final: ArticulatedFit,
    predicted: PredictedErrors,
    *,
    stated: bool,
) -> _Left:
    """What is left of records for judging that are asked as the problem is: by runs, or by the torque, which is never all of it."""
    judged, runs = problem.settings.articulated.judgement, not isinstance(problem, TorqueProblem)
    left = coloured(judging, final, judged) if runs else None
    lost = astray(judging, final, predicted, judged) if runs else None
    # power above the noise at some frequencies shows that what is named is not all; where nothing is named it is no evidence that
    # something is missing, which takes an effect that predicts the judging records better
    noise_alone = lost is None and (left is None or not final.hypothesis) and complete(problem, final, judged)
    return _Left(left, lost, noise_alone and stated and runs)


def _asks_torque(found: Explained) -> bool:
    """Whether runs have named nothing of a robot whose torques were logged, and time is left to ask these."""
    problem = found.problem
    if found.verdict.verdict != "unknown" or not all(joint.torque_driven for joint in problem.joints):
        return False
    return problem.deadline.allows("what the torque along the measured motion tells")


def asked_as(problem: ArticulatedProblem, other: ArticulatedProblem) -> ArticulatedProblem:
    """Other records, asked as those of a problem are."""
    return TorqueProblem.like(other) if isinstance(problem, TorqueProblem) else other


def _run_away(problem: ArticulatedProblem) -> list[str]:
    """Joints whose torque was logged and whose free runs, as the model is stated, end further off than they move."""
    if not any(joint.torque_driven for joint in problem.joints):
        return []
    judged = problem.settings.articulated.judgement
    off = predict(problem, None, np.zeros(len(problem.joints)), judged).discrepancy
    pairs = zip(problem.joints, off, strict=True)
    return [joint.name for joint, error in pairs if joint.torque_driven and error > 1.0]


def _with_free_runs(found: Explained) -> Verdict:
    """The verdict with what free runs miss beside what the torque does."""
    judging = found.judging
    judged = judging.settings.articulated.judgement
    floor = noise_floor(judging, found.final, judged)
    before, after = (predict(judging, fit, floor, judged).discrepancy for fit in (None, found.final))
    told = {
        joint.name: (float(before[j]), float(after[j]), float(floor[j]))
        for j, joint in enumerate(judging.joints)
    }
    gaps = tuple(replace(gap, free_runs=told[gap.dof]) for gap in found.verdict.gaps)
    widest = next(gap for gap in gaps if gap.dof == found.verdict.gap.dof)
    return replace(found.verdict, gaps=gaps, gap=widest)


def _words(away: list[str]) -> str:
    """Why the torque was asked."""
    names = ", ".join(f"'{name}'" for name in away)
    why = (
        f"the model as stated runs further off within half a second than it moves (joint {names})"
        if away
        else "free runs tell of no effect that is missing"
    )
    return (
        f"{why}: what it misses was read off the torque along the measured motion, for whose parameters the smoothed motion was taken to "
        "be right"
    )
