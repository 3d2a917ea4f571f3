"""The two regimes: noise where it explains what is left, the error of the model where it does not.

Where the noise is stated, explanations are searched by it first. What reaches it, without moving a nominal parameter far outside what was
stated of it, is judged by evidence, doubted by free forces and by the judging records, and stays as it is. What does not, and is no
single free force either, is searched again, weighed by the error of the model (`coarse_finding`); so is everything where no noise is
stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.initial_motion import with_starts_found
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.judgement import posterior as evidence
from bench.discrepancy.judgement.coarse_finding import coarse_finding
from bench.discrepancy.judgement.coarse_search import coarse_explanations
from bench.discrepancy.judgement.finalists import bounded, strained
from bench.discrepancy.judgement.finding import Finding
from bench.discrepancy.judgement.nonparametric_rival import Rival, likelier_force
from bench.discrepancy.judgement.predictive_check import contradicted
from bench.discrepancy.likelihood.model_error import ModelInadequacy
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.search.explain import explain
from bench.discrepancy.search.explanation import Explanation, nothing_left_first
from bench.discrepancy.search.load_interpolation import promising_readings
from bench.discrepancy.search.varied_size import differs_in_vain
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings
from bench.progress import Tell


@dataclass(frozen=True)
class How:
    """How a case is searched.

    Attributes:
        catalogue: Effects to consider.
        most: Largest number of effects named together.
        progress: Called with a line of text at every stage.
        deadline: When no further stage is begun.
        settings: Thresholds of the diagnosis.
    """

    catalogue: Sequence[Effect]
    most: int = 3
    progress: Tell = lambda text: None
    deadline: Deadline = NEVER
    settings: DiagnosisSettings = DEFAULT


def found_of(case: Case, how: How, rng: np.random.Generator) -> tuple[Case, Finding]:
    """What is found by the stated noise where that explains what is left, else by the error of the model.

    Args:
        case: The case.
        how: How it is searched.
        rng: For draws and bootstraps.

    Returns:
        The case with what its explanations tell of things that nobody stated, and what was found.
    """

    few = replace(how, most=min(how.most, how.settings.judgement.reference_effects))

    def search(
        case: Case, error: ModelInadequacy, known: Sequence[Explanation]
    ) -> tuple[Case, list[Explanation]]:
        small = [e for e in known if len(e.hypothesis) <= few.most and not differs_in_vain(e, known)]
        return _explained(case, few, error, small)

    known: list[Explanation] = []
    if Problem(
        case, structure_of(case, settings=how.settings), case.identification, settings=how.settings
    ).noise_stated:
        # half the time for either regime
        case, known = _explained(case, replace(how, deadline=how.deadline.part(0.5)))
        sharp = _sharp(case, believable(known), how, rng)
        outside = sharp.rival is not None and sharp.rival.explanation.consistent
        believed = sharp.kind != "unknown" and not strained(
            sharp.explanations[0], how.settings.judgement.coarse.within
        )
        if believed or outside or sharp.doubt:
            return case, sharp
    how.progress("weighed by the error of the model")
    case, explanations = coarse_explanations(case, search, known, how.deadline, settings=how.settings)
    problem = Problem(
        case, structure_of(case, settings=how.settings), case.identification, settings=how.settings
    )
    return case, coarse_finding(case, problem, explanations, rng, how.deadline)


def believable(explanations: Sequence[Explanation]) -> list[Explanation]:
    """Explanations whose nominal parameters stay where they are believed to be, the best first; those far behind as they are.

    A parameter may go as far as the records ask while effects are searched. What would be named leaves it within its bounds, and so
    does what that is held against: else no error of the parameter is ever better than the parameter in its place.
    """
    settings, best = explanations[0].settings.judgement.coarse, explanations[0].log_posterior
    near = (e for e in explanations if not e.hypothesis or e.log_posterior > best - settings.reach)
    far_off = {e for e in near if strained(e, settings.within)}
    if not far_off:
        return list(explanations)
    found = [bounded(e, settings.within) if e in far_off else e for e in explanations]
    return nothing_left_first(sorted(found, key=lambda e: -e.log_posterior))


def _sharp(case: Case, explanations: list[Explanation], how: How, rng: np.random.Generator) -> Finding:
    """What is found by the stated noise."""
    problem = Problem(
        case,
        structure_of(case, settings=explanations[0].settings),
        case.identification,
        settings=explanations[0].settings,
    )
    best = explanations[0]
    kind, probabilities = evidence.judge(explanations)
    doubt, rival = "", None
    if kind != "none" and how.deadline.allows("free forces in place of the laws"):
        how.progress(f"doubts about {names(best.hypothesis)}")
        rival = likelier_force(explanations)
    if kind == "effect":
        doubt = _doubt(case, problem, best, rival, rng)
    if doubt:
        kind, probabilities = "unknown", evidence.outside_the_catalogue(how.settings.judgement)
    words = evidence.plain_words(kind, explanations, doubt=doubt)
    if rival is not None and not doubt and rival.explanation.consistent:
        words += evidence.enough(rival.closure)
    return Finding(
        kind=kind,
        probabilities=probabilities,
        explanations=tuple(explanations),
        named=evidence.named(explanations) if kind == "effect" else (),
        ranking=evidence.ranking(explanations),
        indistinguishable=evidence.indistinguishable(explanations),
        words=words,
        rival=rival,
        doubt=doubt,
    )


def _explained(
    case: Case, how: How, error: ModelInadequacy | None = None, seeds: Sequence[Explanation] = ()
) -> tuple[Case, list[Explanation]]:
    """The explanations of a case, and the case with what they tell of things that nobody stated: its loads and its starts."""

    def explanations_of(case: Case) -> list[Explanation]:
        return explain(
            case,
            how.catalogue,
            most=how.most,
            progress=how.progress,
            error=error,
            deadline=how.deadline,
            seeds=seeds,
            settings=how.settings,
        )

    explanations = explanations_of(case)
    for read in promising_readings(case, explanations):
        if not how.deadline.allows("other readings of the loads between their samples"):
            break
        how.progress(f"once more, the loads read as {read.load_interpolation}")
        again = explanations_of(read)
        if again[0].log_posterior > explanations[0].log_posterior:
            case, explanations = read, again
            break
    started = with_starts_found(case, explanations[0].predict, settings=how.settings)
    if any(a.at_rest != b.at_rest for a, b in zip(case.identification, started.identification, strict=True)):
        how.progress("once more, from the initial states estimated")
        explanations = explanations_of(started)
    return started, explanations


def _doubt(
    case: Case, problem: Problem, best: Explanation, rival: Rival | None, rng: np.random.Generator
) -> str:
    """What speaks against an explanation that leaves nothing but noise; empty where nothing does."""
    if rival is not None:
        return evidence.outdone(rival.closure)
    return evidence.FAILS if contradicted(case, problem, best, rng) else ""
