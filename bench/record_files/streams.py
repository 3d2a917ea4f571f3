"""Several streams with clocks of their own, brought onto one: that of the stream with the most samples.

A stream that is sampled more slowly than that, or at other instants, is held from each of its samples to the next where it is a
command (that is what a controller does with it), and joined by straight lines where it is a measurement. Only the time that all
streams cover is kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.errors import RecordingError
from bench.record_files.column_map import Variable


class Stream(NamedTuple):
    """Columns on a clock of their own.

    Attributes:
        name: Name, for notes.
        time: Times (n,), of all streams in one unit.
        columns: Values (n,) by column.
        units: Units by column.
        held: Whether its values hold until the next sample.
    """

    name: str
    time: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str] = {}
    held: bool = False


def merged(
    streams: Sequence[Stream], file: str, unit: str = "s"
) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """All columns on the clock of the longest stream, from zero, and what was done.

    Args:
        streams: The streams.
        file: Name, for messages.
        unit: Unit of their times.

    Raises:
        RecordingError: There is none with two samples, or the streams have no time in common.
    """
    usable = [_sorted(stream) for stream in streams if len(stream.time) > 1]
    if not usable:
        raise RecordingError(f"'{file}' holds no stream of numbers with two samples or more")
    base = max(usable, key=lambda stream: (len(stream.time), not stream.held))
    # a command that came before the others still holds
    first = max(stream.time[0] for stream in usable)
    last = min(stream.time[-1] if not stream.held else np.inf for stream in usable)
    kept = (base.time >= first) & (base.time <= last)
    clock = base.time[kept]
    if len(clock) < 2:
        raise RecordingError(
            f"the streams of '{file}' have no time in common: "
            + ", ".join(f"{s.name} from {s.time[0]:.6g} to {s.time[-1]:.6g} {unit}" for s in usable[:6])
        )
    # from the first sample, so that a double keeps all digits of a step beside the seconds since 1970
    variables = {"time": Variable(clock - clock[0], unit)}
    held, joined = [], []
    for stream in usable:
        same = stream is base or np.array_equal(stream.time, base.time)
        if not same:
            (held if stream.held else joined).append(stream.name)
        for column, values in stream.columns.items():
            if same:
                found = values[kept]
            elif stream.held:
                found = values[np.searchsorted(stream.time, clock, side="right") - 1]
            else:
                found = np.interp(clock, stream.time, values)
            variables[column] = Variable(found, stream.units.get(column, ""))
    notes = []
    if held:
        notes.append(f"{', '.join(held)}: held from sample to sample on the clock of '{base.name}'")
    if joined:
        notes.append(f"{', '.join(joined)}: joined by straight lines on the clock of '{base.name}'")
    return variables, tuple(notes)


def _sorted(stream: Stream) -> Stream:
    """Its samples by increasing time, the last of those at one instant."""
    order = np.argsort(stream.time, kind="stable")
    time = stream.time[order]
    last = np.append(np.diff(time) > 0.0, True)
    columns = {name: values[order][last] for name, values in stream.columns.items()}
    return stream._replace(time=time[last], columns=columns)
