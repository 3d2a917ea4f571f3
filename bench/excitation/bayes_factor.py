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
        triangle: Cholesky's factor of ``I + J' J`` of the rival ``(p, p)``.
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
    """Write Cholesky's factor of ``I + F``."""
    for j in range(fisher.shape[0]):
        for i in range(j, fisher.shape[0]):
            value = fisher[i, j] + (1.0 if i == j else 0.0)
            for k in range(j):
                value -= triangle[i, k] * triangle[j, k]
            triangle[i, j] = np.sqrt(value) if i == j else value / triangle[j, j]


@numba.njit(error_model="numpy")
def _quadratic(triangle, vector, row):
    """``v' (L L')^-1 v``, by forward substitution in the scratch `row`, which may be the vector itself."""
    total = 0.0
    for i in range(row.size):
        value = vector[i]
        for k in range(i):
            value -= triangle[i, k] * row[k]
        row[i] = value / triangle[i, i]
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
    p_max = contrast.cross.shape[2]
    a = np.zeros(p_max)
    b = np.zeros(p_max)
    for case in range(first, last):
        for pair in range(places.shape[1]):
            pa, pb = counts[case, pair, 0], counts[case, pair, 1]
            if pa < 0:
                break
            at, bt = places[case, pair, 0], places[case, pair, 1]
            for i in range(outputs.shape[2]):
                for c in range(outputs.shape[3]):
                    ya, yb = outputs[case, at, i, c], outputs[case, bt, i, c]
                    r = weights[c] * (ya - yb)
                    contrast.square[case, pair] += r * r
                    for j in range(pa):
                        a[j] = weights[c] * (outputs[case, at + 1 + j, i, c] - ya) / step
                        contrast.score_first[case, pair, j] += a[j] * r
                        for k in range(j + 1):
                            contrast.fisher_first[case, pair, j, k] += a[j] * a[k]
                    for j in range(pb):
                        b[j] = weights[c] * (outputs[case, bt + 1 + j, i, c] - yb) / step
                        contrast.score_second[case, pair, j] += b[j] * r
                        for k in range(j + 1):
                            contrast.fisher_second[case, pair, j, k] += b[j] * b[k]
                        for k in range(pa):
                            contrast.cross[case, pair, k, j] += a[k] * b[j]
            for j in range(p_max):
                for k in range(j):
                    contrast.fisher_first[case, pair, k, j] = contrast.fisher_first[case, pair, j, k]
                    contrast.fisher_second[case, pair, k, j] = contrast.fisher_second[case, pair, j, k]
