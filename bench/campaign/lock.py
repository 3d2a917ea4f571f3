"""One run at a time in a campaign's folder."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from bench.errors import BenchError
from bench.files import OutputError


class CampaignError(BenchError, RuntimeError):
    """A campaign cannot be run, resumed or read."""


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder; the system lets go of it when the process ends, however it ends.

    Raises:
        CampaignError: Another process holds it.
        OutputError: It cannot be written to.
    """
    path = folder / ".lock"
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}; choose another place") from error
    try:
        try:
            import fcntl  # noqa: PLC0415  (not on Windows, where nobody keeps two runs apart)

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:
            pass
        except OSError as error:
            raise CampaignError(
                f"another process is at work in '{folder}'; wait for it or stop it"
            ) from error
        yield
    finally:
        os.close(handle)
