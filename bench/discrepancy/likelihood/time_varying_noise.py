"""What becomes of the noise of a load about a motion whose stiffness changes as it swings.

About rest a linear structure passes noise frequency by frequency. About a pendulum that swings far the stiffness changes with the
angle: noise is passed on at the resonance of the moment, and what comes of it at one frequency goes with what comes at the next.
Looked at frequency by frequency, it would seem to be several times less than it is where a change of the stiffness moves the response,
and clean records would call for springs. So the lower bins, where the resonances are, are whitened together.

The response of every bin to the load of every instant follows from one run of the adjoint equations, backwards in time.

References:
    A. E. Bryson, Y.-C. Ho, Applied Optimal Control, 1975 (adjoint of a linear system, section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
from scipy.linalg import cholesky, solve_triangular

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.whitening import fast_length
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.motion.observer import ACCELERATION, Observer
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import LikelihoodSettings


def whitening_together(
    simulator: Simulator, record: CaseRecord, n_bins: int, values: Array, gains: Array
) -> Array | None:
    """Matrix (k, k) that whitens the lower bins of the spectrum of a record's residuals together; None where bins can stand alone.

    Args:
        simulator: Structure and noise.
        record: The record, whose measured motion decides the stiffness of the moment.
        n_bins: Number of frequency bins in its band.
        values: Values (n_parameters,) of the nominal parameters.
        gains: (n_channels,) what sensors make of a motion.

    Returns:
        Lower triangular; rows and columns are the real parts of the bins, channel by channel within each, then the imaginary ones.
    """
    settings = simulator.settings.likelihood
    structure, load_noise = simulator.structure, simulator.load_noise_of(record)
    if not structure.springs or not np.any(load_noise):
        return None
    linear = structure.at(values)
    n_dof, length, step = len(linear.mass), fast_length(len(record)), record.step
    highest = float(
        np.sqrt(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)))))
    )
    count = int(
        np.clip(
            np.ceil(settings.together_above * highest * length * step / (2.0 * np.pi)),
            1,
            min(n_bins, settings.together_bins),
        )
    )
    omega = 2.0 * np.pi * np.arange(count) / (length * step)
    inverse = np.linalg.inv(linear.mass)
    rate = _rates(structure, values, simulator.motion_of(record).position)
    inputs = np.vstack([np.zeros((n_dof, len(load_noise))), inverse @ linear.inputs * load_noise])
    discrete = _discrete(rate, inputs, step, settings=simulator.settings.likelihood)
    n_channels = len(structure.observers)
    own = np.repeat(np.tile(simulator.noise**2, count)[None], 2, axis=0)
    own[0, :n_channels] *= 2.0  # the mean is all real
    covariance = np.diag(own.ravel())
    seen, direct = _seen(structure.observers, rate, inputs)
    later = np.zeros((n_channels, 2 * n_dof, count), dtype=np.complex128)
    for end in range(len(record), 0, -settings.together_block):
        begin = max(end - settings.together_block, 0)
        moved = np.zeros((end - begin, len(load_noise), count, n_channels), dtype=np.complex128)
        for c in range(n_channels):
            _adjoint(begin, end, omega * step, *discrete, seen[c], direct[c], later[c], moved[..., c])
        moved *= gains / np.sqrt(len(record) / 2.0)
        flat = np.stack([moved.real, moved.imag], axis=2).reshape((end - begin) * len(load_noise), -1)
        covariance += flat.T @ flat
    lower = cholesky(covariance, lower=True)
    return np.asarray(solve_triangular(lower, np.eye(len(lower)), lower=True), dtype=np.float64)


def _seen(observers: Sequence[Observer], rate: Array, inputs: Array) -> tuple[Array, Array]:
    """Channels of a state (n_channels, n, 2 n_dof) at every sample, and of a load at once (n_channels, n_loads)."""
    n_dof = rate.shape[1] // 2
    seen, direct = (
        np.zeros((len(observers), len(rate), 2 * n_dof)),
        np.zeros((len(observers), inputs.shape[1])),
    )
    for c, observer in enumerate(observers):
        if observer.order == ACCELERATION:
            seen[c] = np.einsum("i,kij->kj", observer.row, rate[:, n_dof:])
            direct[c] = observer.row @ inputs[n_dof:]
        else:
            seen[c, :, observer.order * n_dof : (observer.order + 1) * n_dof] = observer.row
    return seen, direct


def _rates(structure: Structure, values: Array, position: Array) -> Array:
    """Rate of the state about a motion (n, n_dof), at every sample (n, 2 n_dof, 2 n_dof)."""
    linear = structure.at(values)
    n_dof = len(linear.mass)
    inverse = np.linalg.inv(linear.mass)
    rate = np.zeros((len(position), 2 * n_dof, 2 * n_dof))
    rate[:, :n_dof, n_dof:] = np.eye(n_dof)
    rate[:, n_dof:, :n_dof] = -inverse @ linear.stiffness
    rate[:, n_dof:, n_dof:] = -inverse @ linear.damping
    for spring in structure.springs:
        slope = spring.slope_along(spring.coefficients(values), position)
        rate[:, n_dof:, :n_dof] -= slope[:, None, None] * np.outer(inverse @ spring.row, spring.row)
    return rate


def _discrete(
    rate: Array, inputs: Array, step: float, *, settings: LikelihoodSettings
) -> tuple[Array, Array, Array]:
    """Transitions (n - 1, m, m), and effects (n - 1, m, n_loads) of the loads at the start and end of each step, straight between."""
    middle = 0.5 * step * (rate[:-1] + rate[1:])
    eye = np.broadcast_to(np.eye(rate.shape[1]), middle.shape)
    transition, held, rising, term = eye.copy(), eye.copy(), 0.5 * eye, eye
    factorial = 1.0
    for k in range(1, settings.transition_terms + 1):
        term = term @ middle
        factorial *= k
        transition = transition + term / factorial
        held = held + term / (factorial * (k + 1))
        rising = rising + term / (factorial * (k + 1) * (k + 2))
    return transition, step * (held - rising) @ inputs, step * rising @ inputs


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _adjoint(begin, end, phase, steps, first, last, seen, direct, later, moved):
    """Spectrum of a channel that a unit of each load makes, at the instants from `begin` to `end`, backwards.

    Args:
        begin: First instant.
        end: The one after the last.
        phase: (n_bins,) angle of a sample at each frequency.
        steps: Transitions (n - 1, m, m).
        first: (n - 1, m, n_loads) effect of a load on the step that it begins.
        last: Likewise on the step that it ends.
        seen: (n, m) the channel.
        direct: (n_loads,) what it has of the loads at once.
        later: (m, n_bins) adjoint state after the last instant, changed to that of the first.
        moved: (end - begin, n_loads, n_bins), written.
    """
    n, m = seen.shape
    now = np.zeros(m, dtype=np.complex128)
    for k in range(end - 1, begin - 1, -1):
        for b in range(phase.shape[0]):
            turn = np.exp(-1j * phase[b] * k)
            for i in range(m):
                now[i] = seen[k, i] * turn
                if k < n - 1:
                    for j in range(m):
                        now[i] += steps[k, j, i] * later[j, b]
            for u in range(direct.shape[0]):
                effect = direct[u] * turn
                for i in range(m):
                    if k < n - 1:
                        effect += later[i, b] * first[k, i, u]
                    if k > 0:
                        effect += now[i] * last[k - 1, i, u]
                moved[k - begin, u, b] = effect
            for i in range(m):
                later[i, b] = now[i]
