"""Regions of the state space: sets of touching cells with a missing force of one sign."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.settings import LocalisationSettings


class Region(NamedTuple):
    """A set of touching cells with a missing force of one sign.

    Attributes:
        displacement: Smallest and largest displacement; None where it does not depend on the displacement.
        velocity: Likewise.
        force: Mean missing force.
        share: Part of the squared missing force of all cells of the place.
        p_value: Smallest of its cells, after correction for the number of cells.
    """

    displacement: tuple[float, float] | None
    velocity: tuple[float, float] | None
    force: float
    share: float
    p_value: float


def joined(significant: np.ndarray, mean: Array) -> np.ndarray:
    """Significant cells that touch another one with a force of the same sign: no force acts in one cell alone."""
    out = np.zeros_like(significant)
    for sign in (1.0, -1.0):
        labels = _touching(significant & (sign * np.nan_to_num(mean) > 0.0))
        sizes = np.bincount(labels.ravel())
        out |= (labels > 0) & (sizes[labels] > 1)
    return out


def _touching(cells: np.ndarray) -> NDArray[np.intp]:
    """Number of the set of touching cells that each cell belongs to, from 1 on; 0 for cells that are not chosen."""
    labels = np.zeros(cells.shape, dtype=np.intp)
    ndimage.label(cells, output=labels)
    return labels


def regions_of(
    edges: tuple[Array, Array],
    mean: Array,
    p_value: Array,
    significant: np.ndarray,
    *,
    settings: LocalisationSettings,
) -> tuple[Region, ...]:
    """Regions of a map, by decreasing share of the squared force.

    Args:
        edges: Edges of the cells in displacement and velocity.
        mean: (n, n) mean force; NaN where the motion did not come often enough.
        p_value: (n, n) after correction.
        significant: (n, n) cells that a region may hold.
        settings: `LocalisationSettings` of the diagnosis.
    """
    visited = np.isfinite(mean)
    square = np.nan_to_num(mean) ** 2
    total = float(square.sum()) or 1.0
    out = []
    for sign in (1.0, -1.0):
        labels = _touching(significant & (sign * np.nan_to_num(mean) > 0.0))
        for k in range(1, int(labels.max()) + 1):
            own = labels == k
            share = float(square[own].sum()) / total
            if share < settings.small:
                continue
            limits = []
            for axis in (0, 1):
                along = np.flatnonzero(own.any(axis=1 - axis))
                rows = np.flatnonzero(own.any(axis=axis))
                # the cells that the motion visited at these values of the other coordinate
                reachable = np.take(visited, rows, axis=1 - axis)
                filled = np.take(own, rows, axis=1 - axis)
                whole = filled.sum() >= settings.whole * reachable.sum()
                limits.append(
                    None if whole else (float(edges[axis][along[0]]), float(edges[axis][along[-1] + 1]))
                )
            force = float(np.mean(mean[own]))
            out.append(Region(limits[0], limits[1], force, share, float(p_value[own].min())))
    return tuple(sorted(out, key=lambda region: -region.share))
