"""Search for what is missing from an articulated model: effects at all places are screened, the most promising fitted, one by one.

A screened effect is one run (or a few, over a grid) of the joints that it changes. The change that it makes, less what the nominal
parameters could do as well, is regressed on the residuals: what that takes away is what the effect promises.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_search.fitting import (
    ArticulatedFit,
    fit,
    free_entries,
    own_entries,
    refitted,
)
from bench.discrepancy.articulated_search.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.placements import apart
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.rounds import (
    Round,
    best_of,
    grounds_of,
    parted,
    quiet,
    sound,
    strained,
)
from bench.discrepancy.multibody.nominal_parameters import twins
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings


def complete(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> bool:
    """Whether no joint keeps more than the noise, and no nominal parameter is strained for it."""
    far = np.abs(found.vector[: len(problem.nominal)]) > settings.strained
    return bool(quiet(found, settings).all() and not far.any())


def nominal_fit(problem: ArticulatedProblem) -> ArticulatedFit:
    """The nominal model alone, with the scales of the joints that it leaves."""
    vector = np.zeros(len(problem.nominal))
    return refitted(problem, (), vector, scale=ArticulatedFit.at(problem, (), vector).scale)


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
    progress: Callable[[str], None] = lambda text: None,
) -> Searched:
    """All fitted hypotheses: the one that nothing is worth adding to or taking from, then the likeliest first."""
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
            return search(corrected.problem, candidates, settings=settings, progress=progress)
        found += fits
        if best is None or best.log_posterior < current.log_posterior + _needed(problem, current, settings):
            break
        if not _material(problem, found[0], current, best):
            break
        problem = problem.settled(best.hypothesis, best.vector)
        before, added = current, len(best.hypothesis) - len(current.hypothesis)
        current, fits = without_idle(problem, best, settings, added=added)
        found += fits
        idle = {placed.key for placed in best.hypothesis} - {placed.key for placed in current.hypothesis}
        given_up += [before] if idle else []
        dropped |= idle
        progress(f"round {count}: " + ", ".join(f"{p.effect.name} ({p.where})" for p in current.hypothesis))
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
    misfit = (_misfit_beyond_noise(f) for f in fits)
    return complete(problem, after, judged) or any(
        bool(np.any(old - new > judged.small * first)) for first, old, new in (power, misfit)
    )


def _misfit_beyond_noise(found: ArticulatedFit) -> Array:
    octaves = found.octaves
    misfit = [octaves.misfit(j, power) for j, power in enumerate(found.chi2)]
    return np.maximum(np.array(misfit) - octaves.count.sum(axis=1), 0.0)


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
    open_joints |= strained(problem, current, settings)
    # behind an elastic drive the link is elsewhere, and all that hangs on it
    shared = [c for c in candidates if len(problem.reached((c,))) > 1 or c.effect.train or not open_joints]
    own = {j: [c for c in candidates if c.joint == j and c not in shared] for j in sorted(open_joints)}
    rounds, parts = list[Round](), list[ArticulatedFit]()
    for j, mine in own.items():
        name = problem.joints[j].name
        if not problem.deadline.allows(f"effects at joint '{name}'"):
            break
        told = best_of(
            problem,
            current,
            grounds,
            mine,
            settings,
            lambda text, name=name: progress(f"joint '{name}': {text}"),
        )
        rounds.append(told)
        if told.best is not None and told.best.log_posterior >= current.log_posterior + settings.worth:
            parts.append(told.best)
    gained = sum(part.log_posterior - current.log_posterior for part in parts)
    if shared and problem.deadline.allows("effects that reach several joints"):
        rounds.append(best_of(problem, current, grounds, shared, settings, progress, gained=2.0 * gained))
    fits = [f for told in rounds for f in told.fits]
    heard = [told.corrected for told in rounds if told.corrected is not None]
    corrected = max(heard, key=lambda one: one.best.log_posterior, default=None)
    best = max((told.best for told in rounds if told.best), key=lambda f: f.log_posterior, default=None)
    if len(parts) > 1 and best is not None and best.log_posterior < current.log_posterior + gained:
        together = _joined(problem, current, sorted(parts, key=lambda part: -part.log_posterior))
        fits.append(together)
        best = max(best, together, key=lambda f: f.log_posterior)
    kinds = list(_of_one_kind(problem, current, fits, own, settings))
    fits += [alike for alike, _ in kinds if alike not in fits]
    if kinds:
        alike, worth = max(kinds, key=lambda kind: kind[0].log_posterior + kind[1])
        if best is None or alike.log_posterior + worth > best.log_posterior:
            best = alike
    return Round(best, fits, corrected)


def _of_one_kind(
    problem: ArticulatedProblem,
    current: ArticulatedFit,
    fits: Sequence[ArticulatedFit],
    own: Mapping[int, Sequence[PlacedOnJoint]],
    settings: SearchSettings,
) -> Iterator[tuple[ArticulatedFit, float]]:
    """Fits with one kind of effect at all parts of a type, and what each has before a choice joint by joint.

    Whether one servo of a type has friction is no news once another has. One choice among the candidates is made for all of them where
    `own` would have them make one each, and a choice among k that are as likely costs log k of log posterior.
    """
    for joints in sorted({p.joints for p in problem.nominal if p.of_type}):
        if not own.keys() >= set(joints):
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
                made = [_joined(problem, current, sorted(parts, key=lambda part: -part.log_posterior))]
            yield max(made, key=lambda f: f.log_posterior), worth


def _begun(current: ArticulatedFit, placed: PlacedOnJoint) -> tuple[JointHypothesis, Array]:
    """The hypothesis of a fit with one effect more, and its vector with the effect where its prior has it."""
    eta = [p.mean for p in placed.effect.parameters]
    return (*current.hypothesis, placed), np.append(current.vector, eta)


def _joined(
    problem: ArticulatedProblem, current: ArticulatedFit, parts: Sequence[ArticulatedFit]
) -> ArticulatedFit:
    """A fit with the last effects of several, each about a joint of its own, on top of what they have in common."""
    vector, last = parts[0].vector[: problem.size(current.hypothesis)].copy(), list[Array]()
    for part in parts:
        (j,) = problem.reached(part.hypothesis[-1:])
        own = own_entries(problem, current.hypothesis, j)
        vector[own] = part.vector[own]
        last.append(part.vector[len(vector) :])
    hypothesis = (*current.hypothesis, *(part.hypothesis[-1] for part in parts))
    vector = np.concatenate([vector, *last])
    settled = problem.settled(hypothesis, vector)
    return refitted(settled, hypothesis, vector, scale=ArticulatedFit.at(settled, hypothesis, vector).scale)


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


def exchanged(
    problem: ArticulatedProblem,
    found: ArticulatedFit,
    lost: Collection[PlacedOnJoint],
    gained: Sequence[PlacedOnJoint],
) -> ArticulatedFit:
    """A fit once more with some of its effects exchanged for others."""
    others, start = _without(problem, found, lost)
    start = np.append(start, [p.mean for placed in gained for p in placed.effect.parameters])
    hypothesis = (*others, *gained)
    return refitted(problem, hypothesis, start, scale=ArticulatedFit.at(problem, hypothesis, start).scale)


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
