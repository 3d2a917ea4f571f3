"""Identification of many records at once: the most probable rig of a family for each, and how well it explains it.

What an excitation is worth shows in the parameters that are identified from its records. This is the identification that all
excitations are judged by: least squares of all channels, whitened by their noise, with the standardised prior (a normal one, cut
at the ends of the ranges), Levenberg-Marquardt from the best of many starting points over growing parts of the record.
`bench.identification.fit_output_error` solves the same problem for one record of any rig; here hundreds of records of one family
are stepped together, each with its own excitation, which is what makes comparisons over hundreds of rigs affordable.

References:
    Voss, Timmer, Kurths 2004, Int. J. Bifurcation and Chaos 14(6) (growing horizons against local minima);
    Kass, Raftery 1995, J. American Statistical Association 90(430), section 4.1 (Laplace's approximation of the evidence).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from bench.excitation.family import Family, fans
from bench.excitation.information import (
    INFORMATION_LIMITS,
)


@dataclass(frozen=True)
class EstimationSettings:
    """Numbers of `bench.excitation.estimation`."""

    bound: float = math.sqrt(3.0)
    candidates: int = 128
    """Starting points that are tried on the first part of a record, spread evenly over the prior."""
    kept: int = 3
    """Of which so many are followed."""
    horizons: tuple[float, float, float] = (0.3, 0.6, 1.0)
    """Parts of the record that are fitted in turn."""
    steps: int = 30
    settled: float = 1e-5
    """Most steps of a search on a horizon, and the fall of the cost, relative to it and to one, that ends it."""
    dampings: NDArray[np.float64] = field(default_factory=lambda: np.array([0.1, 1.0, 10.0]))
    chunk: int = 250_000
    """Samples of records that are held at once, to bound the memory."""


ESTIMATION_SETTINGS = EstimationSettings()


class Estimates(NamedTuple):
    """The most probable rigs; m records."""

    coordinates: NDArray[np.float64]  # (m, p) standardised parameters
    cost: NDArray[np.float64]  # (m,) squared whitened residual and squared coordinates
    information: NDArray[np.float64]  # (m, p, p) there
    log_evidence: NDArray[
        np.float64
    ]  # (m,) of the record [nat], up to a constant of record and noise (Laplace)


@dataclass(frozen=True)
class Records:
    """Measured records with the commands that made them.

    Attributes:
        controls: Commands ``(m, n, n_actuators)``.
        measured: Channels ``(m, n, n_channels)``.
        lengths: Samples of each record that count ``(m,)``; a limit switch may end a test early.
    """

    controls: NDArray[np.float64]
    measured: NDArray[np.float64]
    lengths: NDArray[np.int64]

    def part(self, share: float, places: NDArray[np.int64] | slice = slice(None)) -> Records:
        """The first part of some records."""
        lengths = np.maximum(np.ceil(share * self.lengths[places]).astype(np.int64), 1)
        n = int(lengths.max(initial=1))
        return Records(self.controls[places, :n], self.measured[places, :n], lengths)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def squared_residuals(outputs, measured, weights, lengths, squares):
    """Write the squared whitened residual of each of the rigs of each record."""
    for m in range(outputs.shape[0]):
        for k in range(outputs.shape[1]):
            total = 0.0
            for i in range(lengths[m]):
                for c in range(outputs.shape[3]):
                    r = weights[c] * (measured[m, i, c] - outputs[m, k, i, c])
                    total += r * r
            squares[m, k] = total


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _normal(outputs, measured, weights, lengths, step, fisher, score):
    """``J'J`` and ``J'r`` from records of rigs and their perturbed ones."""
    p = outputs.shape[1] - 1
    row = np.zeros(p)
    for m in range(outputs.shape[0]):
        for i in range(lengths[m]):
            for c in range(outputs.shape[3]):
                base = outputs[m, 0, i, c]
                r = weights[c] * (measured[m, i, c] - base)
                for j in range(p):
                    row[j] = weights[c] * (outputs[m, 1 + j, i, c] - base) / step
                    score[m, j] += row[j] * r
                    for k in range(j + 1):
                        fisher[m, j, k] += row[j] * row[k]
        for j in range(p):
            for k in range(j):
                fisher[m, k, j] = fisher[m, j, k]


def costs(
    family: Family, records: Records, coordinates: NDArray[np.float64], noise: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Cost of each of the points ``(m, k, p)`` of each record ``(m, k)``; infinite where a rig diverged."""
    m, k, _ = coordinates.shape
    result = np.empty((m, k))
    size = max(1, ESTIMATION_SETTINGS.chunk // (k * records.controls.shape[1]))
    for first in range(0, m, size):
        rows = slice(first, first + size)
        outputs = family.record(coordinates[rows], records.controls[rows])
        squared_residuals(outputs, records.measured[rows], 1.0 / noise, records.lengths[rows], result[rows])
    result += np.sum(coordinates**2, axis=2)
    return np.where(np.isfinite(result), result, np.inf)


def normal_equations(
    family: Family, records: Records, coordinates: NDArray[np.float64], noise: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information ``(m, p, p)`` and score ``(m, p)`` of each record at a point ``(m, p)``."""
    m, p = coordinates.shape
    fisher, score = np.zeros((m, p, p)), np.zeros((m, p))
    size = max(1, ESTIMATION_SETTINGS.chunk // ((p + 1) * records.controls.shape[1]))
    for first in range(0, m, size):
        rows = slice(first, first + size)
        outputs = family.record(fans(coordinates[rows], INFORMATION_LIMITS.step), records.controls[rows])
        _normal(
            outputs, records.measured[rows], 1.0 / noise, records.lengths[rows], INFORMATION_LIMITS.step, fisher[rows], score[rows]
        )  # fmt: skip
    return fisher, score


def search(
    family: Family,
    records: Records,
    start: NDArray[np.float64],
    noise: NDArray[np.float64],
    *,
    steps: int = ESTIMATION_SETTINGS.steps,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Levenberg-Marquardt of all records together.

    Args:
        family: The rigs.
        records: The records.
        start: Starting points ``(m, p)``.
        noise: Standard deviations of the channels ``(n_channels,)``.
        steps: Most steps.

    Returns:
        Points ``(m, p)`` and costs ``(m,)``.
    """
    x = np.clip(start, -ESTIMATION_SETTINGS.bound, ESTIMATION_SETTINGS.bound)
    cost = costs(family, records, x[:, None], noise)[:, 0]
    damping = np.full(len(x), 1e-2)
    active = np.flatnonzero(np.isfinite(cost))
    p = x.shape[1]
    for _ in range(steps):
        if not active.size:
            break
        some = records.part(1.0, active)
        fisher, score = normal_equations(family, some, x[active], noise)
        usable = np.isfinite(fisher).all(axis=(1, 2)) & np.isfinite(score).all(axis=1)
        fisher[~usable], score[~usable] = 0.0, 0.0
        inner = fisher + np.eye(p)
        tried = damping[active, None] * ESTIMATION_SETTINGS.dampings  # (a, 3)
        damped = inner[:, None] + tried[:, :, None, None] * (inner * np.eye(p))[:, None]
        gradient = score - x[active]
        moves = np.linalg.solve(damped, np.broadcast_to(gradient[:, None, :, None], (*tried.shape, p, 1)))
        trials = np.clip(
            x[active, None] + moves[..., 0], -ESTIMATION_SETTINGS.bound, ESTIMATION_SETTINGS.bound
        )
        found = costs(family, some, trials, noise)
        best = np.argmin(found, axis=1)
        rows = np.arange(len(active))
        fall = cost[active] - found[rows, best]
        better = fall > 0.0
        gained = active[better]
        x[gained], cost[gained] = trials[rows, best][better], found[rows, best][better]
        damping[active] = np.clip(np.where(better, tried[rows, best], 100.0 * damping[active]), 1e-9, None)
        settled = better & (fall < ESTIMATION_SETTINGS.settled * (1.0 + 1e-2 * cost[active]))
        active = active[~(settled | (damping[active] > 1e7))]
    return x, cost


def spread_points(n: int, p: int) -> NDArray[np.float64]:
    """Points spread evenly over the prior ``(n, p)``, always the same (Sobol's sequence)."""
    points = qmc.Sobol(p, scramble=True, rng=np.random.default_rng(0)).random(n)
    return ESTIMATION_SETTINGS.bound * (2.0 * points - 1.0)


def estimate(
    family: Family,
    records: Records,
    noise: NDArray[np.float64],
    *,
    near: NDArray[np.float64] | None = None,
    candidates: int = ESTIMATION_SETTINGS.candidates,
    kept: int = ESTIMATION_SETTINGS.kept,
) -> Estimates:
    """Find the most probable rig of a family for each record.

    Args:
        family: The rigs.
        records: The records.
        noise: Standard deviations of the channels ``(n_channels,)``.
        near: Points ``(m, p)`` to start from besides, as those of a shorter record.
        candidates: Starting points tried; 0 with `near` only.
        kept: Best of them that are followed.
    """
    m, p = len(records.lengths), family.n_parameters
    tries: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    if near is not None:
        tries.append(search(family, records, near, noise))
    if candidates:
        points = spread_points(candidates, p)
        first = records.part(ESTIMATION_SETTINGS.horizons[0])
        found = costs(family, first, np.broadcast_to(points, (m, *points.shape)).copy(), noise)
        order = np.argsort(found, axis=1)[:, :kept]
        for k in range(order.shape[1]):
            x = points[order[:, k]]
            for horizon in ESTIMATION_SETTINGS.horizons[:-1]:
                x, _ = search(family, records.part(horizon), x, noise, steps=12)
            tries.append(search(family, records, x, noise))
    all_x, all_cost = np.stack([x for x, _ in tries]), np.stack([cost for _, cost in tries])
    best = np.argmin(all_cost, axis=0)
    x, cost = all_x[best, np.arange(m)], all_cost[best, np.arange(m)]
    information, _ = normal_equations(family, records, x, noise)
    information = np.where(np.isfinite(information), information, 0.0)
    evidence = -0.5 * (cost + np.linalg.slogdet(np.eye(p) + information)[1])
    return Estimates(x, cost, information, evidence)
