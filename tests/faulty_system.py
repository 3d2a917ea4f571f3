"""A disk that fails, as `bench.files.SYSTEM`: call number n of write, fsync and replace does not do what it should.

Four ways, as SQLite tests itself: the call *fails* with an error of the system; a write is *torn*, half of it done, and fails;
the process is *killed* there (nothing that comes later reaches the disk, clean-up neither); the *power* goes (as killed, and of
what was not flushed the disk keeps nothing: contents are cut to what their last fsync covered, renames of folders that were not
flushed are undone). Calls are counted over all three kinds.
"""

from __future__ import annotations

import errno
import os
import threading
from pathlib import Path

from bench.files import SystemCalls

WAYS = ("fails", "torn", "killed", "power")


class Killed(BaseException):
    """The process ends here."""


class FaultySystem:
    """Counts the calls; the one of number `at` (from 0) goes wrong in the given way.

    Args:
        at: Number of the call; None for none.
        way: One of `WAYS`.
    """

    def __init__(self, at: int | None = None, way: str = "fails") -> None:
        self.at, self.way = at, way
        self.count, self.dead = 0, False
        self.lock = threading.Lock()
        self.flushed: dict[tuple[int, int], int] = {}  # bytes on the disk, by device and inode
        self.known: dict[tuple[int, int], Path] = {}
        self.renames: list[
            tuple[Path, bytes | None]
        ] = []  # names whose folder was not flushed, and what they held

    @property
    def calls(self) -> SystemCalls:
        return SystemCalls(self._write, self._fsync, self._replace, self._unlink)

    def _comes(self) -> bool:
        """Whether this call is the one that goes wrong."""
        with self.lock:
            if self.dead:
                raise Killed
            mine = self.count == self.at
            self.count += 1
            if mine and self.way in {"killed", "power"}:
                self.dead = True
                if self.way == "power":
                    self._lose()
                raise Killed
            return mine

    def _lose(self) -> None:
        for path, before in reversed(self.renames):
            if before is None:
                path.unlink(missing_ok=True)
            else:
                path.write_bytes(before)
        for key, path in self.known.items():
            if path.exists() and key == _key(path):
                os.truncate(path, min(self.flushed.get(key, 0), path.stat().st_size))

    def _write(self, handle: int, content: bytes | memoryview) -> int:
        path = Path(os.readlink(f"/proc/self/fd/{handle}"))
        state = os.fstat(handle)
        key = (state.st_dev, state.st_ino)
        self.flushed.setdefault(key, state.st_size)
        self.known[key] = path
        if self._comes():
            if self.way == "torn":
                os.write(handle, content[: len(content) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")
        return os.write(handle, content)

    def _fsync(self, handle: int) -> None:
        if self._comes():
            raise OSError(errno.EIO, "Input/output error")
        state = os.fstat(handle)
        path = Path(os.readlink(f"/proc/self/fd/{handle}"))
        with self.lock:
            if path.is_dir():
                self.renames = [(name, before) for name, before in self.renames if name.parent != path]
            else:
                self.flushed[state.st_dev, state.st_ino] = state.st_size

    def _replace(self, source: Path, target: Path) -> None:
        if self._comes():
            raise OSError(errno.EIO, "Input/output error")
        source, target = Path(source), Path(target)
        before = target.read_bytes() if target.is_file() else None
        with self.lock:
            self.renames.append((target, before))
            if source.is_file():
                self.known[_key(source)] = target
        os.replace(source, target)

    def _unlink(self, path: Path) -> None:
        if self.dead:
            raise Killed
        os.unlink(path)


def _key(path: Path) -> tuple[int, int]:
    state = path.stat()
    return state.st_dev, state.st_ino
