"""Logs as they come: columns with units and times, from files, recordings, tables or arrays."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.arrays import Array
from bench.errors import RecordingError
from bench.record_files.column_map import ColumnMap, name_and_unit
from bench.record_files.columns import read_columns
from bench.record_files.times import file_times, time_source
from bench.recording import Recording


@dataclass(frozen=True)
class LogSettings:
    """When the clock of a log is irregular.

    Attributes:
        jittery: Part of a step that a time may lie off a uniform clock, as for every record (`bench.recording.clock`).
        longest: Median steps from which a step is a pause: beyond it straight lines say nothing, as for dropouts in
            `bench.record_files`.
    """

    jittery: float = 0.3
    longest: float = 10.0


LOGS = LogSettings()


class Log(NamedTuple):
    """A log.

    Attributes:
        name: Where it comes from.
        time: Times [s] (n,), as they were recorded.
        arrays: Column without unit to values (n,).
        units: Units that are told.
        notes: What was left out or is doubtful.
    """

    name: str
    time: Array
    arrays: Mapping[str, Array]
    units: Mapping[str, str]
    notes: tuple[str, ...] = ()


def log_of(source: Any, *, rate: float = 0.0, name: str = "log") -> Log:
    """A log from a file, a Recording, a pandas or polars table, or a mapping of columns to arrays.

    Args:
        source: It.
        rate: Sample rate [Hz] where it has no time.
        name: Name where it has none itself.

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: It cannot be read.
        RecordingError: It has no time, or columns of different lengths.
    """
    if isinstance(source, Recording):
        return _of_recording(source, name)
    if isinstance(source, (str, Path)):
        return regular(_of_file(Path(source), rate))
    if hasattr(source, "columns") and hasattr(source, "__getitem__"):
        return regular(_of_table({str(c): source[c] for c in source.columns}, rate, name))
    if isinstance(source, Mapping):
        return regular(_of_table({str(c): values for c, values in source.items()}, rate, name))
    raise RecordingError(
        f"a {type(source).__name__} came for a log; a path, a Recording, a DataFrame, or a mapping of columns to arrays is expected"
    )


def regular(log: Log, settings: LogSettings = LOGS) -> Log:
    """The log on a uniform clock where its own is irregular beyond what every reader bridges: by straight lines, at the median step.

    A log of a program that polls has steps of its own length each. Straight lines keep what is slow against them; how far the steps
    scatter is noted, and the result ends where a step is `settings.longest` times the median, which is a pause.
    """
    steps = np.diff(log.time)
    if len(steps) < 2 or not np.isfinite(steps).all():
        return log
    order = np.argsort(log.time, kind="stable")
    time = np.asarray(log.time)[order]
    kept = np.append(np.diff(time) > 0.0, True)
    time = time[kept]
    step = float(np.median(np.diff(time)))
    drift = np.abs(time - time[0] - step * np.round((time - time[0]) / step))
    if float(np.quantile(drift, 0.99)) <= settings.jittery * step and np.max(np.diff(time)) < 1.5 * step:
        return log
    pauses = np.flatnonzero(np.diff(time) > settings.longest * step)
    edges = [0, *(pauses + 1).tolist(), len(time)]
    first, end = max(itertools.pairwise(edges), key=lambda pair: pair[1] - pair[0])
    own = time[first:end]
    step = float(np.median(np.diff(own)))
    clock = own[0] + step * np.arange(int((own[-1] - own[0]) / step) + 1)
    arrays = {
        name: np.interp(clock, own, values[order][kept][first:end]) for name, values in log.arrays.items()
    }
    note = (
        f"steps of {1e3 * np.min(np.diff(own)):.3g} to {1e3 * np.max(np.diff(own)):.3g} ms, brought onto a clock of {1.0 / step:.4g} Hz by "
        "straight lines"
    )
    if len(pauses):
        note += f"; of {len(pauses) + 1} stretches between pauses the longest is taken"
    return log._replace(time=clock, arrays=arrays, notes=(*log.notes, note))


def _of_file(path: Path, rate: float) -> Log:
    found = read_columns(path, ColumnMap({}, sample_rate=rate), time_optional=rate > 0.0)
    if isinstance(found, Recording):
        return _of_recording(found, path.name)
    n = len(next(iter(found.arrays.values())))
    time = found.time
    notes = found.notes
    if time is None:
        time = np.arange(n) / rate if found.clock is None else found.clock.seconds
        if found.clock is not None and found.clock.doubt:
            raise RecordingError(f"'{path}': {found.clock.doubt}")
    return Log(path.name, np.asarray(time), found.arrays, found.units, notes)


def _of_recording(recording: Recording, name: str) -> Log:
    arrays = {channel.name: recording[channel.name] for channel in recording.channels}
    # a pure number is what a recording says where nobody knew better
    units = {channel.name: channel.unit for channel in recording.channels if channel.unit != "1"}
    return Log(name, recording.time, arrays, units, tuple(map(str, recording.meta.get("warnings", ()))))


def _of_table(columns: Mapping[str, Any], rate: float, name: str) -> Log:
    heading = time_source(columns)
    arrays, units = {}, {}
    for column, values in columns.items():
        numbers = np.asarray(values)
        if column == heading or numbers.dtype.kind not in "biuf" or numbers.ndim != 1:
            continue
        plain, unit = name_and_unit(column)
        arrays[plain] = numbers.astype(float)
        if unit:
            units[plain] = unit
    if not arrays:
        raise RecordingError(
            f"'{name}' has no column of numbers beside the time (it has {', '.join(columns) or 'nothing'})"
        )
    n = {len(values) for values in arrays.values()}
    if len(n) > 1:
        raise RecordingError(
            f"the columns of '{name}' have {sorted(n)} samples; all of one length are expected"
        )
    if heading:
        clock = file_times(np.asarray(columns[heading]), "", heading, told=name_and_unit(heading)[1])
        return Log(name, clock.seconds, arrays, units, clock.notes)
    if not rate > 0.0:
        raise RecordingError(
            f"'{name}' has no column 'time'; add one, or give the sample rate (rate=, --rate)"
        )
    return Log(name, np.arange(n.pop()) / rate, arrays, units)
