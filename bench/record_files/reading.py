"""Reading a record from any file into a recording on a uniform clock, with every doubt told."""

from __future__ import annotations

import hashlib
import math
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import RecordingError, RecordWarning, UnitError
from bench.limits import READING_LIMITS, ReadingLimits
from bench.record_files.column_map import ColumnMap
from bench.record_files.columns import READABLE, Columns, read_columns
from bench.recording import Recording
from bench.recording.channel import channels_from
from bench.recording.clock import (
    CLOCK_SETTINGS,
    grid,
)
from bench.recording.jumps import hidden_dropouts
from bench.recording.mending import mended

__all__ = ["READABLE", "Noted", "on_one_clock", "read_recording"]


class Noted(NamedTuple):
    """Channels on a uniform clock."""

    time: NDArray[np.float64]
    """``(n,)`` [s]."""
    sample_rate: float
    """[Hz]."""
    values: NDArray[np.float64]
    """``(n, n_channels)``, each column contiguous in memory."""
    report: dict[str, Any]
    """What was repaired."""
    notes: tuple[str, ...]
    """What was repaired or is doubtful, in sentences."""


def on_one_clock(
    time: NDArray[np.float64],
    arrays: Mapping[str, NDArray[np.float64]],
    *,
    sample_rate: float = 0.0,
    bridge: bool = True,
    jitter: float = CLOCK_SETTINGS.jitter,
) -> Noted:
    """Channels brought to a uniform clock, as every command does it: see `bench.recording.mending.mended`.

    Besides, samples that seem to be missing although the times run through are told by the jump that they leave
    (`bench.recording.jumps`).

    Args:
        time: Times [s], ``(n,)``.
        arrays: Values by channel name, each ``(n,)``.
        sample_rate: Rate that the clock must have [Hz]; 0 to find it.
        bridge: Whether short dropouts are bridged, or refused.
        jitter: Largest deviation that is taken for uniform, as a fraction of the step.

    Raises:
        RecordingError: A channel of another length, or as `mended`.
    """
    for name, values in arrays.items():
        if np.shape(values) != np.shape(time):
            raise RecordingError(
                f"channel '{name}' has shape {np.shape(values)}; {np.shape(time)} is expected, as long as the clock"
            )
    stacked = np.empty((len(time), len(arrays)), order="F")
    for k, values in enumerate(arrays.values()):
        stacked[:, k] = values
    clock, rate, stacked, report, notes = mended(
        time, stacked, list(arrays), sample_rate=sample_rate, jitter=jitter, bridge=bridge
    )
    places = hidden_dropouts(stacked)
    if places:
        where = ", ".join(f"t = {clock[k]:.6g} s" for k in places)
        notes = (
            *notes,
            f"all channels jump at {where}, although the times run through: samples seem to be missing there (a dropout whose times "
            "were renumbered); cut the record there",
        )
    return Noted(clock, rate, stacked, report, notes)


def read_recording(
    path: str | os.PathLike[str],
    *,
    columns: ColumnMap | Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    time: str = "",
    sample_rate: float = 0.0,
    settle: float | None = None,
    meta: Mapping[str, Any] | None = None,
    gaps: Literal["raise", "interpolate"] = "raise",
    jitter: float = CLOCK_SETTINGS.jitter,
    limits: ReadingLimits = READING_LIMITS,
) -> Recording:
    """Read a record: the bench's own Parquet, or a text table, MAT, npz, HDF5 or plain Parquet file.

    A file of the bench tells everything itself. For the others, name the columns and give units that the headings do not
    tell. Values stay in the file's units: convert with `Recording.to_si` or `Recording.to_units`. Name and SHA-256 of the
    file go to ``meta["source"]``. What is doubtful in the file (jitter that was interpolated away, columns of text, a last line
    that was cut, samples that seem to be missing, times that are hardly seconds) is warned of, and kept in ``meta["warnings"]``.

    Args:
        path: Path of the file.
        columns: Source by channel name, or a `ColumnMap`; None for every column or one-dimensional array as long as
            the time.
        units: Unit by channel name, over those of the column map and of the file.
        time: Source of the time, over that of the column map.
        sample_rate: Samples a second [Hz] where the file has no time, or none to be trusted, over that of the column map.
        settle: Seconds left out of scores [s]; None for what the file says, else zero.
        meta: Provenance to add.
        gaps: What to do about dropped samples and values that are not finite: refuse them, or bridge up to ten in a row.
        jitter: Largest deviation of a time from the uniform clock that is taken for none, as a fraction of the step; from there
            to 30 % the record is interpolated onto the uniform clock.
        limits: What the file may cost in memory.

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: Unknown suffix, not of the format that its suffix says, truncated, changed, no numbers in it, no regular
            file, or beyond the limits.
        RecordingError: The record in it cannot be used: no time, no unit, gaps, NaN, columns of different lengths.
        UnitError: A unit is unknown or does not fit.
        UnknownNameError: The file has no such column.

    Example:
        >>> read_recording("test.csv", columns={"force": "Load Cell 1"}, units={"force": "kip"})  # doctest: +SKIP
    """
    path = Path(path)
    layout = _layout(columns, units, time, sample_rate)
    try:
        contents = read_columns(path, layout, limits=limits)
    except UnitError as error:
        raise UnitError(f"'{path}': {error}") from None
    if isinstance(contents, Recording):
        if columns is not None or units or time or sample_rate or gaps != "raise":
            raise RecordingError(
                f"'{path}' is a file of the bench, which tells its columns, units and clock itself; leave these arguments out "
                "and use select, renamed, to_units or resample on what is read"
            )
        return contents.with_(settle=settle, meta=meta) if settle is not None or meta else contents
    try:
        if gaps not in ("raise", "interpolate"):
            raise RecordingError(f"gaps is {gaps!r}; 'raise' or 'interpolate' is expected")
        noted = _on_its_clock(contents, layout, bridge=gaps == "interpolate", jitter=jitter)
        told, notes = _provenance(path, contents, noted)
        channels = channels_from(
            list(contents.arrays),
            units=contents.units | dict(layout.units),
            quantities=layout.quantities,
            roles=layout.roles,
        )
        contents.arrays.clear()  # the recording makes its own copy of the values
        recording = Recording(
            noted.time,
            noted.values,
            channels,
            settle=settle or 0.0,
            meta={**told, **(meta or {})},
            sample_rate=noted.sample_rate,
        )
    except (RecordingError, UnitError) as error:
        raise type(error)(f"'{path}': {error}") from None
    for note in notes:
        warnings.warn(note, RecordWarning, stacklevel=2)
    return recording


def _on_its_clock(contents: Columns, layout: ColumnMap, *, bridge: bool, jitter: float) -> Noted:
    """Columns of a file on the uniform clock that it tells, or on that of the sample rate given."""
    clock = contents.clock
    if clock is None and not (math.isfinite(layout.sample_rate) and layout.sample_rate > 0.0):
        raise RecordingError("without a time, sample_rate is needed: a finite number > 0 [Hz]")
    n = len(next(iter(contents.arrays.values())))
    seconds = grid(0.0, layout.sample_rate, n) if clock is None else clock.seconds
    return on_one_clock(
        seconds, contents.arrays, sample_rate=layout.sample_rate, bridge=bridge, jitter=jitter
    )


def _provenance(path: Path, contents: Columns, noted: Noted) -> tuple[dict[str, Any], tuple[str, ...]]:
    """What ``meta`` tells of a file and its repairs, and the notes in it."""
    clock = contents.clock
    source = {"file": path.name, "sha256": _digest(path)}
    if clock is not None and clock.start:
        source["start"] = clock.start
    doubts = (clock.doubt,) if clock is not None and clock.doubt else ()
    notes = tuple(f"'{path}': {note}" for note in (*contents.notes, *doubts, *noted.notes))
    told: dict[str, Any] = {"source": source}
    if noted.report:
        told["repaired"] = noted.report
    if notes:
        told["warnings"] = notes
    return told, notes


def _layout(
    columns: ColumnMap | Mapping[str, str] | None,
    units: Mapping[str, str] | None,
    time: str,
    sample_rate: float,
) -> ColumnMap:
    given = columns if isinstance(columns, ColumnMap) else ColumnMap(columns or {})
    return ColumnMap(
        given.columns,
        {**given.units, **(units or {})},
        given.quantities,
        given.roles,
        time or given.time,
        given.time_unit,
        sample_rate or given.sample_rate,
    )


def _digest(path: Path) -> str:
    if path.is_dir():
        whole = hashlib.sha256()
        for file in sorted(file for file in path.rglob("*") if file.is_file()):
            whole.update(file.name.encode() + file.read_bytes())
        return whole.hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
