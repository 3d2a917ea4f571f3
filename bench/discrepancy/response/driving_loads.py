"""What drives a free run: the loads of a record as the integrator takes them.

Loads are read between their samples as the case says (`acquisition.upsampled`), behind the actuator effects of a hypothesis, and
a periodic record is run in from rest over whole periods first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.acquisition import upsampled
from bench.discrepancy.settings import DiagnosisSettings, ResponseSettings
from bench.discrepancy.simulation.stick_slip import StructureMatrices


class Actuated(NamedTuple):
    """An actuator effect on one load.

    Attributes:
        column: The load.
        apply: Load (n,), values and time between samples [s] to the load behind the actuator (n,).
        values: Values of its parameters.
        between_samples: Whether it changes a load between its samples.
    """

    column: int
    apply: Callable[[Array, Array, float], Array]
    values: Array
    between_samples: bool


def run_in(linear: StructureMatrices, length: int, step: float, *, settings: ResponseSettings) -> int:
    """Samples of run-in from rest, in whole periods, after which a linear structure is in its steady state.

    Args:
        linear: The structure.
        length: Samples of a period, or of several.
        step: Time between samples [s].
        settings: `ResponseSettings` of the diagnosis.
    """
    n_dof = len(linear.mass)
    lower = -np.linalg.solve(linear.mass, np.hstack([linear.stiffness, linear.damping]))
    companion = np.vstack([np.hstack([np.zeros((n_dof, n_dof)), np.eye(n_dof)]), lower])
    decay = max(-float(np.linalg.eigvals(companion).real.max()), 1e-12)
    return length * int(
        np.clip(np.ceil(settings.forgotten / (decay * step * length)), 1, settings.max_periods)
    )


def driving_loads(
    loads: Array,
    acting: Sequence[Actuated],
    *,
    interpolation: str,
    step: float,
    substeps: int,
    lead: int = 0,
    periodic: bool = False,
    settings: ResponseSettings,
) -> tuple[Array, int]:
    """Loads as `stick_slip.free_run` takes them, and their rows a sample; run-in and actuator effects included.

    Args:
        loads: (n, n_loads) of a record.
        acting: Actuator effects.
        interpolation: What loads do between samples, see `Case.load_interpolation`.
        step: Time between samples [s].
        substeps: Integration steps a sample; band-limited loads are given at the start, middle and end of each.
        lead: Samples of run-in, a multiple of n.
        periodic: Whether the record is whole periods of a steady state.
        settings: `ResponseSettings` of the diagnosis.
    """
    loads = np.vstack([loads] * (1 + lead // len(loads)))
    rows = 0 if interpolation == "zero_order_hold" else 1
    for effect in sorted(acting, key=lambda effect: effect.between_samples):
        if effect.between_samples and interpolation == "linear" and rows == 1:
            loads, rows = upsampled(loads, settings.corners), settings.corners
        loads[:, effect.column] = effect.apply(loads[:, effect.column], effect.values, step / max(rows, 1))
    if interpolation == "band_limited":
        fine = upsampled(loads, 2 * substeps, interpolation=interpolation, periodic=periodic)
        return fine, 2 * substeps
    return loads, rows


def fewest_steps(predict: Callable[[int], Array], noise: Array, *, settings: DiagnosisSettings) -> int:
    """Fewest integration steps a sample at which the error of the integration stays below the noise.

    Args:
        predict: Integration steps a sample to the channels (n, n_channels) that the nominal model predicts of a record.
        noise: (n_channels,) of the response channels.
        settings: Thresholds of the diagnosis.
    """
    steps = 1
    coarse = predict(steps)
    while steps < settings.simulation.max_substeps:
        fine = predict(2 * steps)
        error = np.sqrt(np.mean((fine - coarse) ** 2, axis=0))
        enough = np.maximum(
            settings.response.integration * noise, settings.response.exact * np.std(fine, axis=0)
        )
        if not np.isfinite(error).all() or np.all(error < enough):
            break
        steps, coarse = 2 * steps, fine
    return steps
