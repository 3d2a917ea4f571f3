"""Compiled loops of the stages with memory, for a whole record and for a single sample alike.

Each works on a block in place and leaves its memory in `state`, so that the split into blocks cannot show. numba is imported
here and nowhere else in the package: `bench.measurement.base.kernels` loads this module when a chain is first used.
"""

from __future__ import annotations

import numba


@numba.njit(cache=True, error_model="numpy", nogil=True)
def second_order_sections(x, sections, state):
    """Cascade of biquads in direct form II transposed, `sections` (n_sections, 6), `state` (n_sections, 2)."""
    for i in range(x.shape[0]):
        value = x[i]
        for s in range(sections.shape[0]):
            out = sections[s, 0] * value + state[s, 0]
            state[s, 0] = sections[s, 1] * value - sections[s, 4] * out + state[s, 1]
            state[s, 1] = sections[s, 2] * value - sections[s, 5] * out
            value = out
        x[i] = value


@numba.njit(cache=True, error_model="numpy", nogil=True)
def delay_line(x, coefficients, base, ring, position):
    """``y_k = sum_j coefficients[j] x_(k - base - j)`` from a ring of the last samples; `position` (1,) is the next place."""
    length = ring.shape[0]
    place = position[0]
    for i in range(x.shape[0]):
        ring[place] = x[i]
        value = 0.0
        for j in range(coefficients.shape[0]):
            value += coefficients[j] * ring[(place - base - j) % length]
        x[i] = value
        place = (place + 1) % length
    position[0] = place


@numba.njit(cache=True, error_model="numpy", nogil=True)
def first_order(x, pole, now, before, state):
    """``y_k = pole y_(k-1) + now x_k + before x_(k-1)``, `state` holds ``x_(k-1), y_(k-1)``."""
    previous, out = state[0], state[1]
    for i in range(x.shape[0]):
        out = pole * out + now * x[i] + before * previous
        previous = x[i]
        x[i] = out
    state[0], state[1] = previous, out


@numba.njit(cache=True, error_model="numpy", nogil=True)
def add_drift(x, slope, step, draws, count, walk):
    """Add ``slope k`` and the sum of ``step draws`` up to ``k``; `count` (1,) and `walk` (1,) go on between blocks."""
    k = count[0]
    offset = walk[0]
    for i in range(x.shape[0]):
        if k > 0:
            offset += step * draws[i]
        x[i] += slope * k + offset
        k += 1
    count[0] = k
    walk[0] = offset
