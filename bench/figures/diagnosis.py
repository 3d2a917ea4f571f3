"""Scores, and what each effect has to do with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from bench.errors import ParameterError
from bench.figures.look import COLOURS, REFERENCE_COLOUR, axes_grid, legend, look, style, thin


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
        figure, grid = axes_grid(max(5.0, 0.95 * len(names) + 1.2), 3.6)
        axes = grid[0, 0]
        axes.bar(places, heights, bottom=bottoms, color=colours, width=0.68)
        ends = np.concatenate([levels[:1], levels[1:], levels[-1:]])
        for i in range(len(names) - 1):
            axes.plot([i + 0.34, i + 0.66], [ends[i], ends[i]], color="#999999", linewidth=0.8)
        for place, bottom, height, step in zip(places, bottoms, heights, steps, strict=True):
            text = f"{step:.3g}" if place in (0, places[-1]) else f"{step:+.3g}".replace("-", "−")
            axes.annotate(
                text, (place, bottom + height), (0, 2), textcoords="offset points", ha="center", fontsize=8
            )
        if floor is not None:
            axes.axhline(
                floor,
                color=REFERENCE_COLOUR,
                linestyle=(0, (4, 2)),
                linewidth=1.0,
                label=f"noise floor {floor:.3g}",
            )
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))
        axes.set_xticks(
            places, names, rotation=25 if len(names) > 4 else 0, ha="right" if len(names) > 4 else "center"
        )
        axes.set_ylabel(axis)
        axes.set_xlabel("effects, in the order added")
        axes.set_ylim(0.0, 1.08 * float(levels.max()) or 1.0)
        axes.grid(visible=False, axis="x")
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
        figure, grid = axes_grid(7.5, 1.3 + 0.32 * len(channels) * max(len(scores), 1.5))
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
        legend(figure, axes, len(scores) + (limit is not None))
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
            f"{len(t)} times and parts of {[part.shape for part in arrays.values()]} came; "
            "parts as long as the times are expected"
        )
    power = float(np.mean(whole**2)) or 1.0
    shares = {name: float(np.mean(part * whole)) / power for name, part in arrays.items()}
    shown = (t >= window[0]) & (t <= window[1]) if window is not None else np.ones(len(t), dtype=bool)
    with style():
        figure, grid = axes_grid(9.0, 3.4, ncols=2, width_ratios=[3.0, 1.0])
        axes, bars = grid[0]
        axes.plot(*thin(t[shown], whole[shown]), label="total", **look(0))
        for number, (name, part) in enumerate(arrays.items(), start=1):
            axes.plot(*thin(t[shown], part[shown]), label=name, **look(number))
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
        legend(figure, axes, len(arrays) + 1)
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure
