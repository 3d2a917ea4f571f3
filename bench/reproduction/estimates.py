"""Figures of an on-line estimation: the course of the estimates, and what each term contributes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.figures import style
from bench.figures.look import axes_grid, thin
from bench.identification.adaptive import AdaptiveHistory

REFERENCE = {"color": "#D55E00", "linestyle": (0, (5, 2)), "linewidth": 1.0}


def estimate_histories(
    history: AdaptiveHistory,
    names: Sequence[str],
    *,
    reference: Sequence[float] = (),
    units: Sequence[str] = (),
    columns: int = 2,
    label: str = "printed",
) -> Figure:
    """The course of each estimate, with reference values dashed.

    Args:
        history: The estimation.
        names: Name of each parameter, for the axes.
        reference: Values drawn dashed.
        units: Unit of each parameter; "1" where empty.
        columns: Columns of axes.
        label: What the reference is.
    """
    rows = math.ceil(len(names) / columns)
    with style():
        figure, grid = axes_grid(4.2 * columns, 0.4 + 1.35 * rows, nrows=rows, ncols=columns, sharex=True)
        for i, name in enumerate(names):
            axes = grid.flat[i]
            axes.plot(*thin(history.time, history.theta[:, i]), color="#1a1a1a", linewidth=1.2, label="estimate")
            if reference:
                axes.axhline(reference[i], label=label, **REFERENCE)
            # The first instants overshoot by decades; the axis belongs to what follows.
            settled = history.theta[history.time > history.time[0] + 0.02 * np.ptp(history.time), i]
            shown = [*settled[[0, -1]], settled.min(), settled.max(), *reference[i : i + 1]]
            margin = 0.12 * (max(shown) - min(shown)) or 1.0
            axes.set_ylim(min(shown) - margin, max(shown) + margin)
            axes.set_ylabel(f"{name} [{units[i] if units else '1'}]")
            axes.set_xlabel("time [s]")
            axes.label_outer()
            axes.margins(x=0.0)
        for axes in list(grid.flat)[len(names) :]:
            axes.remove()
        if reference:
            handles, labels = grid.flat[0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper right", ncols=2)
    return figure


def contribution_parts(history: AdaptiveHistory, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """What each term contributes over time with the estimates of each instant, by name."""
    return {f"{name} φ{i + 1}": history.contributions()[:, i] for i, name in enumerate(names)}


def learnt(history: AdaptiveHistory) -> NDArray[np.float64]:
    """z over time, the estimate's prediction where a sample was not learnt from (n,)."""
    filled = np.where(np.isfinite(history.measured), history.measured, history.predicted)
    return np.nan_to_num(filled)
