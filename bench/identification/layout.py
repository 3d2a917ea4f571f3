"""How the adaptive estimator lies in memory: one flat array, a header of named entries, then vectors and matrices.

All that changes is in this array, so that one sample from Python hands over one array and five numbers, nothing is
allocated in a step, and a copy of the array is a snapshot of the estimator.
"""

from __future__ import annotations

from typing import Any

import numba
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

# Numba's own option, for functions that allocate nothing: references are not counted.
_no_count: Any = {"_nrt": False}
jit = numba.njit(cache=True, error_model="numpy", nogil=True)
# Array arguments are nine words each, and counting their references is an atomic step each: functions that take many of them go
# into their callers, in LLVM rather than in numba, which would type their whole text anew for each caller.
inlined = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True, **_no_count)
# Sums may be reordered into vector registers; NaN and inf keep their meaning, since samples are checked for them.
fast = numba.njit(cache=True, error_model="numpy", nogil=True, fastmath={"reassoc", "contract"}, **_no_count)

# What the header of the state array holds. Settings first, then what changes from sample to sample.
(
    N, N_FILTERS, KIND, ORDER_1, ORDER_2, MASS, RATE, Z_INVERSE, V_FLOOR, F_FLOOR, CROSSOVER, DENOISE_AFTER,
    USES_F, USES_X, USES_V, USES_A, BETA, BOUND, P0, STEP, GAP, STUCK, HALF_WINDOW, LEVEL_FLOOR, MIN_EIGENVALUE,
    JUMP, JUMP_TIME, NORMALISE, MAX_PULL,
    STARTED, T_LAST, T_REJECTED, T_START, COEF_STEP, COEF_RATE, DECAY, B0, B1, C_DECAY, C_B0, C_B1, MU, GAIN, TRACE,
    HELD, HALF_TIME, COUNT, COUNT_BEFORE, HALVES, Z, Z_HAT, FAST, SLOW, POWER, T_RESET, USED, OUT_OF_PHASE,
    SMALLEST, CONDITION, UNEXCITED, EXCITED, PRIOR, TRUSTED, REPORTS, SEEN,
) = range(65)  # fmt: skip
CONSTANT_RUN, LAST_VALUE, HEADER = 65, 69, 73

BOUC_WEN, SDOF, DAMPER_LOG, POLYNOMIAL = range(4)
"""Places in `bench.identification.regressors.KINDS`; what is given has no regressor of its own to form."""

# Flag bits of a sample: the kinds of events in the order of `bench.identification.persistence.EVENT_KINDS`, then the rest; one for
# each of four channels, and last the monitor's own, which is told to no one.
NOT_FINITE, BACKWARDS, CLOCK_RESET, DROPPED, CONSTANT, MOVING, EXCITATION_LOST, EXCITATION_BACK, RESET = (
    1 << bit for bit in range(9)
)
UNUSED, REPORTED, FIRST_CHANNEL, _, _, _, HALF_IS_OVER = (1 << bit for bit in range(9, 16))
REJECTED = NOT_FINITE | BACKWARDS


@intrinsic
def unowned(typing_context, array):
    """The same array without its reference count: the caller keeps the memory alive.

    Counting is atomic and happens at every call that takes an array; in a step of 100 ns it would be most of the time.
    """
    signature = array(array)

    def generate(context, builder, _, arguments):
        view = make_array(array)(context, builder, value=arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return signature, generate


def split(s):
    """Split the flat state: header, theta, d, phi, b, work, inverse scales, levels, peaks, filters, u, Gramians, start, pulls."""
    n = int(s[N])
    m = int(s[N_FILTERS])
    a = HEADER
    f = a + 8 * n
    g = f + 2 * m
    return (
        s[:a],
        s[a : a + n],
        s[a + n : a + 2 * n],
        s[a + 2 * n : a + 3 * n],
        s[a + 3 * n : a + 4 * n],
        s[a + 4 * n : a + 5 * n],
        s[a + 5 * n : a + 6 * n],
        s[a + 6 * n : a + 7 * n],
        s[a + 7 * n : f],
        s[f:g].reshape(2, m),
        s[g : g + n * n].reshape(n, n),
        s[g + n * n : g + 3 * n * n].reshape(2, n, n),
        s[g + 3 * n * n : g + 3 * n * n + n],
        s[g + 3 * n * n + n : g + 3 * n * n + 2 * n],
    )


_compiled_split = jit(split)


def _views(s):
    """`split` for compiled callers, who hold the state themselves."""
    return _compiled_split(unowned(s))  # pyrefly: ignore[missing-argument]  (numba passes the typing context)


views: Any = jit(_views)


def size(n: int, n_filters: int) -> int:
    """Length of the flat state for n parameters and n_filters filters."""
    return HEADER + 10 * n + 2 * n_filters + 3 * n * n
