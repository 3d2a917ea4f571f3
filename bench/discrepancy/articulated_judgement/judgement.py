"""What may be said of an articulated model: effects that predict, how much each closes, what is left.

The search proposes; records that it has not seen decide. On them every joint runs free (in windows where no servo holds it), and a further
effect stays if it takes more off the squared error than twice its standard error over blocks. An explanation is complete if no joint
keeps more than the noise, as well as its size is known.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_judgement.predicted_errors import (
    PredictedErrors,
    better,
    noise_floor,
    predict,
)
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import (
    believable,
    complete,
    predecessors,
    shortened,
    steps,
    taken_out,
    takes_the_place,
)
from bench.discrepancy.multibody.nominal_parameters import twins
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings

EffectKeys = frozenset[tuple[str, str]]
"""Names and places of the effects of an explanation."""


def keys_of(found: ArticulatedFit) -> EffectKeys:
    """Names and places of the effects of a fit."""
    return frozenset(placed.key for placed in found.hypothesis)


@dataclass(frozen=True, eq=False)
class Judge:
    """Records that chose nothing, and what fits predict of them, their nominal parameters no further out than is believed.

    Attributes:
        problem: Records for identification, to which a fit is made once more where it went further (`believable`).
        judging: Records for judging.
    """

    problem: ArticulatedProblem
    judging: ArticulatedProblem
    _believed: dict[ArticulatedFit, ArticulatedFit] = field(init=False, default_factory=dict)

    @property
    def settings(self) -> JudgementSettings:
        """Thresholds."""
        return self.problem.settings.articulated.judgement

    def believed(self, found: ArticulatedFit) -> ArticulatedFit:
        """A fit as it is believed, made once."""
        if found not in self._believed:
            self._believed[found] = believable(self.problem, found)
        return self._believed[found]

    def noise_floor(self, found: ArticulatedFit) -> Array:
        """As of `noise_floor`."""
        return noise_floor(self.judging, self.believed(found), self.settings)

    def predict(self, found: ArticulatedFit | None, floor: Array) -> PredictedErrors:
        """As of `predict`."""
        return predict(self.judging, found and self.believed(found), floor, self.settings)


def ladder(problem: ArticulatedProblem, fits: Sequence[ArticulatedFit]) -> list[ArticulatedFit]:
    """The best fit with its predecessors: the nominal model alone, then one step more at a time, see `steps`."""
    best = fits[0]
    out = [best]
    for size in reversed([0, *steps(problem, best.hypothesis)][:-1]):
        shorter = [f for f in fits if f.hypothesis == best.hypothesis[:size]]
        out.insert(0, max(shorter, key=lambda f: f.log_posterior))
    return out


class Kept(NamedTuple):
    """What the judging records bear out of a ladder.

    Attributes:
        rungs: The ladder.
        last: How many of its steps are kept.
        predictions: Of every rung.
        fits: Further fits that were made.
    """

    rungs: list[ArticulatedFit]
    last: int
    predictions: list[PredictedErrors]
    fits: list[ArticulatedFit]


def kept(judge: Judge, fits: Sequence[ArticulatedFit]) -> Kept:
    """What the judging records bear out of the best of some fits.

    Effects are kept up to the last that improves on what was kept before it. One before it that did not improve when it was added is
    kept if the explanation is worse without it; one that another part of the same type shows, unless it is better without it.

    Args:
        judge: Records that chose nothing.
        fits: All fitted hypotheses, the best first.
    """
    problem, settings = judge.problem, judge.settings
    found, rungs = list(fits), ladder(problem, fits)
    floor = judge.noise_floor(rungs[-1])
    while True:
        predictions = [judge.predict(rung, floor) for rung in rungs]
        last, doubtful = _climbed(judge, rungs, predictions)
        for placed in doubtful:
            shorter = shortened(problem, rungs[last], (placed,))
            found.append(shorter)
            at = judge.judging.reached((placed,))
            without = judge.predict(shorter, floor).of(at)
            mine = predictions[last].of(at)
            shown = [
                p for p in rungs[last].hypothesis if p not in doubtful and p.effect.name == placed.effect.name
            ]
            of_twin = bool({p.joint for p in shown} & twins(problem.nominal, placed.joint))
            if better(mine, without, settings) if of_twin else not better(without, mine, settings):
                break
        else:
            return Kept(rungs, last, predictions, found[len(fits) :])
        # what was added after it is asked again without it, since the one may have spoilt the other
        best = shortened(problem, rungs[-1], (placed,))
        found += [best, *predecessors(problem, best, found)]
        rungs = ladder(problem, [best, *found])


def _climbed(
    judge: Judge, rungs: Sequence[ArticulatedFit], predictions: Sequence[PredictedErrors]
) -> tuple[int, list[PlacedOnJoint]]:
    """How many steps of a ladder the judging records bear out, and which effects did not improve when they were added.

    An effect improves if it takes off more than the standard error allows for, and more than it leaves; one at a joint or its drive is
    asked about that joint, or it stands in for something else. What it leaves of a joint is less than the joint moves: a run that is
    further off than no motion at all has explained nothing, however much worse it was before.
    A number that is named instead of a nominal parameter that is not believed predicts as that does, held back as far as is believed; it
    stays if it predicts no worse than that and better than what was stated.
    What is complete gets no more but what is certain, and nothing small is added where even then something is left: it stands in for a
    little of the form of the law that is not right. What takes away all but as small a part of what was left is no such thing.
    """
    problem, settings = judge.judging, judge.settings
    last, waiting, doubtful = 0, list[PlacedOnJoint](), list[PlacedOnJoint]()
    # of a torque, a law that is off by a part leaves the square of it; what it makes of a free run piles up
    least_part = settings.small**2 if isinstance(problem, TorqueProblem) else settings.small
    for k in range(1, len(rungs)):
        # of what is complete to the accuracy of the stated noise, records may still tell more than that accuracy
        likelier = rungs[k].log_posterior - rungs[last].log_posterior
        if complete(problem, rungs[last], settings) and likelier < settings.certain:
            break
        added = rungs[k].hypothesis[len(rungs[k - 1].hypothesis) :]
        at = problem.reached(added)
        first, before, after = (p.of(at) for p in (predictions[0], predictions[last], predictions[k]))
        gained, left = float(np.mean(before.excess - after.excess)), float(np.mean(after.excess))
        all_but = left < least_part * float(np.mean(before.excess))
        small = 0.0 if not last or all_but or complete(problem, rungs[k], settings) else least_part
        least = max(left if last else 0.0, small * float(np.mean(first.excess)))
        follows = bool(np.all(after.discrepancy < 1.0))
        borne_out = gained > least and better(before, after, settings)
        if follows and (
            borne_out or _stays_instead(judge, rungs[last], rungs[k], predictions[last], predictions[k])
        ):
            last, doubtful, waiting = k, [*doubtful, *waiting], []
        else:
            waiting += added
    return last, doubtful


def _stays_instead(
    judge: Judge,
    fit: ArticulatedFit,
    further: ArticulatedFit,
    before: PredictedErrors,
    after: PredictedErrors,
) -> bool:
    """Whether a number in the place of a nominal parameter stays, from two fits and what they predict."""
    known = keys_of(fit)
    numbers = tuple(p for p in further.hypothesis if p.effect.number and p.key not in known)
    at = judge.judging.reached(numbers)
    then, now = before.of(at), after.of(at)
    if not takes_the_place(judge.problem, fit, further) or better(now, then, judge.settings):
        return False
    stated = judge.predict(taken_out(judge.problem, further, numbers), after.floor)
    return better(stated.of(at), now, judge.settings)


def without_each(fits: Sequence[ArticulatedFit], final: ArticulatedFit) -> list[ArticulatedFit | None]:
    """The likeliest fit of what another one names without one effect after the other; None where none was made."""
    rests = [keys_of(final) - {placed.key} for placed in final.hypothesis]
    made = [[f for f in fits if keys_of(f) == rest] for rest in rests]
    return [max(own, key=lambda f: f.log_posterior, default=None) for own in made]


def alike(
    judge: Judge, fits: Sequence[ArticulatedFit], final: ArticulatedFit, predicted: PredictedErrors
) -> set[EffectKeys]:
    """Explanations, one effect of the final one exchanged for another at its joint, than which that predicts no better for sure.

    Of one kind of effect at parts of one type, all are exchanged for another kind.

    How likely a record is under a law that is not right says little of another law that is not: both leave what neither knows. Where
    more of what an effect leaves of its joint is that than noise, it is held against how others predict; else against those that are
    nearly as likely.

    Args:
        judge: Records that chose nothing.
        fits: All fitted hypotheses, the likeliest first.
        final: What is named, and leaves something.
        predicted: What it predicts.
    """
    problem, settings = judge.judging, judge.settings
    own, likeliest = keys_of(final), dict[EffectKeys, ArticulatedFit]()
    for f in fits:
        if len(f.hypothesis) == len(own) and keys_of(f) != own:
            likeliest.setdefault(keys_of(f), f)
    out = set()
    for theirs, f in likeliest.items():
        lost = tuple(placed for placed in final.hypothesis if placed.key not in theirs)
        gained = tuple(placed for placed in f.hypothesis if placed.key not in own)
        kinds = len(steps(problem, lost)) == len(steps(problem, gained)) == 1
        if len(lost) > 1 and not (kinds and {p.joint for p in lost} == {p.joint for p in gained}):
            continue
        at = problem.reached(lost)
        mine = predicted.of(at)
        noisy = float(np.mean(mine.excess)) <= float(np.sum(mine.floor**2))
        close = final.log_posterior - f.log_posterior <= settings.rival
        if (noisy and not close) or not set(at) & set(problem.reached(gained)):
            continue
        if not better(judge.predict(f, predicted.floor).of(at), mine, settings):
            out.add(theirs)
    return out


def simplest(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, near: Collection[EffectKeys]
) -> ArticulatedFit:
    """Of explanations that predict alike, that with the fewest free parameters; of those, the one that comes first in the catalogue.

    Args:
        fits: All fitted hypotheses, the likeliest first.
        final: What would be named.
        near: Explanations that predict as well.
    """
    order = {effect.name: k for k, effect in enumerate(CATALOGUE)}

    def plain(found: ArticulatedFit) -> tuple[int, int]:
        effects = [placed.effect for placed in found.hypothesis]
        return sum(effect.free for effect in effects), sum(order[effect.name] for effect in effects)

    made = [next(f for f in fits if keys_of(f) == keys) for keys in sorted(near, key=sorted)]
    return min((final, *made), key=plain)
