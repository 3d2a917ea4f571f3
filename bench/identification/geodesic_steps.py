"""Levenberg-Marquardt with geodesic acceleration, several dampings at once.

References:
    More 1978, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630.
    Transtrum and Sethna 2012, arXiv:1201.5885 (geodesic acceleration).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.identification.output_error_problem import SETTINGS, Linearisation, OutputErrorProblem


class FittedPoint(NamedTuple):
    """Where a descent ended, and why."""

    point: Array
    cost: float
    curvature: Array
    held: NDArray[np.bool_]
    iterations: int
    stopped: str


def descend(
    problem: OutputErrorProblem,
    point: Array,
    box: tuple[Array, Array],
    max_iterations: int,
    tolerance: float,
    progress: Callable[[int, float], None] | None,
) -> FittedPoint:
    """Levenberg-Marquardt with geodesic acceleration, within bounds; each iteration tries several dampings at once."""
    low, high = box
    cost = float(problem.costs(point[None, :])[0])
    damping, iterations, stopped = 1e-3, 0, "iterations"
    held = np.zeros(len(point), dtype=bool)
    if not math.isfinite(cost):
        return FittedPoint(point, cost, np.zeros((len(point), len(point))), held, 0, "diverged")
    while True:
        at = problem.linearise(point, high)
        held = ((point <= low) & (at.gradient > 0.0)) | ((point >= high) & (at.gradient < 0.0))
        if iterations == max_iterations or stopped == "tolerance":
            break
        if np.all(np.abs(at.gradient[~held]) <= 1e-14 * (1.0 + cost)):
            stopped = "gradient"
            break
        fall = -1.0
        while damping < 1e12 and fall <= 0.0:
            dampings = damping * np.array(SETTINGS.dampings)
            trials = np.clip(point + _moves(problem, at, held, dampings), low, high)
            costs = problem.costs(trials)
            chosen = int(np.argmin(costs))
            fall = cost - float(costs[chosen])
            damping = dampings[chosen % len(dampings)] if fall > 0.0 else 1e3 * damping
        if fall <= 0.0:
            stopped = "stall"
            break
        point, cost, iterations = trials[chosen], float(costs[chosen]), iterations + 1  # pyrefly: ignore[unbound-name]
        damping = max(damping, 1e-12)
        if progress is not None:
            progress(iterations, cost)
        if fall <= tolerance * cost:
            stopped = "tolerance"  # the curvature at the end is still wanted
    return FittedPoint(point, cost, at.curvature, held, iterations, stopped)


def _moves(problem: OutputErrorProblem, at: Linearisation, held: NDArray[np.bool_], dampings: Array) -> Array:
    """Moves for each damping, straight and then bent along the valley ``(2 n_dampings, n_parameters)``.

    Bouc-Wen parameters, among others, lie in narrow curved valleys that straight steps follow in hundreds of small ones.
    A bent move whose correction is no longer small is left straight.
    """
    moving = np.flatnonzero(~held)
    curvature = at.curvature[np.ix_(moving, moving)]
    diagonal = np.where(np.diag(curvature) > 0.0, np.diag(curvature), 1.0)
    damped = [curvature + np.diag(damping * diagonal) for damping in dampings]
    straight = np.zeros((len(dampings), len(held)))
    for row, matrix in zip(straight, damped, strict=True):
        row[moving] = -np.linalg.lstsq(matrix, at.gradient[moving], rcond=None)[0]
    bent = straight.copy()
    for row, matrix, right in zip(bent, damped, problem.bending(at, straight), strict=True):
        if not np.all(np.isfinite(right)):
            continue
        correction = -0.5 * np.linalg.lstsq(matrix, right[moving], rcond=None)[0]
        if correction @ (diagonal * correction) <= 0.75**2 * (row[moving] @ (diagonal * row[moving])):
            row[moving] += correction
    return np.vstack([straight, bent])
