"""Files written whole or not at all, and the values that JSON files hold."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.errors import BenchError


class OutputError(BenchError, OSError):
    """A file cannot be written where it was asked for."""


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; move it into place when the block ends well, remove it when it does not.

    Args:
        path: The file to be written or replaced; its folder is made where it is missing.

    Raises:
        OutputError: The folder cannot be written to.

    Example:
        >>> with replacing("/tmp/jointbench-example.txt") as temporary:
        ...     _ = temporary.write_text("whole")
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=target.suffix, dir=target.parent)
    except OSError as error:
        raise OutputError(
            f"cannot write {target}: {error.strerror or error}; choose another place"
        ) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp gives 0600, whatever the user's habit
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def json_values(document: Any) -> Any:
    """The document in values that JSON can hold.

    Numbers that are not finite become None, sequences lists, and named tuples objects by the names of their fields; anything
    else stays as it is.
    """
    if isinstance(document, float):
        return document if math.isfinite(document) else None
    if isinstance(document, Mapping):
        return {key: json_values(value) for key, value in document.items()}
    if isinstance(document, tuple) and hasattr(document, "_asdict"):
        return json_values(document._asdict())
    if isinstance(document, list | tuple):
        return [json_values(value) for value in document]
    return document
