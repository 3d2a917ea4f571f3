"""How large things are: factors that are sought, and what a fitted nominal model leaves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from scipy.optimize import least_squares

from bench.arrays import Array
from third_laboratory_cases.case import Case

Errors = Callable[[Mapping[str, float], bool], Array]
"""Errors over the size of the response (n,), from values of a nominal model and whether they are on validation records."""
COUNT, SIGMA = 2000, 0.3
"""Independent samples that a fit takes the identification records for, and their standard deviation over the size of the response."""


def rms(x: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def background_factor(
    found: Callable[[float], float], wanted: float, *, tries: int, tolerance: float
) -> float:
    """Factor of a background with which it has a wanted size, where some tries suffice.

    Args:
        found: Its size with a factor.
        wanted: Its wanted size.
        tries: At most so many.
        tolerance: Relative error of the size that is good enough.
    """
    factor = 1.0
    for _ in range(tries):
        size = found(factor)
        if abs(size / wanted - 1.0) < tolerance:
            break
        factor *= float(np.clip((wanted / max(size, 1e-9)) ** 0.9, 0.2, 5.0))
    return factor


def left_after_fit(case: Case, errors: Errors) -> float:
    """NRMSE that the nominal model leaves on validation records, its parameters fitted to the others within their stated uncertainties."""
    truth = case.specimen.stated_values()
    parameters = list(case.parameters.values())

    def values(off: Array) -> dict[str, float]:
        """Values that are off by multiples of their uncertainty."""
        pairs = zip(parameters, off.tolist(), strict=True)
        return {**truth, **{p.of: truth[p.of] * (1.0 + each * p.relative) for p, each in pairs}}

    def penalised(off: Array) -> Array:
        e = errors(values(off), False)
        return np.concatenate([e * math.sqrt(COUNT / len(e)) / SIGMA, off])

    start = np.zeros(len(parameters))
    best = least_squares(penalised, start, max_nfev=6, bounds=(-3.0, 3.0), diff_step=0.02).x
    return rms(errors(values(best), True))
