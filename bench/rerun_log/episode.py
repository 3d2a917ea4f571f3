"""An excitation episode in the rerun viewer: the rig under the commands, how near its limits, and what is known by when."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.excitation import Experiment, RigPrior, Sensitivity, fisher_information, sensitivity
from bench.excitation.information import noise_vector
from bench.recording import Recording
from bench.rerun_log.comparison import log_comparison
from bench.rig import Rig, simulate


def episode_record(
    rig: Rig, experiment: Experiment, controls: NDArray[np.float64], *, n_told: int = 12
) -> Recording:
    """The rig under the commands, with its nearness to the limits and the information so far as further channels.

    Args:
        rig: The rig.
        experiment: What is asked of it; its merit of the commands up to an instant is the information by then.
        controls: Commands (n, n_actuators) [N, N m].
        n_told: Instants at which the information is told; each costs a simulation of every drawn rig.

    Returns:
        The record, with "limit/…" for each limited channel, force and energy [1] (1 at the limit), "information" [1] (nat; of
        rivals the mean logarithm of the expected Bayes factor), and, where parameters are asked for, "unknown/…" for each [1]: the
        standard deviation that is left of it, 1 before the test.
    """
    limits = experiment.limits
    record = simulate(rig, {name: controls[:, i] for i, name in enumerate(limits.actuators)})
    n = len(record.time)
    shares = {
        f"limit/{name}": np.abs(record[name]) / limit
        for name, limit in limits.watched.items()
        if name in record.names and np.isfinite(limit)
    }
    step = experiment.timestep
    for i, name in enumerate(limits.actuators):
        shares[f"limit/force of {name}"] = _long(np.abs(controls[:, i]) / limits.force[name], n)
        if name in limits.energy:
            spent = step * np.cumsum(controls[:, i] ** 2) / limits.energy[name]
            shares[f"limit/energy of {name}"] = _long(spent, n)
    ends = np.linspace(0, len(controls), n_told + 1).astype(int)[1:]
    # A test that ends there: what the free decay after it would tell is not known yet.
    told = np.array([0.0, *(float(experiment.merit(controls[None, :end])[0]) for end in ends)])
    course = np.interp(np.arange(n), np.concatenate([[0], ends]), told)
    arrays = shares | {"information": course} | _unknown(experiment, controls, ends, n)
    return record.with_channels(arrays, units=dict.fromkeys(arrays, "1"))


def _unknown(
    experiment: Experiment, controls: NDArray[np.float64], ends: NDArray[np.int64], n: int
) -> dict[str, NDArray[np.float64]]:
    """What is left of each parameter's prior standard deviation, mean over the drawn rigs that have it, at the n samples."""
    if not isinstance(experiment.question, RigPrior):
        return {}
    noise = noise_vector(experiment.noise, experiment.channels)
    drive = {name: controls[:, i] for i, name in enumerate(experiment.actuators)}
    left: dict[str, list[NDArray[np.float64]]] = {}
    for draw in experiment.rigs_drawn:
        output, jacobian = sensitivity(draw, drive, channels=experiment.channels)
        parts = [fisher_information(Sensitivity(output[:end], jacobian[:end]), noise) for end in ends]
        covariance = np.linalg.inv(np.eye(jacobian.shape[-1]) + np.stack(parts))
        deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        for name, course in zip(draw.hypothesis.names, deviation.T, strict=True):
            left.setdefault(f"unknown/{name}", []).append(course)
    knots = np.concatenate([[0], ends])
    return {
        name: np.interp(np.arange(n), knots, np.concatenate([[1.0], np.mean(courses, axis=0)]))
        for name, courses in left.items()
    }


def _long(values: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Values of each command at the n samples of the record, the last held."""
    return values[np.minimum(np.arange(n), len(values) - 1)]


def log_episode(
    path: str | Path | None,
    rig: Rig,
    experiment: Experiment,
    controls: Sequence[NDArray[np.float64]] | NDArray[np.float64],
    *,
    title: str = "",
) -> Path | None:
    """Log an excitation episode: the rig in 3-D, its channels and loops, its limits, and what is known by when.

    Args:
        path: The ``.rrd`` file; None opens the viewer.
        rig: The rig that is excited.
        experiment: The question, its means and limits.
        controls: Commands (n, n_actuators) [N, N m].
        title: Name of the recording.

    Returns:
        The file written, or None where the viewer was opened.
    """
    record = episode_record(rig, experiment, np.asarray(controls, dtype=float))
    return log_comparison(path, {"rig": rig}, {"rig": record}, title=title or "excitation episode")
