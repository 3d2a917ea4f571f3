"""What the residuals of a fit say of the logs: their likelihood where the scale of every joint is profiled out."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_search.problem import ArticulatedProblem


def misfit_of(chi2: float, count: float) -> float:
    """Minus twice the profiled log-likelihood of `count` residuals of a sum of squares, their scale unknown but at least one."""
    mean = chi2 / count
    return count * (mean if mean <= 1.0 else 1.0 + float(np.log(mean)))


def log_likelihood(problem: ArticulatedProblem, chi2: Array) -> float:
    """Log-likelihood of the logs up to a constant that no softness changes, given the (n_joints,) sums of squares that a fit leaves.

    The innovations' covariances count with their determinants: a gain that follows everything pays for it by innovations larger than
    the noise.
    """
    whitened = sum(
        float(np.linalg.slogdet(joint.whitening)[1]) * float(np.sum(joint.weight**2)) / joint.n_measured
        for record in problem.records
        for joint in record.joints
    )
    return whitened - 0.5 * sum(misfit_of(c, n) for c, n in zip(chi2, problem.count, strict=True))
