"""What is named is one of few: what predicts near the best, without effects that close nothing material, and without what is larger.

An explanation that loses an effect, since that closes nothing material, is no longer the likeliest of its size for sure: what was out of
reach of the larger one is then weighed as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from bench.arrays import Array
from bench.discrepancy.fitting.goodness_of_fit import complexity, free_parameters, key_of, log_prior_of
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.judgement.doubt import outside
from bench.discrepancy.prediction.discrepancies import Discrepancies
from bench.discrepancy.prediction.held_out import HeldOut, held_out
from bench.discrepancy.search.explanation import Explanation, nominal_alone
from bench.discrepancy.search.varied_size import differs_in_vain, steadier
from bench.discrepancy.settings import CoarseSettings


def finalists(
    explanations: Sequence[Explanation], known: Discrepancies, settings: CoarseSettings
) -> list[HeldOut]:
    """What is near the likeliest on held-out blocks, the best first, without effects that close nothing material; the nominal model
    alone among them."""
    nothing = bounded(nominal_alone(explanations), settings.within)
    told = [e for e in explanations if e.hypothesis and not differs_in_vain(e, explanations)]
    weighed, within = told[: 2 * settings.finalists], cache(lambda e: bounded(e, settings.within))
    likeliest = -np.inf
    for e in weighed:
        if e.log_posterior > likeliest:
            likeliest = max(likeliest, within(e).log_posterior)
    near = _reached(weighed, likeliest - settings.reach, within)
    found = [held_out(e) for e in [*near[: settings.finalists], nothing]]
    best = min(found, key=_surprise)
    base = _pruned(best, found, known, settings)
    if base is not best and base.explanation.hypothesis:  # what was out of reach of more is not of less
        few = len(base.explanation.hypothesis)
        others = [e for e in _unlike(weighed, (base, *found)) if len(e.hypothesis) <= few]
        near = _reached(others, base.explanation.log_posterior - settings.reach, within)
        found += [held_out(e) for e in near[: settings.finalists]]
        base = min((e for e in (base, *found) if 0 < len(e.explanation.hypothesis) <= few), key=_surprise)
    base = _evened(base, found, explanations)
    base = _unvaried(base, found, settings) or base
    if base.explanation.hypothesis:
        found += _not_told_apart(base, _unlike(told, (base, *found)), nothing, within, known)
    found = [own for own in found if own is base or _unvaried(own, found, settings) is None]
    # what is larger than what is material has been weighed already
    return [base, *(e for e in found if e is not base and no_larger(e.explanation, base.explanation))]


def _surprise(entry: HeldOut) -> float:
    """Misfit of what it did not see, and minus twice its log prior."""
    return entry.total - 2.0 * _log_prior(entry.explanation)


def _reached(
    explanations: Sequence[Explanation], least: float, within: Callable[[Explanation], Explanation]
) -> list[Explanation]:
    """Explanations that are likelier than a level within their bounds, the likeliest first.

    No bound makes one likelier: what is below the level without is not fitted again.
    """
    found = [within(e) for e in explanations if e.log_posterior > least]
    return sorted((e for e in found if e.log_posterior > least), key=lambda e: -e.log_posterior)


def _unlike(explanations: Sequence[Explanation], found: Sequence[HeldOut]) -> list[Explanation]:
    """Explanations that are not those of some effects at some places."""
    known = {key_of(entry.explanation.hypothesis) for entry in found}
    return [e for e in explanations if key_of(e.hypothesis) not in known]


def _not_told_apart(
    base: HeldOut,
    others: Sequence[Explanation],
    nothing: Explanation,
    within: Callable[[Explanation], Explanation],
    known: Discrepancies,
) -> list[HeldOut]:
    """Other explanations of as many effects, the likeliest first, until one that the blocks tell from the base, or that leaves
    materially more.

    A reach in log posterior is one of independent samples; where few blocks decide, what they leave open is wider. Of fewer effects
    nothing is asked again: each of those of the base closes a material part.
    """
    judgement, out = base.explanation.settings.judgement, list[HeldOut]()
    settings, errors = judgement.coarse, judgement.coarse_alike
    for e in others:
        if len(e.hypothesis) != len(base.explanation.hypothesis):
            continue
        entry = held_out(within(e))
        more = known.closed(base.explanation, entry.explanation, nothing)
        apart = not as_good(entry, base, settings, errors)
        if apart or more >= settings.material or len(out) == settings.finalists:
            break
        out.append(entry)
    return out


def _unvaried(entry: HeldOut, found: Sequence[HeldOut], settings: CoarseSettings) -> HeldOut | None:
    """The same effects, fewer of them of a size that follows something, where they predict as well: then nothing says that it does."""
    alike = (other for other in found if steadier(other.explanation, entry.explanation))
    return min((o for o in alike if as_good(o, entry, settings)), key=lambda other: other.total, default=None)


def _evened(entry: HeldOut, found: Sequence[HeldOut], explanations: Sequence[Explanation]) -> HeldOut:
    """The same effects of one size, where sizes that may differ hardly do: an effect beside them may have been pruned."""
    if not differs_in_vain(entry.explanation, explanations):
        return entry
    even = next(e for e in explanations if steadier(e, entry.explanation))
    return held_out_as(bounded(even, found[0].explanation.settings.judgement.coarse.within), found)


def _pruned(
    entry: HeldOut, found: Sequence[HeldOut], known: Discrepancies, settings: CoarseSettings
) -> HeldOut:
    """An explanation without the effects that close nothing material beside the others."""
    nothing = next(e for e in found if not e.explanation.hypothesis)
    while entry.explanation.hypothesis:
        smaller = [(i, without(entry.explanation, i)) for i in range(len(entry.explanation.hypothesis))]
        if len(smaller) == 1:
            smaller = [(0, nothing.explanation)]
        closed = [known.closed(entry.explanation, rest, nothing.explanation) for _, rest in smaller]
        least = int(np.argmin(closed))
        if closed[least] >= settings.material or _accounts_for_it(
            entry.explanation, smaller[least][1], known
        ):
            return entry
        entry = held_out_as(smaller[least][1], found)
    return entry


def _accounts_for_it(explanation: Explanation, rest: Explanation, known: Discrepancies) -> bool:
    """Whether an effect is likelier than not the cause of what the others leave, where that is more than a right model would.

    What they leave may be small beside a large discrepancy and be an effect all the same: friction beside a gap. The rule is that of
    `outside` at even odds: small things besides are no rarer than a further effect.
    """
    settings = explanation.settings
    lacking, left = known.beside(explanation, rest)
    if lacking <= settings.likelihood.error.crude:
        return False
    return outside(left, replace(settings.judgement.coarse, outside=0.5)) < 0.5


def plainer(
    entry: HeldOut,
    explanations: Sequence[Explanation],
    nothing: Explanation,
    known: Discrepancies,
    pays: Callable[[Explanation], bool],
) -> HeldOut | None:
    """The same explanation with a plainer law that one of its laws contains, where the richer closes nothing material beyond it.

    What a law may be bent to besides, the small things that every rig has, tells it from the plainer one and is no sign of it.

    Args:
        entry: What would be named.
        explanations: All, the nominal model alone among them.
        nothing: The nominal model, its parameters re-estimated.
        known: What explanations leave of the records.
        pays: Whether an explanation shrinks the judging records' discrepancy as a name has to.
    """
    settings = entry.explanation.settings.judgement.coarse
    asked = [e for e in explanations if contains(entry.explanation, e)]
    for e in sorted(asked, key=lambda e: -e.log_posterior):
        plain = bounded(e, settings.within)
        more = known.closed(entry.explanation, plain, nothing)
        if more >= settings.material or _accounts_for_it(entry.explanation, plain, known):
            continue
        if pays(plain):
            return held_out(plain)
    return None


def same(explanation: Explanation, other: Explanation) -> bool:
    """Whether two explanations have the same effects at the same places."""
    return key_of(explanation.hypothesis) == key_of(other.hypothesis)


def contains(explanation: Explanation, other: Explanation) -> bool:
    """Whether another explanation is one with a plainer law in the place of one that contains it."""
    own, theirs = ({p.key: p for p in e.hypothesis} for e in (explanation, other))
    lost, gained = own.keys() - theirs.keys(), theirs.keys() - own.keys()
    if not len(lost) == len(gained) == 1:
        return False
    (rich,), (plain,) = [own[key] for key in lost], [theirs[key] for key in gained]
    return plain.effect.name in rich.effect.contains and plain.place == rich.place


def as_good(entry: HeldOut, best: HeldOut, settings: CoarseSettings, errors: float = 1.0) -> bool:
    """Whether an explanation predicts as well as the best one: within a standard error, or what so few samples cannot tell."""
    worse, error = entry.worse_than(best)
    return entry is best or worse <= max(errors * error, settings.telling)


def no_larger(explanation: Explanation, other: Explanation) -> bool:
    """Whether an explanation has no more effects than another one, fewer numbers to bend, or takes no more to be described."""
    own, theirs = explanation.hypothesis, other.hypothesis
    few = len(own) <= len(theirs) or free_parameters(own) < free_parameters(theirs)
    settings = explanation.settings.search
    return few or complexity(own, settings=settings) <= complexity(theirs, settings=settings)


def bounded(explanation: Explanation, within: float) -> Explanation:
    """An explanation whose nominal parameters stay within so many stated standard deviations, fitted again where they do not.

    So do those of whatever is made of it, without one of its effects, say: else a parameter would silently stand in for that.
    """
    if all(problem.within <= within for problem, _ in explanation.parts):
        return explanation
    parts = []
    for problem, fitted in explanation.parts:
        narrow, iterations = problem.bounded(within), explanation.settings.search.thorough
        beyond = np.any(np.abs(fitted.vector[: problem.n_physical]) > within)
        again = (
            fit(narrow, fitted.hypothesis, start=fitted.vector, iterations=iterations) if beyond else fitted
        )
        parts.append((narrow, again))
    return Explanation(tuple(parts))


def believed(nothing: Explanation, explanation: Explanation, settings: CoarseSettings) -> Explanation:
    """The nominal model, its parameters moved no further than where a move is a finding, or than an explanation moves them itself.

    A parameter that is moved further is no nominal model any more: it says itself that something is wrong, and may stand in for it.
    """
    within = max(settings.finding, _farthest(explanation))
    return nothing if _farthest(nothing) <= within else bounded(nothing, within)


def _farthest(explanation: Explanation) -> float:
    return float(np.max(np.abs(nominal_moves(explanation)), initial=0.0))


def strained(explanation: Explanation, within: float) -> bool:
    """Whether an explanation moves a nominal parameter by more than `within` of its stated standard deviations."""
    return _farthest(explanation) > within


def nominal_moves(explanation: Explanation) -> Array:
    """Stated standard deviations (n,) by which an explanation moves the uncertain nominal parameters."""
    return np.concatenate(
        [
            fitted.vector[: problem.n_physical][problem.spread[: problem.n_physical] > 0.0]
            for problem, fitted in explanation.parts
        ]
    )


def without(explanation: Explanation, index: int) -> Explanation:
    """An explanation without one of its effects, fitted again from where it was.

    Args:
        explanation: Fitted.
        index: Of the effect in its hypothesis.
    """
    if index not in explanation.smaller:
        explanation.smaller[index] = _without(explanation, index)
    return explanation.smaller[index]


def _without(explanation: Explanation, index: int) -> Explanation:
    parts = []
    for problem, fitted in explanation.parts:
        if not 0 <= index < len(fitted.hypothesis):
            parts.append((problem, fitted))
            index -= len(fitted.hypothesis)
            continue
        _, etas = problem.split(fitted.hypothesis, fitted.vector)
        rest = fitted.hypothesis[:index] + fitted.hypothesis[index + 1 :]
        kept = np.concatenate([fitted.vector[: len(problem.nominal)], *etas[:index], *etas[index + 1 :]])
        starts = np.array(
            [kept, np.concatenate([np.zeros(len(problem.nominal)), *etas[:index], *etas[index + 1 :]])]
        )
        parts.append(
            (problem, fit(problem, rest, start=starts, iterations=explanation.settings.search.thorough))
        )
        index = -1
    return Explanation(tuple(parts))


def held_out_as(explanation: Explanation, found: Sequence[HeldOut]) -> HeldOut:
    """An explanation on held-out blocks, the finalist of the same effects where there is one."""
    known = {key_of(e.explanation.hypothesis): e for e in found}
    return known.get(key_of(explanation.hypothesis)) or held_out(explanation)


def _log_prior(explanation: Explanation) -> float:
    return log_prior_of(explanation.hypothesis, settings=explanation.settings.search)
