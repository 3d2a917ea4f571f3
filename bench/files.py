"""The one place that writes results: files whole or not at all, several of them together, lines that outlive a crash.

Every write, fsync and rename of a result goes through `SYSTEM`, so that a test can make call number n fail, tear or never
return (tests/faulty_system.py does, for every n of a small campaign). The order is always the same: the content to a temporary
file of its own, fsync, rename onto the name, fsync of the folder. Whatever stops it when, the name stands for the old content
or for the new one, never for a part of it.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import secrets
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from bench.errors import BenchError


class OutputError(BenchError, OSError):
    """A file cannot be written where it was asked for."""


@dataclass(frozen=True)
class SystemCalls:
    """The calls by which results reach the disk.

    Attributes:
        write: Write bytes to a file that is open for writing; gives the number written, maybe fewer.
        fsync: Wait until an open file, or folder, is on the disk.
        replace: Rename a file onto a name that may be taken.
        unlink: Remove a file.
    """

    write: Callable[[int, bytes | memoryview], int] = os.write
    fsync: Callable[[int], None] = os.fsync
    replace: Callable[[Path, Path], None] = os.replace
    unlink: Callable[[Path], None] = os.unlink


SYSTEM = SystemCalls()
"""What is called; tests put another one here."""


class _Move(NamedTuple):
    temporary: Path
    target: Path


_held: ContextVar[list[_Move] | None] = ContextVar("moves that wait for the end of `together`", default=None)


@contextlib.contextmanager
def replacing(path: str | Path, *, inside: Path | None = None, settled: bool = True) -> Iterator[Path]:
    """Give a temporary path beside `path`; move it into place when the block ends well, remove it when it does not.

    Within `together` the move waits for the end of that block.

    Args:
        path: The file to be written or replaced; its folder is made where it is missing.
        inside: Folder of the temporary file, on the same disk, where it may not lie beside the target.
        settled: Wait until the name, too, is on the disk; who moves many files may call `settle` once instead.

    Raises:
        OutputError: The file cannot be written or moved; a folder, device or pipe has its name.

    Example:
        >>> with replacing("/tmp/jointbench-example.txt") as temporary:
        ...     _ = temporary.write_text("whole")
    """
    target = Path(path)
    name = f".{target.name}.{secrets.token_hex(4)}{target.suffix}"
    temporary = (target.parent if inside is None else inside) / name
    kept = False
    try:
        with _told(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            # not mkstemp, whose files are for their owner alone, whatever the user's habit (umask)
            os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            yield temporary
            flush(temporary)
            waiting = _held.get()
            if waiting is None:
                check_name(target)
                SYSTEM.replace(temporary, target)
                if settled:
                    settle(target.parent)
            else:
                waiting.append(_Move(temporary, target))
        kept = True
    finally:
        if not kept:
            _discard(temporary)


def write_bytes(
    path: str | Path, content: bytes, *, inside: Path | None = None, settled: bool = True
) -> None:
    """Write a file whole or not at all.

    Args:
        path: The file.
        content: Its content.
        inside: As for `replacing`.
        settled: As for `replacing`.

    Raises:
        OutputError: It cannot be written.
    """
    moving = replacing(path, inside=inside, settled=settled)
    with moving as temporary, _opened(temporary, os.O_WRONLY) as handle:
        _write_all(handle, content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file (UTF-8) whole or not at all.

    Raises:
        OutputError: It cannot be written.
    """
    write_bytes(path, text.encode())


def append_line(path: str | Path, line: str) -> None:
    """Add a line to a file and wait until it is on the disk.

    A line that a crash cut off stays a line of its own: the next one does not go on where it ends.

    Args:
        path: The file, made where it is missing; never one that a link points to.
        line: The line, without its end.

    Raises:
        OutputError: It cannot be written.
    """
    file = Path(path)
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    with _told(file), _opened(file, flags) as handle:
        size = os.fstat(handle).st_size
        torn = False
        if size:
            os.lseek(handle, size - 1, os.SEEK_SET)
            torn = os.read(handle, 1) != b"\n"
        _write_all(handle, ("\n" * torn + line + "\n").encode())
        SYSTEM.fsync(handle)


@contextlib.contextmanager
def folder_made_in(root: Path, name: str) -> Iterator[Path]:
    """Give an empty folder in which the block makes a folder `name`; move that into `root` when the block ends well.

    Args:
        root: Where the folder is to lie; made where it is missing.
        name: Its name, maybe with folders above it, as "a/b".

    Raises:
        OutputError: It cannot be moved.
    """
    target = root / name
    with _told(target):
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".making-", dir=root) as made:
            yield Path(made)
            for path in sorted((Path(made) / name).rglob("*"), reverse=True):
                settle(path) if path.is_dir() else flush(path)
            target.parent.mkdir(parents=True, exist_ok=True)
            SYSTEM.replace(Path(made) / name, target)
        settle(target.parent)


def flush(path: Path) -> None:
    """Wait until the content of a file is on the disk."""
    with _opened(path, os.O_RDONLY) as handle:
        SYSTEM.fsync(handle)


def settle(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can.

    Raises:
        OutputError: The disk reports an error.
    """
    if os.name != "posix":
        return
    with _told(folder), _opened(folder, os.O_RDONLY) as handle:
        try:
            SYSTEM.fsync(handle)
        except OSError as error:
            if error.errno not in (
                errno.EINVAL,
                errno.ENOTSUP,
            ):  # some network disks know no fsync of folders
                raise


@contextlib.contextmanager
def together() -> Iterator[None]:
    """Move all files that are written in the block into place at its end: all of them or, when anything fails, none.

    A file that had one of the names before is put back where a later move fails. (Between two renames nothing but the end of
    the process or of the machine can come; then the names hold whole files, some of them the old ones.)

    Raises:
        OutputError: A file cannot be moved.
    """
    moves: list[_Move] = []
    token = _held.set(moves)
    try:
        yield
        _held.reset(token)
        _move_all(moves)
    except BaseException:
        for move in moves:
            _discard(move.temporary)
        raise
    finally:
        if _held.get() is moves:
            _held.reset(token)


def _move_all(moves: list[_Move]) -> None:
    undo: list[tuple[Path, Path | None]] = []
    try:
        for move in moves:
            with _told(move.target):
                check_name(move.target)
                former = _set_by(move.target)
                undo.append((move.target, former))
                SYSTEM.replace(move.temporary, move.target)
        for folder in dict.fromkeys(move.target.parent for move in moves):
            settle(folder)
    except BaseException:
        for target, former in reversed(undo):
            with contextlib.suppress(OSError):
                if former is None:
                    SYSTEM.unlink(target)
                else:
                    SYSTEM.replace(former, target)
        raise
    finally:
        for _, former in undo:
            if former is not None:
                _discard(former)


def _set_by(target: Path) -> Path | None:
    """A second name for what a file holds now; None where there is no file."""
    former = target.parent / f".{target.name}.{secrets.token_hex(4)}.former"
    if not os.path.lexists(target):
        return None
    try:
        os.link(target, former, follow_symlinks=False)
    except OSError:  # a disk without hard links
        SYSTEM.replace(target, former)
    return former


def check_name(target: Path) -> None:
    """Raise `OutputError` where a folder, a device or a pipe has the name: the rename would put a file in its place."""
    try:
        mode = target.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return  # nothing has the name; whether its folder can be is asked elsewhere
    except OSError as error:
        raise OutputError(
            f"cannot write {target}: {error.strerror or error}; choose another place"
        ) from error
    if stat.S_ISDIR(mode):
        raise OutputError(f"cannot write {target}: it is a folder; name a file in it")
    if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
        raise OutputError(f"cannot write {target}: it is a device or a pipe; name a file")


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


def _write_all(handle: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[SYSTEM.write(handle, rest) :]


@contextlib.contextmanager
def _opened(path: Path, flags: int) -> Iterator[int]:
    handle = os.open(path, flags, 0o666)
    try:
        yield handle
    finally:
        os.close(handle)


@contextlib.contextmanager
def _told(target: Path) -> Iterator[None]:
    """Tell an error of the system with the file that was to be written."""
    try:
        yield
    except BenchError:
        raise
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        todo = "free some space" if full else "choose another place"
        raise OutputError(f"cannot write {target}: {error.strerror or error}; {todo}") from error


def _discard(temporary: Path) -> None:
    with contextlib.suppress(OSError):
        SYSTEM.unlink(temporary)
