"""The monitor of a stream: whether its regressors are excited, and whether the start still rules an estimate."""

from __future__ import annotations

import math

import numpy as np

from bench.identification.layout import (
    CONDITION,
    COUNT,
    COUNT_BEFORE,
    EXCITATION_BACK,
    EXCITATION_LOST,
    EXCITED,
    HALF_IS_OVER,
    HALF_TIME,
    HALF_WINDOW,
    HALVES,
    LEVEL_FLOOR,
    MAX_PULL,
    MIN_EIGENVALUE,
    P0,
    PRIOR,
    REPORTED,
    REPORTS,
    SMALLEST,
    TRUSTED,
    UNEXCITED,
    fast,
    inlined,
    jit,
)


@fast
def add_to_gram(gram, phi):
    """Add phi phi^T to the lower triangle."""
    for i in range(phi.size):
        for j in range(i + 1):
            gram[i, j] += phi[i] * phi[j]


@jit
def judge_prior(h, theta, d, u, level, start, pull):
    """Whether the data rule every parameter; renews `pull`, how far the start still pulls each.

    In information form the estimate solves ``(Q + S) theta = Q start + S theta_data``, with what is left of the start's
    information, ``Q = q I / P0``, and P the inverse of ``Q + S``. So ``W = P Q`` is the weight of the start, and without it the
    estimate would stand at ``theta + (I - W)^-1 W (theta - start)``. The start rules where W has an eigenvalue of a half and more:
    it then knows more of some direction than the data do. Else each parameter's way from there is compared with the parameter, or
    with what would make it a term of `LEVEL_FLOOR` of the largest, if it is less: a parameter may be zero.
    """
    n = d.size
    weight = np.zeros((n, n))
    largest = 0.0
    if h[PRIOR] < 1e-200:  # a few thousand memories later; products of it would be slow, then zero
        h[PRIOR] = 0.0
    for i in range(n):
        largest = max(largest, abs(theta[i]) * level[i])
        for k in range(i + 1):
            total = 0.0
            for j in range(i, n):  # column j of U lies in row j, a one on its end
                total += (u[j, i] if j > i else 1.0) * (u[j, k] if j > k else 1.0) * d[j]
            weight[i, k] = total * h[PRIOR] / h[P0]
            weight[k, i] = weight[i, k]
    values, vectors = np.linalg.eigh(weight)
    if not values[n - 1] < 0.5:
        pull[:] = math.inf
        return False
    way = np.zeros(n)
    for j in range(n):
        along = 0.0
        for i in range(n):
            along += vectors[i, j] * (theta[i] - start[i])
        along *= values[j] / (1.0 - values[j])
        for i in range(n):
            way[i] += vectors[i, j] * along
    free = True
    for i in range(n):
        floor = h[LEVEL_FLOOR] * largest / level[i] if level[i] > 0.0 else 0.0
        scale = max(abs(theta[i]), floor)
        pull[i] = abs(way[i]) / scale if scale > 0.0 else 0.0
        free = free and pull[i] <= h[MAX_PULL]
    return free


@jit
def judge(h, theta, d, u, level, peak, gram, start, pull):
    """Smallest eigenvalue of the correlation of the regressor over the last two half windows; renews the report."""
    n = level.size
    count = h[COUNT] + h[COUNT_BEFORE]
    unexcited = 0
    matrix = np.zeros((n, n))
    for i in range(n):
        level[i] = math.sqrt(max(gram[0, i, i] + gram[1, i, i], 0.0) / max(count, 1.0))
        peak[i] = max(peak[i], level[i])
        if not level[i] > h[LEVEL_FLOOR] * peak[i]:
            unexcited += 1
    for i in range(n):
        for j in range(i + 1):
            scale = level[i] * level[j] * count
            value = (gram[0, i, j] + gram[1, i, j]) / scale if scale > 0.0 else 0.0
            matrix[i, j] = value
            matrix[j, i] = value
    values, _ = np.linalg.eigh(matrix)
    h[SMALLEST] = max(values[0], 0.0)
    h[CONDITION] = values[n - 1] / h[SMALLEST] if h[SMALLEST] > 0.0 else math.inf
    h[UNEXCITED] = unexcited
    excited = 1.0 if (unexcited == 0 and h[SMALLEST] >= h[MIN_EIGENVALUE] and count > n) else 0.0
    flag = REPORTED
    if excited == 0.0 and h[EXCITED] != 0.0:
        flag |= EXCITATION_LOST
    elif excited == 1.0 and h[EXCITED] == 0.0:
        flag |= EXCITATION_BACK
    h[EXCITED] = excited
    free = judge_prior(h, theta, d, u, level, start, pull)
    h[TRUSTED] = 1.0 if excited == 1.0 and free else 0.0
    h[REPORTS] += 1.0
    return flag


@inlined
def watch_half(h, step):
    """Whether a half window is over, as a flag."""
    h[HALF_TIME] += step
    if h[HALF_TIME] < h[HALF_WINDOW]:
        return 0
    h[HALF_TIME] = 0.0
    return HALF_IS_OVER


@jit
def turn(h, theta, d, u, level, peak, gram, start, pull):
    """Turn the half windows; a report comes with every half, the first when the window is full."""
    h[HALVES] += 1.0
    flag = 0
    if h[HALVES] >= 2.0:
        flag = judge(h, theta, d, u, level, peak, gram, start, pull)
    h[COUNT_BEFORE] = h[COUNT]
    h[COUNT] = 0.0
    for i in range(level.size):
        for j in range(i + 1):
            gram[1, i, j] = gram[0, i, j]
            gram[0, i, j] = 0.0
    return flag
