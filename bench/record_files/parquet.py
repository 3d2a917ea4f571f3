"""The bench's own file: Parquet with channels, units, provenance and a checksum, written whole or not at all.

Layout, version 1: the columns "time" [s] and the channels, float64, split into byte streams and compressed with
zstd; the key "jointbench" of the schema holds a JSON object with the version, clock, settle, channels, meta and
`Recording.content_hash`; the key "jointbench_sha256" its own checksum. The units stand with the fields, too.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import BenchError, FileFormatError
from bench.files import replacing
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


def read_parquet(path: Path) -> Recording | dict[str, Variable]:
    """A recording from a file of the bench, or the columns of a Parquet file from elsewhere.

    Args:
        path: Path of the file.

    Raises:
        FileFormatError: No Parquet file, truncated, changed after it was written, or of a later version.
    """
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    try:
        # not read_table, which takes folders named "key=value" above the file for columns
        with pq.ParquetFile(path) as file:
            table = file.read(use_threads=False)
    except (pa.ArrowException, OSError) as error:
        raise FileFormatError(
            f"'{path}' is no readable Parquet file ({_first_line(error)}); it is truncated, damaged, or of another format: "
            "restore it from its source, or give it the suffix of what it is"
        ) from None
    metadata = table.schema.metadata or {}
    if _HEADER not in metadata:
        return {name: Variable(table.column(name).to_numpy()) for name in table.column_names}
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
    except (BenchError, KeyError, TypeError) as error:
        raise FileFormatError(
            f"'{path}' contradicts its own header ({error}); restore it from its source"
        ) from None
    if recording.content_hash != header["content_hash"]:
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


def _checked_header(path: Path, metadata: dict[bytes, bytes]) -> dict[str, Any]:
    text = metadata[_HEADER]
    if hashlib.sha256(text).hexdigest().encode() != metadata.get(_CHECKSUM):
        raise FileFormatError(
            f"the header of '{path}' is not the one it was written with (checksum); restore it from its source, "
            "or change it by reading, recording.with_(…) and write_recording"
        )
    header = json.loads(text)
    if header["format"] > FORMAT_VERSION:
        raise FileFormatError(
            f"'{path}' has version {header['format']} of the format, and this jointbench reads up to {FORMAT_VERSION}; "
            "upgrade jointbench"
        )
    return header


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
