"""How well an excitation tells two rival effects apart: the expected log Bayes factor.

Each rival is a rig with uncertain parameters. About a draw its records are, to first order, normal with mean y and covariance
``S = I + J J'`` (whitened by the noise; the parameters' standardised prior has unit covariance), so that a difference which the
rival could make up by other parameters does not count. The log Bayes factor in favour of the truth then has the expectation of
a Kullback-Leibler divergence between two normal distributions,

``KL(A | B) = (r' S_B^-1 r + tr(S_B^-1 S_A) - n - log det S_A + log det S_B) / 2``, ``r = y_A - y_B``,

and with either rival as likely to be true, ``(KL(A | B) + KL(B | A)) / 2``. All of it comes from sums over the record
(`Contrast`), so that it grows window by window at constant cost.

References:
    Kass, Raftery 1995, "Bayes factors", J. American Statistical Association 90(430); Box, Hill 1967, "Discrimination among
    mechanistic models", Technometrics 9(1), eq. 9 (the expected divergence as design criterion).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.excitation.information import Sensitivity
from bench.excitation.products import difference, dot, tile
from bench.laws.calling import advance, pointer_at


class Contrast(NamedTuple):
    """Sums over a record that the divergences of pairs of rivals are made of; leading axes are cases and pairs."""

    square: NDArray[np.float64]  # (…) r'r
    score_first: NDArray[np.float64]  # (…, p) J_A' r
    score_second: NDArray[np.float64]  # (…, p) J_B' r
    fisher_first: NDArray[np.float64]  # (…, p, p) J_A' J_A
    fisher_second: NDArray[np.float64]  # (…, p, p) J_B' J_B
    cross: NDArray[np.float64]  # (…, p, p) J_A' J_B

    @classmethod
    def zeros(cls, *shape: int, parameters: int) -> Contrast:
        """Empty sums with leading axes `shape`."""
        p = parameters
        matrices = [np.zeros((*shape, p, p)) for _ in range(3)]
        return cls(np.zeros(shape), np.zeros((*shape, p)), np.zeros((*shape, p)), *matrices)


def expected_log_bayes_factor(contrast: Contrast) -> NDArray[np.float64]:
    """Expected log Bayes factor [nat] in favour of the true one of two rivals ``(…)``, each as likely to be true."""
    shape = contrast.square.shape
    flat = Contrast(
        *(np.ascontiguousarray(sums).reshape(1, -1, *sums.shape[len(shape) :]) for sums in contrast)
    )
    values = np.empty(flat.square.shape)
    weigh_contrast(0, 1, flat, values)
    return values.reshape(shape)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def weigh_contrast(first, last, contrast, values):
    """Write the expected log Bayes factors [nat] of the pairs of the cases ``first … last − 1``; NaN where a rig diverged.

    Args:
        first: First case.
        last: One past the last case.
        contrast: Sums with leading axes (n_cases, n_pairs).
        values: ``(n_cases, n_pairs)``, written.
    """
    p = contrast.cross.shape[2]
    triangle = np.zeros((p, p))
    row = np.zeros(p)
    for case in range(first, last):
        for pair in range(values.shape[1]):
            cross = contrast.cross[case, pair]
            fisher_a, fisher_b = contrast.fisher_first[case, pair], contrast.fisher_second[case, pair]
            _factorise(fisher_b, triangle)
            forward = _one_way(triangle, fisher_a, contrast.score_second[case, pair], cross, row)
            _factorise(fisher_a, triangle)
            backward = _one_way(triangle, fisher_b, contrast.score_first[case, pair], cross.T, row)
            # The logarithms of the determinants have opposite signs in the two divergences.
            values[case, pair] = 0.25 * (2.0 * contrast.square[case, pair] + forward + backward)


@numba.njit(error_model="numpy")
def _one_way(triangle, true, score, cross, row):
    """``tr(S^-1 S_true) - n - r'r + r' S^-1 r`` with S of the rival.

    Args:
        triangle: Cholesky's factor of ``I + J' J`` of the rival ``(p, p)``, as `_factorise` writes it.
        true: ``J' J`` of the true one ``(p, p)``.
        score: ``J_rival' r`` ``(p,)``.
        cross: ``J_true' J_rival`` ``(p, p)``.
        row: Scratch ``(p,)``.
    """
    p = row.size
    total = -_quadratic(triangle, score, row)
    for i in range(p):
        total += true[i, i] - _quadratic(triangle, cross[i], row)
        row[:] = 0.0
        row[i] = 1.0
        total += _quadratic(triangle, row, row) - 1.0  # less the trace of (I + J'J)^-1 J'J
    return total


@numba.njit(error_model="numpy")
def _factorise(fisher, triangle):
    """Write Cholesky's factor of ``I + F``, its diagonal inverted: multiplying is quicker than dividing."""
    for j in range(fisher.shape[0]):
        for i in range(j, fisher.shape[0]):
            value = fisher[i, j] + (1.0 if i == j else 0.0)
            for k in range(j):
                value -= triangle[i, k] * triangle[j, k]
            triangle[i, j] = 1.0 / np.sqrt(value) if i == j else value * triangle[j, j]


@numba.njit(error_model="numpy")
def _quadratic(triangle, vector, row):
    """``v' (L L')^-1 v``, by forward substitution in the scratch `row`, which may be the vector itself."""
    total = 0.0
    for i in range(row.size):
        value = vector[i]
        for k in range(i):
            value -= triangle[i, k] * row[k]
        row[i] = value * triangle[i, i]
        total += row[i] * row[i]
    return total


def contrast_of(first: Sensitivity, second: Sensitivity, noise: NDArray[np.float64]) -> Contrast:
    """The sums of a pair of records.

    Args:
        first: Record and derivatives of one rival.
        second: Of the other, under the same excitation and in the same channels.
        noise: Standard deviation of the channels' white noise ``(n_channels,)``.
    """
    p = max(first.jacobian.shape[-1], second.jacobian.shape[-1])
    rows = []
    for item in (first, second):
        flat = (item.jacobian / noise[:, None]).reshape(-1, item.jacobian.shape[-1])
        rows.append(np.pad(flat, ((0, 0), (0, p - flat.shape[1]))))
    r = ((first.output - second.output) / noise).ravel()
    a, b = rows
    return Contrast(np.asarray(r @ r), a.T @ r, b.T @ r, a.T @ a, b.T @ b, a.T @ b)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def accumulate_contrast(first, last, outputs, places, counts, step, weights, contrast):
    """Add records of perturbed rivals to `contrast`, for the cases ``first … last − 1``.

    Args:
        first: First case.
        last: One past the last case.
        outputs: Records ``(n_cases, n_members, n, n_channels)``.
        places: Members of the two rivals of each pair ``(n_cases, n_pairs, 2)``, each followed by its perturbed ones.
        counts: Their numbers of parameters ``(n_cases, n_pairs, 2)``; −1 for no pair.
        step: Step of the differences.
        weights: One over the noise standard deviations ``(n_channels,)``.
        contrast: Sums with leading axes (n_cases, n_pairs), added to.
    """
    outputs = np.ascontiguousarray(outputs)
    p_max, size = contrast.cross.shape[2], outputs.shape[2] * outputs.shape[3]
    room = np.empty((2 * p_max + 3, size))
    rows_a = pointer_at(room.ctypes.data)
    rows_b, residual = advance(rows_a, p_max * size), advance(rows_a, 2 * p_max * size)
    scale, weight = advance(residual, size), advance(residual, 2 * size)
    tile(weights, 1.0 / step, size, scale)
    tile(weights, 1.0, size, weight)
    for case in range(first, last):
        record = pointer_at(outputs.ctypes.data + 8 * size * outputs.shape[1] * case)
        for pair in range(places.shape[1]):
            pa, pb = counts[case, pair, 0], counts[case, pair, 1]
            if pa < 0:
                break
            ya = advance(record, size * places[case, pair, 0])
            yb = advance(record, size * places[case, pair, 1])
            difference(ya, yb, weight, size, residual)
            contrast.square[case, pair] += dot(residual, residual, size)
            score, fisher = contrast.score_first[case, pair], contrast.fisher_first[case, pair]
            _add_rival(ya, residual, scale, size, pa, rows_a, score, fisher)
            score, fisher = contrast.score_second[case, pair], contrast.fisher_second[case, pair]
            _add_rival(yb, residual, scale, size, pb, rows_b, score, fisher)
            cross = contrast.cross[case, pair]
            for k in range(pa):
                for j in range(pb):
                    cross[k, j] += dot(advance(rows_a, k * size), advance(rows_b, j * size), size)
    room[0, 0] = 0.0  # an array of which only the address is in use would be freed before


@numba.njit(error_model="numpy", nogil=True)
def _add_rival(record, residual, scale, size, p, rows, score, fisher):
    """Write the derivatives of one rival into `rows`, and add its score and information."""
    for j in range(p):
        row = advance(rows, j * size)
        difference(advance(record, (1 + j) * size), record, scale, size, row)
        score[j] += dot(row, residual, size)
        for k in range(j + 1):
            fisher[j, k] += dot(row, advance(rows, k * size), size)
            fisher[k, j] = fisher[j, k]
