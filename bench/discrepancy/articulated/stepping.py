"""Integration steps of slowly sampled joints: some a sample, where that many tell the same as the finer ones do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, refitted
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.rounds import best_of, grounds_of, quiet
from bench.discrepancy.articulated_search.search import nominal_fit, taken_out
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.numerics.deadline import Deadline
from bench.discrepancy.settings import DiagnosisSettings


def stepped(
    case: Case, model: ArticulatedModel, settings: DiagnosisSettings, deadline: Deadline
) -> ArticulatedProblem:
    """The problem of the records for identification, in the longest steps in which the nominal model, fitted, is accurate enough.

    Longer ones than usual are asked of servos alone: their runs go from end to end of a log, those of torques are short.
    """
    own = settings.articulated
    servos = all(joint.held for joint in model.joints)
    sample = min(record.step for record in case.identification)
    longest = min(sample / own.steps_a_sample, own.longest_of_few) if servos else 0.0
    if longest >= 2.0 * own.longest_step:  # else what is saved pays for the comparison at best
        longer = replace(settings, articulated=replace(own, longest_step=longest))
        problem = ArticulatedProblem.of(case, model, case.identification, longer, deadline)
        nominal = nominal_fit(problem)
        if accurate(problem, nominal, nominal, settings):
            return problem
    return ArticulatedProblem.of(case, model, case.identification, settings, deadline)


def accurate(
    problem: ArticulatedProblem,
    nominal: ArticulatedFit,
    found: ArticulatedFit,
    settings: DiagnosisSettings,
) -> bool:
    """Whether the steps of a problem change the misfit of a fit by less than what a further effect has to take off, joint by joint.

    That is what evidence asks for, and half of the part of the nominal model's misfit that a round of the search has to take off.

    Args:
        problem: The problem.
        nominal: The fit of the nominal model.
        found: The fit.
        settings: With the steps that its own are held against.
    """
    if problem.settings.articulated.longest_step <= settings.articulated.longest_step:
        return True
    shortest = min((prepared.record for prepared in problem.records), key=len)
    misfit = []
    for how in (problem.settings, settings):
        tried = ArticulatedProblem.of(problem.case, problem.model, [shortest], how).softened(problem.softness)
        misfit.append(ArticulatedFit.at(tried, found.hypothesis, found.vector).misfit)
    samples = sum(len(prepared.record) for prepared in problem.records)
    apart = np.abs(misfit[0] - misfit[1]) * samples / len(shortest)
    least = 0.5 * settings.articulated.judgement.small * nominal.beyond_noise
    return bool(np.all(apart < np.maximum(2.0 * settings.articulated.search.worth, least)))


def misses_a_drive(
    finer: ArticulatedProblem,
    found: ArticulatedFit,
    candidates: Sequence[PlacedOnJoint],
    progress: Callable[[str], None] = lambda text: None,
) -> bool:
    """Whether an elastic drive explains a joint better, in steps as fine as usual, than what was found for it in longer ones.

    The teeth of a gear are stiff: where the link is light they meet and part within a few milliseconds, and a run in longer steps is
    thrown off by them, however well such steps follow the nominal model.

    Args:
        finer: The problem in fine steps.
        found: What was found.
        candidates: Effects at places; those that are elastic drives are asked.
        progress: Called with a line of text at every joint.
    """
    settings, judged = finer.settings.articulated.search, finer.settings.articulated.judgement

    def again(fitted: ArticulatedFit, without: Sequence[PlacedOnJoint]) -> ArticulatedFit:
        rest = taken_out(finer, fitted, without)
        return refitted(finer, rest.hypothesis, rest.vector, scale=rest.scale)

    whole = again(found, ())
    for j in np.flatnonzero(~quiet(whole, judged)):
        trains = [c for c in candidates if c.effect.train and c.joint == j]
        if not (trains and finer.deadline.allows("elastic drives in finer integration steps")):
            continue
        progress(f"joint '{finer.joints[j].name}' in finer steps")
        rest = again(whole, [placed for placed in whole.hypothesis if placed.joint == j])
        least = whole.log_posterior - settings.sight
        told = best_of(
            finer, rest, grounds_of(finer, rest, settings), trains, settings, lambda text: None, least=least
        )
        if told.best is not None and told.best.log_posterior > whole.log_posterior + settings.worth:
            return True
    return False
