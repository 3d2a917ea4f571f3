"""Pictures of a diagnosis: maps of the missing force, shares, rankings and correlations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

from bench.discrepancy.localisation.state_map import StateMap
from bench.discrepancy.report.simulated_records import place_channels
from bench.discrepancy.verdict import Ranked, Split
from bench.figures import loops
from bench.figures.look import COLOURS, REFERENCE_COLOUR, axes_grid, style
from bench.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class FiguresSettings:
    """Numbers of `bench.discrepancy.report.figures`."""

    shown: int = 12
    """Most effects of a ranking."""
    least: float = 1e-12
    """Probability below which none is told apart from zero."""


SETTINGS = FiguresSettings()
LABELS = {
    "band_hz": "frequency [Hz]",
    "time_s": "time [s]",
    "displacement": "displacement",
    "velocity": "velocity",
    "after_reversal": "travel since the last reversal",
}


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


def force_loops(
    records: Mapping[str, Recording], place: str, *, window: tuple[float, float] | None = None
) -> Figure:
    """Missing force over displacement and over velocity: measured, nominal model, final model."""
    x, v, f = place_channels(place)
    return loops(records, [(x, f), (v, f)], window=window)


def shares(splits: Sequence[Split], *, units: tuple[str, str] = ("", "")) -> Figure:
    """Shares of some splits as bars; significant parts are filled.

    Args:
        splits: The splits, one axes each.
        units: Units of displacement and of force, for the labels.
    """
    columns = min(len(splits), 3)
    rows = -(-len(splits) // columns)
    with style():
        figure, grid = axes_grid(3.2 * columns, 0.3 + 2.3 * rows, nrows=rows, ncols=columns)
        for axes, part in zip(grid.flat, splits, strict=False):
            _bars(axes, part, units)
        for axes in list(grid.flat)[len(splits) :]:
            axes.set_axis_off()
    return figure


def _bars(axes: Axes, part: Split, units: tuple[str, str]) -> None:
    values = 100.0 * np.array(part.shares)
    edges = len(part.cells) == len(values) + 1
    if edges:
        cells = np.array(part.cells, dtype=float)
        if part.kind == "band_hz":
            cells[0] = cells[1] ** 2 / cells[2] if len(cells) > 2 else 0.5 * cells[1]
            axes.set_xscale("log")
        left, width = cells[:-1], np.diff(cells)
        where = {"align": "edge", "edgecolor": COLOURS[1], "linewidth": 0.8}
    else:
        left, width = np.arange(len(values)), np.full(len(values), 0.8)
        axes.set_xticks(left, [str(c) for c in part.cells], rotation=20 if len(values) > 2 else 0)
        where = {"edgecolor": COLOURS[1], "linewidth": 0.8}
    colours = [COLOURS[1] if yes else "none" for yes in part.significant]
    axes.bar(left, values, width, color=colours, **where)
    unit = {"displacement": units[0], "after_reversal": units[0], "velocity": f"{units[0]}/s"}.get(
        part.kind, ""
    )
    label = LABELS.get(part.kind, part.kind)
    axes.set_xlabel(f"{label} [{unit}]" if unit and units[0] else label)
    axes.set_ylabel("share [%]")
    axes.set_title(f"{part.of}{f', {part.dof}' if part.dof and part.dof != part.of else ''}", fontsize=9)
    axes.grid(visible=False, axis="x")


def ranking_bars(ranked: Sequence[Ranked]) -> Figure:
    """Probability that each effect belongs to the explanation, on a logarithmic axis."""
    shown = list(ranked[: SETTINGS.shown])
    names = [r.name.replace("_", " ") + (f" ({r.where})" if r.where else "") for r in shown]
    values = np.array([max(r.probability, SETTINGS.least) for r in shown])
    with style():
        figure, grid = axes_grid(7.5, 0.9 + 0.27 * len(shown))
        axes = grid[0, 0]
        bars = axes.barh(np.arange(len(shown)), values, color=COLOURS[1], height=0.7)
        texts = [_probability(r.probability) for r in shown]
        axes.bar_label(bars, texts, padding=3, fontsize=8)
        axes.set_xscale("log")
        axes.set_xlim(max(values.min() * 0.3, SETTINGS.least), 4.0)
        axes.set_yticks(np.arange(len(shown)), names)
        axes.invert_yaxis()
        axes.set_xlabel("probability that it belongs to the explanation [1]")
        axes.set_ylabel("effect")
        axes.grid(visible=False, axis="y")
    return figure


def _probability(p: float) -> str:
    if p >= 1e-3:
        return f"{p:.3g}"
    return f"{p:.0e}" if p > SETTINGS.least else f"< {SETTINGS.least:.0e}"


def correlation_map(labels: Sequence[str], correlation: np.ndarray) -> Figure:
    """Correlations of estimated parameters as a coloured table with its numbers."""
    n = len(labels)
    side = 0.42 * n + 2.2
    with style(), matplotlib.rc_context({"axes.grid": False}):
        figure, grid = axes_grid(side + 1.2, side)
        axes = grid[0, 0]
        drawn = axes.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        figure.colorbar(drawn, ax=axes, label="correlation [1]", shrink=0.8)
        for i in range(n):
            for j in range(n):
                value = correlation[i, j]
                if i != j and abs(value) >= 0.05:
                    colour = "white" if abs(value) > 0.6 else "black"
                    axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6.5, color=colour)
        axes.set_xticks(range(n), labels, rotation=60, ha="right")
        axes.set_yticks(range(n), labels)
    return figure
