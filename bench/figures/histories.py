"""Records over time, over frequency and over each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from bench.errors import ParameterError, UnknownNameError
from bench.figures.look import axes_grid, legend, look, style, thin
from bench.recording import Recording, nmse


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
        figure, grid = axes_grid(8.0, 0.7 + 1.7 * len(channels), nrows=len(channels), sharex=True)
        for axes, channel in zip(grid[:, 0], channels, strict=True):
            for number, (name, recording) in enumerate(records.items()):
                if channel in recording.names:
                    part = _cut(recording, window)
                    axes.plot(
                        *thin(recording.time[part], recording[channel][part]), label=name, **look(number)
                    )
            axes.set_ylabel(_label(records, channel))
            axes.set_xlabel("time [s]")
            axes.label_outer()
            axes.margins(x=0.0)
        legend(figure, grid[0, 0], len(records))
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
        figure, grid = axes_grid(8.0, 0.7 + 1.7 * len(channels), nrows=len(channels), sharex=True)
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
                axes.plot(*thin(reference.time[part], error[part]), label=text, **look(number))
            axes.set_ylabel(f"error of\n{label}")
            axes.set_xlabel("time [s]")
            axes.label_outer()
            axes.margins(x=0.0)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, ncols=3)
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
        figure, grid = axes_grid(4.1 * columns, 0.5 + 3.1 * rows, nrows=rows, ncols=columns)
        for axes, (x, y) in zip(grid.flat, pairs, strict=False):
            for number, (name, recording) in enumerate(records.items()):
                if x in recording.names and y in recording.names:
                    part = _cut(recording, window)
                    axes.plot(recording[x][part], recording[y][part], label=name, **look(number))
            axes.set_xlabel(_label(records, x))
            axes.set_ylabel(_label(records, y))
        for axes in list(grid.flat)[len(pairs) :]:
            axes.remove()
        legend(figure, grid[0, 0], len(records))
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
        figure, grid = axes_grid(8.0, 0.7 + 2.0 * len(channels), nrows=len(channels), sharex=True)
        for axes, channel in zip(grid[:, 0], channels, strict=True):
            for number, (name, recording) in enumerate(records.items()):
                if channel in recording.names:
                    y = recording[channel][recording.scored]
                    # Eight half-overlapping segments: a variance of about a sixth at a resolution of 4.5/T.
                    segment = max(min(len(y), 8), int(len(y) / 4.5))
                    frequency, power = welch(y, recording.sample_rate, nperseg=segment)
                    shown = (frequency > 0.0) & (frequency <= (max_frequency or math.inf))
                    axes.semilogy(frequency[shown], np.sqrt(power[shown]), label=name, **look(number))
            label = _label(records, channel)
            axes.set_ylabel(label[:-1] + "/√Hz]")
            axes.set_xlabel("frequency [Hz]")
            axes.label_outer()
            axes.set_xlim(0.0, max_frequency)
        legend(figure, grid[0, 0], len(records))
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure
