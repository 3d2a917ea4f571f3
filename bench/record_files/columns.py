"""The columns of a record's file, whatever its format: one way in for every command that reads records.

The suffix says the format, a `ColumnMap` what is what. What comes out are plain arrays with the units and times that the file tells;
`bench.record_files.reading` makes recordings of them, the diagnosis its cases.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, RecordingError
from bench.limits import READING_LIMITS, ReadingLimits, regular_file
from bench.record_files.arrays import read_mat, read_npz
from bench.record_files.column_map import ColumnMap, Variable, base_name, find, name_and_unit
from bench.record_files.hdf5 import read_hdf5
from bench.record_files.laboratory_logs import read_lvm, read_tdms, read_uff
from bench.record_files.parquet import read_parquet
from bench.record_files.robot_logs import BAGS, read_bag, read_folder, read_lists
from bench.record_files.samples_json import read_samples
from bench.record_files.text import read_csv
from bench.record_files.times import FileTimes, file_times, is_time, time_source
from bench.recording import Recording

TEXT = (".csv", ".tsv", ".txt", ".dat", ".asc")
"""Suffixes of text tables, which may be gzipped."""

FOREIGN = {
    ".json": read_samples, ".lvm": read_lvm, ".tdms": read_tdms, ".uff": read_uff, ".unv": read_uff,
    **dict.fromkeys(BAGS, read_bag),
}  # fmt: skip
"""Readers of logs by suffix, some of which need the extra `io`."""

READABLE = (
    *(".parquet", ".csv", ".csv.gz", ".mat", ".npz", ".h5", ".hdf5"),
    *FOREIGN,
    *(f"{suffix}{packed}" for suffix in TEXT[1:] for packed in ("", ".gz")),
)
"""Suffixes of the files that are read, in small or capital letters."""


class Columns(NamedTuple):
    """What a file holds of a record."""

    clock: FileTimes | None
    """Its times; None where a sample rate stands in for them."""
    arrays: dict[str, NDArray[np.float64]]
    """Values by channel name, each ``(n,)``."""
    units: dict[str, str]
    """Units that the file tells, by channel name."""
    notes: tuple[str, ...]
    """What was left out, assumed or doubtful in the file."""
    time: NDArray[np.float64] | None = None
    """Times on a clock that is known to be uniform [s]; None where `clock` says what is known."""
    unused: tuple[str, ...] = ()
    """Headings of columns that nobody asked for."""


def suffix_of(path: str | os.PathLike[str]) -> str:
    """The suffix by which a file's format is known, in small letters: ".csv", ".csv.gz", ".parquet", …."""
    suffixes = [suffix.lower() for suffix in Path(path).suffixes]
    return "".join(suffixes[-2:]) if suffixes[-1:] == [".gz"] else "".join(suffixes[-1:])


def read_columns(
    path: str | os.PathLike[str],
    layout: ColumnMap,
    *,
    time_optional: bool = False,
    limits: ReadingLimits = READING_LIMITS,
) -> Columns | Recording:
    """Read the columns of a record, or the recording that a file of the bench holds whole.

    Args:
        path: Path of the file.
        layout: What is what; without columns, every line of numbers as long as the time is a channel of its own name.
        time_optional: Whether a file without a time is accepted, since somebody knows its sample rate.
        limits: What the file may cost.

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: Unknown suffix, not of the format that its suffix says, truncated, changed, no numbers in it, no regular
            file, or beyond the limits.
        RecordingError: No time in it.
        UnknownNameError: The file has no such column.
        UnitError: The unit of the time is none.
    """
    file = Path(path)
    file = file if file.is_dir() else regular_file(path, limits.file_bytes)
    try:
        passed: list[str] = []
        contents, notes = _contents(file, layout, limits, passed)
        if isinstance(contents, Recording):
            return contents
        found = _assembled(contents, layout, file, notes, time_optional)
        return found._replace(unused=tuple(dict.fromkeys(passed)))
    except MemoryError:
        raise FileFormatError(
            f"'{file}' needs more memory than there is; cut it into parts, or name fewer columns"
        ) from None


def _contents(
    path: Path, layout: ColumnMap, limits: ReadingLimits, passed: list[str]
) -> tuple[Recording | dict[str, Variable], tuple[str, ...]]:
    suffix = suffix_of(path)
    if path.is_dir():
        return read_folder(path)
    wanted = _wanted(layout, passed)
    if suffix in FOREIGN:
        return FOREIGN[suffix](path)
    if suffix == ".parquet":
        lists = _lists(path)
        if lists is not None:
            return lists, ()
        return read_parquet(path, wanted, limits=limits), ()
    if suffix.removesuffix(".gz") in TEXT:
        return read_csv(path, wanted, limits=limits)
    if suffix == ".npz":
        return read_npz(path, wanted, limits=limits), ()
    if suffix == ".mat":
        with path.open("rb") as stream:
            if stream.read(10) == b"MATLAB 7.3":  # HDF5 behind a block of text
                return read_hdf5(path, wanted, limits=limits), ()
        return read_mat(path, limits=limits), ()
    if suffix in (".h5", ".hdf5"):
        return read_hdf5(path, wanted, limits=limits), ()
    raise FileFormatError(f"'{path}' has the suffix '{suffix}'; readable are {', '.join(READABLE)}")


def _lists(path: Path) -> dict[str, Variable] | None:
    """Columns of a Parquet file that holds lists; None where it holds none, or is no Parquet file, as the reader of these will say."""
    try:
        return read_lists(path)
    except (OSError, ValueError):
        return None


def _wanted(layout: ColumnMap, passed: list[str]) -> Callable[[str], bool] | None:
    """Which columns of a file are wanted, None for all; headings of the others are added to `passed`."""
    if not layout.columns:
        return None
    sources = [*layout.columns.values(), *([layout.time] if layout.time else [])]
    names = {part for source in sources for part in (source, base_name(source))}
    any_time = not layout.time and not layout.sample_rate

    def wanted(heading: str) -> bool:
        if heading in names or name_and_unit(heading)[0] in names or (any_time and is_time(heading)):
            return True
        if heading and not is_time(heading):
            passed.append(heading)
        return False

    return wanted


def _assembled(
    variables: dict[str, Variable],
    layout: ColumnMap,
    path: Path,
    notes: tuple[str, ...],
    time_optional: bool,
) -> Columns:
    clock = None
    source = layout.time or time_source(variables)
    if (not layout.sample_rate or layout.time) and (source or not time_optional):
        if not source:
            raise RecordingError(
                f"'{path}': no column is named 'time' or 't' (it has {_listing(variables)}); name it with time=, or give sample_rate="
            )
        values, unit = find(variables, source, file=path.name, kinds="biufmM")
        clock = file_times(values, layout.time_unit, source, told=unit)
        notes = (*notes, *clock.notes)
    sources = dict(layout.columns)
    if not sources:
        sources, passed = _all_lines(variables, source, None if clock is None else clock.seconds, path)
        notes = (*notes, *passed)
    if not sources:
        raise RecordingError(
            f"'{path}': no column of numbers stands beside the time (it has {_listing(variables)}); name lines of its arrays, "
            "as in columns={'force': 'data[:, 2]'}"
        )
    arrays, told = {}, {}
    for channel, place in sources.items():
        values, unit = find(variables, place, file=path.name)
        arrays[channel] = values.astype(float, copy=False)
        if unit:
            told[channel] = unit
    return Columns(clock, arrays, told, notes)


def _all_lines(
    variables: dict[str, Variable], clock_source: str, clock: NDArray[np.float64] | None, path: Path
) -> tuple[dict[str, str], list[str]]:
    """Every column or one-dimensional array of numbers, as a channel of its own name, and what is passed over.

    Other things in a MAT, npz or HDF5 file are passed over; of a text table, columns of text are, and said.
    """
    lines, passed = {}, []
    table = suffix_of(path).removesuffix(".gz") in TEXT
    for heading, variable in variables.items():
        line = np.squeeze(np.asarray(variable.values))
        fits = line.ndim == 1 and line.dtype.kind in "biuf" and (clock is None or line.size == clock.size)
        if variable.sample:
            passed.append(f"the column '{heading[:60]}' holds text ({variable.sample}) and is left out")
        elif heading != clock_source and (fits or table):
            lines[name_and_unit(heading)[0]] = heading
    return lines, passed


def _listing(variables: dict[str, Variable]) -> str:
    parts = [f"'{name[:60]}' {np.shape(variable.values)}" for name, variable in list(variables.items())[:12]]
    return ", ".join(parts + ["…"] * (len(variables) > 12)) or "nothing"
