"""Output-error fits: parameters of elements and structure from records of a whole rig.

The rig is simulated under the measured commands and its sensors are held against the measured ones; hidden states,
nominal masses, stiffnesses and dampings are all fitted at once. `bench.identification.parametric` fits a law to the
measured motion *and force* of one component; this needs no force channel at the joint, and pays with simulations.

All columns of a finite-difference Jacobian are simulated in one batch over threads, and so are the trial steps for
several dampings, so that no thread waits. Two engines give the same numbers: `LinearRig`, the compiled loop for rigs of
linear structure, and `mujoco.batch` for all others.

References:
    Ljung 1999, System Identification, section 7.4 (output-error structure).
    More 1978, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630.
    Transtrum and Sethna 2012, arXiv:1201.5885 (geodesic acceleration).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import IdentificationError, ParameterError, UnknownNameError
from bench.identification.linear_rig import current
from bench.identification.rig_response import (
    EngineName,
    Initial,
    LinearEngine,
    MujocoEngine,
    RigRecord,
    engine_for,
    moving_sensors,
    prepare,
    with_initial,
)
from bench.recording import Recording
from bench.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OutputErrorSettings:
    """Numbers of `bench.identification.output_error`."""

    difference: float = 1e-6
    ahead: float = 0.1
    dampings: tuple[float, float, float] = (10.0, 1.0, 0.1)


SETTINGS = OutputErrorSettings()
_POSITIVE = ("mass", "inertia")


@dataclass(frozen=True, eq=False)
class OutputErrorModel:
    """A rig with fitted parameters.

    Attributes:
        rig: The rig with these parameters in place.
        parameters: Fitted values by name.
        std: Their standard deviations, from the Jacobian at the optimum, residuals taken as white; too small where
            they are not. Infinite for what the records do not determine, 0 for a parameter at a bound.
        correlation: Correlation of the parameters ``(n_parameters, n_parameters)``.
        channels: Sensor channels fitted.
        residuals: Simulated less measured, by record ``(n_samples, n_channels)`` [unit of the channel].
        nrmse: rms(residual)/std(measured) by channel, over all records.
        cost: Half the sum of squared weighted residuals, priors included.
        iterations: Accepted steps.
        evaluations: Records simulated.
        stopped: "tolerance", "stall" (no damping lowers the cost), "gradient" or "iterations".
        engine: "linear" or "mujoco".
    """

    rig: Rig
    parameters: Mapping[str, float]
    std: Mapping[str, float]
    correlation: Array = field(repr=False)
    channels: tuple[str, ...]
    residuals: tuple[Array, ...] = field(repr=False)
    nrmse: Mapping[str, float]
    cost: float
    iterations: int
    evaluations: int
    stopped: str
    engine: str


class _Problem:
    """Residuals of all records, whitened, and the priors, as a function of the scaled parameters."""

    def __init__(
        self,
        engine: LinearEngine | MujocoEngine,
        records: Sequence[RigRecord],
        weights: Array,
        scale: Array,
        prior: tuple[Array, Array],
    ) -> None:
        self.engine, self.records, self.weights, self.scale = engine, records, weights, scale
        self.prior_mean, self.prior_precision = prior  # of the scaled parameters; precision 0 for none
        self.evaluations = 0
        self.n_residuals = sum(len(r.measured[r.scored]) for r in records) * len(weights)

    def residuals(self, record: RigRecord, points: Array) -> Array:
        """Simulated less measured over standard deviation ``(n_points, n)``."""
        self.evaluations += len(points)
        simulated = self.engine.simulate(record, points * self.scale)
        with np.errstate(invalid="ignore", over="ignore"):
            difference = (simulated - record.measured)[:, record.scored] * self.weights
        return difference.reshape(len(points), -1)

    def costs(self, points: Array) -> Array:
        """Half the sums of squares ``(n_points,)``; infinite where a simulation diverged."""
        total = np.zeros(len(points))
        for record in self.records:
            part = self.residuals(record, points)
            with np.errstate(invalid="ignore", over="ignore"):
                total += 0.5 * np.einsum("ij,ij->i", part, part)
        total += 0.5 * ((points - self.prior_mean) ** 2 @ self.prior_precision)
        return np.where(np.isfinite(total), total, np.inf)

    def linearise(self, point: Array, high: Array) -> _Linearisation:
        """Residuals and Jacobians by forward differences, backwards at an upper bound."""
        steps = np.where(point + SETTINGS.difference > high, -SETTINGS.difference, SETTINGS.difference)
        points = np.vstack([point, point + np.diag(steps)])
        curvature = np.diag(self.prior_precision)
        gradient = self.prior_precision * (point - self.prior_mean)
        residuals, jacobians = [], []
        for record in self.records:
            residual, *shifted = self.residuals(record, points)
            jacobian = (np.stack(shifted) - residual) / steps[:, None]
            # diverged: leave that parameter where it is
            jacobian[~np.all(np.isfinite(jacobian), axis=1)] = 0.0
            curvature = curvature + jacobian @ jacobian.T
            gradient = gradient + jacobian @ residual
            residuals.append(residual)
            jacobians.append(jacobian)
        return _Linearisation(point, curvature, gradient, residuals, jacobians)

    def bending(self, at: _Linearisation, moves: Array) -> Array:
        """``J' r''`` along each move ``(n_moves, n_parameters)``, r'' the second directional derivative of the residuals."""
        total = np.zeros_like(moves)
        for record, residual, jacobian in zip(self.records, at.residuals, at.jacobians, strict=True):
            ahead = self.residuals(record, at.point + SETTINGS.ahead * moves)
            with np.errstate(invalid="ignore", over="ignore"):
                second = 2.0 / SETTINGS.ahead * ((ahead - residual) / SETTINGS.ahead - moves @ jacobian)
            total += second @ jacobian.T
        return total


class _Linearisation(NamedTuple):
    point: Array
    curvature: Array  # J'J, priors included
    gradient: Array
    residuals: list[Array]  # by record (n,)
    jacobians: list[Array]  # by record (n_parameters, n)


class _Minimum(NamedTuple):
    point: Array
    cost: float
    curvature: Array
    held: NDArray[np.bool_]
    iterations: int
    stopped: str


def fit_output_error(
    rig: Rig,
    records: Sequence[Recording],
    *,
    free: Sequence[str],
    channels: Sequence[str] | None = None,
    inputs: Mapping[str, str] | None = None,
    initial: Initial | Sequence[Initial] | None = None,
    noise: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    search: Mapping[str, tuple[float, float]] | None = None,
    starts: int = 1,
    rng: np.random.Generator | None = None,
    engine: EngineName = "auto",
    threads: int | None = None,
    max_iterations: int = 60,
    tolerance: float = 1e-9,
    progress: Callable[[int, float], None] | None = None,
) -> OutputErrorModel:
    """Fit parameters of a rig to records of its sensors.

    Args:
        rig: The rig; its parameters are the start.
        records: Records, each with the commands of the rig's actuators and some of its sensors. Samples within a
            record's `settle` are simulated and not fitted.
        free: Parameters to fit: "<element>/<parameter>" or "structure/<mass, inertia, stiffness, damping or
            armature>/<body, joint or tendon>".
        channels: Sensors to fit; by default all that the first record has, commands and constant ones left out.
        inputs: Channel of the records that drives an actuator, by actuator name, where it is not called so: a load
            cell's channel, for example.
        initial: (position, velocity) by joint at the start, of all records or one mapping a record; at rest by default.
        noise: Standard deviation of the measurement noise by channel; that of the records' channels by default. Where
            neither is known for all channels, each is weighted by its spread and the noise estimated from the residuals.
        priors: (mean, standard deviation) by parameter; need known noise.
        bounds: (low, high) by parameter; by default those of the law, and masses above zero.
        search: Ranges that further starts are drawn from, log-uniform where both ends are positive.
        starts: Starts in all; sixteen candidates are tried for each further one and the best gone on with.
        rng: Source of the further starts.
        engine: "linear" for the compiled loop, "mujoco", or "auto": linear where the rig allows it.
        threads: Number of threads; all cores by default. It does not change the result.
        max_iterations: Most accepted steps from a start.
        tolerance: Relative fall of the cost below which a start ends.
        progress: Called with the iteration and the cost after each step.

    Returns:
        The best fit.

    Raises:
        UnknownNameError: A name is no parameter, channel or actuator of the rig or the records.
        IdentificationError: No records, nothing to fit, a channel that never changes, priors without known noise, or a
            rig that diverges at every start.
        ModelError: The linear engine was asked for and the rig is not of linear structure.
        ParameterError: A setting is out of range.
    """
    names = _names(records, free)
    start = np.array([current(rig, name) for name in names])
    chosen = tuple(channels) if channels is not None else moving_sensors(rig, records[0])
    prepared = [prepare(rig, r, chosen, inputs or {}, i) for r, i in with_initial(records, initial)]
    weights, known = _weights(records, chosen, prepared, noise)
    scale = _scales(names, start, search or {})
    prior = _priors(names, scale, priors or {}, known)
    low, high = _bounds(rig, names, bounds or {}) / scale
    workers = threads or os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as pool:
        simulator = engine_for(engine, rig, chosen, names, (pool, workers))
        problem = _Problem(simulator, prepared, weights, scale, prior)
        points = _starts(problem, names, start / scale, (low, high), search or {}, starts, rng)
        minima = [_minimise(problem, p, (low, high), max_iterations, tolerance, progress) for p in points]
        best = min(minima, key=lambda minimum: minimum.cost)
        if not math.isfinite(best.cost):
            raise IdentificationError(
                f"rig '{rig.name}' diverges at every start; start nearer, narrow `search`, or set a smaller timestep"
            )
        residuals = tuple(
            simulator.simulate(record, best.point[None, :] * scale)[0] - record.measured
            for record in prepared
        )
    return _report(rig, names, chosen, problem, best, (prepared, residuals, known))


def _names(records: Sequence[Recording], free: Sequence[str]) -> tuple[str, ...]:
    names = tuple(free)
    if not records or not names or len(set(names)) != len(names):
        raise IdentificationError(
            f"{len(records)} records and the free parameters {list(names)} came; at least one each, all different, is expected"
        )
    return names


def _scales(names: tuple[str, ...], start: Array, search: Mapping[str, tuple[float, float]]) -> Array:
    """Size of each parameter: that of its start, of its range of search where it starts at zero, or one."""
    scale = np.where(start != 0.0, np.abs(start), 1.0)
    for i, name in enumerate(names):
        if name in search and start[i] == 0.0:
            scale[i] = max(np.abs(search[name]))
    return scale


def _report(
    rig: Rig,
    names: tuple[str, ...],
    channels: tuple[str, ...],
    problem: _Problem,
    best: _Minimum,
    data: tuple[Sequence[RigRecord], tuple[Array, ...], bool],
) -> OutputErrorModel:
    prepared, residuals, known = data
    values = best.point * problem.scale
    variance = 1.0 if known else 2.0 * best.cost / max(problem.n_residuals - len(names), 1)
    std, correlation = _spread(best)
    std[np.isfinite(std)] *= math.sqrt(variance)
    error = np.concatenate([part[record.scored] for part, record in zip(residuals, prepared, strict=True)])
    measured = np.concatenate([record.measured[record.scored] for record in prepared])
    nrmse = np.sqrt(np.mean(error**2, axis=0)) / np.std(measured, axis=0)
    return OutputErrorModel(
        _fitted(rig, names, values),
        dict(zip(names, values.tolist(), strict=True)),
        dict(zip(names, (std * problem.scale).tolist(), strict=True)),
        correlation,
        channels,
        residuals,
        dict(zip(channels, nrmse.tolist(), strict=True)),
        best.cost,
        best.iterations,
        problem.evaluations,
        best.stopped,
        problem.engine.name,
    )


def _spread(best: _Minimum) -> tuple[Array, Array]:
    """Standard deviations for residuals of unit variance, and correlations, from the curvature at the optimum."""
    n = len(best.point)
    std, correlation = np.zeros(n), np.eye(n)
    free = np.flatnonzero(~best.held)
    size = np.sqrt(np.diag(best.curvature)[free])
    std[free[size == 0.0]] = np.inf
    free, size = free[size > 0.0], size[size > 0.0]
    if not free.size:
        return std, correlation
    values, vectors = np.linalg.eigh(best.curvature[np.ix_(free, free)] / np.outer(size, size))
    open_ends = (
        values <= SETTINGS.difference**2 * values[-1]
    )  # below what finite differences can tell from nothing
    inverse = (vectors[:, ~open_ends] / values[~open_ends]) @ vectors[:, ~open_ends].T
    spread = np.sqrt(np.diag(inverse))
    lost = np.sum(vectors[:, open_ends] ** 2, axis=1) > SETTINGS.difference
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation[np.ix_(free, free)] = np.where(
            np.logical_or.outer(lost, lost), np.eye(free.size), inverse / np.outer(spread, spread)
        )
    std[free] = np.where(lost, np.inf, spread / size)
    return std, correlation


def _minimise(
    problem: _Problem,
    point: Array,
    box: tuple[Array, Array],
    max_iterations: int,
    tolerance: float,
    progress: Callable[[int, float], None] | None,
) -> _Minimum:
    """Levenberg-Marquardt with geodesic acceleration, within bounds; each iteration tries several dampings at once."""
    low, high = box
    cost = float(problem.costs(point[None, :])[0])
    damping, iterations, stopped = 1e-3, 0, "iterations"
    held = np.zeros(len(point), dtype=bool)
    if not math.isfinite(cost):
        return _Minimum(point, cost, np.zeros((len(point), len(point))), held, 0, "diverged")
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
        point, cost, iterations = trials[chosen], float(costs[chosen]), iterations + 1
        damping = max(damping, 1e-12)
        if progress is not None:
            progress(iterations, cost)
        if fall <= tolerance * cost:
            stopped = "tolerance"  # the curvature at the end is still wanted
    return _Minimum(point, cost, at.curvature, held, iterations, stopped)


def _moves(problem: _Problem, at: _Linearisation, held: NDArray[np.bool_], dampings: Array) -> Array:
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


def _starts(
    problem: _Problem,
    names: tuple[str, ...],
    start: Array,
    box: tuple[Array, Array],
    search: Mapping[str, tuple[float, float]],
    starts: int,
    rng: np.random.Generator | None,
) -> list[Array]:
    for name in search:
        if name not in names:
            raise UnknownNameError("free parameter", name, names)
    if starts < 1 or (starts > 1 and (rng is None or not search)):
        raise ParameterError(
            f"{starts} starts, search {dict(search)} and rng {rng} came; more than one start needs `search` and `rng`"
        )
    first = np.clip(start, *box)
    if starts == 1 or rng is None:
        return [first]
    candidates = np.tile(first, (16 * (starts - 1), 1))
    for name, (lowest, highest) in search.items():
        share = rng.random(len(candidates))
        drawn = (
            lowest * (highest / lowest) ** share
            if lowest > 0.0 and highest > 0.0
            else lowest + (highest - lowest) * share
        )
        candidates[:, names.index(name)] = drawn / problem.scale[names.index(name)]
    order = np.argsort(problem.costs(candidates), kind="stable")
    return [first, *(np.clip(candidates[i], *box) for i in order[: starts - 1])]


def _weights(
    records: Sequence[Recording],
    channels: tuple[str, ...],
    prepared: Sequence[RigRecord],
    noise: Mapping[str, float] | None,
) -> tuple[Array, bool]:
    """One over the standard deviation of each channel, and whether that is its noise."""
    for name in noise or {}:
        if name not in channels:
            raise UnknownNameError("fitted channel", name, channels)
    stated = {name: records[0].channel(name).noise_std for name in channels} | dict(noise or {})
    measured = np.concatenate([record.measured[record.scored] for record in prepared])
    spread = np.std(measured, axis=0)
    for name, value, size in zip(channels, spread, np.max(np.abs(measured), axis=0), strict=True):
        if not value > 1e-14 * size:
            raise IdentificationError(f"channel '{name}' never changes; leave it out of `channels`")
    values = list(stated.values())
    if all(value is not None and value > 0.0 for value in values):
        return 1.0 / np.array(values, dtype=float), True
    return 1.0 / spread, False


def _priors(
    names: tuple[str, ...], scale: Array, priors: Mapping[str, tuple[float, float]], known: bool
) -> tuple[Array, Array]:
    mean, precision = np.zeros(len(names)), np.zeros(len(names))
    if priors and not known:
        raise IdentificationError(
            "priors weigh against measurement noise, which is not known; give `noise`, or channels with noise_std"
        )
    for name, (centre, deviation) in priors.items():
        if name not in names:
            raise UnknownNameError("free parameter", name, names)
        if not deviation > 0.0:
            raise ParameterError(
                f"prior of '{name}' has the standard deviation {deviation}; a positive one is expected"
            )
        place = names.index(name)
        mean[place] = centre / scale[place]
        precision[place] = (scale[place] / deviation) ** 2
    return mean, precision


def _bounds(rig: Rig, names: tuple[str, ...], bounds: Mapping[str, tuple[float, float]]) -> Array:
    """Lower and upper bounds ``(2, n_parameters)``."""
    for name in bounds:
        if name not in names:
            raise UnknownNameError("free parameter", name, names)
    result = []
    for name in names:
        first, _, rest = name.partition("/")
        if first == "structure" and "/" in rest:
            kind = rest.split("/", 1)[0]
            lowest = (
                1e-6 * current(rig, name) if kind in _POSITIVE else -math.inf if kind == "stiffness" else 0.0
            )
            default = (lowest, math.inf)
        else:
            label, _, parameter = name.rpartition("/")
            law = rig.element(label).law
            default = law.parameters[law.parameter_names.index(parameter)].bounds
        result.append(bounds.get(name, default))
    return np.array(result).T


def _fitted(rig: Rig, names: tuple[str, ...], values: Array) -> Rig:
    for name, value in zip(names, values.tolist(), strict=True):
        first, _, rest = name.partition("/")
        if first == "structure" and "/" in rest:
            kind, target = rest.split("/", 1)
            rig = rig.with_structure(**{kind: {target: value}})
        else:
            label, _, parameter = name.rpartition("/")
            rig = rig.with_element(rig.element(label).with_(**{parameter: value}))
    return rig
