"""Whitening of the residuals of windows that are restarted from the measured state.

That state is known to the noise only; the responses of the model to a wrong start are projected out of the residuals of every window,
which is the same as fitting a start to every window under a flat prior, without the hundreds of parameters. They are those of the
model at hand, friction and all: a wrong velocity before a reversal moves the reversal, and dry friction more than doubles
the error, which the responses of the linear structure would miss. Residuals are whitened exactly: the noise of a
measured load, integrated within the window, is correlated and not stationary. Where no noise is stated, what the simplest models
leave is an error of force, not of position, and it is weighed as such: a white force in proportion to the loads. Positions
weighed alike would let an error that lasts, twice integrated, outweigh everything that reverses with the motion.

References:
    G. H. Golub, V. Pereyra, SIAM Journal on Numerical Analysis 10 (1973) 413-432 (variable projection).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular, toeplitz

from bench.arrays import Array
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.response.windows import channels_of
from bench.discrepancy.settings import LikelihoodSettings
from bench.discrepancy.simulation.stick_slip import NO_ELEMENTS, StructureMatrices, free_run


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


class RestartWindows(NamedTuple):
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


def window_weights(
    structure: Structure,
    linear: StructureMatrices,
    *,
    step: float,
    length: int,
    share: float,
    noise: Array,
    load_noise: Array,
    model_error: Array,
    settings: LikelihoodSettings,
) -> tuple[Array, Array, Array]:
    """Whitening of the residuals of a window, what a start reaches, and the covariance of what noise leaves; see `RestartWindows`.

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


def white_force(simulator: Simulator) -> Array:
    """White force (n_loads,) that stands for what a model of a measured rig leaves; zero where the noise is stated."""
    stated = simulator.noise_stated or bool(np.any(simulator.load_noise > 0.0))
    loads = [[record.values[name] for name in simulator.structure.loads] for record in simulator.records]
    largest = np.max(np.sqrt(np.mean(np.square(np.concatenate(loads, axis=1)), axis=1)), initial=0.0)
    return np.full(
        len(simulator.load_noise), 0.0 if stated else simulator.settings.likelihood.white_force * largest
    )
