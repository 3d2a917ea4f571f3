"""What is said where the error of the model, not noise, decides what an explanation leaves.

Explanations are compared by blocks that their fits did not see (`held_out`). Among those within one standard error of the best
the simplest and commonest is named, and they are declared a set; so are a law and a plainer one that it contains, where what the richer
closes beyond it is not material. An effect beside others is named if it closes a material part of the
discrepancy. The judging records choose nothing; they veto: what does not shrink their discrepancy is not named.

References:
    L. Breiman, J. Friedman, R. Olshen, C. Stone, Classification and Regression Trees, 1984, section 3.4.3 (one standard error).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.fitting.goodness_of_fit import complexity
from bench.discrepancy.judgement.doubt import like_small_things, outside, stands_outside
from bench.discrepancy.judgement.finalists import (
    as_good,
    believed,
    finalists,
    held_out_as,
    nominal_moves,
    plainer,
    same,
    without,
)
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.prediction.discrepancies import Discrepancies
from bench.discrepancy.prediction.held_out import HeldOut, shares
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.search.steady import diverges, steadied
from bench.discrepancy.settings import CoarseSettings


@dataclass(frozen=True, eq=False)
class Judged:
    """Explanations weighed by prediction.

    Attributes:
        chosen: What is named; nothing where it has no effect.
        found: All finalists on held-out blocks, the chosen one first.
        weights: (n,) probability of each, as if one of them were true.
        within: Those within one standard error of the best.
        alike: Those that the blocks do not tell from the chosen one: two standard errors; and those that the judging records prefer.
        vetoed: Whether the judging records refused what the others would have named.
        off: Whether the nominal model, its parameters re-estimated, is off by more than sensors are calibrated to.
        missing: Whether something is missing that no effect describes, although no noise is stated that would tell: the nominal model is
            off, and an effect was vetoed, or what it leaves is larger than the errors of models.
        doubts: Probability, by name and place of each chosen effect, that what it closes is not its own.
        settings: Thresholds.
        known: What explanations leave of the records.
    """

    chosen: HeldOut
    found: tuple[HeldOut, ...]
    weights: Array
    within: tuple[HeldOut, ...]
    alike: tuple[HeldOut, ...]
    vetoed: bool
    off: bool
    missing: bool
    doubts: Mapping[tuple[str, str], float]
    settings: CoarseSettings
    known: Discrepancies

    @property
    def outside(self) -> float:
        """Probability that no effect of the catalogue is the cause: that not even the surest of the chosen ones is."""
        return min(self.doubts.values(), default=outside(1.0, self.settings))

    @property
    def agreed(self) -> float:
        """Probability of the likeliest kind among those of what was chosen, as if one of the explanations that have effects were true."""
        pairs = [(float(w), kinds_of(e.explanation)) for w, e in zip(self.weights, self.found, strict=True)]
        any_kind = sum(weight for weight, kinds in pairs if kinds)
        of_kind = (
            sum(weight for weight, kinds in pairs if kind in kinds)
            for kind in kinds_of(self.chosen.explanation)
        )
        return max(of_kind, default=0.0) / max(any_kind, 1e-300)


def kinds_of(explanation: Explanation) -> set[str]:
    """Kinds of the effects of an explanation."""
    return {placed.effect.kind for placed in explanation.hypothesis}


def judge(
    case: Case,
    problem: Problem,
    explanations: Sequence[Explanation],
    rng: np.random.Generator,
    *,
    trusted: bool = False,
) -> Judged:
    """Weigh explanations by prediction.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom.
        explanations: By decreasing posterior, the nominal model alone among them.
        rng: For the bootstrap over blocks.
        trusted: Whether the noise is stated, and nothing contradicts it: what is named has to close most of the discrepancy then.
    """
    judgement = problem.settings.judgement
    read = {placed.target for placed in explanations[0].hypothesis if placed.effect.added is not None}
    settings, known = judgement.coarse, Discrepancies(case, problem, read)
    found = finalists(explanations, known, settings)
    base, nothing = found[0], next(e for e in found if not e.explanation.hypothesis)
    within = alike = tuple(entry for entry in found if as_good(entry, base, settings))
    part = settings.most if trusted else settings.pays
    chosen, vetoed = nothing, False

    def pays(e: Explanation) -> bool:
        alone = believed(nothing.explanation, e, settings)
        return known.pays(e, nothing.explanation, part, alone)

    for own in sorted(within, key=_plainness):
        entry = _borne_out(_steady(own, case, rng), found, known)
        if not entry.explanation.hypothesis or pays(entry.explanation):
            found, chosen = _with(entry, own, found), entry
            alike = tuple(
                other
                for other in found
                if known.prefers(other.explanation, entry.explanation)
                or as_good(other, base, settings, judgement.coarse_alike)
            )
            break
        vetoed = True
    plain = plainer(chosen, explanations, nothing.explanation, known, pays)
    richer = [] if plain is None else [chosen]
    if plain is not None:
        found = [plain, *(e for e in found if not same(e.explanation, plain.explanation))]
        alike, chosen = (plain, *alike), plain
    weights = shares(found, _log_priors(found), rng, judgement.held_out.draws)
    if trusted and chosen is not nothing:  # more than noise is missing, and small things are in the doubts
        weights = np.where([entry is nothing for entry in found], 0.0, weights)
        weights = weights / weights.sum()
    off, wrong = _off(problem, nothing.explanation, known)
    missing = chosen is nothing and not problem.noise_stated and off and (vetoed or wrong)
    if chosen.explanation.hypothesis:
        preferred = [other for other in found if known.prefers(other.explanation, chosen.explanation)]
        weights = _undecided(weights, found, [chosen, *richer, *preferred])
    return Judged(
        chosen,
        tuple(found),
        weights,
        within,
        alike,
        vetoed,
        off,
        missing,
        _doubts(chosen.explanation, nothing.explanation, known),
        settings,
        known,
    )


def _off(problem: Problem, nothing: Explanation, known: Discrepancies) -> tuple[bool, bool]:
    """Whether the nominal model, its parameters re-estimated, is off by more than sensors are calibrated to, and by more than models are.

    A nominal model is as right as a model can be within two standard deviations of what sensors are calibrated to.
    """
    settings, error = problem.settings.judgement.coarse, problem.settings.likelihood.error
    off = float(np.max(known.of(nothing, judging=True))) > 2.0 * error.least
    return off, stands_outside(known.beyond_noise(nothing), settings, error)


def _doubts(chosen: Explanation, nothing: Explanation, known: Discrepancies) -> dict[tuple[str, str], float]:
    """Probability, for each effect of an explanation, that what it closes of the judging records is not its own."""
    settings, error = chosen.settings.judgement.coarse, chosen.settings.likelihood.error
    moved, alone = nominal_moves(chosen), believed(nothing, chosen, settings)
    out = dict[tuple[str, str], float]()
    for i, placed in enumerate(chosen.hypothesis):
        size, left = known.part(chosen, alone if len(chosen.hypothesis) == 1 else without(chosen, i))
        doubt = outside(
            left, settings, besides=settings.besides * like_small_things(size, error), moved=moved
        )
        key = placed.effect.name, placed.place.name
        out[key] = min(out.get(key, 1.0), doubt)
    return out


def _with(entry: HeldOut, own: HeldOut, found: Sequence[HeldOut]) -> list[HeldOut]:
    """Finalists with one of them as it is named: moved, or without effects that are not borne out, which may be a finalist as well."""
    if entry in found:
        return [other for other in found if other is entry or other is not own]
    return [entry if other is own else other for other in found]


def _undecided(weights: Array, found: Sequence[HeldOut], among: Sequence[HeldOut]) -> Array:
    """Weights (n,) of which some explanations have equal parts: the records for finding speak for one of them, those for judging for
    others, and neither is to be believed more."""
    own = np.array([entry in among for entry in found])
    return np.where(own, float(weights[own].mean()), weights)


def _steady(entry: HeldOut, case: Case, rng: np.random.Generator) -> HeldOut:
    """An explanation on held-out blocks, moved within its uncertainty where it diverges on the judging records."""
    if not entry.explanation.hypothesis or not diverges(entry.explanation, case.validation):
        return entry
    moved = steadied(entry.explanation, case.validation, rng)
    return entry if moved is None else replace(entry, explanation=moved)


def _log_priors(found: Sequence[HeldOut]) -> Array:
    """Log priors (n,) of explanations: by what they take to be described, and shared by those of the same names at the same places."""
    names = [frozenset((p.effect.name, p.place.name) for p in e.explanation.hypothesis) for e in found]
    plain = [
        -complexity(e.explanation.hypothesis, settings=found[0].explanation.settings.search) for e in found
    ]
    return np.array([value - np.log(names.count(own)) for value, own in zip(plain, names, strict=True)])


def _plainness(entry: HeldOut) -> tuple[float, float]:
    """What comes first is simpler: fewer parameters, fewer and commoner effects; and then what predicts better."""
    return (complexity(entry.explanation.hypothesis, settings=entry.explanation.settings.search), entry.total)


def _borne_out(entry: HeldOut, found: Sequence[HeldOut], known: Discrepancies) -> HeldOut:
    """An explanation without the effects that make the judging records worse than the others alone do, worst first."""
    while len(entry.explanation.hypothesis) > 1:
        smaller = [without(entry.explanation, i) for i in range(len(entry.explanation.hypothesis))]
        harm = [known.harm(entry.explanation, rest) for rest in smaller]
        worst = int(np.argmax(harm))
        if harm[worst] <= 1.0:
            return entry
        entry = held_out_as(smaller[worst], found)
    return entry
