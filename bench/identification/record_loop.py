"""The compiled loop behind `bench.identification.linear_rig`: whole records of a linear structure with force laws.

``M q'' + C q' + K q = B u + c - R' f(t, R q, R q', z)``, commands u held over each step, as MuJoCo holds them. Two
integrators: the classical Runge-Kutta step of MuJoCo, equal to it up to rounding, and Dormand-Prince 5(4) with the step
chosen from the error, for records to a stated accuracy. The latter finds the kinks of gaps by rejecting steps; locating
them by root finding would save some of those steps and was not worth a second kind of kernel.

References:
    J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26.
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, sections II.1 and II.4.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.laws.base import MAX_COORDINATES
from bench.laws.calling import advance, call_kernel, load_int, pointer_at

FORCE, RATE, N_COORDINATES, ROW, THETA, STATE = range(6)
"""Columns of the element table: kernel addresses (0: none), coordinates, then first row, parameter and hidden state."""
COLUMNS = 6

_A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_E = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_STAGES = 7
_SMALLEST = (
    1e-9  # of a step: where the error does not fall with the step (a jump), go on rather than for ever
)

_jit = numba.njit(cache=True, error_model="numpy", nogil=True)
_inline = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)


class Sparse(NamedTuple):
    """A matrix row by row: most entries of a structure's matrices are zero, and products with them took half the time.

    Attributes:
        starts: First entry of each row, and one past the last of all ``(n_rows + 1,)``.
        columns: Column of each entry.
        values: The entries.
    """

    starts: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def of(cls, matrix: NDArray[np.float64]) -> Sparse:
        """The entries of a matrix that are not zero."""
        rows, columns = np.nonzero(matrix)
        starts = np.searchsorted(rows, np.arange(matrix.shape[0] + 1))
        return cls(starts.astype(np.int64), columns.astype(np.int64), np.append(matrix[rows, columns], 0.0))


class _Plan(NamedTuple):
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


def work_size(n: int, n_dof: int) -> int:
    """Numbers of scratch that `run` needs for `n` states of which `2 n_dof` are motion."""
    return (_STAGES + 3) * n + n_dof + 3 * MAX_COORDINATES


@_inline
def _pointers(matrix):
    return matrix.starts.ctypes.data, matrix.columns.ctypes.data, pointer_at(matrix.values.ctypes.data)


@_inline
def _times(matrix, row, y):
    """Row of a matrix times the vector at pointer `y`."""
    starts, columns, values = matrix
    total = 0.0
    for k in range(load_int(starts + 8 * row), load_int(starts + 8 * row + 8)):
        total += values[k] * y[load_int(columns + 8 * k)]
    return total


@_inline
def _derivative(p, t, y, u, slope):
    """Write dy/dt at pointer `slope` for the state at pointer `y` and the commands at pointer `u`."""
    width = 2 * p.n_dof
    for i in range(p.n_dof):
        slope[i] = y[p.n_dof + i]
        slope[p.n_dof + i] = p.load[i] - _times(p.system, i, y)
    for e in range(p.n_elements):
        entry = p.table + 8 * COLUMNS * e
        first = load_int(entry + 8 * ROW)
        count = load_int(entry + 8 * N_COORDINATES)
        for r in range(count):
            source = load_int(p.row_inputs + 8 * (first + r))
            p.q[r] = u[source] if source >= 0 else _times(p.rows, first + r, y)
            p.v[r] = 0.0 if source >= 0 else _times(p.rows, first + r, advance(y, p.n_dof))
            p.f[r] = 0.0
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


@_inline
def _classical(p, t, h, y, u, stage, slope):
    """One classical Runge-Kutta step of the state at `y`; the first slope is at `slope` already."""
    n = p.n
    for i in range(n):
        stage[i] = y[i] + 0.5 * h * slope[i]
    _derivative(p, t + 0.5 * h, stage, u, advance(slope, n))
    for i in range(n):
        stage[i] = y[i] + 0.5 * h * slope[n + i]
    _derivative(p, t + 0.5 * h, stage, u, advance(slope, 2 * n))
    for i in range(n):
        stage[i] = y[i] + h * slope[2 * n + i]
    _derivative(p, t + h, stage, u, advance(slope, 3 * n))
    for i in range(n):
        y[i] += h / 6.0 * (slope[i] + 2.0 * (slope[n + i] + slope[2 * n + i]) + slope[3 * n + i])


@_jit
def _controlled(p, t, length, h, tolerance, y, u, stage, slope, peak):
    """Advance the state at `y` by `length` in steps whose error stays below `tolerance` of each state's peak.

    The first slope is at `slope` already. Returns the step proposed for what follows.
    """
    n = p.n
    done = 0.0
    while done < length:
        # as many equal steps as the proposed one asks for, rather than full ones and a scrap at the end
        count = math.ceil(min((length - done) / h, 1e9))
        step = (length - done) / count
        for s in range(1, _STAGES):
            for i in range(n):
                total = 0.0
                for j in range(s):
                    total += _A[s, j] * slope[j * n + i]
                stage[i] = y[i] + step * total
            _derivative(p, t + done + _C[s] * step, stage, u, advance(slope, s * n))
        worst = 0.0
        for i in range(n):
            error = 0.0
            for j in range(_STAGES):
                error += _E[j] * slope[j * n + i]
            error = abs(step * error)
            scale = max(peak[i], abs(stage[i]), 1e-300)
            if not error <= worst * tolerance * scale:
                worst = error / (tolerance * scale)
        if worst <= 1.0 or step <= _SMALLEST * length or not worst < np.inf:
            done = length if count == 1 else done + step
            for i in range(n):
                y[i] = stage[i]  # the last stage is the step's result
                slope[i] = slope[(_STAGES - 1) * n + i]
                peak[i] = max(peak[i], abs(stage[i]))
        h = step * min(5.0, max(0.2, 0.9 * worst ** (-0.2) if worst > 0.0 else 5.0))
    return h


@_jit
def run(
    n_dof, n, step, start_time, tolerance, stride, controls, system, inputs, table, rows, row_inputs, spread,
    theta, observe, state, work, out,
):  # fmt: skip
    """Fill `out` ``(n_samples, n_channels)`` with the channels of a record.

    Args:
        n_dof: Degrees of freedom.
        n: States, motion and hidden.
        step: Time over which a command is held [s]; also the Runge-Kutta step where `tolerance` is 0.
        start_time: Time of the first command [s].
        tolerance: Local error relative to each state's peak; 0 for fixed steps.
        stride: Steps a sample.
        controls: Commands ``(n_steps, n_inputs)``, the last one the constant 1.
        system: ``M^-1 [K, C]`` ``(n_dof, 2 n_dof)``, sparse.
        inputs: ``M^-1 B`` ``(n_dof, n_inputs)``.
        table: Elements ``(n_elements, 6)``.
        rows: Coordinates of the elements ``(n_rows, n_dof)``, sparse.
        row_inputs: Command that a coordinate reads ``(n_rows,)``, -1 for motion.
        spread: ``(M^-1 R')'`` ``(n_rows, n_dof)``, sparse.
        theta: Parameters of all elements.
        observe: Channels as a map of position, velocity, acceleration and commands ``(n_channels, 3 n_dof + n_inputs)``.
        state: State at the start ``(n,)``; at the end on return.
        work: Scratch, see `work_size`.
        out: The record.
    """
    scratch = pointer_at(work.ctypes.data)
    y = pointer_at(state.ctypes.data)
    slope = scratch
    stage = advance(scratch, _STAGES * n)
    peak = advance(scratch, (_STAGES + 1) * n)
    load = advance(scratch, (_STAGES + 3) * n)
    coordinates = advance(load, n_dof)
    p = _Plan(
        n_dof, n, table.shape[0], table.ctypes.data, row_inputs.ctypes.data, _pointers(system), _pointers(rows),
        _pointers(spread), pointer_at(theta.ctypes.data), load, coordinates, advance(coordinates, MAX_COORDINATES),
        advance(coordinates, 2 * MAX_COORDINATES),
    )  # fmt: skip
    n_inputs = controls.shape[1]
    commands = pointer_at(controls.ctypes.data)
    proposed = step
    for i in range(n):
        peak[i] = abs(y[i])
    for k in range(controls.shape[0]):
        u = advance(commands, k * n_inputs)
        for i in range(n_dof):
            total = 0.0
            for j in range(n_inputs):
                total += inputs[i, j] * u[j]
            load[i] = total
        t = start_time + k * step
        _derivative(p, t, y, u, slope)
        if k % stride == 0:
            for c in range(out.shape[1]):
                total = 0.0
                for j in range(2 * n_dof):
                    total += observe[c, j] * y[j]
                for j in range(n_dof):
                    total += observe[c, 2 * n_dof + j] * slope[n_dof + j]
                for j in range(n_inputs):
                    total += observe[c, 3 * n_dof + j] * u[j]
                out[k // stride, c] = total
        if k == controls.shape[0] - 1:
            break
        if tolerance > 0.0:
            proposed = _controlled(p, t, step, proposed, tolerance, y, u, stage, slope, peak)
        else:
            _classical(p, t, step, y, u, stage, slope)
