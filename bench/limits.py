"""What reading a file may cost, and which paths are files at all.

A file from elsewhere can claim more than it holds (a shape of 7 TiB in 300 bytes, a gzip file of zeros), or never end (a pipe, a
device). Every reader of records, models and decks asks here before it takes memory, so that a refusal costs less than 2 GB and 20 s.
"""

from __future__ import annotations

import errno
import os
import stat
from dataclasses import dataclass
from pathlib import Path

from bench.errors import BenchError, FileFormatError


class MissingFileError(BenchError, FileNotFoundError):
    """There is no such file."""


@dataclass(frozen=True)
class ReadingLimits:
    """What one file may cost when it is read.

    Attributes:
        file_bytes: Largest file on the disk.
        text_bytes: Longest text, unpacked: ten million lines of the longest rows that `numpy.savetxt` writes of five columns.
        numbers: Most numbers in one file, unpacked: ten million samples of six channels. A number costs 8 bytes, and up to three
            copies of it live at once while a record is built, so that these are 1.5 GB.
        line_bytes: Longest line of a text file.
        columns: Most columns or channels.
        objects: Most arrays, groups or members of a file of arrays.
        depth: Deepest nesting of structures in a file of arrays.
        model_bytes: Largest model or deck, all its included files together.
        included: Most files that a model or deck includes, each as often as it is included.
        model_items: Most bodies, vertices, pixels, points or cells that one entry of a model or deck may generate.
    """

    file_bytes: int = 2 * 2**30
    text_bytes: int = 3 * 2**29
    numbers: int = 64_000_000
    line_bytes: int = 2**20
    columns: int = 10_000
    objects: int = 30_000
    depth: int = 32
    model_bytes: int = 64 * 2**20
    included: int = 100
    model_items: int = 2_000_000


READING_LIMITS = ReadingLimits()


def regular_file(path: str | os.PathLike[str], most: int = READING_LIMITS.file_bytes) -> Path:
    """The path, once it is known to be a regular file of at most `most` bytes: no pipe, device, socket or folder.

    Args:
        path: Path of the file.
        most: Largest size [bytes].

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: It is no regular file, or too large.
    """
    file = Path(path)
    shown = repr(str(path)[:200])
    try:
        state = file.stat()
    except OSError as error:
        if error.errno in (errno.ENOENT, errno.ENOTDIR):
            raise MissingFileError(f"there is no file {shown}") from None
        raise FileFormatError(f"{shown} cannot be read: {error.strerror or error}") from None
    except ValueError as error:  # a zero byte in the path
        raise FileFormatError(f"{shown} is no path ({error})") from None
    if not stat.S_ISREG(state.st_mode):
        raise FileFormatError(
            f"{shown} is {_kind(state.st_mode)}; a regular file is expected: copy what it gives to one"
        )
    if state.st_size > most:
        raise FileFormatError(
            f"{shown} has {size_text(state.st_size)}, and at most {size_text(most)} are read; cut it into parts"
        )
    return file


def size_text(n: float) -> str:
    """A number of bytes as people write it."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if n < 1000.0:
            return f"{n:.4g} {unit}"
        n /= 1000.0
    return f"{n:.4g} TB"


def _kind(mode: int) -> str:
    for test, name in (
        (stat.S_ISDIR, "a folder"),
        (stat.S_ISFIFO, "a pipe (FIFO)"),
        (stat.S_ISSOCK, "a socket"),
        (stat.S_ISCHR, "a device"),
        (stat.S_ISBLK, "a device"),
    ):
        if test(mode):
            return name
    return "no regular file"
