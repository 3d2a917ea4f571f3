"""An articulated model's records explained: by runs of its joints, or by their torque where runs tell nothing.

Runs of a model that is nearly right tell most. One without the friction of its gears runs away within half a second, and of a slow or badly
timed log the timing errors are larger than what friction makes of a run. There the torque along the measured motion is asked
(`bench.discrepancy.articulated_judgement.torque_error`), first or after runs have named nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bench.discrepancy.articulated.further_fits import (
    faint_frictions,
    rivals_beside,
    with_dry_friction,
    without_some,
    without_the_idle,
)
from bench.discrepancy.articulated.naming import verdict_of
from bench.discrepancy.articulated.words import left_of
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_judgement.judgement import (
    EffectKeys,
    Judge,
    Kept,
    alike,
    kept,
    keys_of,
    ladder,
    simplest,
    without_each,
)
from bench.discrepancy.articulated_judgement.predicted_errors import PredictedErrors, better, predict
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem, along_motion
from bench.discrepancy.articulated_judgement.whiteness import Astray, Coloured, astray, coloured
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import (
    complete,
    predecessors,
    search,
    taken_out,
    takes_the_place,
)
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
    judges, soft = dict[ArticulatedProblem, Judge](), dict[float, ArticulatedProblem]()

    def judge_of(of: ArticulatedProblem) -> Judge:
        if of.softness not in soft:
            soft[of.softness] = asked_as(of, question.judging.softened(of.softness))
        if of not in judges:
            judges[of] = Judge(of, soft[of.softness])
        return judges[of]

    def misled(of: ArticulatedProblem, before: ArticulatedFit, after: ArticulatedFit) -> bool:
        floor = np.zeros(len(of.joints))  # noise takes the same off both
        then, now = (judge_of(of).predict(fit, floor) for fit in (before, after))
        return better(now, then, judged)

    problem, fits, given_up = search(
        problem, candidates, settings=question.settings, misled=misled, progress=question.progress
    )
    judging, judge = question.judging.softened(problem.softness), judge_of(problem)
    question.progress("judging records")
    climbed = kept(judge, fits)
    for earlier in given_up:  # of what was likelier later, the judging records may bear out less
        if not problem.deadline.allows("whether what the search gave up predicts better"):
            break
        other = kept(judge, [earlier, *fits])
        if better(climbed.predictions[climbed.last], other.predictions[other.last], judged):
            climbed = other
    standing = _Standing(judge, [*fits, *climbed.fits], climbed, stated=question.stated)
    standing.settle(candidates)
    left = standing.left
    verdict = verdict_of(
        problem, standing.fits, standing.rungs, judge.predict(None, standing.floor), standing.predictions,
        standing.without(), judged, rng,
        whole=left.whole, noise_alone=left.noise_alone,
        left=left_of(problem, standing.final, left.coloured, left.astray), alike=standing.near,
    )  # fmt: skip
    return Explained(
        problem, judging, standing.fits, standing.final, standing.predictions, verdict, standing.near
    )


class _Standing:
    """The explanation that stands while what is named is settled: the last rung of a ladder, with what it predicts and what it leaves.

    Args:
        judge: Records that chose nothing.
        fits: All fitted hypotheses, the likeliest first.
        climbed: What the judging records bear out.
        stated: Whether all noise is stated.
    """

    def __init__(
        self,
        judge: Judge,
        fits: list[ArticulatedFit],
        climbed: Kept,
        *,
        stated: bool,
    ) -> None:
        self.judge, self.problem, self.fits, self.stated = judge, judge.problem, fits, stated
        self.floor = climbed.predictions[0].floor
        self.rungs = climbed.rungs[: climbed.last + 1]
        self.predictions = climbed.predictions[: len(self.rungs)]
        self.near = set[EffectKeys]()
        self._known = dict(zip(self.rungs, self.predictions, strict=True))
        self.left = self._left()

    @property
    def final(self) -> ArticulatedFit:
        """The explanation."""
        return self.rungs[-1]

    def predicted(self, found: ArticulatedFit) -> PredictedErrors:
        """What a fit predicts of the judging records."""
        if found not in self._known:
            self._known[found] = self.judge.predict(found, self.floor)
        return self._known[found]

    def without(self) -> list[PredictedErrors | None]:
        """What the explanation predicts without one effect after the other: fitted without it, None where it never was.

        A number in the place of a nominal parameter that is not believed is taken out with that as it was stated: fitted without the
        number, the parameter would take its place.
        """
        final, out = self.final, list[PredictedErrors | None]()
        for k, (placed, fitted) in enumerate(
            zip(final.hypothesis, without_each(self.fits, final), strict=True)
        ):
            before = fitted or next(rung for rung in reversed(self.rungs) if len(rung.hypothesis) <= k)
            in_its_place = placed.effect.number and takes_the_place(self.problem, before, final)
            rest = taken_out(self.problem, final, (placed,)) if in_its_place else fitted
            out.append(None if rest is None else self.predicted(rest))
        return out

    def settle(self, candidates: Sequence[PlacedOnJoint]) -> None:
        """Go over to the plainest of what predicts as well where something is left, and drop what closes nothing beside the others."""
        problem, open_end = self.problem, not self.left.whole
        if open_end:
            self.fits += with_dry_friction(problem, candidates, self.final, keys_of(self.final))
            plain = simplest(self.fits, self.final, self._alike())
            plain = without_the_idle(problem, self.fits, plain, self.predicted)
            if plain is not self.final:
                self.fits += rivals_beside(problem, self.fits, self.final, plain)
            self._go_over_to(plain)
        self.fits += without_some(problem, self.fits, self.rungs, self.predictions)
        if open_end:
            self._go_over_to(without_the_idle(problem, self.fits, self.final, self.predicted))
            self.near = self._alike()
        else:
            small = problem.settings.articulated.judgement.small
            faint = faint_frictions(self.final.hypothesis, self.predictions, self.without(), small)
            plain = with_dry_friction(problem, candidates, self.final, faint)
            self.fits += plain
            self.near = {keys_of(f) for f in plain}

    def _go_over_to(self, final: ArticulatedFit) -> None:
        if final is self.final:
            return
        self.fits += predecessors(self.problem, final, self.fits)
        self.rungs = ladder(self.problem, [final, *self.fits])
        self.predictions = [self.predicted(rung) for rung in self.rungs]
        self.left = self._left()

    def _alike(self) -> set[EffectKeys]:
        return alike(self.judge, self.fits, self.final, self.predictions[-1])

    def _left(self) -> _Left:
        return _left(self.judge, self.final, self.predictions[-1], stated=self.stated)


class _Left(NamedTuple):
    """What an explanation leaves of the judging records, whether that looks like noise alone, and is no more than was stated."""

    coloured: Coloured | None
    astray: Astray | None
    noise_alone: bool
    whole: bool


def _left(judge: Judge, final: ArticulatedFit, predicted: PredictedErrors, *, stated: bool) -> _Left:
    """What is left of records for judging that are asked as the problem is: by runs, or by the torque, which is never all of it."""
    problem, judged = judge.problem, judge.settings
    runs, believed = not isinstance(problem, TorqueProblem), judge.believed(final)
    left = coloured(judge.judging, believed, judged) if runs else None
    lost = astray(judge.judging, believed, predicted, judged) if runs else None
    # power above the noise at some frequencies shows that what is named is not all; where nothing is named it is no evidence that
    # something is missing, which takes an effect that predicts the judging records better
    quiet = lost is None and (left is None or not final.hypothesis) and complete(problem, final, judged)
    noise_alone = runs and quiet
    return _Left(left, lost, noise_alone, noise_alone and stated)


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
    judge = Judge(found.problem, judging)
    floor = judge.noise_floor(found.final)
    before, after = (judge.predict(fit, floor).discrepancy for fit in (None, found.final))
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
