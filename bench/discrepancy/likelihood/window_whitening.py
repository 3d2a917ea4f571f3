"""Where free runs start: at rest, in motion, or anew in every window.

A record that starts at rest is simulated from rest. One that starts in motion has an unknown initial state: position and
velocity of every degree of freedom become parameters of the fit, one set a record, with a prior as broad as the motion
itself around what the smoothed measurement shows. On a judging record, which no fit sees, they are estimated from the
record itself, for every model alike. Hidden states of hysteretic laws start at zero: a law forgets its start
within a reversal or two, and a record that tells neither the start nor the law could not tell them together.

Without a stiffness a free run drifts: the smallest force error grows with the square of time, and whole-record residuals say
nothing but that. The record is then cut into windows, each restarted from the smoothed measured state. That state is known
to the noise only; the responses of the model to a wrong start are projected out of the residuals of every window, which
is the same as fitting a start to every window under a flat prior, without the hundreds of parameters. They are those of the
model at hand, friction and all: a wrong velocity before a reversal moves the reversal, and dry friction more than doubles
the error, which the responses of the linear structure would miss. Residuals are whitened exactly: the noise of a
measured load, integrated within the window, is correlated and not stationary. Where no noise is stated, what the simplest models
leave is an error of force, not of position, and it is weighed as such: a white force in proportion to the loads. Positions
weighed alike would let an error that lasts, twice integrated, outweigh everything that reverses with the motion.

References:
    H. G. Bock, Recent advances in parameter identification techniques for ODE, Birkhaeuser 1983 (multiple shooting).
    G. H. Golub, V. Pereyra, SIAM Journal on Numerical Analysis 10 (1973) 413-432 (variable projection).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular, toeplitz

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.settings import DEFAULT, LikelihoodSettings
from bench.discrepancy.simulation.prescribed_response import driven_states
from bench.discrepancy.simulation.stick_slip import (
    NO_ELEMENTS,
    Elements,
    LinearStructure,
    Motion,
    free_run,
    steps_of_each,
)

if TYPE_CHECKING:
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.model.placement import Hypothesis

Array = NDArray[np.float64]

START = "start "
"""Beginning of the names of initial states among the parameters."""


@numba.njit(cache=True, error_model="numpy", nogil=True, fastmath={"reassoc", "contract"})
def _products(parts, weights, out):
    """Products of every row of `parts` with every row of `weights`.

    A library's product would be as fast for one thread; called from the two threads of a fit it wakes threads of its own, which
    took ten times as long.
    """
    for w in range(parts.shape[0]):
        for i in range(weights.shape[0]):
            total = 0.0
            for j in range(parts.shape[1]):
                total += weights[i, j] * parts[w, j]
            out[w, i] = total


class Windows(NamedTuple):
    """Windows of one record, restarted each from the measured state.

    Attributes:
        firsts: (n_windows,) first sample of each.
        length: Samples of each that count; the last one runs on to the end of the record.
        weights: (n_rows, length * n_channels); times the residuals of a window, sample by sample, is white.
        reachable: (n_rows, n_reachable) orthonormal, what a wrong start of the linear structure makes of it.
        floor: (n_channels, n_channels) mean covariance within a window of residuals that are noise alone, its start fitted.
    """

    firsts: NDArray[np.int64]
    length: int
    weights: Array
    reachable: Array
    floor: Array

    def whitened(self, residual: Array) -> Array:
        """Whitened residuals (n_windows, n_rows) of a record (n, n_channels)."""
        parts = np.stack([residual[first : first + self.length].ravel() for first in self.firsts])
        out = np.zeros((len(parts), len(self.weights)))
        _products(parts, self.weights, out)
        return out

    @property
    def n_residuals(self) -> int:
        """Number of residuals that no start can explain."""
        return len(self.firsts) * (self.reachable.shape[0] - self.reachable.shape[1])


def drifts(structure: Structure, linear: LinearStructure, duration: float) -> bool:
    """Whether a measured motion is without a stiffness that would bring it back within the record.

    Args:
        structure: For its observers.
        linear: Matrices of the nominal model.
        duration: Length of the longest record [s].
    """
    free = np.ix_(structure.free, structure.free)
    squares, modes = np.linalg.eig(np.linalg.solve(linear.mass[free], linear.stiffness[free]))
    slow = np.abs(squares) < (2.0 * np.pi / duration) ** 2
    return bool(
        any(np.any(np.abs(o.row[structure.free] @ modes[:, slow]) > 1e-9) for o in structure.observers)
    )


def cut(
    case: Case, record: CaseRecord, n_channels: int, *, settings: LikelihoodSettings = DEFAULT.likelihood
) -> tuple[NDArray[np.int64], int]:
    """First samples and length of the windows of a record; `window_s` in nominal.json overrides the length."""
    n = len(record)
    asked = case.options.get("window_s")
    wanted = n / settings.windows if asked is None else float(str(asked)) / record.step
    length = int(
        np.clip(
            wanted,
            settings.window_shortest,
            min(n, max(settings.window_largest // n_channels, settings.window_shortest)),
        )
    )
    count = max(n // length, 1)
    length = n // count
    return np.arange(count, dtype=np.int64) * length, length


def window_weights(
    structure: Structure,
    linear: LinearStructure,
    *,
    step: float,
    length: int,
    share: float,
    noise: Array,
    load_noise: Array,
    model_error: Array,
    settings: LikelihoodSettings,
) -> tuple[Array, Array, Array]:
    """Whitening of the residuals of a window, what a start reaches, and the covariance of what noise leaves; see `Windows`.

    Args:
        structure: For its observers.
        linear: Matrices of the nominal model.
        step: Time between samples [s].
        length: Samples of the window.
        share: Part of the frequencies up to Nyquist in which the records stand above their noise.
        noise: (n_channels,) of the response channels.
        load_noise: (n_loads,).
        model_error: (n_loads,) white force that is weighed like noise of a load, and is none.
        settings: `LikelihoodSettings` of the diagnosis.
    """
    n_channels, n_dof = len(noise), linear.mass.shape[0]
    n_bins = int(np.clip(np.ceil(share * length / 2), min(16, length // 4), (length - 1) // 2))
    phase = 2.0 * np.pi * np.outer(np.arange(1, n_bins), np.arange(length)) / length
    basis = np.vstack([np.full((1, length), np.sqrt(0.5)), np.cos(phase), np.sin(phase)])
    basis *= np.sqrt(2.0 / length)
    quiet = np.zeros((length, linear.inputs.shape[1]))
    states = []
    for i in range(2 * n_dof):
        start = np.zeros(2 * n_dof)
        start[i] = 1.0
        states.append(
            channels_of(structure, free_run(linear, NO_ELEMENTS, loads=quiet, step=step, start=start))
        )
    spanned = np.stack(states, axis=-1)
    driven = []
    error = np.hypot(load_noise, model_error)
    for j in np.flatnonzero(error > 0):
        load = quiet.copy()
        load[1, j] = error[j]
        hat = channels_of(structure, free_run(linear, NO_ELEMENTS, loads=load, step=step))[1:]
        hat = np.vstack([hat, np.zeros((1, n_channels))])
        driven += [np.stack([toeplitz(hat[:, c], np.zeros(length)) for c in range(n_channels)], axis=1)]
    rows = np.kron(basis, np.eye(n_channels))
    covariance = (rows.reshape(-1, length, n_channels) * noise).reshape(len(rows), -1)
    covariance = covariance @ covariance.T
    for response in driven:
        passed = rows @ response.reshape(length * n_channels, -1)
        covariance += passed @ passed.T
    weights = solve_triangular(cholesky(covariance, lower=True), rows, lower=True)
    reachable = orthonormal(weights @ spanned.reshape(length * n_channels, -1), settings=settings)
    noisy = [
        (load_noise / error)[j] * response
        for j, response in zip(np.flatnonzero(error > 0), driven, strict=True)
    ]
    return np.ascontiguousarray(weights), reachable, _left_by_noise(spanned, noisy, noise, settings=settings)


def orthonormal(columns: Array, *, settings: LikelihoodSettings) -> Array:
    """Orthonormal basis (n, rank) of what columns span; columns that add nothing to speak of are left out."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    basis, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(
        basis[:, sizes > settings.start_singular * max(float(sizes.max(initial=0.0)), 1e-300)],
        dtype=np.float64,
    )


def _left_by_noise(
    spanned: Array, driven: list[Array], noise: Array, *, settings: LikelihoodSettings
) -> Array:
    """Mean covariance of the channels within a window after the start has been fitted to noise."""
    length, n_channels, _ = spanned.shape
    basis = orthonormal((spanned / noise[:, None]).reshape(length * n_channels, -1), settings=settings)
    total = np.diag(noise**2)
    for response in driven:
        white = (response / noise[:, None]).reshape(length * n_channels, -1)
        rest = (white - basis @ (basis.T @ white)).reshape(length, n_channels, -1)
        total = total + np.einsum("tcs,tds->cd", rest, rest) / length * np.outer(noise, noise)
    return np.asarray(total, dtype=np.float64)


def windows_of(problem: Problem, record: CaseRecord, n_bins: int, values: Array) -> Windows | None:
    """Windows of a record that would drift, whitened for the structure at parameter `values`; None for other records."""
    if not problem.windowed:
        return None
    firsts, length = cut(problem.case, record, len(problem.noise), settings=problem.settings.likelihood)
    share = round(2.0 * n_bins / len(record), 2)
    cache, key = problem.__dict__.setdefault("_weights", {}), (record.step, length, share, values.tobytes())
    if key not in cache:
        cache[key] = window_weights(
            problem.structure, problem.structure.at(values), step=record.step, length=length, share=share,
            noise=problem.noise, load_noise=problem.load_noise, model_error=_model_error(problem),
        settings=problem.settings.likelihood)  # fmt: skip
    return Windows(firsts, length, *cache[key])


def _model_error(problem: Problem) -> Array:
    """White force (n_loads,) that stands for what a model of a measured rig leaves; zero where the noise is stated."""
    stated = problem.noise_stated or bool(np.any(problem.load_noise > 0.0))
    loads = [[record.values[name] for name in problem.structure.loads] for record in problem.records]
    largest = np.max(np.sqrt(np.mean(np.square(np.concatenate(loads, axis=1)), axis=1)), initial=0.0)
    return np.full(
        len(problem.load_noise), 0.0 if stated else problem.settings.likelihood.white_force * largest
    )


def start_responses(
    problem: Problem, hypothesis: Hypothesis, vector: Array, record: CaseRecord, predicted: Array
) -> list[Array]:
    """Change of the channels (n, n_channels) with each entry of the windows' starts, by finite differences.

    Args:
        problem: Records and nominal model.
        hypothesis: Effects.
        vector: See `Problem.simulate`.
        record: The record.
        predicted: (n, n_channels) from the starts as measured.
    """
    motion = problem.motion_of(record)
    starts = measured_states(motion, problem.firsts(record))
    spread = np.concatenate([np.std(motion.position, axis=0), np.std(motion.velocity, axis=0)])
    steps = problem.settings.likelihood.start_difference * np.where(spread > 0.0, spread, 1.0)
    return [
        problem.simulate(hypothesis, vector, record, starts=starts + step) - predicted
        for step in np.diag(steps)
    ]


def channels_of(structure: Structure, motion: Motion) -> Array:
    """Channels (n, n_channels) of a motion."""
    return np.column_stack([motion[o.order] @ o.row for o in structure.observers])


def measured_states(motion: Motion, firsts: NDArray[np.int64]) -> Array:
    """Positions and velocities (n_windows, 2 n_dof) of a motion at some samples."""
    return np.hstack([motion.position[firsts], motion.velocity[firsts]])


def restarted(
    linear: LinearStructure,
    elements: Elements,
    *,
    loads: Array,
    step: float,
    firsts: NDArray[np.int64],
    starts: Array,
    motion: Motion | None = None,
    substeps: int | NDArray[np.int64] = 1,
    load_factor: int = 1,
    start_time: float = 0.0,
) -> Motion:
    """Simulate window by window, each from its own start.

    Args:
        linear: Matrices.
        elements: Force laws.
        loads: Loads of the whole record, as `free_run` takes them.
        step: Time between samples [s].
        firsts: (n_windows,) first sample of each window, the first one zero.
        starts: (n_windows, 2 n_dof) positions and velocities.
        motion: Measured motion, along which hidden states are carried to the start of each window; zero where None.
        substeps: Runge-Kutta steps a sample, or (n,) of each.
        load_factor: As of `free_run`.
        start_time: Time of the first sample [s].

    Returns:
        The motion of the whole record; it jumps where a window begins.
    """
    factor = max(load_factor, 1)
    n = (len(loads) - 1) // factor + 1
    hidden = np.tile(elements.start, (len(firsts), 1))
    if len(elements.start) and motion is not None:
        hidden = driven_states(
            elements, position=motion.position @ elements.rows.T, velocity=motion.velocity @ elements.rows.T,
            step=step, at=firsts, substeps=substeps, start_time=start_time,
        )  # fmt: skip
    counts = steps_of_each(substeps, n)
    parts = []
    for first, end, start, z in zip(firsts, np.append(firsts[1:], n), starts, hidden, strict=True):
        part = loads[first * factor : (end - 1) * factor + 1]
        parts.append(
            free_run(
                linear, elements._replace(start=z), loads=part, step=step, substeps=counts[first:end],
                load_factor=load_factor, start=start, start_time=start_time + first * step,
            )
        )  # fmt: skip
    return Motion(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def in_motion(record: CaseRecord) -> bool:
    """Whether a free run of a record needs an initial state; a periodic one runs in from rest instead."""
    return not record.at_rest and not record.periodic


def start_name(quantity: str, dof: str, record: str) -> str:
    """Name of an initial state as a parameter."""
    return f"{START}{quantity} of {dof} in {record}"


def with_starts(structure: Structure, records: tuple[CaseRecord, ...]) -> Structure:
    """Return a structure that has the initial states of records in motion among its parameters; they move no matrix."""
    names = tuple(
        start_name(quantity, dof, record.name)
        for record in records
        if in_motion(record)
        for quantity in ("position", "velocity")
        for dof in structure.dofs
    )
    if not names:
        return structure
    n_dof = len(structure.dofs)
    zeros = np.zeros((len(names), n_dof, n_dof))
    return replace(
        structure,
        parameters=structure.parameters + names,
        mass=np.concatenate([structure.mass, zeros]),
        damping=np.concatenate([structure.damping, zeros]),
        stiffness=np.concatenate([structure.stiffness, zeros]),
    )


def without_starts(structure: Structure) -> Structure:
    """Return a structure as it was before `with_starts`."""
    kept = [i for i, name in enumerate(structure.parameters) if not name.startswith(START)]
    if len(kept) == len(structure.parameters):
        return structure
    return replace(
        structure,
        parameters=tuple(structure.parameters[i] for i in kept),
        mass=structure.mass[kept],
        damping=structure.damping[kept],
        stiffness=structure.stiffness[kept],
    )


def start_priors(motions: list[Motion]) -> tuple[Array, Array]:
    """Mean and standard deviation of the initial states of records in motion, in the order of `with_starts`."""
    mean, std = [], []
    for motion in motions:
        for samples in (motion.position, motion.velocity):
            mean.append(samples[0])
            spread = np.std(samples, axis=0)
            # a degree of freedom that nothing measures moves as widely as the others, for all one knows
            std.append(np.where(spread > 0.0, spread, np.max(spread, initial=0.0) or 1.0))
    if not mean:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(mean), np.concatenate(std)
