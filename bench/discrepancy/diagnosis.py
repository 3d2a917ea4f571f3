"""The diagnosis of a case: where the gap lies, which effect causes it, how far it shrinks.

The steps, each in its own module: read the case (`case`), find what it leaves unstated of its records (`moving_starts`,
`between_samples`), screen and fit the catalogue (`screen`, `fit`, `attribute`, `explain`), weigh the explanations (`evidence`),
doubt the best one (`free_rival`, `contradiction`), run the judging records with each (`shrink`), and say where the residuals of
the nominal model gather (`locate`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from bench.discrepancy.case.case import Case, read_case
from bench.discrepancy.case.idle_loads import idle_notes, without_idle_noise
from bench.discrepancy.case.schema import check_units
from bench.discrepancy.checks.data_quality import notes, refuse
from bench.discrepancy.checks.initial_motion import with_starts_found
from bench.discrepancy.checks.quantisation import recorded
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.effects.nonparametric import CLOSURES
from bench.discrepancy.fitting.initial_state_fit import start_warnings
from bench.discrepancy.judgement import posterior as evidence
from bench.discrepancy.judgement.nonparametric_rival import Rival, likelier_force
from bench.discrepancy.judgement.predictive_check import contradicted
from bench.discrepancy.judgement.validation_discrepancy import gaps, nominal_prediction
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.localise import Whereabouts, locate
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.next_test.discriminating_excitation import separate, told_apart
from bench.discrepancy.search.explain import Explanation, close, explain, nominal_alone
from bench.discrepancy.search.fits import names
from bench.discrepancy.search.forward_selection import STALLED
from bench.discrepancy.search.load_interpolation import promising_readings, reading_notes
from bench.discrepancy.verdict import Gap, Kind, NamedEffect, Ranked, Verdict
from bench.errors import UnknownNameError

SEED = 20060501
"""Seed of the bootstrap where no generator is given, so that a diagnosis repeats exactly."""

WORSE = 1.1
"""Gap with a closure over that without, on any judged coordinate, from which the closure is withdrawn."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis with everything that its report needs.

    Attributes:
        case: The case.
        problem: Records and priors on all degrees of freedom.
        explanations: All fitted explanations by decreasing posterior.
        verdict: The verdict.
        final: The explanation behind `verdict.gap.after`: the best one, or for an unknown effect its closure; the nominal
            model with its parameters re-estimated where a closure predicts the judging records worse than that.
        where: Where the gap lies, with the maps behind `verdict.locations`.
    """

    case: Case
    problem: Problem
    explanations: tuple[Explanation, ...]
    verdict: Verdict
    final: Explanation
    where: Whereabouts


def diagnose(
    case: Case,
    *,
    catalogue: Sequence[Effect] = CATALOGUE,
    exclude: Collection[str] = (),
    most: int = 3,
    rng: np.random.Generator | None = None,
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """Diagnose a case.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        exclude: Names of effects to leave out of the catalogue.
        most: Largest number of effects named together.
        rng: For the bootstrap intervals; a fixed seed where None.
        progress: Called with a line of text at every stage.

    Raises:
        UnknownNameError: A name in `exclude` is not in the catalogue.
        RecordingError: The records cannot be used.
    """
    rng = np.random.default_rng(SEED) if rng is None else rng
    known = [effect.name for effect in catalogue]
    for name in exclude:
        if name not in known:
            raise UnknownNameError("effect", name, known)
    chosen = [effect for effect in catalogue if effect.name not in exclude]
    # fits run in threads of their own; threads of BLAS within them would only get in each other's way
    with threadpool_limits(1, user_api="blas"):
        return _diagnose(case, chosen, most, rng, progress)


def _diagnose(
    case: Case, catalogue: Sequence[Effect], most: int, rng: np.random.Generator, progress: Progress
) -> Diagnosis:
    began = time.perf_counter()
    progress("looking at the records")
    check_units(case)
    told = case = with_starts_found(case)
    refuse(Problem(case, structure_of(case), case.identification))
    quiet = without_idle_noise(told)
    case, explanations = _explained(quiet, catalogue, most, progress)
    problem = Problem(case, structure_of(case), case.identification)
    best = explanations[0]
    kind, probabilities = evidence.judge(explanations)
    doubt, rival = "", None
    if kind != "none":
        progress(f"doubts about {names(best.hypothesis)}")
        rival = likelier_force(explanations)
    if kind == "effect":
        doubt = _doubt(case, problem, best, rival, rng)
    if doubt:
        kind, probabilities = "unknown", evidence.OUTSIDE_THE_CATALOGUE
    seen, fitted = recorded(problem, catalogue), kind
    words = evidence.plain_words(kind, explanations, doubt=doubt)
    if rival is not None and not doubt and rival.explanation.consistent:
        words += evidence.enough(rival.closure)
    if seen and kind == "none":
        kind = "effect"
        probabilities |= {"effect": 1.0 - probabilities["unknown"], "none": 0.0}
    progress("gap on the judging records")
    final, closure, found = _shrunk(case, problem, explanations, kind, rival, rng)
    widest = max(found, key=lambda gap: gap.before / max(gap.noise_floor, 1e-12))
    if kind == "unknown" and not doubt:
        words += evidence.closes(names(evidence.nearest(explanations).hypothesis), widest)
    where = locate(
        problem,
        nominal_alone(explanations),
        rival.explanation if rival else best,
        borne_out=rival is not None or kind == "effect",
        unknown=kind == "unknown",
    )
    verdict = Verdict(
        verdict=kind,
        named=(*evidence.named(explanations), *seen) if kind == "effect" else (),
        ranking=(*(Ranked(e.name, e.where, e.probability) for e in seen), *evidence.ranking(explanations)),
        indistinguishable=evidence.indistinguishable(explanations) if kind != "unknown" else (),
        locations=where.locations,
        gap=widest,
        gaps=found,
        probabilities=probabilities,
        explanation=_told(words, seen),
        warnings=(
            *notes(case, problem),
            *idle_notes(told, quiet),
            *reading_notes(quiet, case),
            *start_warnings(problem, (*case.identification, *case.validation)),
        ),
        closure=closure,
        next_excitation=(
            separate(problem, explanations) if fitted == "effect" else told_apart(problem, fitted, catalogue)
        ),
        splits=where.splits,
        seconds=time.perf_counter() - began,
    )
    return Diagnosis(case, problem, tuple(explanations), verdict, final, where)


def _explained(
    case: Case, catalogue: Sequence[Effect], most: int, progress: Progress
) -> tuple[Case, list[Explanation]]:
    """The explanations of a case, and the case with what they tell of things that nobody stated: its loads and its starts."""
    explanations = explain(case, catalogue, most=most, progress=progress)
    for read in promising_readings(case, explanations):
        progress(f"once more, the loads read as {read.load_interpolation}")
        again = explain(read, catalogue, most=most, progress=progress)
        if again[0].log_posterior > explanations[0].log_posterior:
            case, explanations = read, again
            break
    started = with_starts_found(case, explanations[0].predict)
    if any(a.at_rest != b.at_rest for a, b in zip(case.identification, started.identification, strict=True)):
        progress("once more, from the initial states estimated")
        explanations = explain(started, catalogue, most=most, progress=progress)
    return started, explanations


def _doubt(
    case: Case, problem: Problem, best: Explanation, rival: Rival | None, rng: np.random.Generator
) -> str:
    """What speaks against an explanation that leaves nothing but noise; empty where nothing does."""
    if rival is not None:
        return evidence.outdone(rival.closure)
    return evidence.FAILS if contradicted(case, problem, best, rng) else ""


def _shrunk(
    case: Case,
    problem: Problem,
    explanations: Sequence[Explanation],
    kind: Kind,
    rival: Rival | None,
    rng: np.random.Generator,
) -> tuple[Explanation, str, tuple[Gap, ...]]:
    """How far the gap shrinks: the explanation behind `Gap.after`, the closure in it if any, and the gaps."""
    best, nothing = explanations[0], nominal_alone(explanations)
    final, closure = best, ""
    stages = [("nominal", nominal_prediction(problem)), ("parameters only", nothing.predict)]
    stages += [(label, e.predict) for label, e in _path(explanations)]
    if kind == "unknown":
        final, closure = _closed(best, nothing, rival)
        nearest = evidence.nearest(explanations)
        label = names(nearest.hypothesis)
        stages += [(label, nearest.predict)] if label not in dict(stages) else []
    stages.append((names(final.hypothesis), final.predict))
    found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    if kind == "unknown" and any(gap.after > WORSE * gap.parameters_only for gap in found):
        # what imitates an unknown force on some records can be worse than nothing on others: nobody should build that in
        final, closure = nothing, ""
        stages[-1] = ("no closure helps", nothing.predict)
        found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    return final, closure, found


def _closed(best: Explanation, nothing: Explanation, rival: Rival | None) -> tuple[Explanation, str]:
    """What a free model makes of an unknown gap: alone where that explains the records, else the likelier of alone and on top."""
    if rival is not None and rival.explanation.consistent:
        return rival
    closed = close(best, nothing, CLOSURES)
    if rival is None or rival.explanation.log_posterior < closed[0].log_posterior:
        return closed
    return rival if rival.explanation.reduced - 1.0 < STALLED * (best.reduced - 1.0) else closed


def _model(explanation: Explanation) -> tuple[Hypothesis, np.ndarray] | None:
    """Effects and vector of an explanation in one part; None where it has several."""
    fits = [fitted for _, fitted in explanation.parts]
    return (fits[0].hypothesis, fits[0].vector) if len(fits) == 1 else None


def _told(words: str, seen: Sequence[NamedEffect]) -> str:
    """The verdict in words, with the effects that were read off the samples."""
    told = "".join(
        f" '{e.channel}' is recorded in steps of {e.parameters['step'].value:.4g} {e.parameters['step'].unit}, "
        f"coarser than its noise: {e.name}."
        for e in seen
    )
    return words + told


def diagnose_folder(folder: str | Path, **options) -> Diagnosis:
    """Diagnose the case in a folder; the options are those of `diagnose`."""
    return diagnose(read_case(folder), **options)


def _path(explanations: Sequence[Explanation]) -> list[tuple[str, Explanation]]:
    """Explanations that lead to the best one by adding its effects one by one, best first effect first."""
    target = {p.key for p in explanations[0].hypothesis}
    steps: list[tuple[str, Explanation]] = []
    reached: set[tuple[str, str, str]] = set()
    for size in range(1, len(target)):
        for e in explanations:
            keys = {p.key for p in e.hypothesis}
            if len(keys) == size and reached < keys < target:
                steps.append((names(e.hypothesis), e))
                reached = keys
                break
    return steps
