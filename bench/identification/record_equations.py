"""Equations of motion that the compiled record loop integrates, and the channels read off a state.

The functions become part of the loops of `bench.identification.record_loop` and `bench.identification.dormand_prince_8`. Numba keeps
the machine code of a loop by the file that the loop stands in: after a change here, remove what is kept of those two.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba

from bench.laws.calling import advance, call_kernel, load_int, pointer_at

FORCE, RATE, N_COORDINATES, ROW, THETA, STATE = range(6)
"""Columns of the element table: kernel addresses (0: none), coordinates, then first row, parameter and hidden state."""
COLUMNS = 6

_CONTRACTED = {"contract", "nsz"}
"""A product and a sum are one instruction, rounded once: a fifth of the time; infinities and NaN mean what they always do."""
contracted = numba.njit(cache=True, error_model="numpy", nogil=True, fastmath=_CONTRACTED)
contracted_inline = numba.njit(
    cache=True, error_model="numpy", nogil=True, forceinline=True, fastmath=_CONTRACTED
)


class Equations(NamedTuple):
    """What the compiled functions share; all but the sizes are pointers, or addresses of integers."""

    n_dof: int
    n: int
    n_elements: int
    table: int
    row_inputs: int
    system: Any
    rows: Any
    spread: Any
    theta: Any
    load: Any
    q: Any
    v: Any
    f: Any


@contracted_inline
def padded(n):
    """Length of a vector of `n` states, a multiple of four."""
    return (n + 3) // 4 * 4


@contracted_inline
def pointers(matrix):
    """Addresses of a sparse matrix, and a pointer to its values."""
    return matrix.starts.ctypes.data, matrix.columns.ctypes.data, pointer_at(matrix.values.ctypes.data)


@contracted_inline
def row_times(matrix, row, y):
    """Row of a matrix times the vector at pointer `y`."""
    starts, columns, values = matrix
    total = 0.0
    for k in range(load_int(starts + 8 * row), load_int(starts + 8 * row + 8)):
        total += values[k] * y[load_int(columns + 8 * k)]
    return total


@contracted
def state_derivative(p, t, y, u, slope):
    """Write dy/dt at pointer `slope` for the state at pointer `y` and the commands at pointer `u`."""
    width = 2 * p.n_dof
    for i in range(p.n_dof):
        slope[i] = y[p.n_dof + i]
        slope[p.n_dof + i] = p.load[i] - row_times(p.system, i, y)
    for e in range(p.n_elements):
        entry = p.table + 8 * COLUMNS * e
        first = load_int(entry + 8 * ROW)
        count = load_int(entry + 8 * N_COORDINATES)
        starts, columns, values = p.rows
        for r in range(count):
            source = load_int(p.row_inputs + 8 * (first + r))
            position = u[source] if source >= 0 else 0.0
            velocity = 0.0
            for k in range(load_int(starts + 8 * (first + r)), load_int(starts + 8 * (first + r) + 8)):
                column = load_int(columns + 8 * k)
                position += values[k] * y[column]
                velocity += values[k] * y[p.n_dof + column]
            p.q[r], p.v[r], p.f[r] = position, velocity, 0.0
        z = advance(y, width + load_int(entry + 8 * STATE))
        theta = advance(p.theta, load_int(entry + 8 * THETA))
        call_kernel(load_int(entry + 8 * FORCE), t, p.q, p.v, z, theta, p.f)
        starts, columns, values = p.spread
        for r in range(count):
            for k in range(load_int(starts + 8 * (first + r)), load_int(starts + 8 * (first + r) + 8)):
                slope[p.n_dof + load_int(columns + 8 * k)] -= values[k] * p.f[r]
        if load_int(entry + 8 * RATE) != 0:
            zdot = advance(slope, width + load_int(entry + 8 * STATE))
            call_kernel(load_int(entry + 8 * RATE), t, p.q, p.v, z, theta, zdot)


@contracted_inline
def write_sample(p, observe, out, row, y, acceleration, u):
    """Write the channels of one sample."""
    motion = 2 * p.n_dof
    for channel in range(out.shape[1]):
        total = 0.0
        for k in range(observe.starts[channel], observe.starts[channel + 1]):
            column = observe.columns[k]
            if column < motion:
                total += observe.values[k] * y[column]
            elif column < motion + p.n_dof:
                total += observe.values[k] * acceleration[column - motion]
            else:
                total += observe.values[k] * u[column - motion - p.n_dof]
        out[row, channel] = total


@contracted_inline
def reads_accelerations(p, observe):
    """Whether a channel depends on an acceleration."""
    found = False
    for k in range(observe.starts[-1]):
        found = found or 2 * p.n_dof <= observe.columns[k] < 3 * p.n_dof
    return found
