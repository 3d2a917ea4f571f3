"""Whitened residuals of all records of a rig and the priors, as a function of the scaled parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.identification.rig_response import (
    LinearEngine,
    MujocoEngine,
    RigRecord,
)


@dataclass(frozen=True)
class OutputErrorSettings:
    """Numbers of `bench.identification.output_error`."""

    difference: float = 1e-6
    ahead: float = 0.1
    dampings: tuple[float, float, float] = (10.0, 1.0, 0.1)


SETTINGS = OutputErrorSettings()


class OutputErrorProblem:
    """Residuals of all records, whitened, and the priors, as a function of the scaled parameters."""

    def __init__(
        self,
        engine: LinearEngine | MujocoEngine,
        records: Sequence[RigRecord],
        weights: Array,
        scale: Array,
        prior: tuple[Array, Array],
    ) -> None:
        self.engine, self.records, self.weights, self.scale = engine, records, weights, scale
        self.prior_mean, self.prior_precision = prior  # of the scaled parameters; precision 0 for none
        self.evaluations = 0
        self.n_residuals = sum(len(r.measured[r.scored]) for r in records) * len(weights)

    def residuals(self, record: RigRecord, points: Array) -> Array:
        """Simulated less measured over standard deviation ``(n_points, n)``."""
        self.evaluations += len(points)
        simulated = self.engine.simulate(record, points * self.scale)
        with np.errstate(invalid="ignore", over="ignore"):
            difference = (simulated - record.measured)[:, record.scored] * self.weights
        return difference.reshape(len(points), -1)

    def costs(self, points: Array) -> Array:
        """Half the sums of squares ``(n_points,)``; infinite where a simulation diverged."""
        total = np.zeros(len(points))
        for record in self.records:
            part = self.residuals(record, points)
            with np.errstate(invalid="ignore", over="ignore"):
                total += 0.5 * np.einsum("ij,ij->i", part, part)
        total += 0.5 * ((points - self.prior_mean) ** 2 @ self.prior_precision)
        return np.where(np.isfinite(total), total, np.inf)

    def linearise(self, point: Array, high: Array) -> Linearisation:
        """Residuals and Jacobians by forward differences, backwards at an upper bound."""
        steps = np.where(point + SETTINGS.difference > high, -SETTINGS.difference, SETTINGS.difference)
        points = np.vstack([point, point + np.diag(steps)])
        curvature = np.diag(self.prior_precision)
        gradient = self.prior_precision * (point - self.prior_mean)
        residuals, jacobians = [], []
        for record in self.records:
            residual, *shifted = self.residuals(record, points)
            jacobian = (np.stack(shifted) - residual) / steps[:, None]
            # diverged: leave that parameter where it is
            jacobian[~np.all(np.isfinite(jacobian), axis=1)] = 0.0
            curvature = curvature + jacobian @ jacobian.T
            gradient = gradient + jacobian @ residual
            residuals.append(residual)
            jacobians.append(jacobian)
        return Linearisation(point, curvature, gradient, residuals, jacobians)

    def bending(self, at: Linearisation, moves: Array) -> Array:
        """``J' r''`` along each move ``(n_moves, n_parameters)``, r'' the second directional derivative of the residuals."""
        total = np.zeros_like(moves)
        for record, residual, jacobian in zip(self.records, at.residuals, at.jacobians, strict=True):
            ahead = self.residuals(record, at.point + SETTINGS.ahead * moves)
            with np.errstate(invalid="ignore", over="ignore"):
                second = 2.0 / SETTINGS.ahead * ((ahead - residual) / SETTINGS.ahead - moves @ jacobian)
            total += second @ jacobian.T
        return total


class Linearisation(NamedTuple):
    """Residuals about a point: their curvature and gradient, priors included, and the Jacobians they come from."""

    point: Array
    curvature: Array  # J'J, priors included
    gradient: Array
    residuals: list[Array]  # by record (n,)
    jacobians: list[Array]  # by record (n_parameters, n)
