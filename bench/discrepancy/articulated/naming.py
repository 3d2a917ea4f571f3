"""The verdict on an articulated model: names with parameters and shares, rivals and probabilities."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from bench.discrepancy.articulated.places import gaps_of, locations_of, remainder_of
from bench.discrepancy.articulated.words import NOISE_UNSTATED, words_of
from bench.discrepancy.articulated_effects.hypothesis import placed_values
from bench.discrepancy.articulated_judgement.judgement import EffectKeys, keys_of
from bench.discrepancy.articulated_judgement.predicted_errors import (
    PredictedErrors,
    closed,
    closed_of_nominal,
)
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.judgement.doubt import outside
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.nominal_parameters import Nominal
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.verdict import (
    Estimate,
    NamedEffect,
    NominalEstimate,
    Ranked,
    Verdict,
    VerdictKind,
    widest_of,
)


def verdict_of(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    rungs: Sequence[ArticulatedFit],
    untouched: PredictedErrors,
    predictions: Sequence[PredictedErrors],
    without: Sequence[PredictedErrors | None],
    settings: JudgementSettings,
    rng: np.random.Generator,
    *,
    whole: bool,
    noise_alone: bool,
    left: str,
    alike: Collection[EffectKeys],
) -> Verdict:
    """The verdict.

    Args:
        problem: Records for identification.
        fits: All fitted hypotheses, the likeliest first.
        rungs: What the judging records bear out with its predecessors, the nominal model alone first.
        untouched: What the nominal model as stated predicts of them.
        predictions: What every rung does.
        without: What the last rung predicts without one of its effects after the other.
        settings: Thresholds.
        rng: For the bootstrap intervals.
        whole: Whether the last rung leaves nothing but the noise that was stated.
        noise_alone: Whether it leaves what looks like noise, of whatever is taken for its size.
        left: What it leaves, in words.
        alike: Explanations that predict the judging records as well, see `judgement.alike`.
    """
    final, base = rungs[-1], rungs[0]
    explained = closed_of_nominal(untouched, predictions[0], predictions[-1], rng)
    kind: VerdictKind = "effect" if final.hypothesis else "none"
    explains = explained >= settings.material if final.hypothesis else noise_alone
    if not whole and not explains:
        kind = "unknown"
    shares = _shares(rungs, predictions, without, rng)
    # of what is named beside noise, the part that is left tells how likely something outside the catalogue is
    foreign = settings.outside
    if kind == "effect" and not whole:
        foreign = outside(1.0 - explained, problem.settings.judgement.coarse)
    probabilities = _probabilities(fits, final, kind, settings, foreign)
    ranking = ranking_of(fits, final, foreign, alike)
    sure = {(entry.name, entry.where): entry.probability for entry in ranking}
    effects = tuple(
        _named(problem, final, k, shares[k], sure[placed.key]) for k, placed in enumerate(final.hypothesis)
    )
    effects = tuple(sorted(effects, key=lambda e: -e.closed))
    gaps = gaps_of(problem, rungs, untouched, predictions, rng)
    acted_on = [gaps[j] for j in problem.reached(final.hypothesis)]
    return Verdict(
        verdict=kind,
        named=effects if kind == "effect" else (),
        nearest=effects if kind == "unknown" else (),
        ranking=ranking,
        indistinguishable=_sets(fits, final, settings, alike) if kind == "effect" else (),
        locations=locations_of(problem, base),
        gap=widest_of(gaps),
        gaps=gaps,
        probabilities=probabilities,
        explanation=words_of(
            kind, effects, explained, "" if whole else NOISE_UNSTATED if noise_alone else left, gaps, acted_on
        ),
        warnings=(),
        complete=whole,
        remainder=remainder_of(problem, final, predictions[-1], untouched),
        nominal=model_numbers(problem, final),
    )


def _shares(
    rungs: Sequence[ArticulatedFit],
    predictions: Sequence[PredictedErrors],
    without: Sequence[PredictedErrors | None],
    rng: np.random.Generator,
) -> list[tuple[float, tuple[float, float]]]:
    """What of the discrepancy comes back where one effect after the other is taken out, and the others are fitted without it.

    Where they never were, it is what came back as the search found it, beside those before it.
    """
    out = []
    for k, others in enumerate(without):
        at = next(i for i, rung in enumerate(rungs) if len(rung.hypothesis) > k)
        before, after = (
            (predictions[at - 1], predictions[at]) if others is None else (others, predictions[-1])
        )
        out.append(closed(before, after, predictions[0], rng))
    return out


def _probabilities(
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    kind: VerdictKind,
    settings: JudgementSettings,
    foreign: float,
) -> dict[str, float]:
    """Probabilities of the verdicts, with that of something outside the catalogue."""
    known = 1.0 - foreign
    if kind == "unknown":
        return {"effect": foreign, "none": 0.0, "unknown": known}
    logs = np.array([f.log_posterior for f in fits if len(f.hypothesis) <= len(final.hypothesis)])
    empty = np.array([not f.hypothesis for f in fits if len(f.hypothesis) <= len(final.hypothesis)])
    shares = np.exp(logs - logs.max())
    none = float(shares[empty].sum() / shares.sum())
    if kind == "none":  # what the search would add is not borne out
        none = max(none, 0.95)
    return {"effect": known * (1.0 - none), "none": known * none, "unknown": foreign}


def _rivals(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, alike: Collection[EffectKeys]
) -> list[tuple[ArticulatedFit, float]]:
    """Explanations of as many effects, by what they are less likely than the final one; nothing if they predict alike."""
    out: dict[EffectKeys, tuple[ArticulatedFit, float]] = {}
    for f in fits:
        if len(f.hypothesis) == len(final.hypothesis):
            key = keys_of(f)
            behind = 0.0 if key in alike else max(final.log_posterior - f.log_posterior, 0.0)
            out.setdefault(key, (f, behind))
    out[keys_of(final)] = (final, 0.0)
    return list(out.values())


def ranking_of(
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    foreign: float,
    alike: Collection[EffectKeys] = (),
) -> tuple[Ranked, ...]:
    """Effects by their probability, shared among explanations that the records hardly tell apart.

    Args:
        fits: All fitted hypotheses.
        final: The one that is named.
        foreign: Probability that something outside the catalogue is the cause.
        alike: Explanations that predict as well.
    """
    rivals = _rivals(fits, final, alike)
    weights = np.exp([-behind for _, behind in rivals])
    weights = (1.0 - foreign) * weights / weights.sum()
    total: dict[tuple[str, str], float] = {}
    for (f, _), weight in zip(rivals, weights, strict=True):
        for placed in f.hypothesis:
            total[placed.key] = total.get(placed.key, 0.0) + float(weight)
    ordered = sorted(total.items(), key=lambda item: -item[1])
    return tuple(Ranked(name, where, probability) for (name, where), probability in ordered)


def closest_rival(
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    settings: JudgementSettings,
    alike: Collection[EffectKeys] = (),
) -> ArticulatedFit | None:
    """The likeliest other explanation of as many effects that the records cannot tell from the final one; None where they can."""
    near = [
        (f, behind)
        for f, behind in _rivals(fits, final, alike)
        if f is not final and behind <= settings.rival
    ]
    return min(near, key=lambda entry: entry[1])[0] if near else None


def _sets(
    fits: Sequence[ArticulatedFit],
    final: ArticulatedFit,
    settings: JudgementSettings,
    alike: Collection[EffectKeys],
) -> tuple[tuple[str, ...], ...]:
    own = {placed.key for placed in final.hypothesis}
    sets: dict[str, set[str]] = {}
    for f, behind in _rivals(fits, final, alike):
        theirs = {placed.key for placed in f.hypothesis}
        lost, gained = own - theirs, theirs - own
        names = {name for name, _ in lost}, {name for name, _ in gained}
        if (
            behind <= settings.rival
            and (len(lost) == 1 or frozenset(theirs) in alike)
            and names[0] != names[1]
        ):
            (mine,), (other,) = names
            sets.setdefault(mine, {mine}).add(other)
    return tuple(tuple(sorted(entry)) for entry in sets.values())


def _named(
    problem: ArticulatedProblem,
    final: ArticulatedFit,
    k: int,
    share: tuple[float, tuple[float, float]],
    probability: float,
) -> NamedEffect:
    placed = final.hypothesis[k]
    at = len(problem.nominal) + sum(len(p.effect.parameters) for p in final.hypothesis[:k])
    eta = final.vector[at : at + len(placed.effect.parameters)]
    std = np.sqrt(np.maximum(np.diag(final.covariance)[at : at + len(eta)], 0.0))
    values = placed_values(placed, eta)
    joint = problem.joints[placed.joint]
    # runs that have to be corrected follow no law as closely as their slope at the best fit says; nor are sensors' gains known to better
    least = problem.settings.likelihood.error.least if problem.softness else 0.0
    estimates = {
        p.name: Estimate(
            float(values[p.name]),
            max(
                float(abs(p.slope(float(e), placed.scales)) * s),
                0.0 if p.fixed else least * abs(float(values[p.name])),
            ),
            placed.effect.unit(p, joint.unit, input_of(problem.case, joint).unit),
        )
        for p, e, s in zip(placed.effect.parameters, eta, std, strict=True)
    }
    return NamedEffect(
        name=placed.effect.name,
        where=placed.where,
        probability=probability,
        parameters=estimates,
        channel=joint.name,
        equation=placed.effect.equation,
        closed=share[0],
        closed_ci95=share[1],
    )


def model_numbers(problem: ArticulatedProblem, final: ArticulatedFit) -> tuple[NominalEstimate, ...]:
    """The nominal parameters as a fit has them, what parts of one type have in common counted in."""

    def estimate(i: int, p: Nominal) -> NominalEstimate:
        moved, slopes = p.deviation(final.vector, i), p.slopes(final.vector, i)
        at, slope = list(slopes), np.array(list(slopes.values()))
        std = float(np.sqrt(max(slope @ final.covariance[np.ix_(at, at)] @ slope, 0.0)))
        return NominalEstimate(
            p.name, p.value + moved, std, p.value, p.stated_std, p.sigmas(final.vector, i), p.stated_factor
        )

    return tuple(estimate(i, p) for i, p in enumerate(problem.nominal) if not p.of_type)
