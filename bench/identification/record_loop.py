"""The compiled loop behind `bench.identification.linear_rig`: whole records of a linear structure with force laws.

``M q'' + C q' + K q = B u + c - R' f(t, R q, R q', z)``, commands u held over each step, as MuJoCo holds them. Three
integrators: the classical Runge-Kutta step of MuJoCo, equal to it up to rounding, and two that choose the step from the error,
for records to a stated accuracy: Dormand-Prince 5(4) within a step whose command is its own, and Dormand-Prince 8(5,3)
across steps of the same command, whose samples are read off its interpolant. The latter two find the kinks of gaps by
rejecting steps; locating them by root finding would save some of those steps and was not worth a second kind of kernel.

References:
    J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26.
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, sections II.1, II.4, II.5 (8(5,3)),
    II.6 (its interpolant).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

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
_STAGES = len(_C)

_A8 = np.zeros((16, 16))
"""Stages of the 8(5,3) pair: twelve, the result, and three more for the interpolant."""
_A8[:12, :12], _A8[12, :12], _A8[13:] = DOP853.A, DOP853.B, DOP853.A_EXTRA
_C8 = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
_E8 = np.zeros((6, 16))
"""Its two estimates of the error, and the four powers of the interpolant that need all stages."""
_E8[0, :13], _E8[1, :13], _E8[2:] = DOP853.E3, DOP853.E5, DOP853.D
_RESULT, _STAGES8, _POWERS = 12, 16, 7


class RecordLoopLimits(NamedTuple):
    """Numbers of `bench.identification.record_loop` that compiled code holds."""

    smallest: float = 1e-9
    growth: float = 6.0
    kink: float = 10.0
    over: float = -0.4
    """A step whose error is so many times too large has a kink in it, which is closed in on by halves until a step over it should
    pass: the error of a step over a kink falls with the power 2 (velocities) to 3 (positions) of what lies beyond it."""


RECORD_LOOP_LIMITS = RecordLoopLimits()
_SMALLEST, _GROWTH, _KINK, _OVER = (
    RECORD_LOOP_LIMITS  # globals, which compiled code folds as the literals that they are
)


def _sparse(table: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    rows, columns = np.nonzero(table)
    starts = np.searchsorted(rows, np.arange(len(table) + 1))
    return starts.astype(np.int64), np.ascontiguousarray(columns, dtype=np.int64), table[rows, columns]


_STARTS8, _COLUMNS8, _VALUES8 = _sparse(_A8)
_STARTS_E, _COLUMNS_E, _VALUES_E = _sparse(_E8)

_CONTRACTED = {"contract", "nsz"}
"""A product and a sum are one instruction, rounded once: a fifth of the time; infinities and NaN mean what they always do."""
_jit = numba.njit(cache=True, error_model="numpy", nogil=True, fastmath=_CONTRACTED)
_inline = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True, fastmath=_CONTRACTED)


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


@_inline
def padded(n):
    """Length of a vector of `n` states, a multiple of four."""
    return (n + 3) // 4 * 4


def work_size(n: int, n_dof: int) -> int:
    """Numbers of scratch that `run` needs for `n` states of which `2 n_dof` are motion."""
    return (_STAGES8 + 3 + _POWERS) * ((n + 3) // 4 * 4) + n_dof + 3 * MAX_COORDINATES


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


@_inline
def _four(table, starts, s, slope, width, i):
    """Row `s` of a sparse table times the slopes of four states from `i` on: side by side, as the processor has them."""
    columns, values = table
    a = b = c = d = 0.0
    for k in range(starts[s], starts[s + 1]):
        factor, at = values[k], columns[k] * width + i
        a += factor * slope[at]
        b += factor * slope[at + 1]
        c += factor * slope[at + 2]
        d += factor * slope[at + 3]
    return a, b, c, d


@_inline
def _stage(p, s, t, h, y, u, stage, slope):
    """State and slope of stage `s` of the 8(5,3) pair."""
    width = padded(p.n)
    for i in range(0, width, 4):
        a, b, c, d = _four((_COLUMNS8, _VALUES8), _STARTS8, s, slope, width, i)
        stage[i] = y[i] + h * a
        stage[i + 1] = y[i + 1] + h * b
        stage[i + 2] = y[i + 2] + h * c
        stage[i + 3] = y[i + 3] + h * d
    _derivative(p, t + _C8[s] * h, stage, u, advance(slope, s * width))


@_inline
def _excess(h, third, fifth, scale):
    """Error of a state over its scale, from the two estimates of the 8(5,3) pair."""
    size = math.sqrt(fifth * fifth + 0.01 * third * third)
    return h * fifth * fifth / size / scale if size > 0.0 else 0.0


@_inline
def _error(n, h, new, slope, peak):
    """Error of a step of the 8(5,3) pair relative to the peaks, the largest of all states; NaN where one is."""
    width = padded(n)
    worst = 0.0
    for i in range(0, width, 4):
        third = _four((_COLUMNS_E, _VALUES_E), _STARTS_E, 0, slope, width, i)
        fifth = _four((_COLUMNS_E, _VALUES_E), _STARTS_E, 1, slope, width, i)
        for j in range(4):
            scale = max(peak[i + j], abs(new[i + j]), 1e-300)
            error = _excess(h, third[j], fifth[j], scale)
            worst = error if not error <= worst else worst
    return worst


@_inline
def _powers(n, h, y, new, slope, powers):
    """Coefficients of the interpolant of a step, all sixteen slopes given."""
    width = padded(n)
    for i in range(n):
        rise = new[i] - y[i]
        powers[i] = rise
        powers[width + i] = h * slope[i] - rise
        powers[2 * width + i] = 2.0 * rise - h * (slope[_RESULT * width + i] + slope[i])
    for m in range(_POWERS - 3):
        for i in range(0, width, 4):
            four = _four((_COLUMNS_E, _VALUES_E), _STARTS_E, 2 + m, slope, width, i)
            for j in range(4):
                powers[(3 + m) * width + i + j] = h * four[j]


@_inline
def _interpolated(n, x, y, powers, out):
    """State at the part `x` of a step."""
    width = padded(n)
    for i in range(0, width, 4):
        a = b = c = d = 0.0
        for m in range(_POWERS - 1, -1, -1):
            factor, at = (x if m % 2 == 0 else 1.0 - x), m * width + i
            a = (a + powers[at]) * factor
            b = (b + powers[at + 1]) * factor
            c = (c + powers[at + 2]) * factor
            d = (d + powers[at + 3]) * factor
        out[i] = y[i] + a
        out[i + 1] = y[i + 1] + b
        out[i + 2] = y[i + 2] + c
        out[i + 3] = y[i + 3] + d


@_inline
def _sample(p, observe, out, row, y, acceleration, u):
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


@_inline
def _accelerated(p, observe):
    """Whether a channel depends on an acceleration."""
    found = False
    for k in range(observe.starts[-1]):
        found = found or 2 * p.n_dof <= observe.columns[k] < 3 * p.n_dof
    return found


@_inline
def _wanted(h, worst):
    """The step whose error should be what is allowed, after one whose error is `worst` times that."""
    return h * min(
        _GROWTH,
        max(0.2, 0.9 * worst ** (-0.125) if worst > 0.0 else _GROWTH),
    )


@_jit
def _across(p, t, step, h, tolerance, place, y, u, work, peak, observe, out):
    """Advance the state at `y` from step `place[0]` to step `place[1]` under one command, and write the samples between.

    The first slope is at `work` already; the sample of the first step is written, one every `place[2]` steps. Returns
    the step proposed for what follows.
    """
    n = p.n
    width = padded(n)
    first, last, stride = place
    slope = work
    stage = advance(work, _STAGES8 * width)
    new = advance(stage, width)
    powers = advance(stage, 3 * width)
    length = (last - first) * step
    k = (first // stride + 1) * stride
    accelerated = _accelerated(p, observe)
    done = 0.0
    wall = reach = before = 0.0
    while done < length:
        ends = done + h >= length
        if ends:
            h = length - done
        for s in range(1, _RESULT):
            _stage(p, s, t + done, h, y, u, stage, slope)
        _stage(p, _RESULT, t + done, h, y, u, new, slope)
        worst = _error(n, h, new, slope, peak) / tolerance
        taken = h
        h = _wanted(h, worst)
        if not (worst <= 1.0 or taken <= _SMALLEST * step or not worst < np.inf):
            if worst > _KINK:
                before = before if wall > done else taken
                wall, reach, h = done + taken, taken * worst**_OVER, 0.5 * taken
            continue
        if k < last and (k - first) * step <= done + taken:
            for s in range(_RESULT + 1, _STAGES8):
                _stage(p, s, t + done, taken, y, u, stage, slope)
            _powers(n, taken, y, new, slope, powers)
        while k < last and (k - first) * step <= done + taken:
            _interpolated(n, ((k - first) * step - done) / taken, y, powers, stage)
            rate = advance(slope, width)  # the second slope is not needed any more
            if accelerated:
                _derivative(p, t + (k - first) * step, stage, u, rate)
            _sample(p, observe, out, k // stride, stage, advance(rate, p.n_dof), u)
            k += stride
        done = length if ends else done + taken
        for i in range(n):
            y[i] = new[i]
            slope[i] = slope[_RESULT * width + i]
            peak[i] = max(peak[i], abs(new[i]))
        if wall > done:
            rest = wall - done
            h = min(h, rest if rest <= reach else 0.5 * rest)
        elif before > 0.0:
            h, before = max(h, 0.5 * before), 0.0
    return h


@_inline
def _same(u, v, n_inputs):
    """Whether two commands are equal."""
    equal = True
    for j in range(n_inputs):
        equal = equal and u[j] == v[j]
    return equal


@_jit
def run(
    n_dof, n, step, start_time, tolerance, stride, controls, system, inputs, table, rows, row_inputs, spread,
    theta, observe, state, sizes, work, out,
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
        observe: Channels as a map of position, velocity, acceleration and commands ``(n_channels, 3 n_dof + n_inputs)``,
            sparse.
        state: State at the start, zeros behind it ``(padded(n),)``; that at the end on return.
        sizes: Least value of each state's peak that errors are relative to ``(n,)``.
        work: Scratch, see `work_size`.
        out: The record.
    """
    scratch = pointer_at(work.ctypes.data)
    y = pointer_at(state.ctypes.data)
    slope = scratch
    stage = advance(scratch, _STAGES8 * padded(n))
    peak = advance(stage, 2 * padded(n))
    load = advance(stage, (3 + _POWERS) * padded(n))
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
        peak[i] = max(abs(y[i]), sizes[i])
    final = controls.shape[0] - 1
    k = 0
    while True:
        u = advance(commands, k * n_inputs)
        for i in range(n_dof):
            total = 0.0
            for j in range(n_inputs):
                total += inputs[i, j] * u[j]
            load[i] = total
        t = start_time + k * step
        _derivative(p, t, y, u, slope)
        if k % stride == 0:
            _sample(p, observe, out, k // stride, y, advance(slope, n_dof), u)
        if k == final:
            break
        after = k + 1
        if tolerance > 0.0:
            while after < final and _same(u, advance(commands, after * n_inputs), n_inputs):
                after += 1
        if after > k + 1:
            place = (k, after, stride)
            proposed = _across(p, t, step, proposed, tolerance, place, y, u, scratch, peak, observe, out)
        elif tolerance > 0.0:
            proposed = _controlled(p, t, step, proposed, tolerance, y, u, stage, slope, peak)
        else:
            _classical(p, t, step, y, u, stage, slope)
        k = after
