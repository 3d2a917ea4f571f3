"""Output-error fits: maximum a posteriori parameters of a hypothesis, and its evidence.

The free run of the model is fitted to the records by a Levenberg-Marquardt iteration on the whitened residuals and
the priors together. Nominal parameters move in units of their stated uncertainty with a unit Gaussian prior, so that a
wrong stiffness is never called an effect; effect parameters have the priors of the catalogue.

References:
    D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447 (evidence and Occam factor).
    J. J. More, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630 (1978).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.problem import Hypothesis, Problem

Array = NDArray[np.float64]

DIFFERENCE = 1e-4
"""Step of the finite differences, in units of the prior standard deviation."""


REFRESH = 3
"""Iterations for which the columns of the nominal parameters are kept."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: Its effects.
        vector: MAP parameters, see `Problem.simulate`.
        chi2: Sum of squared whitened residuals.
        cost: chi2 plus the prior's misfit.
        n_residuals: Number of residuals.
        precision: Posterior precision of the vector (n, n).
        log_evidence: Laplace approximation of the log evidence (constants common to all hypotheses left out).
    """

    hypothesis: Hypothesis
    vector: Array
    chi2: float
    cost: float
    n_residuals: int
    precision: Array
    log_evidence: float

    @property
    def reduced(self) -> float:
        """Chi-squared over its degrees of freedom."""
        return self.chi2 / self.n_residuals

    @property
    def covariance(self) -> Array:
        """Posterior covariance of the vector."""
        return np.asarray(np.linalg.inv(self.precision), dtype=np.float64)


def start_vector(problem: Problem, etas: Sequence[Array], deviations: Array | None = None) -> Array:
    """Join nominal deviations (zero where None) and the etas of the effects."""
    head = np.zeros(len(problem.nominal)) if deviations is None else deviations
    return np.concatenate([head, *etas])


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    *,
    start: Array,
    iterations: int = 15,
    tolerance: float = 0.05,
    fixed: Array | None = None,
) -> Fit:
    """Fit a hypothesis from one start.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        start: Start vector.
        iterations: Most iterations.
        tolerance: Decrease of the cost below which the iteration ends; costs differ meaningfully from about one.
        fixed: (n,) boolean, entries held at their start.

    Returns:
        The fit; its cost is infinite where no simulation stayed finite.
    """
    mean, std, low, high = problem.prior(hypothesis)
    held = np.zeros(len(mean), dtype=bool) if fixed is None else fixed.copy()
    n = len(problem.nominal)
    held[:n] |= problem.spread == 0
    names = [p for placed in hypothesis for p in placed.effect.parameters]
    held[n:] |= np.array([p.fixed for p in names], dtype=bool)
    free = np.flatnonzero(np.logical_not(held))
    vector = np.clip(start, low, high)
    residual = problem.residual(hypothesis, vector)
    cost = _cost(residual, vector, mean, std, free)
    damping = 1e-3
    normal = np.diag(1.0 / std**2)
    jacobian = None
    gained = np.inf
    if np.isfinite(cost):
        for iteration in range(iterations):
            # The response is nearly linear in the nominal parameters: their columns are kept for some iterations.
            stale = jacobian is None or iteration % REFRESH == 0
            jacobian = _jacobian(
                problem, hypothesis, (vector, residual), free, (std, high), None if stale else jacobian
            )
            if jacobian is None:
                break
            curvature = jacobian.T @ jacobian
            normal = np.diag(1.0 / std**2)
            normal[np.ix_(free, free)] += curvature
            gradient = jacobian.T @ residual + ((vector - mean) / std**2)[free]
            vector, residual, cost, damping, gained = _step(
                problem, hypothesis, (vector, residual, cost, damping), normal[np.ix_(free, free)], gradient,
                free, (mean, std, low, high),
            )  # fmt: skip
            if gained < tolerance:
                if stale:
                    break
                jacobian = None
    chi2 = float(residual @ residual)
    scaled = std[free, None] * normal[np.ix_(free, free)] * std[None, free]
    log_prior = sum(placed.effect.log_prior for placed in hypothesis)
    evidence = -0.5 * cost - 0.5 * np.linalg.slogdet(scaled)[1] + log_prior if np.isfinite(cost) else -np.inf
    return Fit(hypothesis, vector, chi2, cost, problem.n_residuals, normal, float(evidence))


def _cost(residual: Array, vector: Array, mean: Array, std: Array, free: NDArray[np.int64]) -> float:
    return float(residual @ residual + np.sum((((vector - mean) / std)[free]) ** 2))


def _jacobian(
    problem: Problem,
    hypothesis: Hypothesis,
    point: tuple[Array, Array],
    free: NDArray[np.int64],
    prior: tuple[Array, Array],
    previous: Array | None,
) -> Array | None:
    """Finite differences of the residual by the free entries; nominal columns from `previous` where it is given."""
    vector, residual = point
    std, high = prior
    out = np.empty((len(residual), len(free)))
    for column, i in enumerate(free):
        if previous is not None and i < len(problem.nominal):
            out[:, column] = previous[:, column]
            continue
        delta = DIFFERENCE * std[i]
        if vector[i] + delta > high[i]:
            delta = -delta
        moved = vector.copy()
        moved[i] += delta
        shifted = problem.residual(hypothesis, moved)
        if shifted.shape != residual.shape:
            return None
        out[:, column] = (shifted - residual) / delta
    return out


def _step(problem, hypothesis, state, normal, gradient, free, prior):
    """Damp the Gauss-Newton step until the cost falls; return the new state and the gain."""
    vector, residual, cost, damping = state
    mean, std, low, high = prior
    for _ in range(7):
        damped = normal + damping * np.diag(np.diag(normal))
        move = -np.linalg.solve(damped, gradient)
        # Further than this the linearisation does not reach; nominal parameters are linear and may go further.
        reach = np.where(free < len(problem.nominal), 20.0, 2.0) * std[free]
        move *= min(1.0, 1.0 / max(np.max(np.abs(move) / reach), 1e-12))
        trial = vector.copy()
        trial[free] = np.clip(vector[free] + move, low[free], high[free])
        trial_residual = problem.residual(hypothesis, trial)
        trial_cost = _cost(trial_residual, trial, mean, std, free)
        if trial_cost < cost:
            return trial, trial_residual, trial_cost, max(damping * 0.1, 1e-9), cost - trial_cost
        damping *= 8.0
    return vector, residual, cost, damping, 0.0
