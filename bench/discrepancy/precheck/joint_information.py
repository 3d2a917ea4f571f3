"""What the records of an articulated model can tell of nominal parameters and effects, joint by joint.

As `information` has it for linear structures: whitened innovations instead of whitened responses, and a size that would matter counted in
the positions of free runs, which is what a verdict is judged by.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.screening import grid
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.nominal_parameters import Nominal
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.precheck.information import (
    SETTINGS,
    Told,
    best_of,
    graded_effect,
    graded_parameter,
    out_of_reach,
    sized,
)
from bench.discrepancy.precheck.settings import CheckSettings


def joints_told(
    case: Case, model: ArticulatedModel, settings: CheckSettings, only: Collection[str] = ()
) -> tuple[list[Told], list[Told]]:
    """How well the identification records tell each uncertain nominal parameter and each effect of the catalogue.

    Args:
        case: The case, its channels bound to joints and actuators.
        model: The model at its nominal parameters.
        settings: When something counts.
        only: Names of effects; all where empty.
    """
    problem = ArticulatedProblem.of(case, model, case.identification)
    zero = np.zeros(len(problem.nominal))
    rest = _residuals(problem, (), zero)
    J = np.zeros((len(rest), len(problem.nominal)))
    for i in range(len(problem.nominal)):
        moved = zero.copy()
        moved[i] = SETTINGS.step
        J[:, i] = (_residuals(problem, (), moved) - rest) / SETTINGS.step
    inner = np.asarray(np.linalg.inv(J.T @ J + np.eye(J.shape[1])), dtype=np.float64)

    def known(i: int, entry: Nominal) -> float:
        slopes = entry.slopes(zero, i)
        at, slope = list(slopes), np.array(list(slopes.values())) / entry.stated_std
        return float(np.sqrt(slope @ inner[np.ix_(at, at)] @ slope))

    parameters = [
        graded_parameter(entry.name, known(i, entry), entry.stated_std, settings)
        for i, entry in enumerate(problem.nominal)
        if not entry.of_type
    ]

    chosen = [effect for effect in CATALOGUE if not only or effect.name in only]

    def told(placed: PlacedOnJoint) -> Told:
        vector = at_size(problem, placed, settings.matters, settings)
        if vector is None:
            return out_of_reach(placed.effect.name, placed.where, settings)
        column = _residuals(problem, (placed,), vector) - rest
        return graded_effect(placed.effect.name, placed.where, column, J, inner, settings)

    return parameters, best_of(in_threads(told, placements(problem, chosen)))


def at_size(
    problem: ArticulatedProblem, placed: PlacedOnJoint, size: float, settings: CheckSettings
) -> Array | None:
    """The vector of an effect whose amplitude moves a joint otherwise by a part of its standard deviation; None where it reaches none."""
    drive = problem.joints[placed.joint].drive
    # on which side of a train an encoder sits does not matter for its size
    points = grid(placed, servo=bool(drive and drive.servo), sides=(0.0,))
    zero = np.zeros(len(problem.nominal))
    reached = problem.reached((placed,))
    runs_of = FreeRuns(problem)
    before = [[runs_of.errors(j, (), zero, record) for j in reached] for record in problem.records]

    def change(eta: Array) -> float | None:
        vector = np.concatenate([zero, eta])
        most = 0.0
        for runs, record in zip(before, problem.motions((placed,), vector), strict=True):
            for j, old in zip(reached, runs, strict=True):
                new = runs_of.errors(j, (placed,), vector, record)
                if not np.isfinite(new).all():
                    return None
                n = min(len(new), len(old))  # an elastic drive leaves its first window out
                scale = max(float(np.std(record.joints[j].position)), 1e-300)
                most = max(most, float(np.sqrt(np.mean((new[-n:] - old[-n:]) ** 2))) / scale)
        return most

    eta = sized(points, placed.effect.parameters[0], size, change, settings)
    return None if eta is None else np.concatenate([zero, eta])


def _residuals(problem: ArticulatedProblem, hypothesis: tuple[PlacedOnJoint, ...], vector: Array) -> Array:
    return np.concatenate([problem.residual(j, hypothesis, vector) for j in range(len(problem.joints))])
