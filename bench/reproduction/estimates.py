"""Figures of an on-line estimation: the course of the estimates, and what each term contributes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.figures import style
from bench.figures.look import axes_grid, thin
from bench.identification.adaptive_history import AdaptiveHistory


@dataclass(frozen=True)
class EstimatesSetup:
    """Numbers of `bench.reproduction.estimates`."""

    reference: Mapping[str, Any] = field(
        default_factory=lambda: {"color": "#D55E00", "linestyle": (0, (5, 2)), "linewidth": 1.0}
    )


ESTIMATES_SETUP = EstimatesSetup()


def estimate_histories(
    history: AdaptiveHistory,
    names: Sequence[str],
    *,
    reference: Sequence[float] = (),
    units: Sequence[str] = (),
    columns: int = 2,
    label: str = "printed",
    until: float = math.inf,
) -> Figure:
    """The course of each estimate, with reference values dashed.

    Args:
        history: The estimation.
        names: Name of each parameter, for the axes.
        reference: Values drawn dashed.
        units: Unit of each parameter; "1" where empty.
        columns: Columns of axes.
        label: What the reference is.
        until: Last time drawn [s].
    """
    shown = history.time <= until
    time = history.time[shown]
    rows = math.ceil(len(names) / columns)
    with style():
        figure, grid = axes_grid(4.2 * columns, 0.4 + 1.35 * rows, nrows=rows, ncols=columns, sharex=True)
        for i, name in enumerate(names):
            axes = grid.flat[i]
            theta = history.theta[shown, i]
            axes.plot(*thin(time, theta), color="#1a1a1a", linewidth=1.2, label="estimate")
            if reference:
                axes.axhline(reference[i], label=label, **ESTIMATES_SETUP.reference)
            # The first instants overshoot by decades; the axis belongs to what follows.
            settled = theta[time > time[0] + 0.02 * np.ptp(time)]
            span = [settled.min(), settled.max(), *reference[i : i + 1]]
            margin = 0.12 * (max(span) - min(span)) or 1.0
            axes.set_ylim(min(span) - margin, max(span) + margin)
            axes.set_ylabel(f"{name} [{units[i] if units else '1'}]")
            axes.margins(x=0.0)
        _finish(grid, len(names))
        if reference:
            handles, labels = grid.flat[0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper right", ncols=2)
    return figure


def _finish(grid: NDArray, count: int) -> None:
    """Remove the axes beyond `count`, and name the time below the lowest of each column."""
    for axes in list(grid.flat)[count:]:
        axes.remove()
    for column in range(grid.shape[1]):
        lowest = list(grid.flat)[column : count : grid.shape[1]][-1]
        lowest.set_xlabel("time [s]")
        lowest.tick_params(labelbottom=True)


def contribution_histories(
    history: AdaptiveHistory,
    names: Sequence[str],
    *,
    unit: str = "lbf",
    window: tuple[float, float] = (0.0, math.inf),
) -> Figure:
    """z, what each term contributes with the estimates of each instant, their sum and the error, on one scale.

    Args:
        history: The estimation, with its regressors.
        names: Name of each parameter.
        unit: Unit of z.
        window: First and last time drawn [s].
    """
    shown = (history.time >= window[0]) & (history.time <= window[1])
    time, z = history.time[shown], learnt(history)[shown]
    parts = history.contributions()[shown]
    total = parts.sum(axis=1)
    rows = {
        "z": z,
        **{f"{name} φ{i + 1}": parts[:, i] for i, name in enumerate(names)},
        "sum": total,
        "z − sum": z - total,
    }
    size = 1.05 * max(float(np.max(np.abs(values))) for values in rows.values())
    count = math.ceil(len(rows) / 2)
    with style():
        figure, grid = axes_grid(8.4, 0.4 + 1.2 * count, nrows=count, ncols=2, sharex=True, sharey=True)
        for axes, (name, values) in zip(grid.flat, rows.items(), strict=False):
            share = 100.0 * float(np.mean(values * z) / np.mean(z**2))
            axes.plot(*thin(time, values), color="#1a1a1a", linewidth=0.8)
            axes.set_ylim(-size, size)
            axes.set_ylabel(f"{name} [{unit}]")
            axes.set_title(f"{share:.3g} % of the mean square", fontsize=8)
            axes.margins(x=0.0)
        _finish(grid, len(rows))
    return figure


def courses(
    time: NDArray[np.float64], drawn: Mapping[str, tuple[NDArray[np.float64], float, tuple[float, float]]]
) -> Figure:
    """Estimates over time with the off-line values dashed.

    Args:
        time: (n,) [s].
        drawn: By label: the estimates (n,), the value off line, and the ends of the axis, those of the printed figure.
    """
    with style():
        figure, grid = axes_grid(8.0, 3.4, nrows=len(drawn), sharex=True)
        for axes, (label, (values, final, span)) in zip(grid[:, 0], drawn.items(), strict=True):
            axes.plot(time, values, color="#1a1a1a", linewidth=1.2, label="on line")
            axes.axhline(final, label="nonlinear least squares", **ESTIMATES_SETUP.reference)
            axes.set_ylim(span)
            axes.set_ylabel(label)
            axes.margins(x=0.0)
        grid[-1, 0].set_xlabel("time [s]")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
    return figure


def fine(figure: Figure) -> Figure:
    """The figure with thinner lines, for records that cross themselves many times; the reference stays the broad one."""
    for axes in figure.axes:
        for line in axes.lines:
            line.set_linewidth(0.7 * line.get_linewidth())
    return figure


def learnt(history: AdaptiveHistory) -> NDArray[np.float64]:
    """z over time, the estimate's prediction where a sample was not learnt from (n,)."""
    filled = np.where(np.isfinite(history.measured), history.measured, history.predicted)
    return np.nan_to_num(filled)
