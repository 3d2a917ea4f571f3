"""Reading a case folder: ``nominal.json``, and records in any format by the one reader of records.

What a file's headings say of units is believed and converted to what ``nominal.json`` declares. Doubts about a clock that would
change every result (times that can hardly be seconds) stop here; what was repaired is kept with the record and told in the verdict.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import (
    Case,
    CaseChannel,
    CaseRecord,
    NominalParameter,
    record_from_arrays,
)
from bench.discrepancy.case.elements import declared_parameters
from bench.discrepancy.case.free_decay import is_free_decay, with_no_load
from bench.discrepancy.case.schema import NominalDocument
from bench.errors import BenchError, FileFormatError, RecordingError, UnitError, UnknownNameError
from bench.record_files.column_map import ColumnMap
from bench.record_files.columns import READABLE, Columns, read_columns, suffix_of
from bench.recording import Recording
from bench.recording.units import conversion

GROUPS = ("identification", "validation")
"""What the names of records begin with: those that serve to find the effect, and those that judge."""


@dataclass(frozen=True)
class ReadingSettings:
    """Numbers of `bench.discrepancy.case.reading`."""

    most_listed: int = 8
    """Unused columns that a note lists by name."""


SETTINGS = ReadingSettings()

_THOUSANDS = {1: "ms", 2: "us", 3: "ns"}


class _Channels(NamedTuple):
    """What is known of the columns before a file is opened."""

    channels: tuple[CaseChannel, ...]
    time_unit: str
    sample_rate: float


def read_case(folder: str | Path, *, planned: bool = False) -> Case:
    """Read a case folder.

    Args:
        folder: Folder with ``nominal.json`` and the records.
        planned: Whether the records are only planned: they hold what is to be commanded, and responses that they lack are zero.

    Raises:
        FileFormatError: A file is missing or malformed.
        DocumentError: ``nominal.json`` has an entry that is not known, missing, of the wrong kind or out of range.
        RecordingError: A record cannot be used.
        UnitError: A heading says another dimension than ``nominal.json``.
    """
    folder = Path(folder)
    path = folder / "nominal.json"
    if not folder.is_dir():
        raise FileFormatError(
            f"'{folder}' is no folder; give the folder that holds nominal.json and the records"
        )
    if not path.exists():
        raise FileFormatError(f"no nominal.json in '{folder}'; a case folder needs one beside its records")
    nominal = NominalDocument.read(path)
    parameters = tuple(
        NominalParameter(name, entry.value, entry.std or 0.0, entry.unit, entry.alike, entry.each or 0.0)
        if entry.factor is None
        else NominalParameter.within_factor(
            name, entry.value, entry.factor, entry.unit, entry.alike, entry.each or 0.0
        )
        for name, entry in nominal.parameters.items()
    )
    declared = declared_parameters(nominal.elements, path)
    parameters += tuple(NominalParameter(name, *entry) for name, entry in declared.items())
    channels = _channels_of(nominal)
    time = nominal.channels.get("time")
    known = _Channels(channels, time.unit if time is not None else "", nominal.sample_rate_hz or 0.0)
    moving = nominal.starts_in_motion
    in_motion = set(moving) if isinstance(moving, tuple) else set()
    periodic = set(nominal.periodic)
    files = _record_files(folder, optional=planned)
    have = [name for group in GROUPS for name in files[group]]
    for name in sorted(periodic.union(in_motion, *(c.antialias.records for c in channels if c.antialias))):
        if name not in have:
            raise UnknownNameError("record", name, have)
    units: dict[str, str] = {}
    records = {
        group: tuple(
            replace(
                _read_record(
                    file,
                    name,
                    known,
                    units,
                    at_rest=moving is not True and name not in in_motion,
                    planned=planned,
                ),
                periodic=name in periodic,
            )
            for name, file in files[group].items()
        )
        for group in GROUPS
    }
    channels = tuple(c if c.unit else replace(c, unit=units.get(c.name, "")) for c in channels)
    case = Case(
        folder.name, nominal.rig, parameters, channels,
        records["identification"], records["validation"], folder, nominal.options,
    )  # fmt: skip
    in_motion = not any(record.at_rest for group in records.values() for record in group)
    return with_no_load(case) if in_motion and is_free_decay(case) else case


def _channels_of(nominal: NominalDocument) -> tuple[CaseChannel, ...]:
    return tuple(
        CaseChannel(
            name, entry.unit, nominal.role_of(name), entry.noise_std, entry.filter(), entry.target, entry.quantity or "",
            entry.side or "", entry.resolution,
        )
        for name, entry in nominal.channels.items()
        if name != "time"
    )  # fmt: skip


def _record_files(folder: Path, *, optional: bool = False) -> dict[str, dict[str, Path]]:
    """The files of each group by the name of their record; a group may have none where they are optional.

    Raises:
        FileFormatError: A group has none, or a record has two.
    """
    found: dict[str, dict[str, Path]] = {group: {} for group in GROUPS}
    unread: list[str] = []
    try:
        files = sorted(folder.iterdir())
    except OSError as error:
        raise FileFormatError(f"'{folder}' cannot be read: {error.strerror or error}") from None
    for file in files:
        group = next((group for group in GROUPS if file.name.startswith(group)), None)
        if group is None:
            continue
        suffix = suffix_of(file)
        if suffix not in READABLE:
            unread.append(file.name)
            continue
        name = file.name[: -len(suffix)]
        other = found[group].setdefault(name, file)
        if other != file:
            raise FileFormatError(
                f"'{other.name}' and '{file.name}' in '{folder}' are two files of one record '{name}'; keep one, or rename the other"
            )
    for group, records in found.items():
        if not records and not optional:
            beside = [name for name in unread if name.startswith(group)]
            hint = f" ('{beside[0]}' is none of them)" if beside else ""
            raise FileFormatError(
                f"no record {group}* in '{folder}'{hint}; at least one is needed, as one of {', '.join(READABLE)}"
            )
    return found


def _read_record(
    file: Path, name: str, known: _Channels, units: dict[str, str], *, at_rest: bool, planned: bool
) -> CaseRecord:
    """One record; `units` gathers what headings say of channels whose unit ``nominal.json`` leaves open."""
    named = {} if planned else {c.name: c.name for c in known.channels}
    layout = ColumnMap(named, time_unit=known.time_unit)
    try:
        contents = read_columns(file, layout, time_optional=known.sample_rate > 0.0)
        if planned and not isinstance(contents, Recording):
            contents = _with_responses(contents, known, file)
    except UnknownNameError as error:
        raise FileFormatError(f"'{file}' lacks a column: {error}") from None
    try:
        if isinstance(contents, Recording):
            contents = _columns_of(contents, known)
        arrays = _in_units(contents, known, units)
        time, notes = _times(contents, known)
    except (RecordingError, UnitError, UnknownNameError) as error:
        raise _at(file, error) from None
    if contents.unused:
        listed = ", ".join(f"'{heading[:60]}'" for heading in contents.unused[: SETTINGS.most_listed])
        more = (
            f" and {len(contents.unused) - SETTINGS.most_listed} more"
            if len(contents.unused) > SETTINGS.most_listed
            else ""
        )
        notes = (*notes, f"columns that nominal.json does not name are not used: {listed}{more}")
    asked = [channel.name for channel in known.channels if channel.role == "command"]
    return record_from_arrays(
        name, time, arrays, at_rest=at_rest, notes=(*contents.notes, *notes), asked=asked
    )


def _with_responses(contents: Columns, known: _Channels, file: Path) -> Columns:
    """The columns of a planned record, responses that it lacks at zero.

    Raises:
        FileFormatError: It lacks a command.
    """
    arrays = dict(contents.arrays)
    for channel in known.channels:
        if channel.name in arrays:
            continue
        if channel.role != "response":
            raise FileFormatError(
                f"'{file}' lacks the column '{channel.name}' (role {channel.role}): what is to be commanded has to be there"
            )
        arrays[channel.name] = np.zeros(len(next(iter(arrays.values()))))
    return contents._replace(arrays=arrays)


def _at(file: Path, error: BenchError) -> BenchError:
    """The error with the file before it."""
    if isinstance(error, UnknownNameError):
        return FileFormatError(f"'{file}': {error}")
    return type(error)(f"'{file}': {error}")


def _columns_of(recording: Recording, known: _Channels) -> Columns:
    """The channels of a recording as columns; its units count as told."""
    names = [c.name for c in known.channels]
    arrays = {name: np.asarray(recording[name]) for name in names}
    # a pure number is what a recording says where nobody knew better
    told = {name: recording.channel(name).unit for name in names if recording.channel(name).unit != "1"}
    notes = recording.meta.get("warnings", ())
    return Columns(None, arrays, told, tuple(map(str, notes)), recording.time)


def _in_units(
    contents: Columns, known: _Channels, units: dict[str, str]
) -> Mapping[str, NDArray[np.float64]]:
    """Values in the units that ``nominal.json`` declares, or where it does not, in the first that a heading tells."""
    out = {}
    for channel in known.channels:
        values, told = contents.arrays[channel.name], contents.units.get(channel.name, "")
        wanted = channel.unit or units.setdefault(channel.name, told)
        if told and wanted and told != wanted:
            try:
                slope, offset = conversion(told, wanted)
            except UnitError as error:
                raise UnitError(
                    f"the heading says that '{channel.name}' is in {told}, nominal.json in {wanted} ({error}); correct the one that "
                    "is wrong"
                ) from None
            values = values if (slope, offset) == (1.0, 0.0) else slope * values + offset
        out[channel.name] = values
    return out


def _times(contents: Columns, known: _Channels) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Times [s], and what is to be said of them."""
    clock = contents.clock
    if contents.time is not None:
        return contents.time, ()
    if clock is None:
        n = len(next(iter(contents.arrays.values())))
        return np.arange(n) / known.sample_rate, ()
    if known.time_unit and clock.told and abs(conversion(clock.told, known.time_unit)[0] - 1.0) > 1e-9:
        raise UnitError(
            f"the heading says that the time is in {clock.told}, nominal.json in {known.time_unit}; correct the one that is wrong"
        )
    remedy = 'or write "time": {"unit": …} among the channels of nominal.json'
    if clock.doubt:
        raise RecordingError(f"{clock.doubt}, {remedy}")
    steps = np.diff(clock.seconds)
    step = float(np.median(steps)) if steps.size else 0.0
    ratio = known.sample_rate * step if np.isfinite(step) else 0.0
    exponent = round(np.log10(ratio) / 3.0) if ratio > 0.0 else 0
    if exponent in _THOUSANDS and abs(np.log10(ratio) - 3.0 * exponent) < 0.01:
        unit = _THOUSANDS[exponent]
        raise RecordingError(
            f"nominal.json says {known.sample_rate:.6g} Hz, the times {1.0 / step:.6g} Hz: time in {unit}? Head the column "
            f"'time [{unit}]', {remedy}"
        )
    return clock.seconds, ()
