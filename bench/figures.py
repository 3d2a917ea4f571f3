"""Figures of records, joints and diagnoses: matplotlib without state, a display or a call to pyplot.

Every function returns a `matplotlib.figure.Figure` with a quantity and a unit on each axis. The first record is the
reference: black and broad; the others are drawn thin on top in the colours of Okabe & Ito, which every colour vision
tells apart, and in differing dashes, which a grey print does. `save` writes a file whole or not at all; `as_svg` and
`as_png_data_uri` embed a figure in a page.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from scipy.signal import welch

from bench.errors import ParameterError, UnknownNameError
from bench.files import OutputError, replacing
from bench.recording import Recording, nmse

REFERENCE_COLOUR = "#1a1a1a"
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of the variants beside the reference (Okabe & Ito 2008, "Color Universal Design")."""

DASHES = ("-", (0, (5, 1.2)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2)), (0, (4, 1, 1, 1, 1, 1)))
MAX_POINTS = 20_000
"""Most points of a drawn line; a longer record is thinned to extremes of short windows, which no eye can tell."""

COVERAGE_SAMPLES = 3
"""Fewest samples in a cell of a surface for it to be drawn: with fewer, the colour would show one stray sample."""

_STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 110.0,
    "savefig.dpi": 150.0,
    "svg.fonttype": "path",
    "svg.hashsalt": "jointbench",  # the same figure gives the same file
}


@contextmanager
def style() -> Iterator[None]:
    """The bench's look, for code that draws its own axes: matplotlib's settings are restored afterwards."""
    with matplotlib.rc_context(_STYLE):
        yield


def _figure(width: float, height: float, **layout: Any) -> tuple[Figure, NDArray]:
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, np.asarray(figure.subplots(squeeze=False, **layout))


def _look(number: int) -> dict[str, Any]:
    if number == 0:
        return {"color": REFERENCE_COLOUR, "linewidth": 2.2, "alpha": 0.75}
    index = (number - 1) % len(COLOURS)
    return {"color": COLOURS[index], "linewidth": 1.1, "linestyle": DASHES[index]}


def _label(records: Mapping[str, Recording], channel: str) -> str:
    for recording in records.values():
        for item in recording.channels:
            if item.name == channel:
                return f"{channel} [{item.unit}]"
    known = {name for recording in records.values() for name in recording.names}
    raise UnknownNameError("channel of the records", channel, known)


def _require(records: Mapping[str, Recording]) -> None:
    if not records:
        raise ParameterError("no records came; at least one is expected")


def _cut(recording: Recording, window: tuple[float, float] | None) -> slice:
    """The samples of a window of time; all of them where None."""
    if window is None:
        return slice(None)
    low, high = np.searchsorted(recording.time, window)
    if high - low < 2:
        raise ParameterError(
            f"the window {window} s holds {high - low} sample(s) of a record from {recording.time[0]:g} to "
            f"{recording.time[-1]:g} s; a window inside it is expected"
        )
    return slice(int(low), int(high))


def _thin(x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
    """At most about `MAX_POINTS` points, among them the extremes of y in each short window."""
    if len(x) <= MAX_POINTS:
        return x, y
    width = math.ceil(2.0 * len(x) / MAX_POINTS)
    whole = len(y) // width * width
    first, windows = np.arange(0, whole, width), y[:whole].reshape(-1, width)
    kept = np.unique(
        np.concatenate([first + windows.argmin(axis=1), first + windows.argmax(axis=1), [len(x) - 1]])
    )
    return x[kept], y[kept]


def _legend(axes: Axes, count: int, *, outside: Figure | None = None) -> None:
    if count < 2:
        return
    if outside is None:
        axes.legend(loc="best")
        return
    handles, labels = axes.get_legend_handles_labels()
    outside.legend(handles, labels, loc="outside upper right", ncols=min(len(labels), 5))


def time_histories(
    records: Mapping[str, Recording],
    channels: Sequence[str],
    *,
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """Channels over time, one below the other, all records overlaid.

    Args:
        records: Records by name, the reference first; those that lack a channel are left out of its axes.
        channels: Channels to draw.
        window: First and last time drawn [s]; everything where None.
        title: Title of the figure.

    Raises:
        ParameterError: No records, no channels, or a window outside a record.
        UnknownNameError: No record holds a channel.
    """
    _require(records)
    if not channels:
        raise ParameterError("no channels came; at least one is expected")
    with style():
        figure, grid = _figure(8.0, 0.7 + 1.7 * len(channels), nrows=len(channels), sharex=True)
        for axes, channel in zip(grid[:, 0], channels, strict=True):
            for number, (name, recording) in enumerate(records.items()):
                if channel in recording.names:
                    part = _cut(recording, window)
                    axes.plot(
                        *_thin(recording.time[part], recording[channel][part]), label=name, **_look(number)
                    )
            axes.set_ylabel(_label(records, channel))
            axes.set_xlabel("time [s]")
            axes.label_outer()
            axes.margins(x=0.0)
        _legend(grid[0, 0], len(records), outside=figure)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def error_histories(
    records: Mapping[str, Recording],
    channels: Sequence[str],
    *,
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """Differences from the reference over time, with the NMSE of each, in the units of the channel.

    Args:
        records: Records by name on one clock, the reference first.
        channels: Channels to compare.
        window: First and last time drawn [s]; NMSE is of the whole record, settling time left out.
        title: Title of the figure.

    Raises:
        ParameterError: Fewer than two records, or records of different lengths.
        UnknownNameError: A record lacks a channel.
    """
    if len(records) < 2 or not channels:
        raise ParameterError(
            f"{len(records)} record(s) and {len(channels)} channel(s) came; errors need a reference and another record"
        )
    (first, reference), *others = records.items()
    with style():
        figure, grid = _figure(8.0, 0.7 + 1.7 * len(channels), nrows=len(channels), sharex=True)
        part = _cut(reference, window)
        for axes, channel in zip(grid[:, 0], channels, strict=True):
            label = _label({first: reference}, channel)
            for number, (name, recording) in enumerate(others, start=1):
                _label({name: recording}, channel)
                if len(recording.time) != len(reference.time):
                    raise ParameterError(
                        f"records '{first}' and '{name}' have {len(reference.time)} and {len(recording.time)} samples; "
                        "resample one of them"
                    )
                error = recording[channel] - reference[channel]
                score = nmse(reference[channel][reference.scored], recording[channel][reference.scored])
                text = f"{name}: NMSE {score:.3g} %"
                axes.plot(*_thin(reference.time[part], error[part]), label=text, **_look(number))
            axes.set_ylabel(f"error of\n{label}")
            axes.set_xlabel("time [s]")
            axes.label_outer()
            axes.margins(x=0.0)
            axes.legend(loc="upper right", ncols=3)
        figure.suptitle(title or f"simulated − {first}", x=0.01, ha="left")
    return figure


def loops(
    records: Mapping[str, Recording],
    pairs: Sequence[tuple[str, str]],
    *,
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """Loops of one channel over another, all records overlaid: force over displacement, force over velocity.

    Args:
        records: Records by name, the reference first.
        pairs: (x channel, y channel) of each loop; `element_loops` names those of an element.
        window: First and last time drawn [s].
        title: Title of the figure.

    Raises:
        ParameterError: No records, no pairs, or a window outside a record.
        UnknownNameError: No record holds a channel.
    """
    _require(records)
    if not pairs:
        raise ParameterError("no channel pairs came; at least one (x channel, y channel) is expected")
    columns = min(len(pairs), 2)
    rows = math.ceil(len(pairs) / columns)
    with style():
        figure, grid = _figure(4.1 * columns, 0.5 + 3.1 * rows, nrows=rows, ncols=columns)
        for axes, (x, y) in zip(grid.flat, pairs, strict=False):
            for number, (name, recording) in enumerate(records.items()):
                if x in recording.names and y in recording.names:
                    part = _cut(recording, window)
                    axes.plot(recording[x][part], recording[y][part], label=name, **_look(number))
            axes.set_xlabel(_label(records, x))
            axes.set_ylabel(_label(records, y))
        for axes in list(grid.flat)[len(pairs) :]:
            axes.remove()
        _legend(grid[0, 0], len(records), outside=figure)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def element_loops(recording: Recording, element: str) -> list[tuple[str, str]]:
    """The loops of an element's channels: force over displacement and over velocity, for each of its coordinates.

    Raises:
        UnknownNameError: The record has no element of that name.
    """
    stem = f"{element}/force"
    forces = [name for name in recording.names if name == stem or name.startswith(stem + "_")]
    if not forces:
        known = {name.rsplit("/", 1)[0] for name in recording.names if "/" in name}
        raise UnknownNameError("element in the record", element, known)
    suffixes = [force.removeprefix(stem) for force in forces]
    return [(f"{element}/{motion}{s}", stem + s) for s in suffixes for motion in ("displacement", "velocity")]


def phase_plot(
    records: Mapping[str, Recording],
    displacement: str,
    velocity: str,
    *,
    window: tuple[float, float] | None = None,
) -> Figure:
    """The path of a motion in the plane of displacement and velocity, all records overlaid."""
    return loops(records, [(displacement, velocity)], window=window)


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
            f"arrays of {[len(a) for a in samples]} samples came; as many finite displacements, velocities and forces are expected"
        )
    count, x_edges, v_edges = np.histogram2d(samples[0], samples[1], bins=bins)
    total, _, _ = np.histogram2d(samples[0], samples[1], bins=(x_edges, v_edges), weights=samples[2])
    enough = count >= min(COVERAGE_SAMPLES, count.max())
    mean = np.where(enough, total / np.maximum(count, 1.0), np.nan)
    with style(), matplotlib.rc_context({"axes.grid": False}):
        figure, grid = _figure(8.6, 3.6, ncols=2, sharex=True, sharey=True)
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


def spectrum(
    records: Mapping[str, Recording],
    channels: Sequence[str],
    *,
    max_frequency: float | None = None,
    title: str = "",
) -> Figure:
    """Amplitude spectral densities of channels by Welch's method, all records overlaid.

    Args:
        records: Records by name, the reference first.
        channels: Channels to draw.
        max_frequency: Highest frequency drawn [Hz]; the Nyquist frequency where None.
        title: Title of the figure.

    Raises:
        ParameterError: No records or no channels.
        UnknownNameError: No record holds a channel.
    """
    _require(records)
    if not channels:
        raise ParameterError("no channels came; at least one is expected")
    with style():
        figure, grid = _figure(8.0, 0.7 + 2.0 * len(channels), nrows=len(channels), sharex=True)
        for axes, channel in zip(grid[:, 0], channels, strict=True):
            for number, (name, recording) in enumerate(records.items()):
                if channel in recording.names:
                    y = recording[channel][recording.scored]
                    # Eight half-overlapping segments: a variance of about a sixth at a resolution of 4.5/T.
                    segment = max(min(len(y), 8), int(len(y) / 4.5))
                    frequency, power = welch(y, recording.sample_rate, nperseg=segment)
                    axes.semilogy(frequency[1:], np.sqrt(power[1:]), label=name, **_look(number))
            label = _label(records, channel)
            axes.set_ylabel(label[:-1] + "/√Hz]")
            axes.set_xlabel("frequency [Hz]")
            axes.label_outer()
            axes.set_xlim(0.0, max_frequency)
        _legend(grid[0, 0], len(records), outside=figure)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def waterfall(
    labels: Sequence[str],
    values: ArrayLike,
    *,
    floor: float | None = None,
    axis: str = "NMSE [%]",
    start: str = "nominal",
    title: str = "",
) -> Figure:
    """What each effect takes off an error, one after the other, down to what is left and the floor of the noise.

    Args:
        labels: Effects in the order they were added (n,).
        values: Error before the first effect, then after each (n + 1,).
        floor: Error that measurement noise alone leaves, drawn as a line.
        axis: Label with unit of the error.
        start: Label of the first bar.
        title: Title of the figure.

    Raises:
        ParameterError: The lengths do not fit, or a value is not finite.
    """
    levels = np.asarray(values, dtype=float)
    if levels.shape != (len(labels) + 1,) or not np.all(np.isfinite(levels)):
        raise ParameterError(
            f"{len(labels)} labels and values of shape {levels.shape} came; one finite value more than labels is expected"
        )
    names = [start, *labels, "left"]
    bottoms = np.concatenate([[0.0], np.minimum(levels[:-1], levels[1:]), [0.0]])
    heights = np.concatenate([[levels[0]], np.abs(np.diff(levels)), [levels[-1]]])
    steps = np.concatenate([[levels[0]], np.diff(levels), [levels[-1]]])
    falls = np.concatenate([[False], np.diff(levels) <= 0.0, [False]])
    colours = [COLOURS[2] if fall else COLOURS[0] for fall in falls]
    colours[0] = colours[-1] = "#777777"
    places = np.arange(len(names))
    with style():
        figure, grid = _figure(max(5.0, 0.95 * len(names) + 1.2), 3.6)
        axes = grid[0, 0]
        axes.bar(places, heights, bottom=bottoms, color=colours, width=0.68)
        ends = np.concatenate([levels[:1], levels[1:], levels[-1:]])
        for i in range(len(names) - 1):
            axes.plot([i + 0.34, i + 0.66], [ends[i], ends[i]], color="#999999", linewidth=0.8)
        for place, bottom, height, step in zip(places, bottoms, heights, steps, strict=True):
            text = f"{step:.3g}" if place in (0, places[-1]) else f"{step:+.3g}"
            axes.annotate(
                text, (place, bottom + height), (0, 2), textcoords="offset points", ha="center", fontsize=8
            )
        if floor is not None:
            axes.axhline(floor, color=REFERENCE_COLOUR, linestyle=(0, (4, 2)), linewidth=1.0)
            axes.annotate(
                f"noise floor {floor:.3g}", (1.0, floor), (-2, 3), xycoords=axes.get_yaxis_transform(),
                textcoords="offset points", ha="right", fontsize=8,
            )  # fmt: skip
        axes.set_xticks(
            places, names, rotation=25 if len(names) > 4 else 0, ha="right" if len(names) > 4 else "center"
        )
        axes.set_ylabel(axis)
        axes.set_xlabel("effects, in the order added")
        axes.set_ylim(bottom=0.0)
        axes.grid(visible=False, axis="x")
        axes.set_title(title)
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
        figure, grid = _figure(5.2, 3.8)
        axes = grid[0, 0]
        norm = TwoSlopeNorm(0.0, -size, size)
        drawn = axes.pcolormesh(x, y, cells.T, cmap="RdBu_r", norm=norm, rasterized=True)
        figure.colorbar(drawn, ax=axes, label=labels[2])
        axes.set_facecolor("#d9d9d9")
        axes.set_xlabel(labels[0])
        axes.set_ylabel(labels[1])
        axes.set_title(title)
    return figure


def bar_table(
    scores: Mapping[str, Mapping[str, float]],
    *,
    axis: str = "NMSE [%]",
    log: bool = True,
    limit: float | None = None,
    limit_label: str = "limit",
    title: str = "",
) -> Figure:
    """Scores of several models over several channels as bars with their numbers.

    Args:
        scores: Scores by model, then by channel.
        axis: Label with unit of the scores.
        log: Logarithmic axis, for scores over decades.
        limit: A score to be kept, drawn as a line.
        limit_label: What the limit is.
        title: Title of the figure.

    Raises:
        ParameterError: No scores.
    """
    channels = list(dict.fromkeys(channel for row in scores.values() for channel in row))
    if not channels:
        raise ParameterError("no scores came; at least one model with one channel is expected")
    height = 0.8 / len(scores)
    with style():
        figure, grid = _figure(7.5, 1.3 + 0.32 * len(channels) * max(len(scores), 1.5))
        axes = grid[0, 0]
        for number, (model, row) in enumerate(scores.items()):
            held = [i for i, channel in enumerate(channels) if channel in row]
            values = [row[channels[i]] for i in held]
            places = np.array(held) - 0.4 + (number + 0.5) * height
            bars = axes.barh(
                places, values, height=0.9 * height, label=model, color=COLOURS[number % len(COLOURS)]
            )
            axes.bar_label(bars, [f"{value:.3g}" for value in values], padding=3, fontsize=8)
        if log:
            axes.set_xscale("log")
        axes.margins(x=0.12)
        if limit is not None:
            axes.axvline(
                limit,
                color=REFERENCE_COLOUR,
                linestyle=(0, (4, 2)),
                linewidth=1.0,
                label=f"{limit_label} {limit:g}",
            )
        axes.set_yticks(range(len(channels)), channels)
        axes.invert_yaxis()
        axes.set_xlabel(axis)
        axes.set_ylabel("channel")
        axes.grid(visible=False, axis="y")
        _legend(axes, len(scores) + (limit is not None), outside=figure)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def contributions(
    time: ArrayLike,
    parts: Mapping[str, ArrayLike],
    *,
    total: ArrayLike | None = None,
    axis: str = "force [N]",
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """What each effect adds to a force over time, and the share of each in the sum's mean square.

    The share of a part p in the sum s is ``mean(p s) / mean(s^2)``; shares add up to one and may be negative, where
    a part works against the sum.

    Args:
        time: Times [s] (n,).
        parts: Contributions (n,) by effect.
        total: What they are to add up to (n,); their sum where None.
        axis: Label with unit of the contributions.
        window: First and last time drawn [s]; shares are of the whole record.
        title: Title of the figure.

    Raises:
        ParameterError: No parts, or different lengths.
    """
    t = np.asarray(time, dtype=float)
    arrays = {name: np.asarray(part, dtype=float) for name, part in parts.items()}
    whole = (
        np.sum(list(arrays.values()), axis=0) if total is None and arrays else np.asarray(total, dtype=float)
    )
    if not arrays or any(part.shape != t.shape for part in (*arrays.values(), whole)):
        raise ParameterError(
            f"{len(t)} times and parts of {[part.shape for part in arrays.values()]} came; parts as long as the times are expected"
        )
    power = float(np.mean(whole**2)) or 1.0
    shares = {name: float(np.mean(part * whole)) / power for name, part in arrays.items()}
    shown = (t >= window[0]) & (t <= window[1]) if window is not None else np.ones(len(t), dtype=bool)
    with style():
        figure, grid = _figure(9.0, 3.4, ncols=2, width_ratios=[3.0, 1.0])
        axes, bars = grid[0]
        axes.plot(*_thin(t[shown], whole[shown]), label="total", **_look(0))
        for number, (name, part) in enumerate(arrays.items(), start=1):
            axes.plot(*_thin(t[shown], part[shown]), label=name, **_look(number))
        axes.set_xlabel("time [s]")
        axes.set_ylabel(axis)
        axes.margins(x=0.0)
        colours = [COLOURS[i % len(COLOURS)] for i in range(len(arrays))]
        drawn = bars.barh(range(len(arrays)), [100.0 * share for share in shares.values()], color=colours)
        bars.bar_label(drawn, [f"{100.0 * share:.3g} %" for share in shares.values()], padding=3, fontsize=8)
        bars.set_yticks(range(len(arrays)), list(arrays))
        bars.invert_yaxis()
        bars.margins(x=0.3)
        bars.set_xlabel("share of the mean square [%]")
        bars.set_ylabel("effect")
        bars.grid(visible=False, axis="y")
        _legend(axes, len(arrays) + 1, outside=figure)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def save(figure: Figure, path: str | Path, *, dpi: float = 150.0) -> Path:
    """Write a figure whole or not at all; the suffix decides the format (.png, .svg, .pdf).

    Args:
        figure: The figure.
        path: The file.
        dpi: Resolution of pictures and of rasterised parts [1/in].

    Raises:
        OutputError: The file cannot be written.
        ParameterError: No such format.
    """
    target = Path(path)
    kind = target.suffix.removeprefix(".").lower()
    if kind not in ("png", "svg", "pdf"):
        raise ParameterError(
            f"a figure cannot be written as '{target.name}'; use a name in .png, .svg or .pdf"
        )
    content = _rendered(figure, kind, dpi)
    with replacing(target) as temporary:
        try:
            temporary.write_bytes(content)
        except OSError as error:
            raise OutputError(
                f"cannot write {target}: {error.strerror or error}; choose another place"
            ) from error
    return target


def _rendered(figure: Figure, kind: str, dpi: float) -> bytes:
    buffer = io.BytesIO()
    # No date: the same figure gives the same file.
    metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
    with style():
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=metadata)
    return buffer.getvalue()


def as_svg(figure: Figure) -> str:
    """The figure as an ``<svg>`` element, to stand in an HTML page."""
    text = _rendered(figure, "svg", 150.0).decode("utf-8")
    return text[text.index("<svg") :]


def as_png_data_uri(figure: Figure, *, dpi: float = 110.0) -> str:
    """The figure as a ``data:`` address of a PNG, for the ``src`` of an ``<img>``."""
    return "data:image/png;base64," + base64.b64encode(_rendered(figure, "png", dpi)).decode("ascii")
