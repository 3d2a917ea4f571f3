"""Inner products of records and their derivatives over a window: the compiled arithmetic that merits are sums of.

Everything is a C pointer, a record of n samples and c channels being one run of n c numbers: arrays of four indices took twice
as long as the arithmetic.
"""

from __future__ import annotations

import numba


@numba.njit(error_model="numpy", inline="always")
def tile(weights, factor, size, out):
    """Write the weights of the channels, times a factor, for every number of a record."""
    channels = weights.size
    for first in range(0, size, channels):
        for c in range(channels):
            out[first + c] = factor * weights[c]


@numba.njit(error_model="numpy", inline="always")
def difference(record, base, scale, size, out):
    """Write ``scale (record - base)``."""
    for s in range(size):
        out[s] = scale[s] * (record[s] - base[s])


@numba.njit(error_model="numpy", nogil=True, fastmath={"reassoc", "contract"})
def dot(a, b, size):
    """Inner product of two runs of numbers."""
    total = 0.0
    for s in range(size):
        total += a[s] * b[s]
    return total
