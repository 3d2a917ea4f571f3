"""Logs of robots: ROS bags (rosbag 1, rosbag 2 in SQLite and MCAP), LeRobot data sets, folders of command and state tables (SAGE)."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import FileFormatError
from bench.record_files.column_map import Variable, name_and_unit
from bench.record_files.streams import Stream, merged
from bench.record_files.times import file_times, time_source
from bench.recording.clock import suspected_unit

BAGS = (".bag", ".db3", ".mcap")
COMMANDS = ("command", "cmd", "control", "goal", "target", "desired", "reference", "action", "setpoint")
"""Words in the name of a stream that is held between its samples."""


def read_bag(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """The numbers of a ROS bag: "position_JOINT", "velocity_JOINT" and "effort_JOINT" of joint states, "TOPIC.field" of the rest.

    Times are those of the headers where messages have one, else those of the recording.

    Args:
        path: A .bag, .db3 or .mcap file, or the folder of a rosbag 2.

    Raises:
        FileFormatError: The package rosbags is not installed, or the bag cannot be read.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError  # noqa: PLC0415  (of the extra `io`)
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415
    except ImportError:
        raise FileFormatError(f"'{path}': ROS bags need the extra io: pip install 'jointbench[io]'") from None
    whole = (
        path.parent if path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").exists() else path
    )
    times: dict[str, list[int]] = defaultdict(list)
    rows: dict[str, list[dict[str, float]]] = defaultdict(list)
    try:
        with AnyReader([whole], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            topics = {c.topic for c in reader.connections}
            states = sum("JointState" in c.msgtype for c in reader.connections)
            for connection, stamp, raw in reader.messages():
                message = reader.deserialize(raw, connection.msgtype)
                own = _stamp(message)
                times[connection.topic].append(own or stamp)
                plain = states == 1 or len(topics) == 1
                prefix = "" if plain and hasattr(message, "effort") else connection.topic
                rows[connection.topic].append(dict(_numbers(message, prefix)))
    except (AnyReaderError, KeyError, ValueError, AttributeError) as error:
        raise FileFormatError(f"'{path}' is no ROS bag that can be read: {error}") from None
    start = min((row[0] for row in times.values()), default=0)
    streams = [
        _stream(topic, np.array([t - start for t in times[topic]]) * 1e-9, rows[topic]) for topic in rows
    ]
    return merged([stream for stream in streams if stream.columns], path.name)


def _stamp(message: Any) -> int:
    """Time of a header [ns], of which a double would keep too few digits; zero where there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _numbers(message: Any, prefix: str) -> Iterator[tuple[str, float]]:
    """Numbers of a message by name; joint states by their joints."""
    if hasattr(message, "effort") and hasattr(message, "position") and hasattr(message, "name"):
        for quantity in ("position", "velocity", "effort"):
            for joint, value in zip(message.name, getattr(message, quantity), strict=False):
                yield f"{prefix}{'.' if prefix else ''}{quantity}_{joint}", float(value)
        return
    for field in getattr(message, "__dataclass_fields__", {}):
        value = getattr(message, field)
        name = f"{prefix.strip('/')}.{field}"
        if field in ("header", "layout") or field.startswith("__"):
            continue
        if isinstance(value, (bool, int, float, np.number)):
            yield name, float(value)
        elif (
            isinstance(value, np.ndarray)
            and value.ndim == 1
            and value.dtype.kind in "biuf"
            and len(value) <= 64
        ):
            yield from ((f"{name}_{i}", float(x)) for i, x in enumerate(value))
        elif hasattr(value, "__dataclass_fields__"):
            yield from _numbers(value, name)


def _stream(topic: str, time: np.ndarray, rows: list[dict[str, float]]) -> Stream:
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    return Stream(topic, time, columns, held=any(word in topic.lower() for word in COMMANDS))


def read_folder(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """A folder of tables with clocks of their own (command and state, as SAGE writes them), or of a rosbag 2.

    Cells that hold a list of numbers become a column a joint, named by joint_list.txt where there is one. Columns of a table of commands
    begin with "command_". Times are in the unit that their headings tell; where none does and they are hardly seconds, in the likely one,
    which is noted.

    Raises:
        FileFormatError: There is no table in it, or the headings of times tell different units.
    """
    if (path / "metadata.yaml").exists():
        return read_bag(path)
    joints_file = path / "joint_list.txt"
    joints = joints_file.read_text(encoding="utf-8").split() if joints_file.exists() else []
    tables = [table for file in sorted(path.glob("*.csv")) if (table := _table(file, joints)) is not None]
    if not tables:
        bags = [file for file in path.iterdir() if file.suffix in BAGS]
        if len(bags) == 1:  # whose metadata.yaml has been lost
            return read_bag(bags[0])
        raise FileFormatError(
            f"'{path}' is a folder without tables; a folder of CSV files with a column timestamp, or of a rosbag 2, is expected"
        )
    streams, units = [stream for stream, _ in tables], sorted({unit for _, unit in tables})
    if len(units) > 1:
        told = " and in ".join(unit or "no unit" for unit in units)
        raise FileFormatError(f"the times of the tables in '{path}' are in {told}; one unit is expected")
    longest = max((stream.time for stream in streams), key=len)
    likely = suspected_unit(longest) if not units[0] and len(longest) > 1 else ""
    variables, notes = merged(streams, path.name, units[0] or likely or "s")
    if likely:
        said = f"no heading tells the unit of the times, which are hardly seconds and taken for {likely}"
        notes += (f"{said}; head them 'timestamp [s]' if they are",)
    return variables, notes


def _table(file: Path, joints: list[str]) -> tuple[Stream, str] | None:
    """A table and the unit of its times, "" where that is not told; None of one without times or numbers."""
    with file.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    heading = time_source(filter(None, rows[0])) if rows else ""
    if not heading:
        return None
    held = any(word in file.stem.lower() for word in COMMANDS)
    columns: dict[str, list[float]] = {}
    times = []
    for row in rows:
        try:
            times.append(float(row[heading]))
        except (TypeError, ValueError):
            raise FileFormatError(f"'{file}': the time '{row[heading]}' is no number") from None
        for name, cell in row.items():
            if name != heading and name:
                for label, value in _cells(name, cell, joints, held):
                    columns.setdefault(label, []).append(value)
    whole = {name: np.array(values) for name, values in columns.items() if len(values) == len(times)}
    unit = name_and_unit(heading)[1] or file_times(np.array(times), "", heading).told
    return (Stream(file.stem, np.array(times), whole, held=held), unit) if whole else None


def _cells(name: str, cell: str, joints: list[str], command: bool) -> list[tuple[str, float]]:
    if not cell:
        return []
    stem = {"positions": "position", "velocities": "velocity", "torques": "torque", "efforts": "effort"}.get(name, name)  # fmt: skip
    stem = "command" if command and stem == "position" else f"command_{stem}" if command else stem
    if cell.startswith("["):
        try:
            values = json.loads(cell)
        except ValueError:
            return []
        return [(f"{stem}_{joints[i] if i < len(joints) else i + 1}", float(x)) for i, x in enumerate(values)]
    try:
        return [(stem, float(cell))]
    except ValueError:
        return []


def read_lists(path: Path) -> dict[str, Variable] | None:
    """The columns of a Parquet file some of whose columns are lists of one length (LeRobot); None where there are none.

    A list "observation.state" becomes "observation.state_0", …; where ``meta/info.json`` of the data set names them, by these names.
    The file has to hold one episode; of several, the first is taken by its `episode_index`.
    """
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    schema = pq.read_schema(path)
    lists = [f.name for f in schema if pa.types.is_list(f.type) or pa.types.is_fixed_size_list(f.type)]
    if not lists or "timestamp" not in schema.names:
        return None
    table = pq.read_table(path)
    if "episode_index" in schema.names:
        episode = np.asarray(table["episode_index"])
        table = table.filter(pa.array(episode == episode[0]))
    names = _feature_names(path)
    out: dict[str, Variable] = {}
    for name in schema.names:
        values = table[name].to_numpy(zero_copy_only=False)
        if name not in lists:
            if np.asarray(values).dtype.kind in "biuf":
                out[name] = Variable(np.asarray(values))
            continue
        if len({len(v) for v in values}) != 1:
            continue
        matrix = np.stack([np.asarray(v, dtype=float) for v in values])
        own = names.get(name, [])
        for i in range(matrix.shape[1]):
            label = own[i] if len(own) == matrix.shape[1] else str(i)
            out[f"{name}_{label}"] = Variable(matrix[:, i])
    return out


def _feature_names(path: Path) -> dict[str, list[str]]:
    """Names of the entries of features, of the data set that a file belongs to."""
    for parent in list(path.resolve().parents)[:4]:
        info = parent / "meta" / "info.json"
        if info.is_file():
            features = json.loads(info.read_text(encoding="utf-8")).get("features", {})
            found = {}
            for name, feature in features.items():
                own = feature.get("names")
                own = next(iter(own.values()), []) if isinstance(own, dict) else own
                if isinstance(own, list):
                    found[name] = [str(x) for x in own]
            return found
    return {}
