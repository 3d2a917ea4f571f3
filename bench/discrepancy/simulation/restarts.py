"""Free runs in windows, each restarted from a state of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.simulation.prescribed_response import driven_states
from bench.discrepancy.simulation.stick_slip import (
    Elements,
    Motion,
    StructureMatrices,
    free_run,
    steps_of_each,
)


def measured_states(motion: Motion, firsts: NDArray[np.int64]) -> Array:
    """Positions and velocities (n_windows, 2 n_dof) of a motion at some samples."""
    return np.hstack([motion.position[firsts], motion.velocity[firsts]])


def restarted(
    linear: StructureMatrices,
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
