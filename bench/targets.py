"""Places for results, checked before the time is spent that making them takes; nothing that exists is overwritten unasked."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from bench.files import OutputError, check_name


def check_targets(*paths: str | Path | None, force: bool = False, option: str = "--force") -> None:
    """Refuse places that results cannot be written to, before the time is spent that making them takes.

    Args:
        paths: The files that will be written; None and "-" (standard output) are passed over.
        force: Let files that exist be overwritten.
        option: What says so on the command line.

    Raises:
        OutputError: A folder has the name, its folder cannot be written to, two results have one name, or the file exists.
    """
    taken: set[Path] = set()
    for path in map(Path, (path for path in paths if path is not None and str(path) != "-")):
        check_name(path)
        try:
            resolved = path.resolve()
            nearest = next(parent for parent in resolved.parents if parent.exists())
        except (OSError, RuntimeError) as error:  # a name that is too long, links in a circle
            raise OutputError(
                f"cannot write {path}: {getattr(error, 'strerror', None) or error}; choose another place"
            ) from error
        if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
            raise OutputError(
                f"cannot write {path}: {nearest} is no folder one may write to; choose another place"
            )
        if resolved in taken:
            raise OutputError(f"{path} is named for two results; give each a file of its own")
        taken.add(resolved)
        if not force and os.path.lexists(path):
            raise OutputError(
                f"{path} exists and is not overwritten; give another name, or {option} to replace it"
            )


def check_target_folder(folder: str | Path, *, force: bool = False, own: Iterable[str] = ()) -> None:
    """Refuse a folder for results that cannot be one, or that holds files of others, before anything is made.

    Args:
        folder: The folder, which need not exist.
        force: Let files in it be overwritten.
        own: Patterns of files by one of which a folder is known as written by the same command.

    Raises:
        OutputError: It cannot be written to, or holds files and none of its own.
    """
    place = Path(folder)
    if place.is_dir():
        check_targets(place / "a result", force=True)
        known = force or any(next(place.glob(pattern), None) is not None for pattern in own)
        files = (path for path in place.rglob("*") if path.is_file() and not path.name.startswith("."))
        other = None if known else next(files, None)
        if other is not None:
            raise OutputError(
                f"'{place}' holds files already ({other.relative_to(place)}); choose another folder, or --force to overwrite in it"
            )
    else:
        check_targets(place, force=force)
