"""Where compiled kernels are kept: beside their source, else in the user's cache, else in a temporary folder.

Numba keeps machine code beside the source file or in the user's cache folder, and refuses to compile where it can write to neither
(a package of the system's, a container without a home). `bench` calls `provide` on import; nothing but the standard library is
needed for it.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
"""Numba's setting; whoever has set it is obeyed."""


def provide(package: Path) -> Path | None:
    """Have numba keep machine code in a temporary folder where it could write to no other place.

    Args:
        package: Folder of the package whose functions are compiled.

    Returns:
        The temporary folder; None where none is needed, or none is to be had.
    """
    if os.environ.get(VARIABLE) or _beside(package) or _users():
        return None
    try:
        folder = _temporary()
    except OSError:  # not one folder to write to: numba will say so when something is to be compiled
        return None
    os.environ[VARIABLE] = str(folder)  # of processes that this one starts, too
    if "numba" in sys.modules:  # has read its settings already
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


def place(package: Path) -> str:
    """Where numba keeps machine code, in words."""
    if os.environ.get(VARIABLE):
        return os.environ[VARIABLE]
    if _beside(package):
        return f"beside the source ({package})"
    return "the user's cache" if _users() else "nowhere: every process compiles anew"


def is_empty(package: Path) -> bool:
    """Whether nothing has been compiled yet, so that the next command takes longer than those after it."""
    chosen = os.environ.get(VARIABLE)
    places = [Path(chosen)] if chosen else [package]
    if not chosen and not _beside(package):
        places = [_users_folder()]
    return not any(next(folder.rglob("*.nbi"), None) for folder in places)


def _beside(package: Path) -> bool:
    """Whether every folder with modules has, or may be given, a `__pycache__` to write to."""
    for folder, names, files in os.walk(package):
        names[:] = [name for name in names if not name.startswith(("_", "."))]
        if any(file.endswith(".py") for file in files):
            cache = Path(folder, "__pycache__")
            if not os.access(cache if cache.exists() else folder, os.W_OK | os.X_OK):
                return False
    return True


def _users_folder() -> Path:
    """The user's cache folder, where numba looks for it."""
    home = Path("~").expanduser()
    if sys.platform == "darwin":
        folder = home / "Library" / "Caches"
    elif os.name == "nt":
        folder = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    else:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return folder / "numba"


def _users() -> bool:
    """Whether the user has a cache folder of his own, or may be given one."""
    folder = _users_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _temporary() -> Path:
    """A folder that is this user's alone, since what lies there is run; the same one each time where there is one."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir(), f"jointbench-kernels-{user}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        owned = not hasattr(os, "getuid") or (found.st_uid == user and not found.st_mode & 0o022)
        if stat.S_ISDIR(found.st_mode) and owned and os.access(folder, os.W_OK | os.X_OK):
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="jointbench-kernels-"))
