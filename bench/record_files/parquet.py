"""The bench's own file: Parquet with channels, units, provenance and a checksum, written whole or not at all.

Layout, version 1: the columns "time" [s] and the channels, float64, split into byte streams and compressed with
zstd; the key "jointbench" of the schema holds a JSON object with the version, clock, settle, channels, meta and
`Recording.content_hash`; the key "jointbench_sha256" its own checksum. The units stand with the fields, too.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import BenchError, FileFormatError
from bench.files import replacing
from bench.limits import READING_LIMITS, ReadingLimits
from bench.record_files.column_map import Variable
from bench.recording import Channel, Recording

FORMAT_VERSION = 1
"""Version of the layout that is written; all earlier ones are read."""

_HEADER, _CHECKSUM = b"jointbench", b"jointbench_sha256"


def write_recording(path: str | os.PathLike[str], recording: Recording) -> Path:
    """Write a recording to a Parquet file, exact to the bit.

    The file appears under its name only when it is complete and on the disk (a temporary file in the same folder, fsync,
    rename); a failure leaves the old file, if any, as it was and nothing else behind.

    Args:
        path: Path of the file, ending in ".parquet".
        recording: What to write.

    Returns:
        The path.

    Raises:
        FileFormatError: Another suffix.
        OutputError: The folder cannot be made or written to.
    """
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    path = Path(path)
    if path.suffix.lower() != ".parquet":
        raise FileFormatError(
            f"recordings are written as Parquet only; give '{path.name}' the suffix .parquet"
        )
    header = json.dumps(_header(recording), ensure_ascii=False, sort_keys=True).encode()
    fields = [pa.field("time", pa.float64(), nullable=False, metadata={"unit": "s"})]
    for channel in recording.channels:
        fields.append(pa.field(channel.name, pa.float64(), nullable=False, metadata={"unit": channel.unit}))
    schema = pa.schema(
        fields, metadata={_HEADER: header, _CHECKSUM: hashlib.sha256(header).hexdigest().encode()}
    )
    columns = [pa.array(column) for column in (recording.time, *recording.values.T)]
    table = pa.Table.from_arrays(columns, schema=schema)
    with replacing(path) as temporary:
        # measured doubles repeat in their high bytes only: split streams are a fifth smaller than plain pages
        pq.write_table(
            table,
            temporary,
            compression="zstd",
            compression_level=12,
            use_dictionary=False,
            use_byte_stream_split=True,
        )
    return path


def read_parquet(
    path: Path, wanted: Callable[[str], bool] | None = None, *, limits: ReadingLimits = READING_LIMITS
) -> Recording | dict[str, Variable]:
    """A recording from a file of the bench, or the columns of a Parquet file from elsewhere.

    Args:
        path: Path of the file.
        wanted: Which columns of a file from elsewhere are read; the others are empty in what is returned. None for all.
        limits: What the file may cost.

    Raises:
        FileFormatError: No Parquet file, truncated, changed after it was written, of a later version, or beyond the limits.
    """
    import pyarrow.parquet as pq  # noqa: PLC0415

    try:
        # not read_table, which takes folders named "key=value" above the file for columns
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            numbers = [name for name in schema.names if _holds_numbers(schema, name)]
            twice = next((name for name in schema.names if schema.names.count(name) > 1), None)
            metadata = schema.metadata or {}
            own = _HEADER in metadata
            chosen = [name for name in numbers if own or wanted is None or wanted(name)]
            _check_claims(path, file.metadata, len(chosen), limits)
            if twice is not None:
                raise FileFormatError(
                    f"'{path}' has several columns named '{twice[:60]}'; give each its own name"
                )
            table = file.read(columns=chosen, use_threads=False)
            table.validate(full=True)
    except BenchError:
        raise
    # Arrow's errors are children of several built-in classes, and what thrift finds comes as OSError
    except Exception as error:
        raise FileFormatError(
            f"'{path}' is no readable Parquet file ({_first_line(error)}); it is truncated, damaged, or of another format: "
            "restore it from its source, or give it the suffix of what it is"
        ) from None
    if own:
        return _recording(path, table, metadata)
    variables = {}
    for name in schema.names:
        if name in chosen:
            variables[name] = Variable(table.column(name).to_numpy(), _unit(schema.field(name)))
        else:
            variables[name] = Variable(np.empty(0, dtype=float if name in numbers else "U1"))
    return variables


def _holds_numbers(schema: Any, name: str) -> bool:
    import pyarrow as pa  # noqa: PLC0415

    kinds = [schema.field(i).type for i in schema.get_all_field_indices(name)]
    return all(
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_timestamp(kind)
        or pa.types.is_duration(kind)
        for kind in kinds
    )


def _unit(field: Any) -> str:
    text = (field.metadata or {}).get(b"unit", b"")
    return text.decode("utf-8", "replace")[:200]


def _check_claims(path: Path, metadata: Any, n_columns: int, limits: ReadingLimits) -> None:
    """Refuse a file whose footer claims more than the limits allow."""
    claimed = metadata.num_rows * max(n_columns, 1)
    if metadata.num_columns > limits.columns or claimed > limits.numbers or metadata.num_rows < 0:
        raise FileFormatError(
            f"'{path}' claims {metadata.num_rows} rows of {n_columns} columns to be read, and {limits.numbers} numbers are the most; "
            "if that is no damage, cut it into parts, or name fewer columns"
        )
    if metadata.num_row_groups > limits.objects:
        raise FileFormatError(f"'{path}' claims {metadata.num_row_groups} row groups; write it in fewer")


def _recording(path: Path, table: Any, metadata: Mapping[bytes, bytes]) -> Recording:
    header = _checked_header(path, metadata)
    try:
        recording = Recording(
            table.column("time").to_numpy(),
            np.stack([table.column(entry["name"]).to_numpy() for entry in header["channels"]], axis=1)
            if header["channels"]
            else np.empty((table.num_rows, 0)),
            tuple(Channel(**entry) for entry in header["channels"]),
            settle=header["settle"],
            meta=header["meta"],
            sample_rate=header["sample_rate"],
        )
        same = recording.content_hash == header["content_hash"]
    # the header is JSON of any shape, and what it holds goes into constructors: KeyError, TypeError, ValueError, OverflowError, …
    except Exception as error:
        raise FileFormatError(
            f"'{path}' contradicts its own header ({_first_line(error)}); restore it from its source"
        ) from None
    if not same:
        raise FileFormatError(
            f"the values in '{path}' are not those it was written with (checksum); restore it from its source"
        )
    return recording


def _header(recording: Recording) -> dict[str, Any]:
    return {
        "format": FORMAT_VERSION,
        "sample_rate": recording.sample_rate,
        "settle": recording.settle,
        "channels": [asdict(channel) for channel in recording.channels],
        "meta": recording.meta,
        "content_hash": recording.content_hash,
    }


def _checked_header(path: Path, metadata: Mapping[bytes, bytes]) -> dict[str, Any]:
    text = metadata[_HEADER]
    if hashlib.sha256(text).hexdigest().encode() != metadata.get(_CHECKSUM):
        raise FileFormatError(
            f"the header of '{path}' is not the one it was written with (checksum); restore it from its source, "
            "or change it by reading, recording.with_(…) and write_recording"
        )
    try:
        header = json.loads(text)
        later = int(header["format"]) > FORMAT_VERSION
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise FileFormatError(
            f"the header of '{path}' is none of the bench's ({type(error).__name__}: {_first_line(error)}); restore it from its source"
        ) from None
    if later:
        raise FileFormatError(
            f"'{path}' has version {header['format']} of the format, and this jointbench reads up to {FORMAT_VERSION}; "
            "upgrade jointbench"
        )
    return header


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:300] or type(error).__name__
