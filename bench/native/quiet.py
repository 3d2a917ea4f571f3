"""MuJoCo's warnings while the bench runs it: kept from the terminal and from MUJOCO_LOG.TXT.

A Python function as MuJoCo's warning callback, set for a run and cleared after it, aborts the process when simulations diverge in
several threads. In its place one compiled log handler is installed for good, in front of the one there was: it drops warnings
while a run of the bench is under way, and hands everything else on. A diverging simulation is reported by the bench itself, as a
`SimulationError` with time and element.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numba
from numba import types

from bench.laws.calling import call_with_address, load_int, load_int32
from bench.native.library import set_log_handler
from bench.native.table import LOG_NEXT, RUNNING, read_word, words_address, write_word

WARNING = 2  # mjLOG_WARNING, the level at the start of mjLogMessage


@numba.cfunc(types.void(types.int64), cache=True, error_model="numpy")
def log_handler(message):
    """Drop a warning while the bench runs MuJoCo; hand anything else on."""
    table = words_address()
    if load_int32(message) == WARNING and load_int(table + 8 * RUNNING) > 0:
        return
    following = load_int(table + 8 * LOG_NEXT)
    if following != 0:
        call_with_address(following, message)


_lock = threading.Lock()


def _stand_in_front() -> None:
    """Put the handler in front of MuJoCo's own, where it is not; a handler that another library sets later stays in front."""
    own: int = log_handler.address  # type: ignore[assignment]  (numba: None before it is compiled)
    before = set_log_handler(own)
    if before == own:
        return
    known = read_word(LOG_NEXT)
    if known in {0, before}:
        write_word(LOG_NEXT, before)
    else:  # it may hand on to ours: then ours must not hand on to it
        set_log_handler(before)


@contextmanager
def quiet() -> Iterator[None]:
    """Within it MuJoCo's warnings reach neither the terminal nor a file. Safe to enter from several threads at a time."""
    with _lock:
        _stand_in_front()
        write_word(RUNNING, read_word(RUNNING) + 1)
    try:
        yield
    finally:
        with _lock:
            write_word(RUNNING, read_word(RUNNING) - 1)
