"""MuJoCo's C library itself: its callback pointers and its log handler, which the Python bindings do not tell the truth of.

`mujoco.get_mjcb_passive` returns what Python set last, also where a C library has changed the pointer since. What a step will
call is what the pointer holds.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import mujoco

from bench.errors import NativeError


@cache
def library() -> ctypes.CDLL:
    """The MuJoCo library that the Python bindings have loaded.

    Raises:
        NativeError: It is not found.
    """
    folder = Path(mujoco.__file__).parent
    # the extension module stands for the library that it is linked with, wherever a distribution has put it; not so on Windows
    candidates = [*folder.glob("libmujoco*"), *folder.glob("mujoco.dll"), *folder.glob("_callbacks.*")]
    for path in candidates:
        try:
            found = ctypes.CDLL(str(path))
            _ = found.mju_setLogHandler, found.mjcb_passive
        except (OSError, AttributeError):
            continue
        found.mju_setLogHandler.restype = ctypes.c_void_p
        found.mju_setLogHandler.argtypes = [ctypes.c_void_p]
        return found
    raise NativeError(
        f"the C library of MuJoCo {mujoco.__version__} is not found in {folder}; install MuJoCo anew (`pip install mujoco`)"
    )


@cache
def _slot(name: str) -> ctypes.c_void_p:
    return ctypes.c_void_p.in_dll(library(), f"mjcb_{name}")


def callback(name: str) -> int:
    """Address that MuJoCo's global callback `name` ("passive", "act_dyn", …) holds now; 0 for none."""
    return _slot(name).value or 0


def set_log_handler(address: int) -> int:
    """Make a C function MuJoCo's log handler; return the address of the one before."""
    return library().mju_setLogHandler(address) or 0
