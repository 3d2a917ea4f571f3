"""The diagnosis of an articulated model: where the discrepancy lies joint by joint, which effect causes it, how far it shrinks.

`applies` tells whether a case is one for this engine rather than for linear structures: a servo, a parameter of a drive, or inertia that
changes with the posture.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.judgement import kept, noise_floor, predict, without_each
from bench.discrepancy.articulated.naming import closest_rival, verdict_of
from bench.discrepancy.articulated.next_test import Trajectory, propose
from bench.discrepancy.articulated.places import matrix_of
from bench.discrepancy.articulated.whiteness import coloured
from bench.discrepancy.articulated_search.catalogue import CATALOGUE
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import search
from bench.discrepancy.articulated_search.torque_error import TorqueProblem, along_motion
from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.long_records import after, long_record_notes, thinned, with_beginnings
from bench.discrepancy.effects.catalogue import CATALOGUE as LINEAR
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings, changed
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.verdict import Verdict, far_off
from bench.errors import UnknownNameError


@dataclass(frozen=True, eq=False)
class ArticulatedDiagnosis:
    """A diagnosis with everything that its report needs.

    Attributes:
        case: The case.
        model: Its model.
        problem: Its records for identification.
        judging: Its records for judging.
        fits: All fitted hypotheses, the likeliest first.
        final: The one behind `verdict`.
        matrix: Joint to effect to the part of that joint's discrepancy that the effect alone closes, where it was fitted.
        verdict: The verdict.
        next_test: Joint trajectories that would tell its explanation from the closest rival; None where nothing is to be told apart.
    """

    case: Case
    model: ArticulatedModel
    problem: ArticulatedProblem
    judging: ArticulatedProblem
    fits: tuple[ArticulatedFit, ...]
    final: ArticulatedFit
    matrix: dict[str, dict[str, float]]
    verdict: Verdict
    next_test: Trajectory | None = None


def diagnose_articulated(
    case: Case,
    *,
    exclude: Collection[str] = (),
    most: int = 3,
    anyway: bool = False,
    rng: np.random.Generator | None = None,
    deadline: Deadline = NEVER,
    settings: DiagnosisSettings = DEFAULT,
    progress: Callable[[str], None] = lambda text: None,
) -> ArticulatedDiagnosis:
    """Diagnose a case whose rig is an articulated MJCF.

    Args:
        case: Nominal model and records.
        exclude: Names of effects to leave out of the catalogue.
        most: Largest number of effects named together at one joint.
        anyway: Whether factors, signs and parts of the model that stand against a diagnosis are noted rather than refused.
        rng: For the bootstrap intervals; a fixed seed where None.
        deadline: When nothing further is screened or fitted and fits end where they are; the warnings of the verdict say what was left out.
        settings: Thresholds, see docs/thresholds.md.
        progress: Called with a line of text at every stage.

    Raises:
        UnknownNameError: A name in `exclude` is not in the catalogue.
        ModelError: The model has something that is no hinge or slide on a fixed base, or that the equations of its joints leave out
            and the records reach.
        FileFormatError: A joint is not measured or not driven.
        RecordingError: The records cannot be used.
        UnitError: A unit does not fit the model, or a channel is off by a factor or a sign that no missing force makes.
    """
    began = time.perf_counter()
    rng = np.random.default_rng(settings.seed) if rng is None else rng
    how, judged = replace(settings.articulated.search, most=most), settings.articulated.judgement
    known = {effect.name for effect in (*CATALOGUE, *LINEAR)}
    for name in exclude:
        if name not in known:
            raise UnknownNameError("effect", name, sorted(known))
    catalogue = [effect for effect in CATALOGUE if effect.name not in exclude]
    progress("reading the model and the records")
    stated = all((c.noise_std or 0.0) > 0.0 for c in case.channels if c.role == "response")
    told, compiled, notes = admitted_robot(case, anyway=anyway, settings=settings)
    model = ArticulatedModel.of(compiled, case.rig)
    case = with_beginnings(whole := thinned(told, settings=settings), settings=settings)
    problem = ArticulatedProblem.of(case, model, case.identification, settings, deadline)
    judging = ArticulatedProblem.of(case, model, case.validation, settings)
    candidates = placements(problem, catalogue)
    if away := _run_away(problem, judged):
        problem, candidates = TorqueProblem.like(problem), along_motion(candidates)
    problem, fits = search(problem, candidates, settings=how, progress=progress)
    judging = judging.softened(problem.softness)
    told_by = _like(problem, judging)
    progress("judging records")
    rungs, last, predictions, more = kept(problem, told_by, fits, judged)
    fits += more
    untouched = predict(told_by, None, predictions[0].floor, judged)
    final = rungs[last]
    left = coloured(judging, final, judged)
    without = without_each(told_by, fits, final, predictions[0].floor, judged)
    verdict = verdict_of(
        problem,
        fits,
        rungs,
        last,
        untouched,
        predictions,
        without,
        judged,
        rng,
        stated=stated and not away,
        left=left,
    )
    verdict = replace(
        _with_free_runs(verdict, judging, final, judged) if away else verdict,
        warnings=(
            *far_off(verdict.nominal, settings.judgement.far),
            *verdict.warnings,
            *notes,
            *_of_long_records(told, whole, problem, final, predictions[0].floor),
            *_followed(problem),
            *_torques(problem, away),
            *deadline.untried,
        ),
        settings=changed(settings),
    )
    rival = closest_rival(fits, final, judged) if verdict.named else None
    told_apart = rival is not None and deadline.allows("the next test")
    proposal = propose(problem, compiled, final, rival) if told_apart else None
    if proposal is not None:
        verdict = replace(verdict, next_excitation=proposal.told)
    verdict = verdict.timed(time.perf_counter() - began)
    return ArticulatedDiagnosis(
        case, model, problem, judging, tuple(fits), final, matrix_of(problem, fits), verdict,
        None if proposal is None else proposal.trajectory,
    )  # fmt: skip


def _of_long_records(
    told: Case, whole: Case, problem: ArticulatedProblem, final: ArticulatedFit, floor: Array
) -> tuple[str, ...]:
    """What is said of records that were thinned or cut, and how the explanation does over what follows the cut."""
    case, settings = problem.case, problem.settings
    found = long_record_notes(told, case, settings=settings)
    pairs = zip(whole.identification, case.identification, strict=True)
    rests = [rest for record, fitted in pairs if (rest := after(record, fitted)) is not None]
    if not rests:
        return found
    later = _like(
        problem, ArticulatedProblem.of(case, problem.model, rests, settings).softened(problem.softness)
    )
    judged = settings.articulated.judgement
    off = [float(np.max(predict(p, final, floor, judged).discrepancy)) for p in (problem, later)]
    return (
        *found,
        f"what was found is {off[0]:.3g} off where it was fitted (NRMSE), {off[1]:.3g} in what follows",
    )


def _followed(problem: ArticulatedProblem) -> tuple[str, ...]:
    """What is said where the runs listen to the encoders more than the stated noise asks for."""
    if not problem.softness:
        return ()
    return (
        f"runs are corrected by the encoder as if {100.0 * problem.softness:.0f} % of the torque were unknown: with a play, small errors "
        "grow at every impact, and no run follows the joint by itself for long",
    )


def _like(problem: ArticulatedProblem, other: ArticulatedProblem) -> ArticulatedProblem:
    """Other records, asked as those of a problem are."""
    return TorqueProblem.like(other) if isinstance(problem, TorqueProblem) else other


def _run_away(problem: ArticulatedProblem, settings: JudgementSettings) -> list[int]:
    """Joints whose torque was logged and whose free runs, as the model is stated, end further off than they move."""
    off = predict(problem, None, np.zeros(len(problem.joints)), settings).discrepancy
    driven = [j.drive is not None and not j.drive.servo for j in problem.joints]
    return [j for j, (error, torque) in enumerate(zip(off, driven, strict=True)) if torque and error > 1.0]


def _with_free_runs(
    verdict: Verdict, judging: ArticulatedProblem, final: ArticulatedFit, settings: JudgementSettings
) -> Verdict:
    """The verdict with what free runs miss beside what the torque does."""
    floor = noise_floor(judging, final, settings)
    before, after = (predict(judging, found, floor, settings).discrepancy for found in (None, final))
    told = {
        joint.name: (float(before[j]), float(after[j]), float(floor[j]))
        for j, joint in enumerate(judging.joints)
    }
    gaps = tuple(replace(gap, free_runs=told[gap.dof]) for gap in verdict.gaps)
    return replace(verdict, gaps=gaps, gap=next(gap for gap in gaps if gap.dof == verdict.gap.dof))


def _torques(problem: ArticulatedProblem, away: list[int]) -> tuple[str, ...]:
    """What is said of joints that run away."""
    if not away:
        return ()
    names = ", ".join(f"'{problem.joints[j].name}'" for j in away)
    return (
        f"the model as stated runs further off within half a second than it moves (joint {names}): what it misses was read off the torque "
        "along the measured motion, for whose parameters the smoothed motion was taken to be right",
    )
