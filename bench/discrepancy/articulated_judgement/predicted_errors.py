"""What explanations predict of records that they were not fitted to, and how predictions compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.articulated_judgement.torque_runs import TorqueRuns
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings


@dataclass(frozen=True, eq=False)
class PredictedErrors:
    """Squared errors in the judging records, of free runs or of torques (`runs_of`).

    Attributes:
        power: (n_blocks, n_joints) mean squares over those of the joint's own motion or torque.
        floor: (n_joints,) what noise alone leaves.
        weight: (n_joints,) of the errors where explanations are compared, see `FreeRuns.weight`.
    """

    power: Array
    floor: Array
    weight: Array

    @property
    def discrepancy(self) -> Array:
        """NRMSE (n_joints,)."""
        return np.sqrt(self.power.mean(axis=0))

    @property
    def compared(self) -> Array:
        """What explanations are compared by (n_blocks, n_joints): a run further off than the joint moves tells no more than that it is."""
        return np.minimum(self.power * self.weight**2, 1.0)

    @property
    def excess(self) -> Array:
        """Excess over the noise, block by block (n_blocks,), summed over the joints."""
        return np.asarray((self.compared - self.floor**2).sum(axis=1))

    def of(self, joints: Sequence[int]) -> PredictedErrors:
        """Those of some joints."""
        mine = list(joints)
        return PredictedErrors(self.power[:, mine], self.floor[mine], self.weight[mine])


def runs_of(problem: ArticulatedProblem) -> FreeRuns | TorqueRuns:
    """What explanations are judged by: free runs, or the torque where the model as stated runs away."""
    return TorqueRuns(problem) if isinstance(problem, TorqueProblem) else FreeRuns(problem)


def noise_floor(problem: ArticulatedProblem, found: ArticulatedFit, settings: JudgementSettings) -> Array:
    """NRMSE (n_joints,) that noise alone leaves, were the model of a fit right."""
    runs = runs_of(problem.settled(found.hypothesis, found.vector))
    jobs = [(j, r) for r in range(len(problem.records)) for j in range(len(problem.joints))]
    left = in_threads(lambda job: runs.noise(job[0], found.hypothesis, found.vector, job[1]), jobs)
    table = np.reshape(np.array(left), (len(problem.records), -1)) / runs.sizes
    return np.asarray(np.sqrt(np.mean(table**2, axis=0)), dtype=np.float64)


def predict(
    problem: ArticulatedProblem, found: ArticulatedFit | None, floor: Array, settings: JudgementSettings
) -> PredictedErrors:
    """Errors in a problem's records with a fit's model, with the nominal model as it is where None; `floor` as of `noise_floor`."""
    hypothesis, vector = (found.hypothesis, found.vector) if found else ((), np.zeros(len(problem.nominal)))
    runs = runs_of(problem.settled(hypothesis, vector))
    joints = range(len(problem.joints))
    jobs = [(j, prepared) for prepared in runs.problem.motions(hypothesis, vector) for j in joints]
    errors = in_threads(lambda job: runs.errors(job[0], hypothesis, vector, job[1]), jobs)

    def blocks(j: int, error: Array) -> list[float]:
        over = np.nan_to_num(error / runs.sizes[j], nan=1e3)
        return [float(np.mean(part**2)) for part in np.array_split(over, settings.blocks)]

    table = np.array([blocks(j, error) for (j, _), error in zip(jobs, errors, strict=True)])
    power = np.vstack([table[k : k + len(joints)].T for k in range(0, len(table), len(joints))])
    weight = np.array([runs.weight(j, hypothesis, vector) for j in joints])
    return PredictedErrors(np.minimum(power, 1e6), floor, weight)


def better(before: PredictedErrors, after: PredictedErrors, settings: JudgementSettings) -> bool:
    """Whether a prediction improves on another by more than the standard error over the blocks.

    Where a few blocks hold most of a discrepancy, its mean is uncertain by itself, however much of it is taken away everywhere: what
    takes away more than it leaves may show in the logarithms of the blocks instead.
    """
    gained = before.excess - after.excess
    if _sure(gained, settings):
        return True
    first, last = (np.maximum(p.compared.sum(axis=1), 1e-300) for p in (before, after))
    factors = np.log(first / last)
    return float(np.mean(gained)) > float(np.mean(after.excess)) and _sure(factors, settings)


def _sure(gains: Array, settings: JudgementSettings) -> bool:
    return float(np.mean(gains)) > settings.sure * float(np.std(gains, ddof=1)) / np.sqrt(len(gains))


def closed_of_nominal(
    stated: PredictedErrors, estimated: PredictedErrors, after: PredictedErrors, rng: np.random.Generator
) -> float:
    """Part of the discrepancy of the nominal model that an explanation closes.

    It has to beat that model as it was stated, too: re-estimated without what is missing, it may be worse on other records.

    Args:
        stated: Predictions of the nominal model as stated.
        estimated: With its parameters re-estimated.
        after: Of the explanation.
        rng: For the bootstrap.
    """
    bare = min(stated, estimated, key=lambda found: float(np.mean(found.excess)))
    return closed(bare, after, bare, rng)[0]


def closed(
    before: PredictedErrors, after: PredictedErrors, first: PredictedErrors, rng: np.random.Generator
) -> tuple[float, tuple[float, float]]:
    """Part of the first discrepancy that lies between two predictions, and its block-bootstrap interval; of the squares of NRMSE."""
    table = np.column_stack([before.excess - after.excess, first.excess])
    draws = table[rng.integers(len(table), size=(1000, len(table)))].sum(axis=1)
    shares = draws[:, 0] / np.maximum(draws[:, 1], 1e-12)
    low, high = np.percentile(shares, [2.5, 97.5])
    total = float(table[:, 0].sum() / max(float(table[:, 1].sum()), 1e-12))
    return min(total, 1.0), (float(min(low, 1.0)), float(min(high, 1.0)))
