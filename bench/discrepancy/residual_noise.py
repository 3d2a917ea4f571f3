"""The noise that residuals have: that of the response channels, and what a model makes of the noise of what drives it.

The noise of a measured load passes the linear structure on its way into the responses, and the sensors. The noise of a prescribed
motion becomes a force in the component, by its stiffness and damping first. A law that makes more of it, such as damping that grows
with the velocity, or a sensor of a wrong gain, is unknown before it is found, and its noise is counted once it is (`Problem.behind`).
Springs of the nominal model that bend are known: about a pendulum that swings far, noise passes a stiffness that changes as it swings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from bench.discrepancy.case import CaseRecord
from bench.discrepancy.prepared import fast_length, masked
from bench.discrepancy.system import Motion

if TYPE_CHECKING:
    from bench.discrepancy.placed import Hypothesis
    from bench.discrepancy.problem import Problem

Array = NDArray[np.float64]
SMOOTHED_BINS = 9
"""Bins over which the spectrum of draws of noise is averaged: with eight draws its level at a frequency is known to
some 12 %, and chi-squared to far less."""
DRAWS = 8
"""Draws of the noise of loads that pass a stiffness that changes."""


def whitening_behind(
    problem: Problem,
    record: CaseRecord,
    n_bins: int,
    model: tuple[Hypothesis, Array],
    compared: Array | None,
) -> NDArray[np.complex128]:
    """Matrices (n_bins, n_channels, n_channels) that whiten the spectrum of the residuals of a record.

    Args:
        problem: Structure and noise.
        record: The record.
        n_bins: Number of frequency bins in its band.
        model: Effects and vector, see `Problem.simulate`, that the noise of a prescribed motion passes. The noise of
            loads passes the linear structure at that vector, and the sensors.
        compared: (n,) ones and zeros: samples that are compared; None for all.
    """
    own = np.diag(problem.noise**2).astype(complex)
    noise = np.broadcast_to(own, (n_bins, *own.shape))
    if problem.driven:
        noise = noise + _power(forces_of_noise(problem, record, model), compared)[:n_bins, None, None]
    elif np.any(load_noise := problem.load_noise_of(record)):
        omega = 2.0 * np.pi * np.arange(n_bins) / (fast_length(len(record)) * record.step)
        linear = problem.structure.at(problem.split(*model)[0])
        if problem.structure.springs:
            passed = _about_the_motion(problem, record, model, load_noise)[:n_bins]
        else:
            scaled = problem.structure.transfer(linear, np.asarray(omega, dtype=np.float64)) * load_noise
            passed = scaled @ np.conj(np.swapaxes(scaled, 1, 2))
        gains = _gains(problem, record, model)
        noise = noise + passed * np.outer(gains, gains)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=np.complex128)


def _about_the_motion(
    problem: Problem, record: CaseRecord, model: tuple[Hypothesis, Array], load_noise: Array
) -> NDArray[np.complex128]:
    """Power (n_frequencies, n_channels, n_channels) of what the noise of loads moves beside the measured motion."""
    structure, values = problem.structure, problem.split(*model)[0]
    linear, position = structure.at(values), problem.motion_of(record).position
    slopes = np.column_stack([s.slope_along(s.coefficients(values), position) for s in structure.springs])
    rows = np.array([spring.row for spring in structure.springs])
    inverse = np.linalg.inv(linear.mass)
    stiffness, damping, spread = inverse @ linear.stiffness, inverse @ linear.damping, inverse @ rows.T
    rng = np.random.default_rng(0)
    n = len(record)
    total = np.zeros(
        (fast_length(n) // 2 + 1, len(structure.observers), len(structure.observers)), dtype=complex
    )
    for _ in range(DRAWS):
        push = (load_noise * rng.standard_normal((n, len(load_noise)))) @ (inverse @ linear.inputs).T
        moved = np.zeros((3, n, len(inverse)))
        _perturb(record.step, stiffness, damping, spread, rows, slopes, push, moved)
        channels = np.column_stack([moved[o.order] @ o.row for o in structure.observers])
        spectrum = np.fft.rfft(channels, fast_length(n), axis=0)
        total += spectrum[:, :, None] * np.conj(spectrum[:, None, :]) / (n * DRAWS)
    smooth = [
        ndimage.uniform_filter1d(x, SMOOTHED_BINS, axis=0, mode="nearest") for x in (total.real, total.imag)
    ]
    return np.asarray(smooth[0] + 1j * smooth[1], dtype=np.complex128)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _perturb(step, stiffness, damping, spread, rows, slopes, push, moved):
    """Positions, velocities and accelerations (3, n, n_dof) under accelerations `push` (n, n_dof), by Runge-Kutta steps of a sample.

    The stiffness is that of the structure and of springs along `rows` whose `slopes` (n, n_springs) change with time.
    """
    n, n_dof = push.shape
    n_springs = rows.shape[0]
    state, stage = np.zeros(2 * n_dof), np.zeros(2 * n_dof)
    rates = np.zeros((4, 2 * n_dof))
    for k in range(n):
        after = min(k + 1, n - 1)
        for part in range(4):
            at = 0.0 if part == 0 else (1.0 if part == 3 else 0.5)
            for i in range(2 * n_dof):
                stage[i] = state[i] + (at * step * rates[part - 1, i] if part > 0 else 0.0)
            for i in range(n_dof):
                rates[part, i] = stage[n_dof + i]
                total = (1.0 - at) * push[k, i] + at * push[after, i]
                for j in range(n_dof):
                    total -= stiffness[i, j] * stage[j] + damping[i, j] * stage[n_dof + j]
                for s in range(n_springs):
                    along = 0.0
                    for j in range(n_dof):
                        along += rows[s, j] * stage[j]
                    total -= spread[i, s] * ((1.0 - at) * slopes[k, s] + at * slopes[after, s]) * along
                rates[part, n_dof + i] = total
        for i in range(n_dof):
            moved[0, k, i] = state[i]
            moved[1, k, i] = state[n_dof + i]
            moved[2, k, i] = rates[0, n_dof + i]
        for i in range(2 * n_dof):
            state[i] += step / 6.0 * (rates[0, i] + 2.0 * (rates[1, i] + rates[2, i]) + rates[3, i])


def _gains(problem: Problem, record: CaseRecord, model: tuple[Hypothesis, Array]) -> Array:
    """How many times what moves a channel is recorded (n_channels,), behind the sensor effects of a model."""
    hypothesis, vector = model
    _, etas = problem.split(hypothesis, vector)
    own = [
        (placed, eta) for placed, eta in zip(hypothesis, etas, strict=True) if placed.effect.site == "sensor"
    ]
    moved = np.column_stack([record.values[name] for name in problem.structure.channels])
    if not own:
        return np.ones(moved.shape[1])
    sensors = tuple(placed for placed, _ in own), [eta for _, eta in own]
    still = problem.sensed(*sensors, np.zeros_like(moved), record.step)
    recorded = problem.sensed(*sensors, moved.copy(), record.step) - still
    return np.std(recorded, axis=0) / np.maximum(np.std(moved, axis=0), 1e-300)


def forces_of_noise(problem: Problem, record: CaseRecord, model: tuple[Hypothesis, Array]) -> Array:
    """Forces (n_draws, n) that the stated noise of a prescribed motion makes in a component; zero where none is stated.

    Args:
        problem: Component.
        record: Record of its motion.
        model: Effects and vector of the component, see `Problem.simulate`.
    """
    if not np.any(problem.load_noise):
        return np.zeros((1, len(record)))

    def force(motion: Motion) -> Array:
        moved = problem.forgetful()
        moved.motions[record.name] = motion
        return moved.simulate(*model, record)[:, 0]

    prescribed = problem.prescribed(record)
    return np.stack([force(motion) for motion in prescribed.noisy]) - force(prescribed.motion)


def _power(forces: Array, compared: Array | None) -> Array:
    """Smoothed power (n_frequencies,) of the compared samples of draws (n_draws, n)."""
    n = forces.shape[1]
    spectra = np.fft.rfft(masked(forces.T, compared), fast_length(n), axis=0)
    power = np.mean(np.abs(spectra) ** 2, axis=1) / n
    return np.asarray(ndimage.uniform_filter1d(power, SMOOTHED_BINS, mode="nearest"), dtype=np.float64)
