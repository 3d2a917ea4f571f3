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
    forward = _divergence(
        contrast.square, contrast.score_second, contrast.fisher_first, contrast.fisher_second, contrast.cross
    )
    backward = _divergence(
        contrast.square,
        contrast.score_first,
        contrast.fisher_second,
        contrast.fisher_first,
        np.swapaxes(contrast.cross, -1, -2),
    )
    return 0.5 * (forward + backward)


def _divergence(square: NDArray, score: NDArray, true: NDArray, rival: NDArray, cross: NDArray) -> NDArray:
    """``KL(true | rival)``; `score` is ``J_rival' r`` and `cross` is ``J_true' J_rival``."""
    eye = np.eye(true.shape[-1])
    inner = eye + rival
    solved = np.linalg.solve(
        inner, np.concatenate([score[..., None], rival, np.swapaxes(cross, -1, -2)], axis=-1)
    )
    p = true.shape[-1]
    quadratic = square - np.einsum("...i,...i->...", score, solved[..., 0])
    trace = (
        np.trace(true, axis1=-2, axis2=-1)
        - np.trace(solved[..., 1 : 1 + p], axis1=-2, axis2=-1)
        - np.einsum("...ij,...ji->...", cross, solved[..., 1 + p :])
    )
    return 0.5 * (quadratic + trace - np.linalg.slogdet(eye + true)[1] + np.linalg.slogdet(inner)[1])


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
