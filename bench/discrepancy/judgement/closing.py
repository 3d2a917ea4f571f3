"""What each named effect closes of the discrepancy, whether that is all, and where the nominal parameters have gone.

An effect closes the part of the judging records' discrepancy that comes back when it is taken out and everything else is fitted again, the
nominal parameters where they are believed to be, with an interval from blocks of these records, which chose nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.fitting.goodness_of_fit import key_of
from bench.discrepancy.judgement.finalists import bounded, without
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.prediction.validation_discrepancy import part_closed
from bench.discrepancy.search.explanation import Explanation, nominal_alone
from bench.discrepancy.settings import JudgementSettings
from bench.discrepancy.verdict import Gap, NamedEffect, NominalEstimate, Ranked

Probable = TypeVar("Probable", NamedEffect, Ranked)


def with_closed(
    case: Case,
    problem: Problem,
    named: Sequence[NamedEffect],
    explanations: Sequence[Explanation],
    rng: np.random.Generator,
) -> tuple[NamedEffect, ...]:
    """Named effects with what each of them closes, the one that closes most first.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom.
        named: Effects of the first explanation, in its order.
        explanations: All of them.
        rng: For the bootstrap.
    """
    within = explanations[0].settings.judgement.coarse.within
    best, nothing = (bounded(e, within) for e in (explanations[0], nominal_alone(explanations)))
    known = {key_of(e.hypothesis): e for e in explanations}
    out = []
    for i, (effect, placed) in enumerate(zip(named, best.hypothesis, strict=True)):
        rest = known.get(key_of(tuple(p for p in best.hypothesis if p is not placed)))
        rest = bounded(rest, within) if rest else nothing if len(best.hypothesis) == 1 else without(best, i)
        part = part_closed(case, problem, nothing.predict, rest.predict, best.predict, rng)
        out.append(replace(effect, closed=part.share, closed_ci95=part.ci95))
    return tuple(sorted(out, key=lambda effect: -effect.closed))


def as_borne_out(
    named: Sequence[NamedEffect], ranking: Sequence[Ranked], *, least: float = 0.0
) -> tuple[tuple[NamedEffect, ...], tuple[Ranked, ...]]:
    """Named effects and a ranking, in which what closes nothing of the judging records for sure is no surer than even.

    Noise that explains what several effects leave says that there is something behind each of them, but not that the catalogue holds it.
    A share whose interval reaches zero does not say so either, nor one that is smaller than what the effect that closes most would leave
    if its law, or the gain of a sensor, were off by as little as they are known to. That effect is as sure as it was, and so is what no
    judged coordinate shows: a sensor beside them.

    Args:
        named: Effects with their shares, the one that closes most first.
        ranking: Effects by decreasing probability.
        least: How well laws and gains are known, at best, as a part of what they make.
    """
    first, *further = named
    in_doubt = {
        (e.name, e.where)
        for e in further
        if e.closed != 0.0 and min(e.closed - least, e.closed_ci95[0]) <= 0.0
    }

    def even(entry: Probable) -> Probable:
        doubted = (entry.name, entry.where) in in_doubt
        return replace(entry, probability=min(entry.probability, 0.5)) if doubted else entry

    ordered = sorted(map(even, ranking), key=lambda entry: -entry.probability)
    return (first, *map(even, further)), tuple(ordered)


def nominal_estimates(explanation: Explanation) -> tuple[NominalEstimate, ...]:
    """The nominal parameters as an explanation has them."""
    out: dict[str, NominalEstimate] = {}
    for problem, fitted in explanation.parts:
        values, _ = problem.split(fitted.hypothesis, fitted.vector)
        deviations = np.sqrt(np.maximum(np.diag(fitted.covariance), 0.0))
        for i, name in enumerate(problem.structure.parameters[: problem.n_physical]):
            if problem.spread[i] > 0.0:
                out[name] = NominalEstimate(
                    name=name,
                    value=float(values[i]),
                    std=float(problem.spread[i] * deviations[i]),
                    stated=float(problem.nominal[i]),
                    stated_std=float(problem.spread[i]),
                    shift_in_std=float(fitted.vector[i]),
                )
    return tuple(out.values())


def complete(found: Sequence[Gap], *, sharp: bool, stated: bool, settings: JudgementSettings) -> bool:
    """Whether what an explanation leaves is noise.

    Args:
        found: Discrepancies of the judging records.
        sharp: Whether the stated noise explains what is left.
        stated: Whether the noise is stated: where it is and does not, more is left, and be it in channels that are not judged.
        settings: How near to noise counts as noise where none is stated.
    """
    return sharp or (
        not stated and all(gap.after <= settings.within_noise * gap.noise_floor for gap in found)
    )
