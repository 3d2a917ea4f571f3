"""Records as plain tables for other tools: CSV with units in its headings, npz, MAT 5. Parquet alone keeps all that a recording says."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from bench.errors import FileFormatError
from bench.files import write_bytes
from bench.record_files.parquet import write_recording
from bench.recording import Recording

WRITABLE = (".parquet", ".csv", ".npz", ".mat")
"""Suffixes that a record can be written as."""


def write_record(path: str | Path, recording: Recording) -> None:
    """Write a record in the format of its suffix, whole or not at all.

    CSV has 17 significant digits, which read back to the bit. npz and MAT hold `time`, one array a channel (in MAT under a name that
    MATLAB takes), and `units`, one text "CHANNEL [UNIT]" a channel, from which the units are read back.

    Raises:
        FileFormatError: No such suffix.
        OutputError: It cannot be written.
    """
    target = Path(path)
    if target.suffix == ".parquet":
        write_recording(target, recording)
    elif target.suffix == ".csv":
        write_bytes(target, _csv(recording))
    elif target.suffix == ".npz":
        write_bytes(target, _npz(recording))
    elif target.suffix == ".mat":
        write_bytes(target, _mat(recording))
    else:
        raise FileFormatError(
            f"'{target}' has the suffix '{target.suffix}'; records are written as {', '.join(WRITABLE)}"
        )


def _csv(recording: Recording) -> bytes:
    headings = ["time [s]", *(f"{channel.name} [{channel.unit}]" for channel in recording.channels)]
    quoted = [f'"{heading}"' if "," in heading or '"' in heading else heading for heading in headings]
    stream = io.BytesIO()
    table = np.column_stack([recording.time, recording.values])
    np.savetxt(stream, table, delimiter=",", header=",".join(quoted), comments="", fmt="%.17g")
    return stream.getvalue()


def _npz(recording: Recording) -> bytes:
    stream = io.BytesIO()
    arrays = {channel.name: recording[channel.name] for channel in recording.channels}
    np.savez_compressed(
        stream,
        time=recording.time,
        units=np.array([f"{channel.name} [{channel.unit}]" for channel in recording.channels]),
        **arrays,  # type: ignore[arg-type]
    )
    return stream.getvalue()


def _mat(recording: Recording) -> bytes:
    from scipy.io import savemat  # noqa: PLC0415

    stream = io.BytesIO()
    names = [_matlab_name(channel.name) for channel in recording.channels]
    arrays = {name: recording.values[:, k] for k, name in enumerate(names)}
    headings = [f"{name} [{channel.unit}]" for name, channel in zip(names, recording.channels, strict=True)]
    units = np.array(headings, dtype=object)
    savemat(stream, {"time": recording.time, "units": units, **arrays}, oned_as="column")
    return stream.getvalue()


def _matlab_name(name: str) -> str:
    plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return (plain if plain[:1].isalpha() else f"c_{plain}")[:31]
