"""A case of which the error of the model decides: its explanations searched again by that error, weighed, and put into words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.fitting.goodness_of_fit import consistent, names
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.judgement import posterior as evidence
from bench.discrepancy.judgement.coarse import Judged, judge, kinds_of
from bench.discrepancy.judgement.finding import Finding
from bench.discrepancy.judgement.nonparametric_rival import Rival, likelier_force
from bench.discrepancy.likelihood.model_error import own_noise
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.prediction.discrepancies import Discrepancies
from bench.discrepancy.screening.score_test import lack_of_fit
from bench.discrepancy.search.explanation import Explanation, nominal_alone
from bench.discrepancy.verdict import Ranked, VerdictKind


def coarse_finding(
    case: Case,
    problem: Problem,
    explanations: Sequence[Explanation],
    rng: np.random.Generator,
    deadline: Deadline = NEVER,
) -> Finding:
    """Weigh explanations by prediction and say what is missing.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom.
        explanations: Weighed by the error of the model, by decreasing posterior.
        rng: For bootstraps.
        deadline: When nothing is doubted any more.
    """
    factors = _noise_over_stated(problem, explanations[0])
    threshold = problem.settings.judgement.noise_understated
    understated = louder_than_stated(factors, threshold)
    judged = judge(case, problem, explanations, rng, trusted=problem.noise_stated and not understated)
    chosen, nearest = judged.chosen.explanation, _nearest(judged)
    probabilities = _marginal(judged)
    untouched = not chosen.hypothesis and not judged.vetoed
    noise = untouched and _explained_by_noise(problem, factors)
    understated = louder_than_stated(factors, 1.0) if noise else understated
    right = untouched and not noise and _right_as_a_model_can_be(problem, judged, factors)
    kind = "none" if noise or right else _kind(problem, judged)
    doubted = kind == "effect" and deadline.allows("free forces in place of the laws")
    nothing = next(entry for entry in judged.found if not entry.explanation.hypothesis)
    rival = _rival(judged.known, chosen, nothing.explanation) if doubted else None
    kind = "unknown" if rival else kind
    words = _words(kind, judged, nearest, rival, stated=problem.noise_stated)
    words = NOISE_ALONE if noise else RIGHT if right else words
    least = problem.settings.likelihood.error.least  # the gains of sensors are known to no better
    first = judged.chosen if kind == "effect" else nothing
    rest = sorted(
        (pair for pair in zip(judged.weights, judged.found, strict=True) if pair[1] is not first),
        key=lambda pair: -pair[0],
    )
    return Finding(
        kind=kind,
        probabilities=_probabilities(kind, judged),
        explanations=(first.explanation, *(entry.explanation for _, entry in rest)),
        named=evidence.effects_of(chosen, probabilities, least) if kind == "effect" else (),
        ranking=tuple(Ranked(*key, p) for key, p in sorted(probabilities.items(), key=lambda item: -item[1])),
        indistinguishable=_sets(judged),
        words=words,
        rival=rival,
        nearest=evidence.effects_of(nearest, probabilities, least) if kind == "unknown" else (),
        closest=nearest if kind == "unknown" and nearest.hypothesis else None,
        notes=understated,
        coarse=True,
    )


def refusal(known: Discrepancies, nearest: Explanation, nothing: Explanation) -> str:
    """Why the judging records refuse an explanation, in words.

    Args:
        known: What explanations leave of the records.
        nearest: The explanation.
        nothing: The nominal model, its parameters re-estimated.
    """
    if known.harm(nearest, nothing) > 1.0:
        return (
            "but leaves more of the judging records than the nominal model with its parameters re-estimated"
        )
    if known.left(nearest, nothing) >= 1.0:
        return "but does not shrink the discrepancy of the judging records"
    return "but shrinks the discrepancy of the judging records by less than what is named has to"


def _kind(problem: Problem, judged: Judged) -> VerdictKind:
    """The verdict."""
    if judged.chosen.explanation.hypothesis:
        # that which rivals of other families explain as well is something, and nobody can say what kind of thing
        return "effect" if judged.agreed >= judged.settings.kind else "unknown"
    # noise that is stated and is not all that is left is something that is missing, whatever it be
    return "unknown" if problem.noise_stated or judged.missing else "none"


def _rival(known: Discrepancies, chosen: Explanation, nothing: Explanation) -> Rival | None:
    """A free force in place of what would be named, where that leaves more of the judging records than a right model does: laws may be
    bent to what no catalogue holds. It has to be plainly likelier, and to shrink the judging records' discrepancy as a name has to."""
    settings = chosen.settings
    if known.beyond_noise(chosen) <= settings.likelihood.error.crude:
        return None
    rival = likelier_force([chosen], margin=settings.judgement.coarse.telling)
    part = settings.judgement.coarse.pays
    return rival if rival is not None and known.pays(rival.explanation, nothing, part) else None


def _probabilities(kind: VerdictKind, judged: Judged) -> dict[str, float]:
    """Probabilities of the verdicts."""
    if kind == "unknown":
        return {"effect": judged.settings.outside, "none": 0.0, "unknown": 1.0 - judged.settings.outside}
    pairs = zip(judged.weights, judged.found, strict=True)
    nothing = float(sum(weight for weight, entry in pairs if not entry.explanation.hypothesis))
    outside = judged.outside if kind == "effect" else judged.settings.outside
    known = 1.0 - outside
    return {"effect": known * (1.0 - nothing), "none": known * nothing, "unknown": outside}


def _nearest(judged: Judged) -> Explanation:
    """The likeliest explanation that has an effect; the chosen one where there is none."""
    pairs = sorted(zip(judged.weights, judged.found, strict=True), key=lambda pair: -pair[0])
    return next((e.explanation for _, e in pairs if e.explanation.hypothesis), judged.chosen.explanation)


def _noise_over_stated(problem: Problem, best: Explanation) -> dict[str, float]:
    """Factor by which every channel's noise is at least larger than stated: what is left nearly everywhere in its spectrum."""
    settings = problem.settings.judgement
    error = best.parts[0][0].error
    factors = {}
    for c, name in enumerate(problem.structure.channels):
        if error is None or not problem.case.channel(name).noise_std or problem.windowed:
            continue
        least = [
            np.quantile(error.power[data.record.name, name] / own_noise(data)[:, c], settings.quietest)
            for data in problem.data
        ]
        factors[name] = float(np.sqrt(1.0 + min(least)))
    return factors


def louder_than_stated(factors: Mapping[str, float], threshold: float) -> tuple[str, ...]:
    """Channels whose noise is larger than stated by more than a factor, in words."""
    return tuple(
        f"the noise of '{name}' is larger than stated, by a factor of {factor:.2g}: hardly anywhere in its spectrum does an "
        "explanation leave less; measure it at rest"
        for name, factor in factors.items()
        if factor > threshold
    )


def _explained_by_noise(problem: Problem, factors: Mapping[str, float]) -> bool:
    """Whether the nominal model explains the records once the noise is as large as their spectra show nearly everywhere."""
    if not problem.noise_stated or not any(factor > 1.0 for factor in factors.values()):
        return False
    louder, fitted = _with_louder_noise(problem, factors)
    return consistent(fitted) and not lack_of_fit(louder, fitted).significant(0.0)


def _right_as_a_model_can_be(problem: Problem, judged: Judged, factors: Mapping[str, float]) -> bool:
    """Whether the nominal model is off by no more than sensors are calibrated to, most of that all over the spectrum of every channel, and
    by nothing of which a free force, told from noise as large as what is left, would take a material part."""
    if judged.off or not problem.noise_stated or problem.windowed:
        return False
    channels, alone = problem.structure.channels, judged.chosen.explanation
    runs = [alone.predict(record) for record in problem.records]
    left = [
        problem.responses_of(record) - np.column_stack([run[name] for name in channels])
        for record, run in zip(problem.records, runs, strict=True)
    ]
    whole = np.sqrt(np.mean(np.concatenate(left) ** 2, axis=0)) / problem.noise
    everywhere = np.array([factors.get(name, 0.0) for name in channels])
    if np.any(everywhere**2 < problem.settings.judgement.everywhere * whole**2):
        return False
    louder, fitted = _with_louder_noise(problem, dict(zip(channels, whole.tolist(), strict=True)))
    lack = lack_of_fit(louder, fitted)
    return lack.gain - lack.expected < judged.settings.material * fitted.chi2


def _with_louder_noise(problem: Problem, factors: Mapping[str, float]) -> tuple[Problem, Fit]:
    """A problem of the same records whose channels are noisier than stated by some factors, and the nominal model fitted to it."""
    channels = tuple(
        replace(c, noise_std=c.noise_std * factors.get(c.name, 1.0)) if c.noise_std else c
        for c in problem.case.channels
    )
    case = replace(problem.case, channels=channels)
    louder = Problem(case, problem.structure, case.identification, settings=problem.settings)
    start = np.zeros(len(louder.nominal))
    return louder, fit(louder, (), start=start, iterations=problem.settings.search.thorough)


NOISE_ALONE = (
    "Nothing is missing from the model: with its parameters re-estimated it leaves what looks like noise all over the spectrum, "
    "and that noise is larger than stated."
)


RIGHT = (
    "Nothing is missing that the records could tell: the model with its parameters re-estimated leaves more than the stated noise, "
    "but less than sensors are calibrated to and most of it all over the spectrum, and neither an effect of the catalogue nor a free "
    "force predicts the records better."
)


def _marginal(judged: Judged) -> dict[tuple[str, str], float]:
    """Probability that each (name, place) belongs to the truth."""
    total: dict[tuple[str, str], float] = {}
    others = judged.settings.outside if judged.vetoed else judged.outside
    for weight, entry in zip(judged.weights, judged.found, strict=True):
        for key in dict.fromkeys((p.effect.name, p.place.name) for p in entry.explanation.hypothesis):
            total[key] = total.get(key, 0.0) + (1.0 - judged.doubts.get(key, others)) * float(weight)
    return total


def _sets(judged: Judged) -> tuple[tuple[str, ...], ...]:
    """Names that may stand for one another in what was chosen."""
    chosen = judged.chosen.explanation
    own = {p.key: p for p in chosen.hypothesis}
    sets: dict[str, set[str]] = {}
    for entry in judged.alike:
        theirs = {p.key: p for p in entry.explanation.hypothesis}
        if not theirs or not own or entry is judged.chosen:
            continue
        lost = [p for key, p in own.items() if key not in theirs]
        gained = [p for key, p in theirs.items() if key not in own]
        if len(lost) != 1 or len(gained) != 1:
            lost, gained = list(chosen.hypothesis), list(entry.explanation.hypothesis)
        label, instead = (" + ".join(sorted(p.effect.name for p in part)) for part in (lost, gained))
        if label != instead:
            sets.setdefault(label, {label}).add(instead)
    return tuple(tuple(sorted(entry)) for entry in sets.values())


def _other_kinds(judged: Judged) -> list[str]:
    """Explanations of other kinds that do as well, in words."""
    own = kinds_of(judged.chosen.explanation)
    others = [
        names(entry.explanation.hypothesis)
        for entry in judged.alike
        if entry.explanation.hypothesis and kinds_of(entry.explanation) != own
    ]
    return list(dict.fromkeys(others))


def _words(
    kind: VerdictKind, judged: Judged, nearest: Explanation, rival: Rival | None, *, stated: bool
) -> str:
    chosen = judged.chosen.explanation
    others = _other_kinds(judged)
    if kind == "effect":
        return (
            f"Missing from the model: {names(chosen.hypothesis)}. What is left is more than the stated noise, or no noise is stated: "
            "the model stays wrong in small ways, and explanations were weighed by what they predict of blocks that they did not see."
            + (
                f" What kind of thing it is stays open: {', or '.join(others)} would do as well."
                if others
                else ""
            )
        )
    if kind == "none":
        return "No effect of the catalogue predicts the records better than the nominal model does with its parameters re-estimated."
    if not nearest.hypothesis:
        least = "the stated noise" if stated else "noise or the small errors of a right model would"
        return (
            f"The nominal model leaves more than {least}, and no effect of the catalogue predicts the records better than it does with "
            "its parameters re-estimated."
        )
    if chosen.hypothesis and rival is None:
        return (
            "Something is missing from the model, and what kind of thing it is stays open: no family of effects is likelier than all "
            f"others together. Nearest come {', and '.join([names(chosen.hypothesis), *others])}."
        )
    fate = (
        evidence.likelier(rival.closure)
        if rival
        else refusal(judged.known, nearest, nominal_alone([entry.explanation for entry in judged.found]))
        if judged.vetoed
        else "but does not predict the records better than the nominal model does with its parameters re-estimated"
    )
    return (
        "Something is missing from the model, and no catalogued effect is it. "
        f"The nearest is {names(nearest.hypothesis)}, {fate}."
    )
