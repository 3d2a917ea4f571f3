"""The process table: what the compiled callbacks must know and cannot hold as constants.

A flat array of 64-bit words: first MuJoCo's struct offsets, then what `bench.native.quiet` counts, then, from `FIRST_LAW` on,
three words (force address, rate address, token) for each law registered in this process. The callbacks find it through the C
symbol `jointbench_words`, so that their machine code can be cached between processes.

The token is a random number drawn when the law is registered, and stands beside the law's number in every model that uses it. A
model from another process, or a file in which somebody wrote a number, has a number but not its token. Two processes that forked
share the laws, and the tokens, of before the fork and none of after it.
"""

from __future__ import annotations

import secrets
import threading

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import types

from bench.errors import NativeError
from bench.laws.base import ForceLaw
from bench.laws.calling import intrinsic
from bench.native.layout import offsets

CAPACITY = 1024
FIRST_LAW = 24
(
    M_NQ,
    M_NV,
    M_NU,
    M_NA,
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
) = range(17)
RUNNING, LOG_NEXT = 17, 18  # runs of the bench under way; the log handler that follows the bench's own
LAW_WORDS = 3
FORCE, RATE, TOKEN = range(LAW_WORDS)
TOKEN_BITS = 53
"""Bits of a token: as many as a float64, the type of a model's numbers, holds exactly."""

_words = np.zeros(FIRST_LAW + LAW_WORDS * CAPACITY, dtype=np.int64)
_numbers = _words.view(np.float64)
_numbers[FIRST_LAW + TOKEN :: LAW_WORDS] = np.nan  # the token of no law equals nothing
_slots: dict[tuple[int, int], int] = {}
_laws: list[ForceLaw] = []  # keeps the compiled kernels alive
_lock = threading.Lock()


_SYMBOL = "jointbench_words"
llvm.add_symbol(_SYMBOL, int(_words.ctypes.data))
_words[: len(offsets())] = list(offsets().values())


@intrinsic
def words_address(typingctx):
    """For compiled code: the address of the table."""
    word = ir.IntType(64)

    def codegen(context, builder, signature, args):
        return builder.ptrtoint(context.get_c_value(builder, word, _SYMBOL), word)

    return types.int64(), codegen


def read_word(place: int) -> int:
    """A word of the table."""
    return int(_words[place])


def write_word(place: int, value: int) -> None:
    """Set a word of the table."""
    _words[place] = value


def slot(law: ForceLaw) -> tuple[int, float]:
    """Number under which `law`'s kernels stand in this process's table, and its token; registers and compiles it at first use.

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
            at = FIRST_LAW + LAW_WORDS * number
            _words[at + RATE] = law.rate.address if law.rate is not None else 0
            _words[at + FORCE] = law.force.address
            _numbers[at + TOKEN] = float(1 + secrets.randbelow(2**TOKEN_BITS - 1))
            _laws.append(law)
            _slots[key] = number
        number = _slots[key]
    return number, float(_numbers[FIRST_LAW + LAW_WORDS * number + TOKEN])


def registered(number: float, token: float) -> bool:
    """Whether a law number and its token were given out by this process."""
    if not 0.0 <= number < len(_laws) or number != int(number):
        return False
    return bool(_numbers[FIRST_LAW + LAW_WORDS * int(number) + TOKEN] == token)
