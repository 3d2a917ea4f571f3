"""Forces and residuals over the plane of states, with what they stand on."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from bench.errors import ParameterError
from bench.figures.look import axes_grid, style


@dataclass(frozen=True)
class SurfacesSettings:
    """Numbers of `bench.figures.surfaces`."""

    coverage_samples: int = 3
    """Fewest samples in a cell of a surface for it to be drawn: with fewer, the colour would show one stray sample."""


SETTINGS = SurfacesSettings()


def surface(
    x: ArrayLike,
    v: ArrayLike,
    r: ArrayLike,
    *,
    labels: tuple[str, str, str] = ("displacement [m]", "velocity [m/s]", "restoring force [N]"),
    bins: int = 40,
    title: str = "",
) -> Figure:
    """Restoring force over the states that the data reached; states they did not reach stay empty.

    The mean force of each cell of the plane of states, and beside it the number of samples that it stands on: a force
    that is nearly extrapolated is to be seen as such.

    Args:
        x: Displacements (n,).
        v: Velocities (n,).
        r: Restoring forces (n,).
        labels: Labels with units of displacement, velocity and force.
        bins: Cells along each axis.
        title: Title of the figure.

    Raises:
        ParameterError: Different lengths, or numbers that are not finite.

    References:
        Masri, S. F. and Caughey, T. K. (1979), A nonparametric identification technique, J. Appl. Mech. 46(2).
    """
    samples = [np.asarray(a, dtype=float).ravel() for a in (x, v, r)]
    if (
        len({len(a) for a in samples}) != 1
        or not len(samples[0])
        or not all(np.all(np.isfinite(a)) for a in samples)
    ):
        raise ParameterError(
            f"arrays of {[len(a) for a in samples]} samples came; "
            "as many finite displacements, velocities and forces are expected"
        )
    count, x_edges, v_edges = np.histogram2d(samples[0], samples[1], bins=bins)
    total, _, _ = np.histogram2d(samples[0], samples[1], bins=(x_edges, v_edges), weights=samples[2])
    enough = count >= min(SETTINGS.coverage_samples, count.max())
    mean = np.where(enough, total / np.maximum(count, 1.0), np.nan)
    with style(), matplotlib.rc_context({"axes.grid": False}):
        figure, grid = axes_grid(8.6, 3.6, ncols=2, sharex=True, sharey=True)
        size = np.nanmax(np.abs(mean)) or 1.0
        norm = TwoSlopeNorm(0.0, -size, size)
        drawn = grid[0, 0].pcolormesh(x_edges, v_edges, mean.T, cmap="RdBu_r", norm=norm, rasterized=True)
        figure.colorbar(drawn, ax=grid[0, 0], label=labels[2])
        shown = np.where(count > 0, count, np.nan)
        drawn = grid[0, 1].pcolormesh(x_edges, v_edges, shown.T, cmap="cividis", norm="log", rasterized=True)
        figure.colorbar(drawn, ax=grid[0, 1], label="samples in the cell [1]")
        for axes, name in zip(grid[0], (title or "mean restoring force", "coverage"), strict=True):
            axes.set_title(name)
            axes.set_xlabel(labels[0])
            axes.set_ylabel(labels[1])
            axes.set_facecolor("#eeeeee")
    return figure


def residual_map(
    x_edges: ArrayLike,
    y_edges: ArrayLike,
    residual: ArrayLike,
    *,
    labels: tuple[str, str, str] = ("displacement [m]", "velocity [m/s]", "residual force [N]"),
    title: str = "",
) -> Figure:
    """A residual over two states, white where there is none and where no data are grey.

    Args:
        x_edges: Edges of the cells along x (n + 1,).
        y_edges: Edges of the cells along y (m + 1,).
        residual: Residual of each cell (n, m); NaN without data.
        labels: Labels with units of x, y and the residual.
        title: Title of the figure.

    Raises:
        ParameterError: The shapes do not fit.
    """
    x, y, cells = (np.asarray(a, dtype=float) for a in (x_edges, y_edges, residual))
    if cells.shape != (len(x) - 1, len(y) - 1):
        raise ParameterError(
            f"a residual of shape {cells.shape} came with {len(x)} and {len(y)} edges; one edge more than cells is expected"
        )
    finite = np.abs(cells[np.isfinite(cells)])
    size = float(finite.max()) if finite.size and finite.max() > 0.0 else 1.0
    with style(), matplotlib.rc_context({"axes.grid": False}):
        figure, grid = axes_grid(5.2, 3.8)
        axes = grid[0, 0]
        norm = TwoSlopeNorm(0.0, -size, size)
        drawn = axes.pcolormesh(x, y, cells.T, cmap="RdBu_r", norm=norm, rasterized=True)
        figure.colorbar(drawn, ax=axes, label=labels[2])
        axes.set_facecolor("#d9d9d9")
        axes.set_xlabel(labels[0])
        axes.set_ylabel(labels[1])
        axes.set_title(title)
    return figure
