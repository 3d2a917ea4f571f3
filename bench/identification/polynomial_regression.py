"""Terms of a polynomial at many states in blocks, and the least-squares fit of them by sequential QR.

The records are read in blocks and folded into one triangular factor (sequential QR), whose singular values give the
condition number and a minimum-norm solution: forming ``A'A`` would square the condition number, and the whole regressor
matrix of three 30 s records at 1 kHz and 256 terms would take 180 MB.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeqrf  # pyrefly: ignore[missing-module-attribute]
from threadpoolctl import threadpool_limits

from bench.laws.polynomial import Basis


@dataclass(frozen=True)
class PolynomialSettings:
    """Numbers of `bench.identification.polynomial_regression`."""

    block: int = 4096
    """Rows of a block."""
    around: int = 20
    """Points of the surroundings for each term: as many times over-determined as a record should be."""


SETTINGS = PolynomialSettings()


def in_blocks(array: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """The rows of an array, block by block."""
    for first in range(0, len(array), SETTINGS.block):
        yield array[first : first + SETTINGS.block]


def polynomial_terms(
    states: NDArray[np.float64],
    exponents: NDArray[np.int64],
    basis: Basis,
    centre: NDArray[np.float64],
    scale: NDArray[np.float64],
) -> Iterator[NDArray[np.float64]]:
    """The terms at all states, in blocks (up to `block`, n_terms)."""
    c = 1.0 if basis == "chebyshev" else 0.0
    orders = exponents.max(axis=0)
    for block in in_blocks(states):
        terms = np.ones((len(exponents), len(block)))
        for i, order in enumerate(orders):
            u = (block[:, i] - centre[i]) / scale[i]
            table = [np.ones_like(u), u]
            for _ in range(1, order):
                table.append((1.0 + c) * u * table[-1] - c * table[-2])
            terms *= np.array(table)[exponents[:, i]]
        yield terms.T


def solve_in_blocks(
    blocks: Iterator[NDArray[np.float64]],
    n_outputs: int,
    unknowns: int,
    ridge: float,
    rcond: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Least-squares solution (unknowns, n_outputs), singular values and rank, by sequential QR of regressors beside targets."""
    width = unknowns + n_outputs
    triangle = np.zeros((0, width))
    # One BLAS thread: OpenBLAS' own spin when another process is busy, which made this twenty times slower.
    with threadpool_limits(1, user_api="blas"):
        for block in blocks:
            stacked = np.vstack([triangle, block])
            factor = dgeqrf(np.asfortranarray(stacked), lwork=64 * width, overwrite_a=1)[0]
            triangle = np.triu(factor[:width])
        # Columns of unit norm: rank and condition then speak of the data, not of the units of the states.
        size = np.linalg.norm(triangle[:unknowns, :unknowns], axis=0)
        size = np.where(size > 0.0, size, 1.0)
        left, singular, right = np.linalg.svd(triangle[:unknowns, :unknowns] / size)
    projected = left.T @ triangle[:unknowns, unknowns:]
    kept = singular > rcond * singular[0]
    penalty = ridge * float(np.sum(singular**2)) / unknowns
    gains = np.where(kept, singular / np.where(kept, singular**2 + penalty, 1.0), 0.0)
    return (right.T @ (gains[:, None] * projected)) / size[:, None], singular, int(kept.sum())
