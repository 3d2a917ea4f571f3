"""The interpolating cubic spline of samples at equal steps, compiled: what a search evaluates at every correction of an encoder.

SciPy's `CubicSpline` builds and searches pieces of any length; at equal steps its equations have constant coefficients. The conditions at
the ends are its own, "not-a-knot": the first two pieces are one cubic, and the last two.

References:
    C. de Boor, A Practical Guide to Splines (2001), chapter IV.
"""

from __future__ import annotations

import numba
import numpy as np

from bench.arrays import Array
from bench.errors import ParameterError


def uniform_spline(samples: Array, step: float, at: Array) -> Array:
    """Values (n_columns, m), or (m,), at places of the cubic splines through columns of samples.

    Args:
        samples: (n, n_columns), or (n,), at 0, step, 2 step, …; four at least.
        step: Between samples.
        at: (m,) places, in the unit of the step; beyond the ends the outer pieces go on.

    Raises:
        ParameterError: There are less than four samples.
    """
    if len(samples) < 4:  # the first two pieces are one, and the last two
        raise ParameterError(f"{len(samples)} samples came; a cubic spline takes 4 at least")
    out = np.asarray(
        _interpolated(np.ascontiguousarray(np.atleast_2d(samples.T), dtype=np.float64), at / step)
    )
    return out[0] if samples.ndim == 1 else out


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _interpolated(columns: Array, at: Array) -> Array:
    """Values (k, m) at places (m,), in steps, of the splines through columns (k, n)."""
    k, n = columns.shape
    out = np.empty((k, len(at)))
    slopes, factors = np.empty(n), np.empty(n)
    for c in range(k):
        _slopes(columns[c], slopes, factors)
        for i in range(len(at)):
            piece = min(max(int(at[i]), 0), n - 2)
            s = at[i] - piece
            y, d = columns[c, piece], columns[c, piece + 1] - columns[c, piece]
            left, right = slopes[piece] - d, slopes[piece + 1] - d
            r = 1.0 - s
            out[c, i] = y + s * d + s * r * (r * left - s * right)
    return out


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _slopes(y: Array, slopes: Array, factors: Array) -> None:
    """Slopes s (n,) per step of the spline through values y (n,), of which s[i-1] + 4 s[i] + s[i+1] = 3 (y[i+1] - y[i-1])."""
    n = len(y)
    factors[0] = 2.0
    slopes[0] = 0.5 * (5.0 * (y[1] - y[0]) + (y[2] - y[1]))
    for i in range(1, n - 1):
        pivot = 1.0 / (4.0 - factors[i - 1])
        factors[i] = pivot
        slopes[i] = (3.0 * (y[i + 1] - y[i - 1]) - slopes[i - 1]) * pivot
    end = 0.5 * (5.0 * (y[n - 1] - y[n - 2]) + (y[n - 2] - y[n - 3]))
    slopes[n - 1] = (end - 2.0 * slopes[n - 2]) / (1.0 - 2.0 * factors[n - 2])
    for i in range(n - 2, -1, -1):
        slopes[i] -= factors[i] * slopes[i + 1]
