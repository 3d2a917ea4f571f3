"""Output-error fits: maximum a posteriori parameters of a hypothesis, and its evidence.

The free run of the model is fitted to the records: whitened residuals and priors together (`minimise`). Nominal
parameters move in units of their stated uncertainty with a unit Gaussian prior, so that a wrong stiffness is never called an
effect; effect parameters have the priors of the catalogue.

References:
    D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447 (evidence and Occam factor).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.numerics.least_squares import Prior, minimise
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: Its effects.
        vector: MAP parameters, see `Simulator.simulate`.
        chi2: Sum of squared whitened residuals.
        cost: chi2 plus the prior's misfit.
        n_residuals: Number of residuals.
        precision: Posterior precision of the vector (n, n).
        log_evidence: Laplace approximation of the log evidence (constants common to all hypotheses left out).
        settled: Whether the iteration ended because nothing more was to be gained.
        settings: Thresholds of the problem it is a fit of.
    """

    hypothesis: Hypothesis
    vector: Array
    chi2: float
    cost: float
    n_residuals: float
    precision: Array
    log_evidence: float
    settled: bool = False
    settings: DiagnosisSettings = DEFAULT

    @property
    def reduced(self) -> float:
        """Chi-squared over its degrees of freedom."""
        return self.chi2 / self.n_residuals

    @property
    def covariance(self) -> Array:
        """Posterior covariance of the vector."""
        return np.asarray(np.linalg.inv(self.precision), dtype=np.float64)


def free_entries(
    simulator: Simulator, hypothesis: Hypothesis, fixed: Array | None = None
) -> NDArray[np.int64]:
    """Indices of the entries of a vector that move, but for those `fixed` (n,) besides."""
    shapes = [p.fixed for placed in hypothesis for p in placed.effect.parameters]
    held = np.append(simulator.spread == 0, np.array(shapes, dtype=bool))
    return np.flatnonzero(np.logical_not(held if fixed is None else held | fixed))


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    *,
    start: Array,
    iterations: int = 15,
    tolerance: float = 0.05,
    fixed: Array | None = None,
    limit: float = np.inf,
    exact: bool = True,
) -> Fit:
    """Fit a hypothesis.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        start: Start vector (n,), or several (k, n): the fit begins at the one of least cost.
        iterations: Most iterations.
        tolerance: Decrease of the cost below which the iteration ends; costs differ meaningfully from about one.
        fixed: (n,) boolean, entries held at their start.
        limit: Cost that has to be within sight, see `minimise`.
        exact: Whether the curvature is taken anew at the end, as the evidence and intervals need it.

    Returns:
        The fit; its cost is infinite where no simulation stayed finite.
    """
    settings = problem.settings.fitting
    prior = Prior(*problem.prior(hypothesis))
    n = len(problem.nominal)
    free = free_entries(problem, hypothesis, fixed)
    found = minimise(
        lambda vector: problem.residual(hypothesis, vector),
        np.clip(start, prior.low, prior.high),
        prior=prior,
        free=free,
        reach=np.where(free < n, settings.nominal_reach, settings.effect_reach),
        iterations=iterations,
        tolerance=tolerance,
        limit=limit,
        exact=exact,
        deadline=problem.deadline,
        settings=problem.settings.numerics,
        near=lambda vector: problem.residual_near(hypothesis, vector),
    )
    precision, evidence = laplace(problem, hypothesis, found.cost, found.curvature, free)
    with np.errstate(over="ignore"):  # a run on its way to divergence
        chi2 = float(found.residual @ found.residual)
    return Fit(
        hypothesis,
        found.vector,
        chi2,
        found.cost,
        problem.n_residuals,
        precision,
        evidence,
        found.settled,
        problem.settings,
    )


def laplace(
    problem: Problem, hypothesis: Hypothesis, cost: float, curvature: Array, free: NDArray[np.int64]
) -> tuple[Array, float]:
    """Posterior precision (n, n) of a vector, and log evidence, from the cost at its minimum.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        cost: At the minimum.
        curvature: (n_free, n_free) of half the cost in units of the prior's standard deviations, the prior included.
        free: (n_free,) indices of the entries that moved.
    """
    _, std, _, _ = problem.prior(hypothesis)
    precision = np.diag(1.0 / std**2)
    precision[np.ix_(free, free)] = curvature / np.outer(std[free], std[free])
    if not np.isfinite(cost):
        return precision, -np.inf
    log_prior = sum(placed.effect.log_prior for placed in hypothesis)
    return precision, float(-0.5 * cost - 0.5 * np.linalg.slogdet(curvature)[1] + log_prior)
