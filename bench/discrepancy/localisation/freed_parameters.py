"""Nominal parameters that leave most samples free of a missing force.

A wrong nominal stiffness leaves a force, a weak one, all over the plane. Where most of the record needs no further
force at all with nominal parameters a little different, those parameters are taken: a robust regression on the deviations
within their uncertainty, whose outliers are the region.

References:
    M. J. Black, A. Rangarajan, International Journal of Computer Vision 19 (1996) 57-91 (bounded misfit of Geman and McClure,
    iteratively reweighted).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.force_smoother import ForceObserver
from bench.discrepancy.settings import LocalisationSettings


class FreedParameters(NamedTuple):
    """Nominal parameters that leave most samples free of a missing force, and what their uncertainty still does to it."""

    values: Array
    doubt: Array  # (n_doubts, n, n_places)


def freed(observer: ForceObserver, records: Sequence[CaseRecord], nominal: Array) -> FreedParameters:
    """Move the nominal parameters within their uncertainty so that most samples need no further force.

    Where no such parameters are found they stay, and all of their uncertainty remains as doubt.
    """
    settings = observer.simulator.settings.localisation
    spread = observer.spread()
    free = [i for i in range(len(spread)) if spread[i] > 0.0]

    def force_at(values: Array) -> Array:
        return np.concatenate([observer.estimate(r, values).force for r in records])

    force = force_at(nominal)
    if not free:
        return FreedParameters(nominal, np.zeros((0, *force.shape)))
    columns = np.array([force_at(nominal + spread * (np.arange(len(spread)) == i)) - force for i in free])
    noise = np.concatenate([observer.estimate(r, nominal, noise=1).noise[0] for r in records])
    stride = max(1, len(force) // settings.robust_samples)
    count = len(force[::stride]) * force.shape[1]
    # Samples of one swing say the same thing: about as many are independent as there are swings, times a few.
    weight = min(1.0, 400.0 / count)
    deviation, values = np.zeros(len(free)), nominal
    for _ in range(settings.robust_rounds):
        # linear about the values reached, and as exact as the force that is left there
        error = np.sqrt(np.mean(noise**2, axis=0) + (settings.map_floor * np.abs(force).max(axis=0)) ** 2)
        matrix = np.column_stack([(c / error)[::stride].ravel() for c in columns])
        y = (force / error)[::stride].ravel() - matrix @ deviation
        starts = [
            deviation,
            _ridge(matrix, y, np.full(len(y), weight), settings=settings),
        ]
        candidates = [_robust(matrix, y, weight, start, settings=settings) for start in starts]
        deviation = min(candidates, key=lambda d: _robust_cost(matrix, y, weight, d))
        values = nominal.copy()
        values[free] += spread[free] * deviation
        force = force_at(values)
    error = np.sqrt(np.mean(noise**2, axis=0) + (settings.map_floor * np.abs(force).max(axis=0)) ** 2)
    matrix = np.column_stack([(c / error)[::stride].ravel() for c in columns])
    rest = (force / error)[::stride].ravel()
    if np.mean(np.abs(rest) < settings.free_of_force) < settings.sparse:
        return FreedParameters(nominal, columns)
    normal = matrix.T @ ((weight / (1.0 + rest**2) ** 2)[:, None] * matrix) + np.eye(len(free))
    root = np.linalg.cholesky(np.linalg.inv(normal))
    return FreedParameters(values, np.asarray(np.tensordot(root.T, columns, 1), dtype=np.float64))


def _ridge(matrix: Array, y: Array, weight: Array, *, settings: LocalisationSettings) -> Array:
    normal = matrix.T @ (weight[:, None] * matrix) + np.eye(matrix.shape[1])
    minimum = np.asarray(-np.linalg.solve(normal, matrix.T @ (weight * y)), dtype=np.float64)
    return np.clip(minimum, -settings.most_sigmas, settings.most_sigmas)


def _robust(
    matrix: Array, y: Array, weight: float, deviation: Array, *, settings: LocalisationSettings
) -> Array:
    """Iteratively reweighted least squares of Geman and McClure's bounded misfit, its width narrowed step by step."""
    for width in settings.robust_widths:
        for _ in range(15):
            rest = (y + matrix @ deviation) / width
            new = _ridge(matrix, y, weight / (1.0 + rest**2) ** 2, settings=settings)
            settled = np.abs(new - deviation).max() < 1e-4
            deviation = new
            if settled:
                break
    return deviation


def _robust_cost(matrix: Array, y: Array, weight: float, deviation: Array) -> float:
    square = (y + matrix @ deviation) ** 2
    return float(weight * np.sum(square / (1.0 + square)) + deviation @ deviation)
