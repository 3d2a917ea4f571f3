"""One round over all joints: effects at single joints, fitted together, against effects that reach several, and one kind at twins."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, own_entries, refitted
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.rounds import (
    Grounds,
    Round,
    best_of,
    freed,
    grounds_of,
    quiet,
    strained,
)
from bench.discrepancy.articulated_search.soundness import sound
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


def round_of(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    candidates: Sequence[PlacedOnJoint],
    settings: SearchSettings,
    progress: Callable[[str], None],
) -> Round:
    """One round: an effect more at every joint that misses one, or one that reaches them all if that explains more.

    What sits at one joint changes the runs of that joint alone. So what joints miss of their own is looked for joint by joint, and all is
    then fitted together; what they gain in sum is held against what one effect common to them gains.
    """
    grounds = grounds_of(problem, current, settings)
    judged = problem.settings.articulated.judgement
    open_joints = {j for j, still in enumerate(quiet(current, judged)) if not still}
    open_joints |= strained(problem, current, settings.strained)
    # behind an elastic drive the link is elsewhere, and all that hangs on it
    shared = [c for c in candidates if len(problem.reached((c,))) > 1 or c.effect.train or not open_joints]
    own = {j: [c for c in candidates if c.joint == j and c not in shared] for j in sorted(open_joints)}
    rounds, parts = list[Round](), list[ArticulatedFit]()
    for j, mine in own.items():
        name = problem.joints[j].name
        if not problem.deadline.allows(f"effects at joint '{name}'"):
            break

        def tell(text: str, name: str = name) -> None:
            progress(f"joint '{name}': {text}")

        told = best_of(problem, current, grounds, mine, settings, tell)
        rounds.append(told)
        if told.best is not None and told.best.log_posterior >= current.log_posterior + settings.worth:
            parts.append(told.best)
    joined = None
    if len(parts) > 1:
        joined = _joined(problem, current, sorted(parts, key=lambda part: -part.log_posterior))
    rounds, best = _likeliest(problem, rounds, joined)
    fits = [f for told in rounds for f in told.fits] + ([] if joined is None else [joined])
    if shared and problem.deadline.allows("effects that reach several joints"):
        gained = sum(part.log_posterior - current.log_posterior for part in parts)
        least = -np.inf if best is None else best.log_posterior - settings.sight
        told = best_of(
            problem, current, grounds, shared, settings, progress, gained=2.0 * gained, least=least
        )
        told = freed(problem, told, least)
        rounds.append(told)
        instead = _in_the_place(problem, current, told.best, parts, settings)
        fits += told.fits if instead is None else [*told.fits, instead]
        best = _likelier(best, told.best, instead)
    behind = _behind_a_train(problem, current, grounds, parts, candidates, settings, progress)
    fits += [] if behind is None else [behind]
    best = _likelier(best, behind)
    kinds = list(_of_one_kind(problem, current, fits, own, settings, progress))
    fits += [alike for alike, _ in kinds if alike not in fits]
    if kinds:
        alike, worth = max(kinds, key=lambda kind: kind[0].log_posterior + kind[1])
        if best is None or alike.log_posterior + worth > best.log_posterior:
            best = alike
    heard = [told.corrected for told in rounds if told.corrected is not None]
    corrected = max(heard, key=lambda one: one.best.log_posterior, default=None)
    return Round(best, fits, corrected)


def _likelier(*fits: ArticulatedFit | None) -> ArticulatedFit | None:
    """The likeliest of some fits, of which there need not be any."""
    return max((f for f in fits if f is not None), key=lambda f: f.log_posterior, default=None)


def _likeliest(
    problem: ArticulatedProblem, rounds: Sequence[Round], joined: ArticulatedFit | None
) -> tuple[list[Round], ArticulatedFit | None]:
    """The rounds of single joints, and the likeliest of their fits and of the one that joins them, all joints free.

    What the other joints lose by a fit about one is known as a quadratic form: all joints are run for those that come first by it alone.
    """
    rounds, best = list(rounds), joined
    waiting = {k: told.best.log_posterior for k, told in enumerate(rounds) if told.best is not None}
    while waiting:
        k = max(waiting, key=lambda k: waiting[k])
        promised = waiting.pop(k)
        if best is not None and best.log_posterior >= promised:
            break
        rounds[k] = freed(problem, rounds[k])
        found = rounds[k].best
        if found is not None and (best is None or found.log_posterior > best.log_posterior):
            best = found
    return rounds, best


def _behind_a_train(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    grounds: Grounds,
    parts: Sequence[ArticulatedFit],
    candidates: Sequence[PlacedOnJoint],
    settings: SearchSettings,
    progress: Callable[[str], None],
) -> ArticulatedFit | None:
    """A fit with an elastic drive at the joint that gains most, and what the other joints miss beside it.

    Where many joints miss something, an elastic drive alone is less than all of that, and yet more than what else may be at its joint. What
    other joints seem to miss may be where its link is, though, and is nothing once that is known: each has to be worth naming still.
    """
    if len(parts) < 2 or not problem.deadline.allows("an elastic drive beside what other joints miss"):
        return None
    most = max(parts, key=lambda part: part.log_posterior)
    trains = [c for c in candidates if c.effect.train and c.joint == most.hypothesis[-1].joint]
    gained, least = 2.0 * (most.log_posterior - current.log_posterior), most.log_posterior - settings.sight
    progress(f"an elastic drive at joint '{problem.joints[most.hypothesis[-1].joint].name}'")
    told = best_of(problem, current, grounds, trains, settings, lambda text: None, gained, least)
    train = freed(problem, told, least).best
    return _in_the_place(problem, current, train, parts, settings)


def _in_the_place(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    found: ArticulatedFit | None,
    parts: Sequence[ArticulatedFit],
    settings: SearchSettings,
) -> ArticulatedFit | None:
    """A fit with an effect in the place of what its joint misses of its own, where it is likelier than that, beside what others miss.

    Where many joints miss something, one effect that reaches several of them is less than all of that, be it what its joint misses or not.
    A drive that joints share is rarer than what each of them misses, and has to be likelier than all of that by itself.
    """
    if found is None or len(found.hypothesis[-1].joints) > 1:
        return None
    joint = found.hypothesis[-1].joint
    mine = [part for part in parts if part.hypothesis[-1].joint == joint]
    others = sorted((part for part in parts if part not in mine), key=lambda part: -part.log_posterior)
    if not mine or not others or found.log_posterior < max(part.log_posterior for part in mine):
        return None
    if not problem.deadline.allows("what reaches several joints beside what others miss"):
        return None
    whole = _joined(problem, current, [found, *others])
    return whole if whole.log_posterior >= found.log_posterior + settings.worth * len(others) else None


def _of_one_kind(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    fits: Sequence[ArticulatedFit],
    own: Mapping[int, Sequence[PlacedOnJoint]],
    settings: SearchSettings,
    progress: Callable[[str], None],
) -> Iterator[tuple[ArticulatedFit, float]]:
    """Fits with one kind of effect at all parts of a type, and what each has before a choice joint by joint.

    Whether one servo of a type has friction is no news once another has. One choice among the candidates is made for all of them where
    `own` would have them make one each, and a choice among k that are as likely costs log k of log posterior.
    """
    for joints in sorted({p.joints for p in problem.nominal if p.of_type}):
        if not all(own.get(j) for j in joints):
            continue
        found: dict[str, dict[int, ArticulatedFit]] = {}
        for f in sorted(fits, key=lambda f: f.log_posterior):
            placed = f.hypothesis[-1]
            if len(f.hypothesis) == len(current.hypothesis) + 1 and problem.reached((placed,)) == (
                placed.joint,
            ):
                found.setdefault(placed.effect.name, {})[placed.joint] = f
        open_to = {(c.effect.name, c.joint): c for j in joints for c in own[j]}
        whole = [name for name in found if all((name, j) in open_to for j in joints)]
        gains = {
            name: sum(f.log_posterior - current.log_posterior for f in found[name].values()) for name in whole
        }
        worth = sum(float(np.log(len(own[j]))) for j in joints[1:])
        for name in sorted(whole, key=lambda name: -gains[name])[: settings.finalists]:
            if not problem.deadline.allows("one kind of effect at all parts of a type"):
                return
            kind = {open_to[name, j].key for j in joints}
            made = [f for f in fits if {p.key for p in f.hypothesis[len(current.hypothesis) :]} == kind]
            if not made:
                parts = [
                    found[name].get(j) or ArticulatedFit.at(problem, *_begun(current, open_to[name, j]))
                    for j in joints
                ]
                progress(f"{name} at all parts of a type")
                made = [_joined(problem, current, sorted(parts, key=lambda part: -part.log_posterior))]
            made = [f for f in made if sound(problem, f)]
            if made:
                yield max(made, key=lambda f: f.log_posterior), worth


def _begun(current: ArticulatedFit, placed: PlacedOnJoint) -> tuple[JointHypothesis, Array]:
    """The hypothesis of a fit with one effect more, and its vector with the effect where its prior has it."""
    eta = [p.mean for p in placed.effect.parameters]
    return (*current.hypothesis, placed), np.append(current.vector, eta)


def _joined(
    problem: ArticulatedProblem, current: ArticulatedFit, parts: Sequence[ArticulatedFit]
) -> ArticulatedFit:
    """A fit with the last effects of several, each about a joint of its own but perhaps the first, on top of what they have in common."""
    vector, last = parts[0].vector[: problem.size(current.hypothesis)].copy(), list[Array]()
    for part in parts:
        reached = problem.reached(part.hypothesis[-1:])
        if len(reached) == 1:  # what reaches more stands as the first, and has moved what is theirs
            own = own_entries(problem, current.hypothesis, reached[0])
            vector[own] = part.vector[own]
        last.append(part.vector[len(vector) :])
    hypothesis = (*current.hypothesis, *(part.hypothesis[-1] for part in parts))
    vector = np.concatenate([vector, *last])
    settled = problem.settled(hypothesis, vector)
    scale = ArticulatedFit.at(settled, hypothesis, vector).scale
    return refitted(settled, hypothesis, vector, scale=scale)
