"""The map of the missing force as a matplotlib figure, for pages that are not a diagnosis's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

from bench.discrepancy.localisation.state_map import StateMap
from bench.figures.look import COLOURS, REFERENCE_COLOUR, axes_grid, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def state_figure(found: StateMap) -> Figure:
    """Missing force over the plane of states, and its mean over displacement and over velocity.

    Colour is drawn where the motion came twice; cells with a significant force are outlined.
    """
    place = found.place
    x_label = f"displacement [{place.position_unit}]"
    v_label = f"velocity [{place.position_unit}/s]"
    f_label = f"missing force [{place.force_unit}]"
    size = float(np.nanmax(np.abs(found.force), initial=0.0)) or 1.0
    with style(), matplotlib.rc_context({"axes.grid": False}):
        figure, grid = axes_grid(9.6, 3.4, ncols=3, width_ratios=[1.35, 1.0, 1.0])
        axes = grid[0, 0]
        drawn = axes.pcolormesh(
            found.displacement_edges, found.velocity_edges, found.force.T, cmap="RdBu_r",
            norm=TwoSlopeNorm(0.0, -size, size), rasterized=True,
        )  # fmt: skip
        figure.colorbar(drawn, ax=axes, label=f_label)
        axes.set_facecolor("#e4e4e4")
        _outline(axes, found)
        axes.set_xlabel(x_label)
        axes.set_ylabel(v_label)
        axes.set_title("mean of each cell")
        track = found.track
        for axes, samples, label in (
            (grid[0, 1], track.displacement, x_label),
            (grid[0, 2], track.velocity, v_label),
        ):
            step = max(1, len(samples) // 6000)
            axes.plot(
                samples[::step],
                track.force[::step],
                ".",
                markersize=1.2,
                color=COLOURS[1],
                alpha=0.35,
                rasterized=True,
            )
            axes.axhline(0.0, color=REFERENCE_COLOUR, linewidth=0.6)
            axes.set_xlabel(label)
            axes.set_ylabel(f_label)
            axes.set_title("every sample")
    return figure


def _outline(axes: Axes, found: StateMap) -> None:
    """Draw the border of the significant cells."""
    x, v, marked = found.displacement_edges, found.velocity_edges, found.significant
    padded = np.pad(marked, 1)
    lines = []
    for i, j in zip(*np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1]), strict=True):
        lines.append(((x[i], x[i]), (v[j], v[j + 1])))
    for i, j in zip(*np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1]), strict=True):
        lines.append(((x[i], x[i + 1]), (v[j], v[j])))
    for xs, vs in lines:
        axes.plot(xs, vs, color=REFERENCE_COLOUR, linewidth=1.3)
