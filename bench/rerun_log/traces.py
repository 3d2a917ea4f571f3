"""Channels over time and loops: fewer samples where the eye cannot tell, the same colours everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import rerun as rr
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class TracesSettings:
    """Numbers of `bench.rerun_log.traces`."""

    reference_colour: tuple[int, int, int] = (225, 225, 225)
    colours: tuple[tuple[int, int, int], ...] = (
        (240, 150, 30),
        (86, 180, 233),
        (0, 190, 130),
        (225, 130, 190),
        (240, 228, 66),
        (213, 94, 0),
    )
    """Colours of the variants beside the reference, told apart with any colour vision, on rerun's dark ground (after Okabe & Ito 2008,
    lightened)."""
    axes_colour: tuple[int, int, int] = (130, 130, 130)
    grid_colour: tuple[int, int, int] = (60, 60, 60)
    label_colour: tuple[int, int, int] = (200, 200, 200)
    # Rerun writes a label below its point and centred on it.
    label_below: tuple[float, float] = (0.0, 0.01)
    label_beside: tuple[float, float] = (-0.12, -0.06)


SETTINGS = TracesSettings()


class Style(NamedTuple):
    """How a variant is drawn."""

    colour: tuple[int, int, int]
    width: float  # [points]


def trace_style(number: int) -> Style:
    """The reference (number 0) broad and pale, the others thin and coloured on top of it."""
    if number == 0:
        return Style(SETTINGS.reference_colour, 2.6)
    return Style(SETTINGS.colours[(number - 1) % len(SETTINGS.colours)], 1.3)


def extremes(
    time: ArrayLike, values: ArrayLike, rate: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """At most `rate` samples a second of a record, among them the least and the largest of every short window.

    Picking every k-th sample would lose impacts; a mean would flatten them. All samples returned were in the record,
    at their own times.

    Args:
        time: Times [s] (n,), even.
        values: Samples (n,).
        rate: Largest number of samples a second.

    Returns:
        Times and samples ``(m,)`` of the samples kept; first and last always are.
    """
    t, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 3 or (len(t) - 1) / (t[-1] - t[0]) <= rate:
        return t, y
    width = int(np.ceil(2.0 * (len(t) - 1) / ((t[-1] - t[0]) * rate)))
    if not float(np.ptp(y)) > 0.0:
        return t[[0, -1]], y[[0, -1]]
    whole = len(y) // width * width
    windows = y[:whole].reshape(-1, width)
    first = np.arange(0, whole, width)
    kept = np.unique(
        np.concatenate([[0], first + windows.argmin(axis=1), first + windows.argmax(axis=1), [len(y) - 1]])
    )
    return t[kept], y[kept]


def log_series(
    stream: rr.RecordingStream,
    path: Sequence[str],
    time: NDArray,
    values: NDArray,
    *,
    label: str,
    look: Style,
    rate: float,
) -> None:
    """Log one channel over time, at no more than `rate` samples a second, in single precision.

    Rerun stores double precision; with the lower half of the mantissa zero it packs into two thirds of the space.
    """
    entity = rr.new_entity_path(list(path))
    stream.log(entity, rr.SeriesLines(colors=[look.colour], widths=[look.width], names=[label]), static=True)
    t, y = extremes(time, np.asarray(values, dtype=np.float32), rate)
    rr.send_columns(
        entity, [rr.TimeColumn("time", duration=t)], rr.Scalars.columns(scalars=y), recording=stream
    )


class Frame(NamedTuple):
    """The axes of a loop: rerun's 2-D views scale both axes alike, so data are drawn in a unit square."""

    x_ticks: NDArray[np.float64]
    y_ticks: NDArray[np.float64]

    def place(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float32]:
        """Points ``(n, 2)`` of the view, in which the second coordinate points down."""
        u = (np.asarray(x) - self.x_ticks[0]) / (self.x_ticks[-1] - self.x_ticks[0])
        v = (np.asarray(y) - self.y_ticks[0]) / (self.y_ticks[-1] - self.y_ticks[0])
        return np.stack([u, 1.0 - v], axis=-1).astype(np.float32)


def _ticks(low: float, high: float) -> NDArray[np.float64]:
    if not high > low:
        low, high = low - 0.5 * max(abs(low), 1.0), high + 0.5 * max(abs(high), 1.0)
    return np.asarray(MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))


def frame_of(xs: Sequence[NDArray], ys: Sequence[NDArray]) -> Frame:
    """Axes that hold all the data given."""
    return Frame(
        _ticks(min(float(x.min()) for x in xs), max(float(x.max()) for x in xs)),
        _ticks(min(float(y.min()) for y in ys), max(float(y.max()) for y in ys)),
    )


def _scaled(ticks: NDArray[np.float64], label: str) -> tuple[list[str], str]:
    """Short tick labels, and the axis label with the power of ten they leave out: "force [10³ N]"."""
    exponent = 3 * int(np.floor(np.log10(np.abs(ticks).max()) / 3.0))
    if exponent == -3 and np.abs(ticks).max() >= 0.1:
        exponent = 0
    texts = [f"{tick / 10.0**exponent:.4g}" for tick in ticks]
    power = "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return texts, label if exponent == 0 else label.replace("[", f"[{power} ", 1)


def log_frame(
    stream: rr.RecordingStream, path: Sequence[str], frame: Frame, x_label: str, y_label: str
) -> None:
    """Draw the axes of a loop: frame, grid, labels with units, and the numbers of the first, middle and last tick."""
    lines = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]]
    x = frame.place(frame.x_ticks, np.full(len(frame.x_ticks), frame.y_ticks[0]))
    y = frame.place(np.full(len(frame.y_ticks), frame.x_ticks[0]), frame.y_ticks)
    lines += [[[u, 0.0], [u, 1.0]] for u in x[1:-1, 0]] + [[[0.0, v], [1.0, v]] for v in y[1:-1, 1]]
    stream.log(
        rr.new_entity_path([*path, "axes"]),
        rr.LineStrips2D(
            lines,
            colors=[SETTINGS.axes_colour] + [SETTINGS.grid_colour] * (len(lines) - 1),
            radii=rr.Radius.ui_points(0.5),
        ),
        static=True,
    )
    x_texts, x_label = _scaled(frame.x_ticks, x_label)
    y_texts, y_label = _scaled(frame.y_ticks, y_label)
    shown_x, shown_y = ([0, len(t) // 2, len(t) - 1] for t in (x_texts, y_texts))
    places = [
        *(x[shown_x] + SETTINGS.label_below),
        *(y[shown_y] + SETTINGS.label_beside),
        (0.5, 1.15),
        (0.25, -0.17),
    ]
    texts = [x_texts[i] for i in shown_x] + [y_texts[i] for i in shown_y] + [x_label, y_label]
    stream.log(
        rr.new_entity_path([*path, "labels"]),
        rr.Points2D(
            places,
            labels=texts,
            show_labels=True,
            radii=rr.Radius.ui_points(0.01),
            colors=SETTINGS.label_colour,
        ),
        static=True,
    )


def _strips(points: NDArray[np.float32], starts: NDArray, ends: NDArray) -> pa.Array:
    """Stretches ``points[start:end]`` as rerun stores strips; its own conversion takes 60 µs a strip."""
    kind = rr.components.LineStrip2DBatch([[[0.0, 0.0], [1.0, 1.0]]]).as_arrow_array().type
    at = np.concatenate([np.arange(a, b) for a, b in zip(starts, ends, strict=True)])
    flat = pa.FixedSizeListArray.from_arrays(pa.array(points[at].ravel()), type=kind.value_type)
    offsets = np.concatenate([[0], np.cumsum(ends - starts)]).astype(np.int32)
    return pa.ListArray.from_arrays(pa.array(offsets), flat, type=kind)


def log_loop(
    stream: rr.RecordingStream,
    path: Sequence[str],
    time: NDArray,
    points: NDArray[np.float32],
    *,
    look: Style,
    layer: int,
    frames: NDArray,
) -> None:
    """Draw a loop: the whole of it faint, and over time the stretch run through in each frame.

    Args:
        stream: Where to.
        path: Entity path of the variant's loop.
        time: Times of the points [s] (n,).
        points: Points of the view (n, 2).
        look: Colour and width.
        layer: Place in the pile of variants, 0 lowest.
        frames: Times of the frames [s] (n_frames,).
    """
    faint = (*look.colour, 40)
    stream.log(
        rr.new_entity_path([*path, "whole"]),
        rr.LineStrips2D(
            [points], colors=[faint], radii=rr.Radius.ui_points(0.25 * look.width), draw_order=1.0 + layer
        ),
        static=True,
    )
    ends = np.clip(np.searchsorted(time, frames, side="right"), 1, len(time))
    starts = np.maximum(np.concatenate([[1], ends[:-1]]) - 1, 0)
    count = len(frames)
    trail = rr.LineStrips2D.columns(
        strips=_strips(points, starts, ends),
        colors=[look.colour] * count,
        radii=np.repeat(rr.Radius.ui_points(0.5 * look.width), count),
        draw_order=[20.0 + layer] * count,
    )
    clock = [rr.TimeColumn("time", duration=frames)]
    rr.send_columns(rr.new_entity_path([*path, "trail"]), clock, trail, recording=stream)
