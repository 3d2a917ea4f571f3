"""Reading a record from any file: the suffix says the format, the column map says what is what."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, RecordingError, UnitError
from bench.record_files.arrays import read_hdf5, read_mat, read_npz
from bench.record_files.column_map import ColumnMap, Variable, base_name, find, name_and_unit
from bench.record_files.parquet import read_parquet
from bench.record_files.text import first_text, read_csv
from bench.recording import Recording
from bench.recording.clock import JITTER
from bench.recording.units import conversion

READABLE = (".parquet", ".csv", ".csv.gz", ".mat", ".npz", ".h5", ".hdf5")
"""Suffixes of the files that `read_recording` understands."""

_TIME_NAMES = ("time", "t")


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
    jitter: float = JITTER,
) -> Recording:
    """Read a record: the bench's own Parquet, or a CSV(.gz), MAT, npz, HDF5 or plain Parquet file.

    A file of the bench tells everything itself. For the others, name the columns and give units that the headings do not
    tell. Values stay in the file's units: convert with `Recording.to_si` or `Recording.to_units`. Name and SHA-256 of the
    file go to ``meta["source"]``.

    Args:
        path: Path of the file.
        columns: Source by channel name, or a `ColumnMap`; None for every column or one-dimensional array as long as
            the time.
        units: Unit by channel name, over those of the column map and of the file.
        time: Source of the time, over that of the column map.
        sample_rate: Samples a second [Hz] where the file has no time, or none to be trusted, over that of the column map.
        settle: Seconds left out of scores [s]; None for what the file says, else zero.
        meta: Provenance to add.
        gaps: What to do about dropped samples: as `Recording.from_arrays`.
        jitter: As `Recording.from_arrays`.

    Raises:
        FileNotFoundError: There is no such file.
        FileFormatError: Unknown suffix, not of the format that its suffix says, truncated, changed, no numbers in it.
        RecordingError: The record in it cannot be used: no time, no unit, gaps, NaN, columns of different lengths.
        UnitError: A unit is unknown or does not fit.
        UnknownNameError: The file has no such column.

    Example:
        >>> read_recording("test.csv", columns={"force": "Load Cell 1"}, units={"force": "kip"})  # doctest: +SKIP
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file '{path}'")
    layout = _layout(columns, units, time, sample_rate)
    contents = _contents(path, layout)
    if isinstance(contents, Recording):
        if columns is not None or units or time or sample_rate or gaps != "raise":
            raise RecordingError(
                f"'{path}' is a file of the bench, which tells its columns, units and clock itself; leave these arguments out "
                "and use select, renamed, to_units or resample on what is read"
            )
        return contents.with_(settle=settle, meta=meta) if settle is not None or meta else contents
    source = {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    try:
        arrays, told, clock = _assembled(contents, layout, path)
        return Recording.from_arrays(
            clock,
            arrays,
            units=told | dict(layout.units),
            quantities=layout.quantities,
            roles=layout.roles,
            settle=settle or 0.0,
            meta={"source": source, **(meta or {})},
            sample_rate=layout.sample_rate,
            gaps=gaps,
            jitter=jitter,
        )
    except (RecordingError, UnitError) as error:
        raise type(error)(f"'{path}': {error}") from None


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


def _contents(path: Path, layout: ColumnMap) -> Recording | dict[str, Variable]:
    suffix = "".join(path.suffixes[-2:]).lower() if path.suffix.lower() == ".gz" else path.suffix.lower()
    if suffix == ".parquet":
        return read_parquet(path)
    if suffix in (".csv", ".csv.gz"):
        return read_csv(path)
    if suffix == ".npz":
        return read_npz(path)
    if suffix == ".mat":
        return read_mat(path)
    if suffix in (".h5", ".hdf5"):
        sources = [*layout.columns.values(), *([layout.time] if layout.time else [])]
        named = bool(layout.columns) and bool(layout.time or layout.sample_rate)
        return read_hdf5(path, {part for s in sources for part in (s, base_name(s))} if named else None)
    raise FileFormatError(f"'{path}' has the suffix '{suffix}'; readable are {', '.join(READABLE)}")


def _assembled(
    variables: dict[str, Variable], layout: ColumnMap, path: Path
) -> tuple[dict[str, NDArray[np.float64]], dict[str, str], NDArray[np.float64] | None]:
    """Arrays by channel name, the units that the file tells, and the times [s] or None."""
    clock_source = layout.time or next(
        (heading for heading in variables if name_and_unit(heading)[0].lower() in _TIME_NAMES), ""
    )
    clock = None
    if not layout.sample_rate or layout.time:
        if not clock_source:
            raise RecordingError(
                f"no column is named 'time' or 't' (it has {_listing(variables)}); name it with time=, or give sample_rate="
            )
        clock, unit = _numbers(variables, clock_source, path)
        scale, _ = conversion(layout.time_unit or unit or "s", "s")
        clock = clock if scale == 1.0 else scale * clock
    sources = layout.columns or _all_lines(variables, clock_source, clock, path)
    if not sources:
        raise RecordingError(
            f"no column of numbers stands beside the time (it has {_listing(variables)}); name lines of its arrays, "
            "as in columns={'force': 'data[:, 2]'}"
        )
    arrays, told = {}, {}
    for channel, source in sources.items():
        arrays[channel], unit = _numbers(variables, source, path)
        if unit:
            told[channel] = unit
    return arrays, told, clock


def _numbers(variables: dict[str, Variable], source: str, path: Path) -> tuple[NDArray[np.float64], str]:
    try:
        return find(variables, source, file=path.name)
    except FileFormatError as error:
        headings = [heading for heading in variables if source in (heading, name_and_unit(heading)[0])]
        if not _is_csv(path) or not headings:
            raise
        if np.size(variables[headings[0]].values) == 1:
            raise FileFormatError(
                f"'{path}' has a single line of numbers; at least two are expected"
            ) from None
        where = first_text(path, headings[0])
        raise FileFormatError(
            f"column '{source}' of '{path.name}' does not hold numbers only: {where}; correct that cell, or name the "
            "columns that are wanted with columns={channel name: heading}"
        ) from error


def _all_lines(
    variables: dict[str, Variable], clock_source: str, clock: NDArray[np.float64] | None, path: Path
) -> dict[str, str]:
    """Every column or one-dimensional array of numbers, as a channel of its own name.

    Other things in a MAT, npz or HDF5 file are passed over. In a CSV file, where one wrong cell makes a column text,
    every column counts, so that none is lost in silence.
    """
    lines = {}
    for heading, variable in variables.items():
        line = np.squeeze(np.asarray(variable.values))
        fits = line.ndim == 1 and line.dtype.kind in "biuf" and (clock is None or line.size == clock.size)
        if heading != clock_source and (fits or _is_csv(path)):
            lines[name_and_unit(heading)[0]] = heading
    return lines


def _is_csv(path: Path) -> bool:
    return ".csv" in (suffix.lower() for suffix in path.suffixes[-2:])


def _listing(variables: dict[str, Variable]) -> str:
    parts = [f"'{name}' {np.shape(variable.values)}" for name, variable in list(variables.items())[:12]]
    return ", ".join(parts + ["…"] * (len(variables) > 12)) or "nothing"
