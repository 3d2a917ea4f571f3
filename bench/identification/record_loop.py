"""The compiled loop behind `bench.identification.linear_rig`: whole records of a linear structure with force laws.

``M q'' + C q' + K q = B u + c - R' f(t, R q, R q', z)``, commands u held over each step, as MuJoCo holds them. Three
integrators: the classical Runge-Kutta step of MuJoCo, equal to it up to rounding, and two that choose the step from the error,
for records to a stated accuracy: Dormand-Prince 5(4) within a step whose command is its own, and across steps of the same
command the one of `bench.identification.dormand_prince_8`.

References:
    J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26.
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, sections II.1, II.4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.identification.dormand_prince_8 import POWERS, SMALLEST_STEP, STAGES8, across
from bench.identification.record_equations import (
    Equations,
    contracted,
    contracted_inline,
    padded,
    pointers,
    state_derivative,
    write_sample,
)
from bench.laws.base import MAX_COORDINATES
from bench.laws.calling import advance, pointer_at

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


def work_size(n: int, n_dof: int) -> int:
    """Numbers of scratch that `run` needs for `n` states of which `2 n_dof` are motion."""
    return (STAGES8 + 3 + POWERS) * ((n + 3) // 4 * 4) + n_dof + 3 * MAX_COORDINATES


@contracted_inline
def _classical(p, t, h, y, u, stage, slope):
    """One classical Runge-Kutta step of the state at `y`; the first slope is at `slope` already."""
    n = p.n
    for i in range(n):
        stage[i] = y[i] + 0.5 * h * slope[i]
    state_derivative(p, t + 0.5 * h, stage, u, advance(slope, n))
    for i in range(n):
        stage[i] = y[i] + 0.5 * h * slope[n + i]
    state_derivative(p, t + 0.5 * h, stage, u, advance(slope, 2 * n))
    for i in range(n):
        stage[i] = y[i] + h * slope[2 * n + i]
    state_derivative(p, t + h, stage, u, advance(slope, 3 * n))
    for i in range(n):
        y[i] += h / 6.0 * (slope[i] + 2.0 * (slope[n + i] + slope[2 * n + i]) + slope[3 * n + i])


@contracted
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
            state_derivative(p, t + done + _C[s] * step, stage, u, advance(slope, s * n))
        worst = 0.0
        for i in range(n):
            error = 0.0
            for j in range(_STAGES):
                error += _E[j] * slope[j * n + i]
            error = abs(step * error)
            scale = max(peak[i], abs(stage[i]), 1e-300)
            if not error <= worst * tolerance * scale:
                worst = error / (tolerance * scale)
        if worst <= 1.0 or step <= SMALLEST_STEP * length or not worst < np.inf:
            done = length if count == 1 else done + step
            for i in range(n):
                y[i] = stage[i]  # the last stage is the step's result
                slope[i] = slope[(_STAGES - 1) * n + i]
                peak[i] = max(peak[i], abs(stage[i]))
        h = step * min(5.0, max(0.2, 0.9 * worst ** (-0.2) if worst > 0.0 else 5.0))
    return h


@contracted_inline
def _same(u, v, n_inputs):
    """Whether two commands are equal."""
    equal = True
    for j in range(n_inputs):
        equal = equal and u[j] == v[j]
    return equal


@contracted
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
    stage = advance(scratch, STAGES8 * padded(n))
    peak = advance(stage, 2 * padded(n))
    load = advance(stage, (3 + POWERS) * padded(n))
    coordinates = advance(load, n_dof)
    p = Equations(
        n_dof, n, table.shape[0], table.ctypes.data, row_inputs.ctypes.data, pointers(system), pointers(rows),
        pointers(spread), pointer_at(theta.ctypes.data), load, coordinates, advance(coordinates, MAX_COORDINATES),
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
        state_derivative(p, t, y, u, slope)
        if k % stride == 0:
            write_sample(p, observe, out, k // stride, y, advance(slope, n_dof), u)
        if k == final:
            break
        after = k + 1
        if tolerance > 0.0:
            while after < final and _same(u, advance(commands, after * n_inputs), n_inputs):
                after += 1
        if after > k + 1:
            place = (k, after, stride)
            proposed = across(p, t, step, proposed, tolerance, place, y, u, scratch, peak, observe, out)
        elif tolerance > 0.0:
            proposed = _controlled(p, t, step, proposed, tolerance, y, u, stage, slope, peak)
        else:
            _classical(p, t, step, y, u, stage, slope)
        k = after
