"""The Parquet files of a part: samples, records, and the answers that are withheld."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.campaign.distribution import Distribution, Quantity, Shared
from bench.campaign.plan import Plan

if TYPE_CHECKING:
    import pyarrow as pa

    from bench.campaign.generation import Generator, Part


@dataclass(frozen=True)
class TablesSettings:
    """Numbers of `bench.campaign.tables`."""

    rows_per_group: int = 8192
    """Rows that a row group holds at least: a record, or a few short ones, so that a window can be read by itself."""


SETTINGS = TablesSettings()


def records_per_group(n_samples: int) -> int:
    """Records of one row group of the samples."""
    return max(1, -(-SETTINGS.rows_per_group // n_samples))


def part_contents(generator: Generator, part: Part) -> dict[str, bytes]:
    """The bytes of a part's files, by folder."""
    plan = generator.plan
    told, withheld = _columns(plan)
    contents = {"samples": _samples(generator, part), "records": _records(plan, part, told, told=True)}
    if plan.withholds:
        contents["answers"] = _records(plan, part, withheld, told=False)
    return contents


def _samples(generator: Generator, part: Part) -> bytes:
    import pyarrow as pa  # noqa: PLC0415

    plan, n = generator.plan, generator.plan.n_samples
    kind = pa.float32() if plan.precision == "float32" else pa.float64()
    fields = [pa.field("record", pa.int64(), nullable=False), pa.field("sample", pa.int32(), nullable=False)]
    fields += [
        pa.field(channel.name, kind, metadata={"unit": channel.unit}) for channel in generator.channels
    ]
    metadata = {
        "jointbench": json.dumps(
            {"campaign": plan.name, "sample_rate": plan.sample_rate, "plan_sha256": plan.sha256}
        )
    }
    columns: list[Any] = [
        np.repeat(np.array(part.good, dtype=np.int64), n),
        np.tile(np.arange(n, dtype=np.int32), len(part.good)),
    ]
    for values, has in zip(part.values, part.has, strict=True):
        columns.append(pa.array(values.reshape(-1), mask=None if has.all() else np.repeat(~has, n)))
    table = pa.Table.from_arrays(
        [pa.array(column) for column in columns], schema=pa.schema(fields, metadata=metadata)
    )
    # numbers that count up cost next to nothing as differences; the high bytes of a channel compress, the low ones do not
    encoding = {"record": "DELTA_BINARY_PACKED", "sample": "DELTA_BINARY_PACKED"}
    encoding |= {channel.name: "BYTE_STREAM_SPLIT" for channel in generator.channels}
    return _written(table, plan, encoding, rows=n * records_per_group(n))


def _written(table: pa.Table, plan: Plan, encoding: Mapping[str, str] | None, *, rows: int) -> bytes:
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    stream = pa.BufferOutputStream()
    pq.write_table(
        table,
        stream,
        row_group_size=rows,
        compression=plan.compression,
        compression_level=1 if plan.compression == "zstd" else None,
        use_dictionary=False,
        column_encoding=encoding,
    )
    return stream.getvalue().to_pybytes()


def _columns(plan: Plan) -> tuple[dict[str, bool], dict[str, bool]]:
    """Columns of what is told and of what is withheld, in the order of the plan; whether a column holds names."""
    told: dict[str, bool] = {}
    withheld: dict[str, bool] = {}
    for rig in plan.rigs:
        for element in rig.elements:
            if element.probability < 1.0:
                (withheld if element.withheld else told)[f"{element.name}/present"] = False
        for column, quantity, hidden in rig.quantities():
            _enter(plan, withheld if hidden else told, column, quantity)
    for excitation in plan.excitations:
        for column, quantity in excitation.quantities():
            _enter(plan, told, column, quantity)
    for sensors in plan.sensors:
        for column, quantity, hidden in sensors.quantities():
            _enter(plan, withheld if hidden else told, column, quantity)
    return told, withheld


def _enter(plan: Plan, columns: dict[str, bool], column: str, quantity: Quantity) -> None:
    if isinstance(quantity, Shared):
        quantity = plan.shared[quantity.name]
    textual = quantity.textual if isinstance(quantity, Distribution) else isinstance(quantity, str)
    columns[column] = columns.get(column, False) or textual


def _records(plan: Plan, part: Part, columns: Mapping[str, bool], *, told: bool) -> bytes:
    """What the records of a part drew, the failed ones too, and what became of them."""
    import pyarrow as pa  # noqa: PLC0415

    failures = {failure.record: failure for failure in part.failures}
    numbers = [draw.record for draw in part.draws]
    data: dict[str, pa.Array] = {"record": pa.array(numbers, pa.int64())}
    if told:
        data["status"] = pa.array(["failed" if record in failures else "ok" for record in numbers])
        data["rig"] = pa.array([plan.rigs[draw.rig].name for draw in part.draws])
        data["excitation"] = pa.array([plan.excitations[draw.excitation].name for draw in part.draws])
        data["sensors"] = pa.array(
            [plan.sensors[draw.sensors].name if draw.sensors >= 0 else None for draw in part.draws],
            pa.string(),
        )
    if told is not plan.withholds:  # the message of a diverged record names the elements of its rig
        times = [failures[record].time if record in failures else math.nan for record in numbers]
        data["failed_at"] = pa.array([None if math.isnan(time) else time for time in times], pa.float64())
        reasons = [failures[record].reason if record in failures else None for record in numbers]
        data["reason"] = pa.array(reasons, pa.string())
    rows = [_values(plan, draw, told=told) for draw in part.draws]
    for column, textual in columns.items():
        found = [row.get(column) for row in rows]
        if textual:
            data[column] = pa.array([None if value is None else str(value) for value in found], pa.string())
        elif column.endswith("/present"):
            data[column] = pa.array(found, pa.bool_())
        else:
            data[column] = pa.array(
                [None if value is None else float(value) for value in found], pa.float64()
            )
    return _written(pa.table(data), plan, None, rows=1 << 20)


def _values(plan: Plan, draw, *, told: bool) -> dict[str, Any]:
    """The record's row of one table: presence of elements, and the quantities of those it has."""
    rig = plan.rigs[draw.rig]
    absent = {element.name for element, has in zip(rig.elements, draw.present, strict=True) if not has}
    row: dict[str, Any] = {}
    for element, has in zip(rig.elements, draw.present, strict=True):
        if element.probability < 1.0 and element.withheld is not told:
            row[f"{element.name}/present"] = has
    for column, _, hidden in rig.quantities():
        if hidden is not told and column.rpartition("/")[0] not in absent:
            row[column] = draw.values[column]
    if told:
        row |= {column: draw.values[column] for column, _ in plan.excitations[draw.excitation].quantities()}
    if draw.sensors >= 0:
        for column, _, hidden in plan.sensors[draw.sensors].quantities():
            if hidden is not told:
                row[column] = draw.values[column]
    return row
