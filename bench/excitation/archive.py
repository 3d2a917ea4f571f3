"""Archives of policies: plain NumPy arrays and a JSON text, without pickles."""

from __future__ import annotations

import io
import json
import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError
from bench.files import write_bytes

FORMAT = 1
_UNREADABLE = (
    ValueError, EOFError, OSError, RuntimeError, NotImplementedError, MemoryError, zipfile.BadZipFile, zlib.error
)  # fmt: skip
"""What NumPy and zipfile raise for archives that are damaged, encrypted, or packed in a way they do not know."""


@dataclass(frozen=True)
class ArchiveSettings:
    """Numbers of `bench.excitation.archive`."""

    largest: int = 64 * 2**20
    """Bytes of all arrays of a policy at most: networks of some millions of weights, which no laboratory computer runs in a window."""


SETTINGS = ArchiveSettings()


def write_archive(
    path: Path, document: str, content: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write arrays and a document, whole or not at all.

    Args:
        path: Path of the file; ".npz" is appended where it does not end so.
        document: Name of the document in the archive.
        content: The document, in JSON values.
        arrays: The arrays by name.

    Raises:
        OutputError: It cannot be written.
    """
    written = io.BytesIO()
    named = {document: np.array(json.dumps(content)), **arrays}
    np.savez_compressed(written, allow_pickle=False, **named)  # pyrefly: ignore[bad-argument-type]
    write_bytes(path if path.suffix == ".npz" else Path(f"{path}.npz"), written.getvalue())


def read_archive(path: Path, *documents: str) -> tuple[dict[str, NDArray[Any]], str]:
    """Arrays of an archive, and the first document of these names that it holds.

    Raises:
        FileFormatError: It is no archive of a policy.
    """
    try:
        arrays = _arrays(path)
        name = next(name for name in documents if name in arrays)
        return arrays, str(arrays.pop(name))
    except (*_UNREADABLE, StopIteration) as error:
        reason = f"it holds no {documents[0]}" if isinstance(error, StopIteration) else error
        raise FileFormatError(
            f"{path} is no policy ({reason}); one is written by scripts/train_excitation.py or scripts/train_plans.py"
        ) from error


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an archive, none of which may claim more than the archive holds, nor all of them more than `window_largest`."""
    arrays: dict[str, NDArray[Any]] = {}
    with zipfile.ZipFile(path) as archive:
        if sum(member.file_size for member in archive.infolist()) > SETTINGS.largest:
            raise ValueError(f"its arrays take more than {SETTINGS.largest} bytes")
        for member in archive.infolist():
            content = archive.read(member)
            stream = io.BytesIO(content)
            version = np.lib.format.read_magic(stream)
            read = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, _, dtype = read(stream)
            if dtype.kind not in "fiuU" or math.prod(shape) * dtype.itemsize > len(content):
                raise ValueError(
                    f"{member.filename} is {dtype} {shape}, of which the archive holds {len(content)} bytes"
                )
            stream.seek(0)
            arrays[member.filename.removesuffix(".npy")] = np.lib.format.read_array(
                stream, allow_pickle=False
            )
    return arrays
