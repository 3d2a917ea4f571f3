"""Output-error fits: parameters of elements and structure from records of a whole rig.

The rig is simulated under the measured commands and its sensors are held against the measured ones; hidden states,
nominal masses, stiffnesses and dampings are all fitted at once. `bench.identification.parametric` fits a law to the
measured motion *and force* of one component; this needs no force channel at the joint, and pays with simulations.

All columns of a finite-difference Jacobian are simulated in one batch over threads, and so are the trial steps for
several dampings, so that no thread waits. Two engines give the same numbers: `LinearRig`, the compiled loop for rigs of
linear structure, and `mujoco.batch` for all others.

References:
    Ljung 1999, System Identification, section 7.4 (output-error structure).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from bench.arrays import Array
from bench.errors import IdentificationError, ParameterError, UnknownNameError
from bench.identification.geodesic_steps import FittedPoint, descend
from bench.identification.linear_rig import current
from bench.identification.output_error_problem import SETTINGS, OutputErrorProblem
from bench.identification.rig_response import (
    EngineName,
    Initial,
    RigRecord,
    engine_for,
    moving_sensors,
    prepare_response,
    with_initial,
)
from bench.recording import Recording
from bench.rig import Rig

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
    prepared = [prepare_response(rig, r, chosen, inputs or {}, i) for r, i in with_initial(records, initial)]
    weights, known = _weights(records, chosen, prepared, noise)
    scale = _scales(names, start, search or {})
    prior = _priors(names, scale, priors or {}, known)
    low, high = _bounds(rig, names, bounds or {}) / scale
    workers = threads or os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as pool:
        simulator = engine_for(engine, rig, chosen, names, (pool, workers))
        problem = OutputErrorProblem(simulator, prepared, weights, scale, prior)
        points = _starts(problem, names, start / scale, (low, high), search or {}, starts, rng)
        minima = [descend(problem, p, (low, high), max_iterations, tolerance, progress) for p in points]
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
    problem: OutputErrorProblem,
    best: FittedPoint,
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


def _spread(best: FittedPoint) -> tuple[Array, Array]:
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


def _starts(
    problem: OutputErrorProblem,
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
