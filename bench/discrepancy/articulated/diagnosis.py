"""The diagnosis of an articulated model: where the discrepancy lies joint by joint, which effect causes it, how far it shrinks.

`applies` tells whether a case is one for this engine rather than for linear structures: a servo, a parameter of a drive, or inertia that
changes with the posture.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.asking import Asking
from bench.discrepancy.articulated.explaining import Explained, asked_as
from bench.discrepancy.articulated.held_inputs import HELD, explained_as_held
from bench.discrepancy.articulated.naming import closest_rival
from bench.discrepancy.articulated.next_test import JointProposal, Trajectory, propose
from bench.discrepancy.articulated.places import matrix_of
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.predicted_errors import predict
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.long_records import after, long_record_notes, thinned, with_beginnings
from bench.discrepancy.effects.catalogue import CATALOGUE as LINEAR
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings, changed
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
    how = replace(settings.articulated.search, most=most)
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
    asking = Asking(model, catalogue, how, rng, stated, settings, deadline, progress)
    found = asking.asked(case)
    steps_kept = all(a.step == b.step for a, b in zip(told.identification, case.identification, strict=True))
    # of samples that were thinned none was held
    held = explained_as_held(case, found, asking.asked, progress) if steps_kept else None
    if held is not None:
        found, notes = held, (*notes, HELD)
    problem, fits, final, verdict = found.problem, found.fits, found.final, found.verdict
    notes = (*notes, *_of_long_records(told, whole, found), *_followed(problem), *deadline.untried)
    verdict = replace(verdict.in_haste() if deadline.skipped else verdict, settings=changed(settings))
    far = far_off(verdict.nominal, settings.judgement.far)
    verdict = replace(verdict, warnings=(*far, *verdict.warnings, *notes))
    proposal = _next_test(compiled, found)
    if proposal is not None:
        verdict = replace(verdict, next_excitation=proposal.told)
    verdict = verdict.timed(time.perf_counter() - began)
    return ArticulatedDiagnosis(
        problem.case, model, problem, found.judging, tuple(fits), final, matrix_of(problem, fits), verdict,
        None if proposal is None else proposal.trajectory,
    )  # fmt: skip


def _next_test(compiled: mujoco.MjModel, found: Explained) -> JointProposal | None:
    """The motion that would tell what is named from its closest rival, where there is one and time for it."""
    if not found.verdict.named:
        return None
    problem = found.problem
    rival = closest_rival(found.fits, found.final, problem.settings.articulated.judgement, found.alike)
    if rival is None or not problem.deadline.allows("the next test"):
        return None
    return propose(problem, compiled, found.final, rival)


def _of_long_records(told: Case, whole: Case, found: Explained) -> tuple[str, ...]:
    """What is said of records that were thinned or cut, and how the explanation does over what follows the cut."""
    problem, floor = found.problem, found.predictions[0].floor
    case, settings = problem.case, problem.settings
    notes = long_record_notes(told, case, settings=settings)
    pairs = zip(whole.identification, case.identification, strict=True)
    rests = [rest for record, fitted in pairs if (rest := after(record, fitted)) is not None]
    if not rests:
        return notes
    later = ArticulatedProblem.of(case, problem.model, rests, settings).softened(problem.softness)
    judged = settings.articulated.judgement
    off = [
        float(np.max(predict(p, found.final, floor, judged).discrepancy))
        for p in (problem, asked_as(problem, later))
    ]
    return (
        *notes,
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
