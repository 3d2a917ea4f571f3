"""Least squares with a Gaussian prior and bounds, sparing of evaluations.

A free run costs milliseconds and everything else microseconds, so free runs are what is saved: the Jacobian is taken by
finite differences once, carried along by Broyden's update, and taken anew only where it predicts badly, and at the end.

References:
    J. J. More, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630 (1978).
    C. G. Broyden, A class of methods for solving nonlinear simultaneous equations, Math. Comp. 19 (1965) 577-593.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import DEFAULT, NumericsSettings


class Prior(NamedTuple):
    """Gaussian prior with bounds.

    Attributes:
        mean: (n,).
        std: (n,).
        low: (n,).
        high: (n,).
    """

    mean: Array
    std: Array
    low: Array
    high: Array


class Minimum(NamedTuple):
    """Where a minimisation ended.

    Attributes:
        vector: (n,).
        residual: (n_residuals,) at the vector.
        cost: Squared residuals plus prior misfit; infinite where nothing finite was found.
        curvature: (n_free, n_free) of the cost in units of the prior's standard deviations, halved; the prior included.
        settled: Whether nothing more was to be gained.
        jacobian: (n_residuals, n_free) by prior standard deviations, where it was taken at the vector.
    """

    vector: Array
    residual: Array
    cost: float
    curvature: Array
    settled: bool
    jacobian: Array | None = None


class _State(NamedTuple):
    vector: Array
    residual: Array
    cost: float


class _Task(NamedTuple):
    """What stays the same during a minimisation, see there; all arrays (n_free,)."""

    residual_at: Callable[[Array], Array]
    free: NDArray[np.int64]
    mean: Array
    std: Array
    low: Array
    high: Array
    reach: Array
    tolerance: float
    limit: float
    deadline: Deadline
    settings: NumericsSettings
    near: Callable[[Array], Callable[[Array], Array]] | None

    def excess(self, state: _State) -> float:
        """Cost beyond that from which a minimisation is carried to its end."""
        return state.cost - self.settings.noise_level * len(state.residual)

    def state(self, vector: Array) -> _State:
        residual = self.residual_at(vector)
        with np.errstate(over="ignore"):  # a run on its way to divergence
            return _State(vector, residual, float(residual @ residual + np.sum(self.deviation(vector) ** 2)))

    def deviation(self, vector: Array) -> Array:
        return (vector[self.free] - self.mean) / self.std

    def blocked(self, vector: Array, gradient: Array) -> NDArray[np.bool_]:
        """Which entries lie on a bound that the cost pushes them against."""
        x = vector[self.free]
        return ((x <= self.low) & (gradient > 0)) | ((x >= self.high) & (gradient < 0))


def minimise(
    residual_at: Callable[[Array], Array],
    start: Array,
    *,
    prior: Prior,
    free: NDArray[np.int64],
    reach: Array,
    iterations: int,
    tolerance: float = 0.05,
    limit: float = np.inf,
    exact: bool = True,
    deadline: Deadline = NEVER,
    settings: NumericsSettings = DEFAULT.numerics,
    near: Callable[[Array], Callable[[Array], Array]] | None = None,
    known: Array | None = None,
) -> Minimum:
    """Minimise squared residuals plus the misfit of a Gaussian prior.

    Args:
        residual_at: Vector (n,) to residuals; any other shape than at the start stands for "diverged".
        start: Within the bounds, (n,), or several (k, n): the one of least cost is taken.
        prior: Prior and bounds.
        free: Indices of the entries that move.
        reach: (n_free,) longest step, in prior standard deviations.
        iterations: Most steps.
        tolerance: Decrease of the cost that is not worth a step.
        limit: Cost that has to be within sight; the iteration ends where the linearisation promises much less.
        exact: Whether the curvature is taken anew at the end, where the residuals have come near the noise.
        deadline: When the iteration ends where it is, once it has the curvature there.
        settings: `NumericsSettings` of the diagnosis.
        near: Vector to cheaper residuals of vectors near it, for differences; `residual_at` itself where None.
        known: Jacobian (n, n_free) by prior standard deviations at a single start, where it is known.
    """
    own = Prior(prior.mean[free], prior.std[free], prior.low[free], prior.high[free])
    task = _Task(residual_at, free, *own, reach, tolerance, limit, deadline, settings, near)
    state = min((task.state(vector.copy()) for vector in np.atleast_2d(start)), key=lambda at: at.cost)
    identity = np.eye(len(free))
    if not np.isfinite(state.cost):
        return Minimum(state.vector, state.residual, np.inf, identity, False)
    finely: tuple[Array | None, Array | None] = None, None
    coarse = ends = steps = 0
    while True:
        found = _descend(task, state, settings.differences[coarse], range(steps, iterations), known)
        known, state, steps = None, found.state, found.steps
        ends = int(found.ended) * (1 if found.progressed else 1 + ends)
        if not found.ended or ends == len(settings.differences) or not exact or task.excess(state) > 0.0:
            break
        finely, coarse = ((None, None) if coarse else (found.jacobian, found.at)), 1 - coarse
    jacobian, at = found.jacobian, found.at
    if coarse:  # columns of fine differences at the same place, where there are any
        jacobian, at = finely if found.ended and not found.progressed else (None, None)
    if jacobian is None or (exact and found.at is None and task.excess(state) <= 0.0):
        anew = _jacobian(task, state, settings.differences[0])
        jacobian, at = (jacobian, None) if anew is None else (anew, state.vector)
    curvature = None if jacobian is None else _squared(jacobian)
    return Minimum(
        state.vector,
        state.residual,
        state.cost,
        identity if curvature is None else curvature,
        found.ended,
        jacobian if at is state.vector else None,
    )


class _Descent(NamedTuple):
    """How far steps with one size of differences led.

    Attributes:
        state: Where they ended.
        jacobian: The last one, if any.
        at: Where that was taken; None where it was carried along since.
        ended: Whether nothing more was to be gained with it.
        progressed: Whether anything was.
        steps: Number of steps so far.
    """

    state: _State
    jacobian: Array | None
    at: Array | None
    ended: bool
    progressed: bool
    steps: int


def _descend(task: _Task, state: _State, difference: float, steps: range, jacobian: Array | None) -> _Descent:
    """Take Levenberg and Marquardt's steps, of the given numbers at most, with one size of differences, from a known Jacobian, if any."""
    at = None if jacobian is None else state.vector
    progressed = False
    damping = task.settings.damping
    for step in steps:
        if jacobian is None:
            jacobian, at = _jacobian(task, state, difference), state.vector
            if jacobian is None:
                break
        if not task.deadline.allows("the last steps of fits"):
            return _Descent(state, jacobian, at, False, progressed, step + 1)
        normal, fresh = _squared(jacobian), at is not None
        if normal is None:
            if fresh:
                break
            jacobian = None
            continue
        gradient = jacobian.T @ state.residual + task.deviation(state.vector)
        normal, gradient = _without(task.blocked(state.vector, gradient), normal, gradient)
        # least squares: far off, columns of very unequal size leave a normal matrix singular to working precision
        promise = float(gradient @ np.linalg.lstsq(normal, gradient, rcond=None)[0])
        negligible = max(task.tolerance, task.settings.coarse * task.excess(state))
        ended = fresh and promise < negligible
        hopeless = (
            step >= task.settings.patience and state.cost - task.settings.optimism * promise > task.limit
        )
        if ended or hopeless:
            return _Descent(state, jacobian, at, ended, progressed, step + 1)
        moved, damping = _step(
            task,
            state,
            normal,
            gradient,
            damping,
            task.settings.fresh_trials if fresh else task.settings.stale_trials,
        )
        if moved is None:
            if fresh:
                return _Descent(state, jacobian, at, True, progressed, step + 1)
            jacobian = None
            continue
        move = (moved.vector - state.vector)[task.free] / task.std
        gained = state.cost - moved.cost
        predicted = -2.0 * gradient @ move - move @ normal @ move
        surprise = moved.residual - state.residual - jacobian @ move
        state = moved
        if fresh and gained < negligible:
            return _Descent(state, jacobian, at, True, progressed, step + 1)
        progressed = progressed or gained >= negligible
        if gained < max(task.settings.faithful * predicted, negligible):
            jacobian = None
        else:
            jacobian, at = jacobian + np.outer(move / (move @ move), surprise).T, None
    return _Descent(state, jacobian, at, False, progressed, steps.stop)


def _squared(jacobian: Array) -> Array | None:
    """Curvature (n_free, n_free) of half the cost; None on the way to divergence, where squares overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        normal = np.eye(jacobian.shape[1]) + jacobian.T @ jacobian
    return normal if np.isfinite(normal).all() else None


def _without(blocked: NDArray[np.bool_], normal: Array, gradient: Array) -> tuple[Array, Array]:
    if not blocked.any():
        return normal, gradient
    normal, gradient = normal.copy(), np.where(blocked, 0.0, gradient)
    normal[blocked] = 0.0
    normal[:, blocked] = 0.0
    normal[blocked, blocked] = 1.0
    return normal, gradient


def _step(
    task: _Task, state: _State, normal: Array, gradient: Array, damping: float, trials: int
) -> tuple[_State | None, float]:
    """Damp the Gauss-Newton step until the cost falls; return the new state (None: it never did) and the damping."""
    for _ in range(trials):
        move = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
        # further than this the linearisation does not reach
        move *= min(1.0, 1.0 / max(np.max(np.abs(move) / task.reach), 1e-12))
        vector = state.vector.copy()
        vector[task.free] = np.clip(vector[task.free] + task.std * move, task.low, task.high)
        trial = task.state(vector)
        if trial.cost < state.cost:
            return trial, max(damping * 0.1, 1e-9)
        damping *= 8.0
    return None, damping


def differences(
    residual_at: Callable[[Array], Array],
    vector: Array,
    residual: Array,
    *,
    free: NDArray[np.int64],
    steps: Array,
    high: Array,
) -> Array | None:
    """Finite differences of the residuals.

    Args:
        residual_at: Vector (n,) to residuals.
        vector: Where they are taken, (n,).
        residual: (n_residuals,) there.
        free: (n_free,) indices of the entries that move.
        steps: (n_free,) how far; backwards from a bound.
        high: (n_free,) upper bounds.

    Returns:
        (n_residuals, n_free) changes by the steps; None where a run diverged.
    """

    # each column in one piece of memory: to interleave them takes longer than all that is done with them
    changes = np.empty((len(free), len(residual)))

    def column(k: int) -> bool:
        moved = vector.copy()
        sign = 1.0 if moved[free[k]] + steps[k] <= high[k] else -1.0
        moved[free[k]] += sign * steps[k]
        shifted = residual_at(moved)
        if shifted.shape != residual.shape:
            return False
        ahead, behind = (shifted, residual) if sign > 0.0 else (residual, shifted)
        np.subtract(ahead, behind, out=changes[k])
        return True

    return changes.T if all(in_threads(column, range(len(free)))) else None


def _jacobian(task: _Task, state: _State, difference: float) -> Array | None:
    """Finite differences (n_residuals, n_free) by prior standard deviations; None where a run diverged."""
    changes = differences(
        task.residual_at if task.near is None else task.near(state.vector),
        state.vector,
        state.residual,
        free=task.free,
        steps=difference * task.std,
        high=task.high,
    )
    if changes is not None:
        changes /= difference
    return changes
