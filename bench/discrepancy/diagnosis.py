"""The diagnosis of a case: where the discrepancy lies, which effect causes it, how far it shrinks.

The steps, each in its own room: read the case (`case`), find what it leaves unstated of its records (`checks.initial_motion`,
`search.load_interpolation`), screen the catalogue and fit what is promising (`screening`, `fitting`, `search`), weigh the
explanations and doubt the best one (`judgement`), run the judging records with each (`prediction.validation_discrepancy`), and say
where the residuals of the nominal model gather (`localisation`). docs/architecture.md draws the rooms.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis, diagnose_articulated
from bench.discrepancy.articulated.recognition import applies, drives_only
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE as ARTICULATED
from bench.discrepancy.case.case import Case
from bench.discrepancy.case.idle_loads import idle_notes, without_idle_noise
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.checks.data_quality import notes, untried_points
from bench.discrepancy.checks.long_records import long_record_notes, thinned, with_beginnings
from bench.discrepancy.checks.quantisation import recorded
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.fitting.initial_state_fit import start_warnings
from bench.discrepancy.judgement import posterior as evidence
from bench.discrepancy.judgement.closing import as_borne_out, complete, nominal_estimates, with_closed
from bench.discrepancy.judgement.finding import Finding
from bench.discrepancy.judgement.stages import shrunk
from bench.discrepancy.judgement.two_regimes import How, Tell, found_of
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.localise import Whereabouts, locate
from bench.discrepancy.localisation.remainder import remainder
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.next_test.discriminating_excitation import separate, told_apart
from bench.discrepancy.numerics.deadline import Deadline
from bench.discrepancy.prediction.run_on import rest_of_records
from bench.discrepancy.search.explanation import Explanation, nominal_alone
from bench.discrepancy.search.load_interpolation import reading_notes
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings, changed
from bench.discrepancy.verdict import (
    Gap,
    NamedEffect,
    Ranked,
    Verdict,
    VerdictKind,
    far_off,
    of_runs,
    widest_of,
)
from bench.errors import BenchError, UnknownNameError

_Placed = TypeVar("_Placed", NamedEffect, Ranked)


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
        where: Where the discrepancy lies, with the maps behind `verdict.locations`.
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
    anyway: bool = False,
    rng: np.random.Generator | None = None,
    progress: Tell = lambda text: None,
    budget: float | None = None,
    settings: DiagnosisSettings = DEFAULT,
) -> Diagnosis | ArticulatedDiagnosis:
    """Diagnose a case; one of an articulated MJCF by `diagnose_articulated`, with the catalogue of joints, drives and encoders.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        exclude: Names of effects to leave out of the catalogue.
        most: Largest number of effects named together; of an articulated model, at one joint.
        anyway: Whether factors, signs and parts of the model that stand against a diagnosis are noted rather than refused.
        rng: For the bootstrap intervals; a fixed seed where None.
        progress: Called with a line of text at every stage.
        budget: Seconds after which nothing further is screened or fitted and fits end where they are; the verdict is then the best one
            so far, and its warnings say what was not tried. Those of the settings where None; `math.inf` for no end.
        settings: Thresholds, see docs/thresholds.md.

    Raises:
        UnknownNameError: A name in `exclude` is not in the catalogue.
        RecordingError: The records cannot be used.
        UnitError: A unit does not fit the model, or a channel is off by a factor or a sign that no missing force makes.
        ModelError: The model holds what a nominal simulation cannot, and the records reach it.
    """
    deadline = Deadline(settings.budget if budget is None else budget)
    if applies(case, settings=settings.articulated):
        with threadpool_limits(1, user_api="blas"):
            return diagnose_articulated(
                case,
                exclude=exclude,
                most=most,
                anyway=anyway,
                rng=rng,
                deadline=deadline,
                settings=settings,
                progress=progress,
            )
    rng = np.random.default_rng(settings.seed) if rng is None else rng
    known = [effect.name for effect in catalogue]
    for name in exclude:
        if name not in known and name not in {effect.name for effect in ARTICULATED}:
            raise UnknownNameError("effect", name, known)
    chosen = [effect for effect in catalogue if effect.name not in exclude]
    how = How(chosen, most, progress, deadline, settings)
    # fits run in threads of their own; threads of BLAS within them would only get in each other's way
    with threadpool_limits(1, user_api="blas"):
        found = _diagnose(case, how, rng, anyway)
        if deadline.skipped:
            found = replace(found, verdict=found.verdict.in_haste())
        return _by_drives(found, case, how, exclude=exclude, anyway=anyway, rng=rng) or found


def _by_drives(
    found: Diagnosis,
    case: Case,
    how: How,
    *,
    exclude: Collection[str],
    anyway: bool,
    rng: np.random.Generator,
) -> ArticulatedDiagnosis | None:
    """Diagnosis by the equations of drives and encoders, where no force on the joint explains the records and one of these does."""
    asked = "effects of drives and encoders"
    if (
        found.verdict.verdict == "none"
        or found.verdict.complete
        or not drives_only(case)
        or not how.deadline.allows(asked)
    ):
        return None
    how.progress(asked)
    try:
        other = diagnose_articulated(
            case,
            exclude=exclude,
            most=how.most,
            anyway=anyway,
            rng=rng,
            deadline=how.deadline,
            settings=how.settings,
            progress=how.progress,
        )
    except BenchError:  # admitted as a linear structure, with parts that the equations of drives leave out
        return None
    left, (before, after, _) = found.verdict.gap, of_runs(other.verdict.gap)
    # free runs of one kind in both: parts of what each began with are compared; a name is left for one that is nearer by far
    least = how.settings.judgement.coarse.most if found.verdict.named else 1.0
    nearer = after * left.before < least * left.after * before
    return other if other.verdict.verdict == "effect" and (other.verdict.complete or nearer) else None


def _diagnose(case: Case, how: How, rng: np.random.Generator, anyway: bool) -> Diagnosis:
    began, progress, catalogue = time.perf_counter(), how.progress, how.catalogue
    progress("looking at the records")
    told = _told_records(case, anyway=anyway, settings=how.settings)
    case, finding = found_of(with_beginnings(told.whole, settings=how.settings), how, rng)
    problem = Problem(
        case, structure_of(case, settings=how.settings), case.identification, settings=how.settings
    )
    explanations, rival, words = finding.explanations, finding.rival, finding.words
    seen = recorded(problem, catalogue)
    kind, probabilities = _kind(finding, seen)
    progress("gap on the judging records")
    closest = finding.closest or evidence.nearest(explanations)
    final, closure, found = shrunk(case, problem, explanations, kind, rival, rng, closest)
    widest = widest_of(found)
    if kind == "unknown" and not finding.doubt and closest.hypothesis:
        words += evidence.closes(names(closest.hypothesis), widest, settings=how.settings.judgement)
    where = locate(
        problem,
        nominal_alone(explanations),
        rival.explanation if rival else explanations[0],
        borne_out=rival is not None or kind == "effect",
        unknown=kind == "unknown",
    )
    named = with_closed(case, problem, finding.named, explanations, rng) if finding.named else ()
    ranking = finding.ranking
    if named and not finding.coarse:
        named, ranking = as_borne_out(named, ranking, least=problem.settings.likelihood.error.least)
    near = _nearest(case, problem, finding, closest, found, rng) if kind == "unknown" else {}
    ranked = (*(Ranked(e.name, e.where, e.probability) for e in seen), *ranking)
    stated, sharp, nominal = problem.noise_stated, not finding.coarse, nominal_estimates(final)
    judged = complete(found, sharp=sharp, stated=stated, settings=how.settings.judgement)
    verdict = Verdict(
        verdict=kind,
        named=_somewhere(problem, (*named, *seen)) if kind == "effect" else (),
        ranking=_somewhere(problem, ranked),
        indistinguishable=finding.indistinguishable if kind != "unknown" else (),
        locations=where.locations,
        gap=widest,
        gaps=found,
        probabilities=probabilities,
        explanation=_told(words, seen),
        warnings=(
            *told.admission,
            *how.deadline.untried,
            *finding.notes,
            *far_off(nominal, how.settings.judgement.far),
            *_warnings(problem, told, final, open_end=kind == "unknown" or (kind == "effect" and not judged)),
        ),
        closure=closure,
        next_excitation=_next_excitation(problem, finding, catalogue),
        splits=where.splits,
        seconds=time.perf_counter() - began,
        complete=kind != "unknown" and judged,
        remainder=remainder(problem, final, widest),
        nominal=nominal,
        settings=changed(how.settings),
        **near,
    )
    return Diagnosis(case, problem, tuple(explanations), verdict, final, where)


def _nearest(
    case: Case,
    problem: Problem,
    finding: Finding,
    closest: Explanation,
    found: Sequence[Gap],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """What the verdict says of the effects that come nearest where nothing is named: what each closes, and what all of them leave."""
    if not closest.hypothesis:
        return {}
    effects = finding.nearest or evidence.effects_of(closest, evidence.marginal(finding.explanations))
    label = names(closest.hypothesis)
    return {
        "nearest": with_closed(case, problem, effects, (closest, *finding.explanations), rng),
        "nearest_nominal": nominal_estimates(closest),
        "nearest_left": tuple(dict(gap.steps).get(label, math.nan) for gap in found),
    }


def _kind(finding: Finding, seen: Sequence[NamedEffect]) -> tuple[VerdictKind, dict[str, float]]:
    """Kind of the verdict and the probabilities of all kinds, with effects that were read off the samples."""
    if not seen or finding.kind != "none":
        return finding.kind, finding.probabilities
    return "effect", finding.probabilities | {"effect": 1.0 - finding.probabilities["unknown"], "none": 0.0}


class _ToldRecords(NamedTuple):
    """A case on its way to the search.

    Attributes:
        admitted: As it was admitted.
        admission: What was said of it then.
        quiet: Without the noise of idle loads.
        whole: Its long records thinned, but not cut.
    """

    admitted: Case
    admission: tuple[str, ...]
    quiet: Case
    whole: Case


def _told_records(case: Case, *, anyway: bool, settings: DiagnosisSettings) -> _ToldRecords:
    told, admission = admitted(case, anyway=anyway, settings=settings)
    quiet = without_idle_noise(told, settings=settings.case)
    return _ToldRecords(told, tuple(admission), quiet, thinned(quiet, settings=settings))


def _warnings(problem: Problem, told: _ToldRecords, final: Explanation, *, open_end: bool) -> tuple[str, ...]:
    """What the reader should know about the records, as they came and as they were read in the end; and where nothing was tried, if
    something is left."""
    case = problem.case
    return (
        *long_record_notes(told.admitted, case, settings=problem.settings),
        *rest_of_records(told.whole, problem, final),
        *notes(case, problem),
        *idle_notes(told.admitted, told.quiet),
        *reading_notes(told.quiet, case),
        *start_warnings(problem, (*case.identification, *case.validation)),
        *(untried_points(problem) if open_end else ()),
    )


def _next_excitation(problem: Problem, finding: Finding, catalogue: Sequence[Effect]) -> dict[str, Any]:
    """The next test: one that separates rivals, or what the records could have shown where they call for nothing."""
    if finding.kind == "effect":
        return separate(problem, finding.explanations)
    # by the error of the model where that, not noise, decides
    error = finding.explanations[0].parts[0][0].error
    weighed = Problem(
        problem.case, problem.structure, problem.case.identification, error=error, settings=problem.settings
    )
    return told_apart(weighed, finding.kind, catalogue)


def _somewhere(problem: Problem, found: Sequence[_Placed]) -> tuple[_Placed, ...]:
    """Effects with the name of the only place where they need none to be told apart."""
    sites = {place.name: place.site for place in problem.structure.places}
    return tuple(replace(effect, where=effect.where or sites.get("", "")) for effect in found)


def _told(words: str, seen: Sequence[NamedEffect]) -> str:
    """The verdict in words, with the effects that were read off the samples."""
    told = "".join(
        f" '{e.channel}' is recorded in steps of {e.parameters['step'].value:.4g} {e.parameters['step'].unit}, "
        f"coarser than its noise: {e.name}."
        for e in seen
    )
    return words + told


def diagnose_folder(folder: str | Path, **options) -> Diagnosis | ArticulatedDiagnosis:
    """Diagnose the case in a folder; the options are those of `diagnose`."""
    return diagnose(read_case(folder), **options)
