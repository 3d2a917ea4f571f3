"""Dormand-Prince 8(5,3) across steps of one command, whose samples are read off its interpolant.

The kinks of gaps are found by rejecting steps; locating them by root finding would save some of those steps and was not worth a
second kind of kernel.

References:
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, sections II.5 (8(5,3)), II.6 (its
    interpolant).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from bench.identification.record_equations import (
    contracted,
    contracted_inline,
    padded,
    reads_accelerations,
    state_derivative,
    write_sample,
)
from bench.laws.calling import advance

_A8 = np.zeros((16, 16))
"""Stages of the 8(5,3) pair: twelve, the result, and three more for the interpolant."""
_A8[:12, :12], _A8[12, :12], _A8[13:] = DOP853.A, DOP853.B, DOP853.A_EXTRA
_C8 = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
_E8 = np.zeros((6, 16))
"""Its two estimates of the error, and the four powers of the interpolant that need all stages."""
_E8[0, :13], _E8[1, :13], _E8[2:] = DOP853.E3, DOP853.E5, DOP853.D
_RESULT, STAGES8, POWERS = 12, 16, 7


class DormandPrinceLimits(NamedTuple):
    """Numbers of `bench.identification.dormand_prince_8` that compiled code holds."""

    smallest: float = 1e-9
    growth: float = 6.0
    kink: float = 10.0
    over: float = -0.4
    """A step whose error is so many times too large has a kink in it, which is closed in on by halves until a step over it should
    pass: the error of a step over a kink falls with the power 2 (velocities) to 3 (positions) of what lies beyond it."""


DORMAND_PRINCE_LIMITS = DormandPrinceLimits()
SMALLEST_STEP, _GROWTH, _KINK, _OVER = DORMAND_PRINCE_LIMITS
# globals, which compiled code folds as the literals that they are


def _sparse(table: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    rows, columns = np.nonzero(table)
    starts = np.searchsorted(rows, np.arange(len(table) + 1))
    return starts.astype(np.int64), np.ascontiguousarray(columns, dtype=np.int64), table[rows, columns]


_STARTS8, _COLUMNS8, _VALUES8 = _sparse(_A8)
_STARTS_E, _COLUMNS_E, _VALUES_E = _sparse(_E8)


@contracted_inline
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


@contracted_inline
def _stage(p, s, t, h, y, u, stage, slope):
    """State and slope of stage `s` of the 8(5,3) pair."""
    width = padded(p.n)
    for i in range(0, width, 4):
        a, b, c, d = _four((_COLUMNS8, _VALUES8), _STARTS8, s, slope, width, i)
        stage[i] = y[i] + h * a
        stage[i + 1] = y[i + 1] + h * b
        stage[i + 2] = y[i + 2] + h * c
        stage[i + 3] = y[i + 3] + h * d
    state_derivative(p, t + _C8[s] * h, stage, u, advance(slope, s * width))


@contracted_inline
def _excess(h, third, fifth, scale):
    """Error of a state over its scale, from the two estimates of the 8(5,3) pair."""
    size = math.sqrt(fifth * fifth + 0.01 * third * third)
    return h * fifth * fifth / size / scale if size > 0.0 else 0.0


@contracted_inline
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


@contracted_inline
def _powers(n, h, y, new, slope, powers):
    """Coefficients of the interpolant of a step, all sixteen slopes given."""
    width = padded(n)
    for i in range(n):
        rise = new[i] - y[i]
        powers[i] = rise
        powers[width + i] = h * slope[i] - rise
        powers[2 * width + i] = 2.0 * rise - h * (slope[_RESULT * width + i] + slope[i])
    for m in range(POWERS - 3):
        for i in range(0, width, 4):
            four = _four((_COLUMNS_E, _VALUES_E), _STARTS_E, 2 + m, slope, width, i)
            for j in range(4):
                powers[(3 + m) * width + i + j] = h * four[j]


@contracted_inline
def _interpolated(n, x, y, powers, out):
    """State at the part `x` of a step."""
    width = padded(n)
    for i in range(0, width, 4):
        a = b = c = d = 0.0
        for m in range(POWERS - 1, -1, -1):
            factor, at = (x if m % 2 == 0 else 1.0 - x), m * width + i
            a = (a + powers[at]) * factor
            b = (b + powers[at + 1]) * factor
            c = (c + powers[at + 2]) * factor
            d = (d + powers[at + 3]) * factor
        out[i] = y[i] + a
        out[i + 1] = y[i + 1] + b
        out[i + 2] = y[i + 2] + c
        out[i + 3] = y[i + 3] + d


@contracted_inline
def _wanted(h, worst):
    """The step whose error should be what is allowed, after one whose error is `worst` times that."""
    return h * min(
        _GROWTH,
        max(0.2, 0.9 * worst ** (-0.125) if worst > 0.0 else _GROWTH),
    )


@contracted
def across(p, t, step, h, tolerance, place, y, u, work, peak, observe, out):
    """Advance the state at `y` from step `place[0]` to step `place[1]` under one command, and write the samples between.

    The first slope is at `work` already; the sample of the first step is written, one every `place[2]` steps. Returns
    the step proposed for what follows.
    """
    n = p.n
    width = padded(n)
    first, last, stride = place
    slope = work
    stage = advance(work, STAGES8 * width)
    new = advance(stage, width)
    powers = advance(stage, 3 * width)
    length = (last - first) * step
    k = (first // stride + 1) * stride
    accelerated = reads_accelerations(p, observe)
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
        if not (worst <= 1.0 or taken <= SMALLEST_STEP * step or not worst < np.inf):
            if worst > _KINK:
                before = before if wall > done else taken
                wall, reach, h = done + taken, taken * worst**_OVER, 0.5 * taken
            continue
        if k < last and (k - first) * step <= done + taken:
            for s in range(_RESULT + 1, STAGES8):
                _stage(p, s, t + done, taken, y, u, stage, slope)
            _powers(n, taken, y, new, slope, powers)
        while k < last and (k - first) * step <= done + taken:
            _interpolated(n, ((k - first) * step - done) / taken, y, powers, stage)
            rate = advance(slope, width)  # the second slope is not needed any more
            if accelerated:
                state_derivative(p, t + (k - first) * step, stage, u, rate)
            write_sample(p, observe, out, k // stride, stage, advance(rate, p.n_dof), u)
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
