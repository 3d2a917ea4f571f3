"""Interactive figures of a diagnosis, plotly's: to be zoomed into, read off, and drawn light or dark.

Measured curves are broad in the page's own ink, the simulations in the colours of `bench.figures` with a dash of their own each. A
figure is as wide as its place, so that a telephone shows it whole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from bench.arrays import Array
from bench.discrepancy.judgement.shares import probability
from bench.discrepancy.localisation.state_map import StateMap
from bench.discrepancy.report.simulated_records import APPLIED, NOMINAL
from bench.discrepancy.verdict import Gap, Ranked, Split
from bench.figures.look import COLOURS, thin
from bench.page import INK, PAPER, RULE
from bench.recording import Recording


@dataclass(frozen=True)
class InteractiveSettings:
    """Numbers of `bench.discrepancy.report.interactive`."""

    points: int = 2500
    """Most points of a line: a few for each pixel of a wide screen, and a page of a hundred lines within three megabytes."""
    dashes: tuple[str, ...] = ("dash", "solid", "dot")
    """Of the nominal model, the final one, and that applied in the user's simulator."""
    shown: int = 12
    """Most effects of a ranking."""
    likely: float = 1e-3
    """Probability below which an effect is counted rather than drawn: what three decimals would round to zero."""
    row: int = 210
    """Height of one row of a figure [px]."""
    edges: int = 6
    """Most edges of cells that an axis names: what a telephone has room for."""
    diverging: tuple[tuple[float, str], ...] = ((0.0, COLOURS[1]), (0.5, PAPER), (1.0, COLOURS[0]))
    """Colours of maps: blue, the page's own, vermilion."""
    numbered: int = 10
    """Most rows of a map whose cells hold their numbers."""


SETTINGS = InteractiveSettings()
LABELS = {
    "band_hz": "frequency [Hz]",
    "time_s": "time [s]",
    "displacement": "displacement",
    "velocity": "velocity",
    "after_reversal": "travel since the last reversal",
}


def _finished(figure: go.Figure, height: int, **layout: Any) -> go.Figure:
    axis = {
        "gridcolor": RULE, "zerolinecolor": RULE, "linecolor": RULE, "automargin": True, "title": {"standoff": 8},
    }  # fmt: skip
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    return figure.update_layout(
        height=height, margin={"l": 8, "r": 8, "t": 34, "b": 8}, paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)", font={"color": INK, "size": 13, "family": "system-ui, sans-serif"},
        legend={"font": {"size": 12}, "orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0.0},
        hoverlabel={"bgcolor": PAPER, "font": {"color": INK}},
        modebar={"bgcolor": "rgba(0,0,0,0)", "color": RULE, "activecolor": INK}, template="none", **layout,
    )  # fmt: skip


def _look(name: str, number: int) -> dict[str, Any]:
    """How a record is drawn: the first as measured, the others by what they are, whichever of them are there."""
    if number == 0:
        return {"line": {"color": INK, "width": 4.5}, "opacity": 0.45}
    k = {NOMINAL: 0, APPLIED: 2}.get(name, 1)
    return {"line": {"color": COLOURS[k], "width": 1.6, "dash": SETTINGS.dashes[k]}}


def _curve(x: Array, y: Array, name: str, number: int, *, legend: bool) -> go.Scatter:
    xs, ys = thin(x, y, SETTINGS.points)
    return go.Scatter(
        x=xs.astype(np.float32), y=ys.astype(np.float32), name=name, legendgroup=name, showlegend=legend,
        mode="lines", **_look(name, number),
    )  # fmt: skip


def histories(
    runs: Mapping[str, Recording],
    channels: Sequence[str],
    *,
    window: tuple[float, float] | None = None,
    errors: bool = False,
) -> go.Figure:
    """Channels over time, all records in the same axes, one row a channel.

    Args:
        runs: Records by name on one clock, the measured one first.
        channels: Channels to draw.
        window: First and last time shown at first [s]; all is there to be zoomed out to.
        errors: Draw the simulations less the measurement.
    """
    figure = make_subplots(
        rows=len(channels), shared_xaxes=True, vertical_spacing=0.06 if len(channels) < 4 else 0.03
    )
    (first, measured), *others = runs.items()
    named: set[str] = set()
    for row, channel in enumerate(channels, start=1):
        for number, (name, run) in enumerate([(first, measured), *others]):
            if channel not in run.names or (errors and number == 0):
                continue
            y = run[channel] - measured[channel] if errors else run[channel]
            figure.add_trace(_curve(run.time, y, name, number, legend=name not in named), row=row, col=1)
            named.add(name)
        unit = measured.channel(channel).unit
        figure.update_yaxes(title_text=f"{channel} [{unit}]", row=row, col=1)
    figure.update_xaxes(title_text="time [s]", row=len(channels), col=1)
    if window is not None:
        figure.update_xaxes(range=list(window))
    return _finished(figure, 110 + SETTINGS.row * len(channels), hovermode="x unified")


def loop(runs: Mapping[str, Recording], x: str, y: str) -> go.Figure:
    """One channel over another, all records in the same axes."""
    figure = go.Figure()
    unit = {}
    for number, (name, run) in enumerate(runs.items()):
        if x not in run.names or y not in run.names:
            continue
        every = max(1, len(run.time) // SETTINGS.points)
        unit = {x: run.channel(x).unit, y: run.channel(y).unit}
        figure.add_scatter(
            x=run[x][::every].astype(np.float32), y=run[y][::every].astype(np.float32), name=name, mode="lines",
            **_look(name, number),
        )  # fmt: skip
    figure.update_xaxes(title_text=f"{x} [{unit.get(x, '')}]")
    figure.update_yaxes(title_text=f"{y} [{unit.get(y, '')}]")
    return _finished(figure, 330)


def state_plot(found: StateMap) -> go.Figure:
    """Mean missing force over the plane of states; cells that differ from zero significantly are marked, unvisited ones empty."""
    place = found.place
    size = float(np.nanmax(np.abs(found.force), initial=0.0)) or 1.0
    x, v = (0.5 * (e[1:] + e[:-1]) for e in (found.displacement_edges, found.velocity_edges))
    figure = go.Figure(
        go.Heatmap(
            x=found.displacement_edges, y=found.velocity_edges, z=found.force.T, zmin=-size, zmax=size,
            colorscale=SETTINGS.diverging, hoverongaps=False,
            colorbar={"title": {"text": f"[{place.force_unit}]"}, "thickness": 12, "outlinecolor": RULE},
            hovertemplate=f"displacement %{{x:.3g}}, velocity %{{y:.3g}}: %{{z:.3g}} {place.force_unit}<extra></extra>",
        )
    )  # fmt: skip
    i, j = np.nonzero(found.significant)
    figure.add_scatter(
        x=x[i], y=v[j], mode="markers", hoverinfo="skip", showlegend=False,
        marker={"symbol": "square-open", "size": 9, "color": INK},
    )  # fmt: skip
    figure.update_xaxes(title_text=f"displacement [{place.position_unit}]")
    figure.update_yaxes(title_text=f"velocity [{place.position_unit}/s]")
    return _finished(figure, 330)


def matrix_plot(matrix: Mapping[str, Mapping[str, float]]) -> go.Figure:
    """Joint by candidate: the part of a joint's own discrepancy that one effect alone closes there; empty where none was fitted."""
    effects = _by_closing(matrix)
    joints = list(matrix)
    values = np.array([[100.0 * matrix[j].get(e, np.nan) for j in joints] for e in effects])
    figure = go.Figure(
        go.Heatmap(
            x=joints, y=effects, z=values, zmin=0.0, zmax=100.0, colorscale=[[0.0, PAPER], [1.0, COLOURS[1]]],
            xgap=2, ygap=2, hoverongaps=False, texttemplate="%{z:.3g}",
            colorbar={"title": {"text": "[%]"}, "thickness": 12, "outlinecolor": RULE},
            hovertemplate="%{y} at %{x}: closes %{z:.3g} %<extra></extra>",
        )
    )  # fmt: skip
    figure.update_yaxes(autorange="reversed", showgrid=False)
    figure.update_xaxes(side="top", showgrid=False)
    return _finished(figure, 90 + 30 * len(effects))


def _by_closing(matrix: Mapping[str, Mapping[str, float]]) -> list[str]:
    best: dict[str, float] = {}
    for row in matrix.values():
        for effect, closed in row.items():
            best[effect] = max(best.get(effect, closed), closed)
    return sorted(best, key=lambda effect: -best[effect])


def ranking_plot(ranked: Sequence[Ranked]) -> tuple[go.Figure, int]:
    """Probability of each effect that has any, and how many have none."""
    shown = [r for r in ranked if r.probability >= SETTINGS.likely][: SETTINGS.shown]
    names = [r.name + (f" ({r.where})" if r.where else "") for r in shown]
    figure = go.Figure(
        go.Bar(
            x=[r.probability for r in shown], y=names, orientation="h", marker={"color": COLOURS[1]}, textposition="auto",
            text=[probability(r.probability) for r in shown], hovertemplate="%{y}: %{x:.3g}<extra></extra>",
        )
    )  # fmt: skip
    figure.update_xaxes(title_text="probability", range=[0.0, 1.0])
    figure.update_yaxes(autorange="reversed", showgrid=False)
    return _finished(figure, 110 + 30 * len(shown), bargap=0.35), len(ranked) - len(shown)


def waterfall_plot(gap: Gap) -> go.Figure:
    """The discrepancy before and after each step, and the floor of the noise."""
    labels = [label for label, _ in gap.steps]
    values = [value for _, value in gap.steps]
    figure = go.Figure(
        go.Bar(
            x=values, y=labels, orientation="h", marker={"color": [COLOURS[0], *[COLOURS[1]] * (len(values) - 1)]},
            text=[f"{value:.3g}" for value in values], textposition="auto", hovertemplate="%{y}: %{x:.3g}<extra></extra>",
        )
    )  # fmt: skip
    figure.add_vline(x=gap.noise_floor, line={"color": INK, "dash": "dash", "width": 1.5})
    figure.add_annotation(
        x=gap.noise_floor, y=1.0, yref="paper", yanchor="bottom", xanchor="left", showarrow=False,
        text=f"noise alone {gap.noise_floor:.3g}",
    )  # fmt: skip
    figure.update_xaxes(title_text="NRMSE", rangemode="tozero")
    figure.update_yaxes(autorange="reversed", showgrid=False)
    return _finished(figure, 120 + 34 * len(values), bargap=0.35)


def share_plot(part: Split, *, units: tuple[str, str] = ("", "")) -> go.Figure:
    """Shares of a split as bars; significant parts are filled.

    Args:
        part: The split.
        units: Of displacement and of force.
    """
    values = 100.0 * np.array(part.shares)
    places = np.arange(len(values))
    names = [str(cell) for cell in part.cells]
    ticks = {"tickvals": places, "ticktext": names}
    if len(part.cells) == len(values) + 1:
        names = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(part.cells)]
        every = -(-len(values) // SETTINGS.edges)
        edges = np.arange(0, len(values) + 1, every)
        ticks = {"tickvals": edges - 0.5, "ticktext": [f"{part.cells[i]:.3g}" for i in edges]}
    figure = go.Figure(
        go.Bar(
            x=places, y=values, customdata=names, hovertemplate="%{customdata}: %{y:.3g} %<extra></extra>",
            marker={
                "color": [COLOURS[1] if yes else PAPER for yes in part.significant],
                "line": {"color": COLOURS[1], "width": 1.2},
            },
        )
    )  # fmt: skip
    unit = {"displacement": units[0], "after_reversal": units[0], "velocity": f"{units[0]}/s"}.get(
        part.kind, ""
    )
    label = LABELS.get(part.kind, part.kind)
    figure.update_xaxes(
        title_text=f"{label} [{unit}]" if units[0] and unit else label, showgrid=False, **ticks
    )
    figure.update_yaxes(title_text="share [%]")
    title = f"{part.of}{f', {part.dof}' if part.dof and part.dof != part.of else ''}"
    return _finished(
        figure, 290, title={"text": title, "font": {"size": 13}, "x": 0.0, "xref": "paper"}, bargap=0.1
    )


def correlation_plot(labels: Sequence[str], correlation: Array) -> go.Figure:
    """Correlations of estimated parameters."""
    numbered = len(labels) <= SETTINGS.numbered
    figure = go.Figure(
        go.Heatmap(
            x=list(labels), y=list(labels), z=np.round(correlation, 2), zmin=-1.0, zmax=1.0, colorscale=SETTINGS.diverging,
            xgap=1, ygap=1, texttemplate="%{z:.2f}" if numbered else None,
            colorbar={"thickness": 12, "outlinecolor": RULE},
            hovertemplate="%{y} and %{x}: %{z:.2f}<extra></extra>",
        )
    )  # fmt: skip
    figure.update_yaxes(autorange="reversed", showgrid=False)
    figure.update_xaxes(showgrid=False, tickangle=-60)
    return _finished(figure, 220 + 30 * len(labels))
