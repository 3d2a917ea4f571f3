"""The diagnosis of a case: where the gap lies, which effect causes it, how far it shrinks.

The steps, each in its own room: read the case (`case`), find what it leaves unstated of its records (`checks.initial_motion`,
`search.load_interpolation`), screen the catalogue and fit what is promising (`screening`, `fitting`, `search`), weigh the
explanations and doubt the best one (`judgement`), run the judging records with each (`judgement.validation_discrepancy`), and say
where the residuals of the nominal model gather (`localisation`). docs/architecture.md draws the rooms.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis, diagnose_articulated
from bench.discrepancy.articulated.recognition import applies, drives_only
from bench.discrepancy.articulated_search.catalogue import CATALOGUE as ARTICULATED
from bench.discrepancy.case.case import Case
from bench.discrepancy.case.idle_loads import idle_notes, without_idle_noise
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.checks.data_quality import notes
from bench.discrepancy.checks.quantisation import recorded
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.effects.nonparametric import CLOSURES
from bench.discrepancy.fitting.initial_state_fit import start_warnings
from bench.discrepancy.judgement import posterior as evidence
from bench.discrepancy.judgement.closing import complete, nominal_estimates, with_closed
from bench.discrepancy.judgement.nonparametric_rival import Rival
from bench.discrepancy.judgement.two_regimes import How, Progress, found_of
from bench.discrepancy.judgement.validation_discrepancy import gaps, nominal_prediction
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.localise import Whereabouts, locate
from bench.discrepancy.localisation.remainder import remainder
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.next_test.discriminating_excitation import separate, told_apart
from bench.discrepancy.numerics.deadline import Deadline
from bench.discrepancy.search.explain import Explanation, close, nominal_alone
from bench.discrepancy.search.fits import names
from bench.discrepancy.search.load_interpolation import reading_notes
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings, changed
from bench.discrepancy.verdict import Gap, Kind, NamedEffect, Ranked, Verdict
from bench.errors import BenchError, UnknownNameError

Placed = TypeVar("Placed", NamedEffect, Ranked)


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
    anyway: bool = False,
    rng: np.random.Generator | None = None,
    progress: Progress = lambda text: None,
    budget: float = math.inf,
    settings: DiagnosisSettings = DEFAULT,
) -> Diagnosis | ArticulatedDiagnosis:
    """Diagnose a case; one of an articulated MJCF by `diagnose_articulated`, with the catalogue of joints, drives and encoders.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        exclude: Names of effects to leave out of the catalogue.
        most: Largest number of effects named together.
        anyway: Whether factors, signs and parts of the model that stand against a diagnosis are noted rather than refused.
        rng: For the bootstrap intervals; a fixed seed where None.
        progress: Called with a line of text at every stage.
        budget: Seconds after which no further stage of the search is begun; the verdict is then the best one so far, and its
            warnings say what was not tried.
        settings: Thresholds, see docs/thresholds.md.

    Raises:
        UnknownNameError: A name in `exclude` is not in the catalogue.
        RecordingError: The records cannot be used.
        UnitError: A unit does not fit the model, or a channel is off by a factor or a sign that no missing force makes.
        ModelError: The model holds what a nominal simulation cannot, and the records reach it.
    """
    if applies(case, settings=settings.articulated):
        with threadpool_limits(1, user_api="blas"):
            robot = diagnose_articulated(
                case, exclude=exclude, most=most, anyway=anyway, rng=rng, settings=settings, progress=progress
            )
        if budget == math.inf:
            return robot
        unused = "budget is not heeded on an articulated model"
        return replace(robot, verdict=replace(robot.verdict, warnings=(*robot.verdict.warnings, unused)))
    rng = np.random.default_rng(settings.seed) if rng is None else rng
    known = [effect.name for effect in catalogue]
    for name in exclude:
        if name not in known and name not in {effect.name for effect in ARTICULATED}:
            raise UnknownNameError("effect", name, known)
    chosen = [effect for effect in catalogue if effect.name not in exclude]
    # fits run in threads of their own; threads of BLAS within them would only get in each other's way
    with threadpool_limits(1, user_api="blas"):
        deadline = Deadline(budget)
        found = _diagnose(case, How(chosen, most, progress, deadline, settings), rng, anyway)
        asked = "effects of drives and encoders"
        if (
            found.verdict.verdict != "none"
            and not found.verdict.complete
            and drives_only(case)
            and deadline.allows(asked)
        ):
            # what no force on the joint explains to the noise may sit in its drive
            progress(asked)
            try:
                other = diagnose_articulated(
                    case,
                    exclude=exclude,
                    most=most,
                    anyway=anyway,
                    rng=rng,
                    settings=settings,
                    progress=progress,
                )
            except (
                BenchError
            ):  # admitted as a linear structure, with parts that the equations of drives leave out
                return found
            left, theirs = found.verdict.gap, other.verdict.gap
            # free runs of one kind in both: parts of what each began with are compared
            nearer = theirs.after * left.before < settings.judgement.coarse.most * left.after * theirs.before
            if other.verdict.verdict == "effect" and (other.verdict.complete or nearer):
                return other
        return found


def _diagnose(case: Case, how: How, rng: np.random.Generator, anyway: bool) -> Diagnosis:
    began, progress, catalogue = time.perf_counter(), how.progress, how.catalogue
    progress("looking at the records")
    told, admission = admitted(case, anyway=anyway, settings=how.settings)
    quiet = without_idle_noise(told, settings=how.settings.case)
    case, finding = found_of(quiet, how, rng)
    problem = Problem(
        case, structure_of(case, settings=how.settings), case.identification, settings=how.settings
    )
    explanations, kind, rival = finding.explanations, finding.kind, finding.rival
    best, probabilities, words = explanations[0], finding.probabilities, finding.words
    seen, fitted = recorded(problem, catalogue), kind
    if seen and kind == "none":
        kind = "effect"
        probabilities = probabilities | {"effect": 1.0 - probabilities["unknown"], "none": 0.0}
    progress("gap on the judging records")
    closest = finding.closest or evidence.nearest(explanations)
    final, closure, found = _shrunk(case, problem, explanations, kind, rival, rng, closest)
    widest = max(found, key=lambda gap: gap.before / max(gap.noise_floor, 1e-12))
    if kind == "unknown" and not finding.doubt:
        words += evidence.closes(names(closest.hypothesis), widest, settings=how.settings.judgement)
    where = locate(
        problem,
        nominal_alone(explanations),
        rival.explanation if rival else best,
        borne_out=rival is not None or kind == "effect",
        unknown=kind == "unknown",
    )
    named = with_closed(case, problem, finding.named, explanations, rng) if finding.named else ()
    nearest = finding.nearest
    if finding.closest is not None:
        nearest = with_closed(case, problem, nearest, (finding.closest, *explanations), rng)
    ranked = (*(Ranked(e.name, e.where, e.probability) for e in seen), *finding.ranking)
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
            *admission,
            *_untried(how.deadline),
            *finding.notes,
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
        complete=kind != "unknown"
        and complete(
            found,
            sharp=not finding.coarse,
            stated=problem.noise_stated,
            settings=how.settings.judgement,
        ),
        remainder=remainder(problem, final, widest),
        nominal=nominal_estimates(final),
        nearest=nearest,
        settings=changed(how.settings),
    )
    return Diagnosis(case, problem, tuple(explanations), verdict, final, where)


def _untried(deadline: Deadline) -> tuple[str, ...]:
    """What there was no time for, in words."""
    if not deadline.skipped:
        return ()
    return (f"there was no time for {'; '.join(deadline.skipped)}: a larger --budget may change the verdict",)


def _shrunk(
    case: Case,
    problem: Problem,
    explanations: Sequence[Explanation],
    kind: Kind,
    rival: Rival | None,
    rng: np.random.Generator,
    nearest: Explanation,
) -> tuple[Explanation, str, tuple[Gap, ...]]:
    """How far the gap shrinks: the explanation behind `Gap.after`, the closure in it if any, and the gaps."""
    best, nothing = explanations[0], nominal_alone(explanations)
    final, closure = best, ""
    stages = [("nominal", nominal_prediction(problem)), ("parameters only", nothing.predict)]
    stages += [(label, e.predict) for label, e in _path(explanations)]
    if kind == "unknown":
        final, closure = _closed(best, nothing, rival)
        label = names(nearest.hypothesis)
        tells = label not in dict(stages) and all(_finite(nearest.predict(r)) for r in case.validation)
        stages += [(label, nearest.predict)] if tells else []
    stages.append((names(final.hypothesis), final.predict))
    found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    if kind == "unknown" and any(
        gap.after > problem.settings.judgement.closure_worse * gap.parameters_only for gap in found
    ):
        # what imitates an unknown force on some records can be worse than nothing on others: nobody should build that in
        final, closure = nothing, ""
        stages[-1] = ("no closure helps", nothing.predict)
        found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    return final, closure, found


def _finite(run: Mapping[str, np.ndarray]) -> bool:
    return all(np.isfinite(samples).all() for samples in run.values())


def _closed(best: Explanation, nothing: Explanation, rival: Rival | None) -> tuple[Explanation, str]:
    """What a free model makes of an unknown gap: alone where that explains the records, else the likelier of alone and on top."""
    if rival is not None and rival.explanation.consistent:
        return rival
    closed = close(best, nothing, CLOSURES)
    if rival is None or rival.explanation.log_posterior < closed[0].log_posterior:
        return closed
    return (
        rival
        if rival.explanation.reduced - 1.0 < best.settings.search.stalled * (best.reduced - 1.0)
        else closed
    )


def _model(explanation: Explanation) -> tuple[Hypothesis, np.ndarray] | None:
    """Effects and vector of an explanation in one part; None where it has several."""
    fits = [fitted for _, fitted in explanation.parts]
    return (fits[0].hypothesis, fits[0].vector) if len(fits) == 1 else None


def _somewhere(problem: Problem, found: Sequence[Placed]) -> tuple[Placed, ...]:
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
