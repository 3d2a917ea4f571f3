"""Cubic B-splines of equal pieces from -1 to 1: one value within a compiled law, many values, and the spline through given ones."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from scipy.interpolate import BSpline

from bench.arrays import Array

_inline: Any = numba.njit(error_model="numpy", nogil=True, forceinline=True)


@_inline
def spline_weights(s):
    """Weights, times six, of the four coefficients that a piece depends on; `s` runs from 0 to 1 over it."""
    r = 1.0 - s
    first, last = r * r * r, s * s * s
    return first, 3.0 * last - 6.0 * s * s + 4.0, 3.0 * first - 6.0 * r * r + 4.0, last


@_inline
def piece(u, pieces):
    """The piece that a place falls into, which counts from 0 to `pieces`."""
    return min(max(int(u), 0), pieces - 1)


@_inline
def cubic(theta, start, pieces, u):
    """Value at `u`, from 0 to `pieces`, of the spline whose pieces + 3 coefficients stand in `theta` from `start` on."""
    k = piece(u, pieces)
    a, b, c, d = spline_weights(u - k)
    k += start
    return (a * theta[k] + b * theta[k + 1] + c * theta[k + 2] + d * theta[k + 3]) / 6.0


def spline_of(coefficients: Array) -> BSpline:
    """The spline with these coefficients (pieces + 3, …), for many places at once."""
    return BSpline(_knots(len(coefficients) - 3), coefficients, 3)


def spline_through(x: Array, y: Array, pieces: int) -> Array:
    """Coefficients (pieces + 3, …) of the spline nearest to values (n, …) at places (n,) from -1 to 1."""
    design = np.asarray(BSpline.design_matrix(x, _knots(pieces), 3).toarray(), dtype=np.float64)
    return np.asarray(np.linalg.lstsq(design, y, rcond=None)[0], dtype=np.float64)


def _knots(pieces: int) -> Array:
    return np.asarray(-1.0 + 2.0 / pieces * np.arange(-3, pieces + 4), dtype=np.float64)
