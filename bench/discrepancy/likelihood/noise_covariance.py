"""The noise that residuals have: that of the response channels, and what a model makes of the noise of what drives it.

The noise of a measured load passes the linear structure on its way into the responses, and the sensors. The noise of a prescribed
motion becomes a force in the component, by its stiffness and damping first. A law that makes more of it, such as damping that grows
with the velocity, or a sensor of a wrong gain, is unknown before it is found, and its noise is counted once it is (`Problem.behind`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.whitening import fast_length, masked
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import LikelihoodSettings
from bench.discrepancy.simulation.stick_slip import Motion


def whitening_behind(
    simulator: Simulator,
    record: CaseRecord,
    n_bins: int,
    model: tuple[Hypothesis, Array],
    compared: Array | None,
) -> NDArray[np.complex128]:
    """Matrices (n_bins, n_channels, n_channels) that whiten the spectrum of the residuals of a record.

    Args:
        simulator: Structure and noise.
        record: The record.
        n_bins: Number of frequency bins in its band.
        model: Effects and vector, see `Simulator.simulate`, that the noise of a prescribed motion passes. The noise of
            loads passes the linear structure at that vector, and the sensors.
        compared: (n,) ones and zeros: samples that are compared; None for all.
    """
    own = np.diag(simulator.noise**2).astype(complex)
    noise = np.broadcast_to(own, (n_bins, *own.shape))
    if simulator.driven:
        noise = (
            noise
            + _power(
                forces_of_noise(simulator, record, model), compared, settings=simulator.settings.likelihood
            )[:n_bins, None, None]
        )
    elif np.any(load_noise := simulator.load_noise_of(record)):
        omega = 2.0 * np.pi * np.arange(n_bins) / (fast_length(len(record)) * record.step)
        values, etas = simulator.split(*model)
        linear = simulator.linear(model[0], etas, values)
        scaled = simulator.structure.transfer(linear, np.asarray(omega, dtype=np.float64)) * load_noise
        scaled = scaled * sensor_gains(simulator, record, model)[:, None]
        noise = noise + scaled @ np.conj(np.swapaxes(scaled, 1, 2))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=np.complex128)


def sensor_gains(simulator: Simulator, record: CaseRecord, model: tuple[Hypothesis, Array]) -> Array:
    """How many times what moves a channel is recorded (n_channels,), behind the sensor effects of a model."""
    hypothesis, vector = model
    _, etas = simulator.split(hypothesis, vector)
    own = [
        (placed, eta) for placed, eta in zip(hypothesis, etas, strict=True) if placed.effect.site == "sensor"
    ]
    moved = simulator.responses_of(record)
    if not own:
        return np.ones(moved.shape[1])
    sensors = tuple(placed for placed, _ in own), [eta for _, eta in own]
    still = simulator.sensed(*sensors, np.zeros_like(moved), record.step)
    recorded = simulator.sensed(*sensors, moved.copy(), record.step) - still
    return np.std(recorded, axis=0) / np.maximum(np.std(moved, axis=0), 1e-300)


def forces_of_noise(simulator: Simulator, record: CaseRecord, model: tuple[Hypothesis, Array]) -> Array:
    """Forces (n_draws, n) that the stated noise of a prescribed motion makes in a component; zero where none is stated.

    Args:
        simulator: Component.
        record: Record of its motion.
        model: Effects and vector of the component, see `Simulator.simulate`.
    """
    if not np.any(simulator.load_noise):
        return np.zeros((1, len(record)))

    def force(motion: Motion) -> Array:
        moved = simulator.forgetful().moving({record.name: motion})
        return moved.simulate(*model, record)[:, 0]

    prescribed = simulator.prescribed(record)
    return np.stack([force(motion) for motion in prescribed.noisy]) - force(prescribed.motion)


def _power(forces: Array, compared: Array | None, *, settings: LikelihoodSettings) -> Array:
    """Smoothed power (n_frequencies,) of the compared samples of draws (n_draws, n)."""
    n = forces.shape[1]
    spectra = np.fft.rfft(masked(forces.T, compared), fast_length(n), axis=0)
    power = np.mean(np.abs(spectra) ** 2, axis=1) / n
    return np.asarray(
        ndimage.uniform_filter1d(power, settings.smoothed_bins, mode="nearest"), dtype=np.float64
    )
