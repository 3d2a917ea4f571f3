"""The process table: what the compiled callbacks must know and cannot hold as constants.

A flat array of 64-bit integers: first MuJoCo's struct offsets, then, from `FIRST_LAW` on, one pair (force address,
rate address) for each law registered in this process. The callbacks find it through the C symbol `jointbench_table`,
so that their machine code can be cached between processes.
"""

from __future__ import annotations

import threading

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types

from bench.errors import NativeError
from bench.laws.base import ForceLaw
from bench.native.layout import offsets

CAPACITY = 1024
FIRST_LAW = 16
(
    M_NNUMERIC,
    M_NUMERIC_ADR,
    M_NUMERIC_SIZE,
    M_NUMERIC_DATA,
    M_ACTUATOR_DYNPRM,
    M_ACTUATOR_ACTADR,
    D_TIME,
    D_QPOS,
    D_QVEL,
    D_ACT,
    D_CTRL,
    D_QFRC_PASSIVE,
    D_ACT_DOT,
) = range(13)

_words = np.zeros(FIRST_LAW + 2 * CAPACITY, dtype=np.int64)
_slots: dict[tuple[int, int], int] = {}
_laws: list[ForceLaw] = []  # keeps the compiled kernels alive
_lock = threading.Lock()


def _publish() -> object:
    address = int(_words.ctypes.data)

    @numba.cfunc(types.int64())
    def table_address():
        return address

    llvm.add_symbol("jointbench_table", table_address.address)
    return table_address


_symbol = _publish()
_words[: len(offsets())] = list(offsets().values())

table_address = types.ExternalFunction("jointbench_table", types.int64())
"""For compiled code: the address of the table."""


def slot(law: ForceLaw) -> int:
    """Number under which `law`'s kernels stand in this process's table; registers and compiles it at first use.

    Raises:
        NativeError: More than `CAPACITY` different pairs of kernels were registered.
    """
    key = (id(law.force), id(law.rate))
    with _lock:
        if key not in _slots:
            number = len(_laws)
            if number == CAPACITY:
                raise NativeError(
                    f"more than {CAPACITY} different laws in one process; reuse laws by changing theta"
                )
            at = FIRST_LAW + 2 * number
            _words[at + 1] = law.rate.address if law.rate is not None else 0
            _words[at] = law.force.address
            _laws.append(law)
            _slots[key] = number
        return _slots[key]
