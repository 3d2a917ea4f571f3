"""How figures look, and how they are written: palette, style, legends, thinning, files and data addresses."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.files import write_bytes

REFERENCE_COLOUR = "#1a1a1a"
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of the variants beside the reference (Okabe & Ito 2008, "Color Universal Design")."""


@dataclass(frozen=True)
class LookSettings:
    """Numbers of `bench.figures.look`."""

    dashes: tuple[Any, ...] = (
        "-",
        (0, (5, 1.2)),
        (0, (3, 1, 1, 1)),
        (0, (1, 1)),
        (0, (7, 2)),
        (0, (4, 1, 1, 1, 1, 1)),
    )
    max_points: int = 20_000
    """Most points of a drawn line; a longer record is thinned to extremes of short windows, which no eye can tell."""
    style: Mapping[str, Any] = field(
        default_factory=lambda: {
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
    )


SETTINGS = LookSettings()


@contextmanager
def style() -> Iterator[None]:
    """The bench's look, for code that draws its own axes: matplotlib's settings are restored afterwards."""
    with matplotlib.rc_context(cast(Any, dict(SETTINGS.style))):
        yield


def axes_grid(width: float, height: float, **layout: Any) -> tuple[Figure, NDArray]:
    """A figure of a size in inches and its axes ``(n_rows, n_columns)``."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, np.asarray(figure.subplots(squeeze=False, **layout))


def look(number: int) -> dict[str, Any]:
    """How the record of that number is drawn: the reference (0) broad and grey, to be seen on both sides of the thin coloured others."""
    if number == 0:
        return {"color": REFERENCE_COLOUR, "linewidth": 3.4, "alpha": 0.45}
    index = (number - 1) % len(COLOURS)
    return {"color": COLOURS[index], "linewidth": 1.0, "linestyle": SETTINGS.dashes[index]}


def thin(x: NDArray, y: NDArray, points: int = SETTINGS.max_points) -> tuple[NDArray, NDArray]:
    """At most about that many points, among them the extremes of y in each short window."""
    if len(x) <= points:
        return x, y
    width = math.ceil(2.0 * len(x) / points)
    whole = len(y) // width * width
    first, windows = np.arange(0, whole, width), y[:whole].reshape(-1, width)
    kept = np.unique(
        np.concatenate([first + windows.argmin(axis=1), first + windows.argmax(axis=1), [len(x) - 1]])
    )
    return x[kept], y[kept]


def legend(figure: Figure, axes: Axes, count: int) -> None:
    """Name the lines above the figure, where they hide nothing; no legend for a single line."""
    if count > 1:
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=min(len(labels), 5))


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
    write_bytes(target, content)
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
