"""Files of laboratory instruments: Universal File Format (type 58), National Instruments TDMS and LVM."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import FileFormatError
from bench.record_files.column_map import Variable
from bench.record_files.streams import Stream, merged


def read_uff(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """The time responses (data sets of type 58, function type 1) of a Universal File.

    Raises:
        FileFormatError: The package pyuff is not installed, or there are none.
    """
    try:
        import pyuff  # noqa: PLC0415  (of the extra `io`)
    except ImportError:
        raise FileFormatError(
            f"'{path}': Universal Files need the extra io: pip install 'jointbench[io]'"
        ) from None
    try:
        sets = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # pyuff raises plain exceptions on malformed lines
        raise FileFormatError(f"'{path}' is no Universal File that can be read: {error}") from None
    sets = sets if isinstance(sets, list) else [sets]
    streams = []
    for k, one in enumerate(s for s in sets if s.get("type") == 58 and s.get("func_type") == 1):
        name = str(one.get("id1") or "").strip()
        label = name if name and name.upper() != "NONE" else f"{one.get('rsp_node', k)}{_direction(one)}"
        unit = str(one.get("ordinate_axis_units_lab") or "").strip()
        unit = "" if unit.upper() == "NONE" else unit
        x = np.asarray(one["x"], dtype=float)
        streams.append(Stream(label, x, {label: np.asarray(one["data"], dtype=float)}, {label: unit}))
    if not streams:
        raise FileFormatError(f"'{path}' holds no time response (data set 58 of function type 1)")
    return merged(_distinct(streams), path.name)


def _direction(one: dict[str, Any]) -> str:
    direction = int(one.get("rsp_dir") or 0)
    return {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}.get(abs(direction), "")


def _distinct(streams: list[Stream]) -> list[Stream]:
    """Streams of the same name numbered."""
    seen: dict[str, int] = {}
    out = []
    for stream in streams:
        seen[stream.name] = seen.get(stream.name, 0) + 1
        if seen[stream.name] == 1:
            out.append(stream)
            continue
        name = f"{stream.name}_{seen[stream.name]}"
        (values,), unit = stream.columns.values(), next(iter(stream.units.values()), "")
        out.append(Stream(name, stream.time, {name: values}, {name: unit}))
    return out


def read_tdms(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """The waveforms of a TDMS file, and columns beside a channel "time" where channels have no clock of their own.

    Raises:
        FileFormatError: The package npTDMS is not installed, or the file cannot be read.
    """
    try:
        import nptdms  # noqa: PLC0415  (of the extra `io`)
    except ImportError:
        raise FileFormatError(f"'{path}': TDMS needs the extra io: pip install 'jointbench[io]'") from None
    try:
        file = nptdms.TdmsFile.read(str(path))
    except Exception as error:  # nptdms raises plain ValueError, KeyError, struct.error on malformed files
        raise FileFormatError(f"'{path}' is no TDMS file that can be read: {error}") from None
    streams, plain = [], {}
    for group in file.groups():
        for channel in group.channels():
            values = np.asarray(channel[:])
            if values.dtype.kind not in "biufM" or len(values) < 2:
                continue
            unit = str(channel.properties.get("unit_string") or "")
            try:
                time = channel.time_track()
            except KeyError:
                plain[channel.name] = Variable(values, unit)
                continue
            own = {channel.name: values.astype(float)}
            streams.append(Stream(channel.name, np.asarray(time, dtype=float), own, {channel.name: unit}))
    if streams:
        return merged(_distinct(streams), path.name)
    if not plain:
        raise FileFormatError(f"'{path}' holds no channel of numbers")
    return plain, ()


def read_lvm(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """The first table of a LabVIEW measurement file: times in "X_Value", or from Delta_X where it has none.

    Raises:
        FileFormatError: It is no LVM file.
    """
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    ends = [k for k, line in enumerate(lines) if line.startswith("***End_of_Header***")]
    if not lines or not lines[0].startswith("LabVIEW Measurement") or not ends:
        raise FileFormatError(f"'{path}' is no LabVIEW measurement file (no header of one)")
    head = [line for line in lines[: ends[-1]] if line]
    separator = "," if any(line.strip() == "Separator,Comma" for line in head) else "\t"
    comma = any(line.replace("\t", ",").startswith("Decimal_Separator,,") for line in head)
    table = [line.rstrip("\r\n").split(separator) for line in lines[ends[-1] + 1 :] if line.strip()]
    names = [name.strip() for name in table[0]] if table else []
    rows = [row for row in table[1:] if _number(row[0] if row[0] else "0", comma) is not None]
    columns = {
        name: [_number(row[i], comma) if i < len(row) else None for row in rows]
        for i, name in enumerate(names)
        if name and name != "Comment"
    }
    arrays = {
        name: np.array([np.nan if value is None else value for value in values])
        for name, values in columns.items()
    }
    units = _of_head(head, "Y_Unit_Label", separator)
    steps = [_number(cell, comma) for cell in _of_head(head, "Delta_X", separator)]
    time = arrays.pop("X_Value", np.array([np.nan]))
    if not np.isfinite(time).all():
        step = next((s for s in steps if s), None)
        if step is None:
            raise FileFormatError(f"'{path}' has neither times (X_Value) nor a step (Delta_X)")
        time = step * np.arange(len(rows))
    found = {"time": Variable(time, "s")}
    for k, (name, values) in enumerate(arrays.items()):
        unit = units[k].strip() if k < len(units) else ""
        found[name] = Variable(values, unit)
    return found, ()


def _of_head(head: list[str], key: str, separator: str) -> list[str]:
    lines = [line for line in head if line.startswith(key)]
    return lines[-1].split(separator)[1:] if lines else []


def _number(cell: str, comma: bool) -> float | None:
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return None
