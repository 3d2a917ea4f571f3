"""From explanations to probabilities: verdict, ranking, and the sets that the records cannot tell apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from bench.discrepancy.effects.effect import unit_of
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.judgement.shares import percent
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.prediction.validation_discrepancy import (
    closed_share,
)
from bench.discrepancy.search.explanation import Explanation, nominal_alone, plainest
from bench.discrepancy.settings import DEFAULT, JudgementSettings
from bench.discrepancy.verdict import Estimate, Gap, NamedEffect, Ranked, VerdictKind

FAILS = "explains the records for identification and fails on those for judging"
"""Doubt about an explanation."""
SINGLE = {
    "free_displacement": "smooth force of the displacement",
    "free_velocity": "smooth force of the velocity",
    "free_surface": "smooth force of displacement and velocity",
    "free_memory": "force with a memory of its own",
    "damped_one_sided_stop": "stop that dissipates",
    "damped_gap": "gap whose contacts dissipate",
}
"""Closures in words, where one of them stands for all that is missing."""


def outdone(closure: str) -> str:
    """The doubt about an explanation that closures, their names joined by " + ", explain better."""
    return f"explains the records, but {_forces(closure)}, which no law of the catalogue describes, does so better"


def likelier(closure: str) -> str:
    """What speaks against the nearest explanation, weighed by the error of the model, if closures are likelier."""
    return f"but {_forces(closure)}, which no law of the catalogue describes, is likelier"


def enough(closure: str) -> str:
    """What closures, their names joined by " + ", do where no explanation by the catalogue reaches the noise."""
    return f" But {_forces(closure)} would: with nothing else it leaves nothing but noise."


def _forces(closure: str) -> str:
    return " and ".join(f"a single {SINGLE[name]}" for name in closure.split(" + "))


def nearest(explanations: Sequence[Explanation]) -> Explanation:
    """The explanation that comes nearest to what is unknown: where none reaches the noise, the plainest, not the likeliest."""
    best = explanations[0]
    plain = best if best.consistent else plainest(explanations)
    return plain if plain.hypothesis else best


def closes(label: str, gap: Gap, *, settings: JudgementSettings = DEFAULT.judgement) -> str:
    """How far the nearest explanation goes on the judging records, beyond what re-estimated parameters do; empty where not far.

    Args:
        label: Its effects as they stand among the gap's steps.
        gap: A gap of the case.
        settings: `JudgementSettings` of the diagnosis.
    """
    left = dict(gap.steps).get(label, math.inf)
    before = min(gap.before, gap.parameters_only)
    share = closed_share(before, left, gap.noise_floor, settings=settings)
    if share < settings.mostly or before <= settings.at_the_noise * gap.noise_floor:
        return ""
    return (
        f" Of the gap of the judging records that re-estimated parameters leave, {label} closes {percent(share)} all the same: it is much "
        "of what is missing, or much like it."
    )


def weights(explanations: Sequence[Explanation]) -> np.ndarray:
    """Posterior probabilities of explanations (n,), as if one of them were true; the first one's rivals are less likely.

    What is likelier than the first was passed over because free models still find a force in it.
    """
    logs = np.array([e.log_posterior for e in explanations])
    logs[logs > logs[0]] = -np.inf
    if not explanations[0].scaled:
        # The noise is whatever the first explanation leaves, and hardly more independent than the visits to a state;
        # what has more parameters was passed over because it is not much better.
        best = explanations[0]
        logs = np.array(
            [
                -0.5 * explanations[0].settings.judgement.independent * e.reduced / best.reduced
                if e.n_free <= best.n_free
                else -np.inf
                for e in explanations
            ]
        )
    shares = np.exp(logs - logs.max())
    return shares / shares.sum()


def outside_the_catalogue(settings: JudgementSettings) -> dict[str, float]:
    """Probabilities of the verdicts where there is a doubt about an explanation that leaves nothing but noise."""
    return {"effect": settings.within, "none": 0.0, "unknown": 1.0 - settings.within}


def judge(explanations: Sequence[Explanation]) -> tuple[VerdictKind, dict[str, float]]:
    """Verdict, and the probabilities of "effect", "none" and "unknown"."""
    best = explanations[0]
    if not best.noise_stated:
        return _judge_unscaled(explanations)
    shares = weights(explanations)
    none = float(sum(w for w, e in zip(shares, explanations, strict=True) if not e.hypothesis))
    complete = best.consistent and not any(best.lacking(nominal_alone(explanations)))
    known = (
        1.0 - explanations[0].settings.judgement.outside
        if complete
        else explanations[0].settings.judgement.within
    )
    probabilities = {"effect": known * (1.0 - none), "none": known * none, "unknown": 1.0 - known}
    if not complete:
        return "unknown", probabilities
    return ("none" if not best.hypothesis else "effect"), probabilities


def _judge_unscaled(explanations: Sequence[Explanation]) -> tuple[VerdictKind, dict[str, float]]:
    """Verdict where the noise is not stated: by the part of the residual power that the best explanation takes away."""
    best = explanations[0]
    nothing = nominal_alone(explanations)
    explained = 1.0 - best.reduced / nothing.reduced
    if not best.hypothesis:
        return "none", {"effect": 0.0, "none": 1.0, "unknown": 0.0}
    probabilities = {"effect": explained, "none": 0.0, "unknown": 1.0 - explained}
    return ("effect" if explained > explanations[0].settings.judgement.mostly else "unknown"), probabilities


def marginal(explanations: Sequence[Explanation]) -> dict[tuple[str, str], float]:
    """Probability that each (name, place) belongs to the truth."""
    total: dict[tuple[str, str], float] = {}
    known = 1.0 - explanations[0].settings.judgement.outside if explanations[0].scaled else 1.0
    for share, explanation in zip(weights(explanations), explanations, strict=True):
        for key in dict.fromkeys((p.effect.name, p.place.name) for p in explanation.hypothesis):
            total[key] = total.get(key, 0.0) + known * float(share)
    return total


def ranking(explanations: Sequence[Explanation]) -> tuple[Ranked, ...]:
    """Effects by decreasing probability."""
    ordered = sorted(marginal(explanations).items(), key=lambda item: -item[1])
    return tuple(Ranked(name, where, probability) for (name, where), probability in ordered)


def indistinguishable(explanations: Sequence[Explanation]) -> tuple[tuple[str, ...], ...]:
    """Sets of effect names that may stand for one another in the best explanation.

    Where the records cannot tell how many effects there are, whole explanations stand for one another: "gap" and
    "gap + cubic_stiffness". The nominal model alone is not among them; the probability of "none" speaks for it.
    """
    best = explanations[0]
    if not best.hypothesis:
        return ()
    own = {p.key: p for p in best.hypothesis}
    sets: dict[str, set[str]] = {}
    for other in explanations[1:]:
        if not other.hypothesis or _behind(explanations, other) > explanations[0].settings.judgement.rival:
            continue
        theirs = {p.key: p for p in other.hypothesis}
        lost = [p for key, p in own.items() if key not in theirs]
        gained = [p for key, p in theirs.items() if key not in own]
        if len(lost) != 1 or len(gained) != 1:
            lost, gained = list(best.hypothesis), list(other.hypothesis)
        label, instead = (" + ".join(sorted(p.effect.name for p in part)) for part in (lost, gained))
        if label != instead:
            sets.setdefault(label, {label}).add(instead)
    return tuple(tuple(sorted(entry)) for entry in sets.values())


def _behind(explanations: Sequence[Explanation], other: Explanation) -> float:
    """Log odds of the best explanation against another."""
    shares = weights([explanations[0], other])
    return float(np.log(max(shares[0], 1e-300)) - np.log(max(shares[1], 1e-300)))


def named(explanations: Sequence[Explanation]) -> tuple[NamedEffect, ...]:
    """Effects of the best explanation with their parameters."""
    return effects_of(explanations[0], marginal(explanations))


BY_THE_CLOCK = ("s", "Hz")
"""Units of what the clock of a record tells, which is right to parts of a million."""


def effects_of(
    explanation: Explanation, probabilities: Mapping[tuple[str, str], float], least: float = 0.0
) -> tuple[NamedEffect, ...]:
    """Effects of an explanation with their parameters, and their probabilities by (name, place).

    Args:
        explanation: Fitted.
        probabilities: By (name, place).
        least: Part of a parameter's value by which it is uncertain besides, whatever the records say: the gains of the sensors, which no
            time and no frequency depends on.
    """
    out = []
    for problem, fitted in explanation.parts:
        deviations = np.sqrt(np.diag(fitted.covariance))
        start = len(problem.nominal)
        for placed in fitted.hypothesis:
            stop = start + len(placed.effect.parameters)
            out.append(
                named_effect(
                    problem, placed, fitted.vector[start:stop], deviations[start:stop], probabilities, least
                )
            )
            start = stop
    return tuple(out)


def named_effect(
    problem,
    placed: Placed,
    eta: np.ndarray,
    std: np.ndarray,
    probabilities: Mapping[tuple[str, str], float],
    least: float = 0.0,
) -> NamedEffect:
    """An effect at a place with its parameters (n,), their deviations, and its probability by (name, place), one where that is not told.

    For `least`, see `effects_of`.
    """
    effect, place = placed.effect.on(problem.case.load_interpolation), placed.place
    scales = problem.scales_of(placed)
    estimates = {}
    for parameter, value, deviation in zip(effect.parameters, eta, std, strict=True):
        unit = parameter.unit or unit_of(parameter.scale, place.position_unit, place.force_unit)
        if placed.source:
            unit = "/".join(f"({problem.case.channel(c).unit})" for c in (placed.channel, placed.source))
        estimate = parameter.value(value, scales)
        besides = 0.0 if unit in BY_THE_CLOCK else least * estimate
        spread = math.hypot(abs(parameter.slope(value, scales)) * deviation, besides)
        estimates[parameter.name] = Estimate(estimate, 0.0 if parameter.fixed else spread, unit)
    theta = tuple(float(x) for x in effect.kernel_theta(eta, scales)) if effect.law is not None else ()
    return NamedEffect(
        name=effect.name,
        where=place.name,
        probability=probabilities.get((effect.name, place.name), 1.0),
        parameters=estimates,
        channel=placed.target,
        equation=effect.equation,
        variant=effect.variant,
        law=effect.law.name if effect.law else "",
        theta=theta,
    )


def _short_of_it(explanations: Sequence[Explanation]) -> str:
    best, near = explanations[0], nearest(explanations)
    if not best.noise_stated or not best.consistent:
        return (
            "and no catalogued effect brings the records down to their noise. "
            f"The nearest is {names(near.hypothesis)}, which leaves {near.reduced:.3g} times the power of the noise."
        )
    lack = min(best.lacks, key=lambda lack: lack.p_value)
    free = {
        "memory": "with a memory of its own",
        "product": "of displacement and velocity",
        "any": "of any kind",
    }
    return (
        f"and no catalogued effect is it: {names(near.hypothesis)} comes near, "
        f"but a force {free.get(lack.model, f'of {lack.model}')} on top of it lowers chi-squared by {lack.gain:.0f}, "
        f"where noise would let it gain {lack.expected:.0f}."
    )


def plain_words(kind: VerdictKind, explanations: Sequence[Explanation], *, doubt: str = "") -> str:
    """The verdict in a sentence or two.

    Args:
        kind: Verdict.
        explanations: All of them, the best first.
        doubt: What speaks against the best although it explains the records for identification; empty where nothing does.
    """
    best = explanations[0]
    if doubt:
        return f"Something is missing from the model, and no catalogued effect is it: {names(best.hypothesis)} {doubt}."
    if kind == "none":
        return (
            "The stated uncertainties and the noise explain the records; nothing is missing from the model."
        )
    if kind == "unknown":
        return f"Something is missing from the model, {_short_of_it(explanations)}"
    missing = f"Missing from the model: {names(best.hypothesis)}."
    if not best.noise_stated:
        nothing = nominal_alone(explanations)
        share = 100.0 * (1.0 - best.reduced / nothing.reduced)
        taken = f"It takes away {share:.3g} % of the power of the residuals"
        return f"{missing} {taken}; without the noise being stated nobody can say whether that is all."
    return f"{missing} With it the records are explained to within their noise."
