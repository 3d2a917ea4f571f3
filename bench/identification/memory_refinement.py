"""Ranges, slip profiles and relaxation times of a joint with memory, by separable least squares through its own simulation.

The weights are solved for anew at every trial (`memory_terms.solve`), so that only what shapes the hidden states is searched. The
Jacobian is Kaufman's: the change of the force with each shape, less what the weights above zero can make up for. Hidden states of
different elements do not depend on each other, so one simulation with all elements changed alike gives the derivatives of all.

References:
    Golub & Pereyra 1973, SIAM J. Numer. Anal. 10(2); Kaufman 1975, BIT 15 (variable projection and its cheaper Jacobian).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr
from threadpoolctl import threadpool_limits

from bench.arrays import Array
from bench.identification.memory_terms import (
    MemoryRecord,
    MemoryTerms,
    fold,
    smoothness,
    solve,
    triangular,
    weighted_rows,
)


@dataclass(frozen=True)
class MemoryRefinementSettings:
    """Numbers of `bench.identification.memory_refinement`."""

    step: float = 1e-3
    samples: int = 6_000
    dampings: tuple[float, ...] = (1.0, 0.1, 10.0, 100.0)
    enough: float = 1e-4


SETTINGS = MemoryRefinementSettings()


class _Point(NamedTuple):
    terms: MemoryTerms
    matrix: Array  # columns and forces at the samples (n_rows, n_weights + 1)
    weights: Array
    loss: float


def refine_memory(
    terms: MemoryTerms, records: Sequence[MemoryRecord], spreads: Array, strength: float, steps: int
) -> tuple[MemoryTerms, int]:
    """The terms with better shapes, and the number of trials."""
    stride = max(1, sum(len(record.used) for record in records) // SETTINGS.samples)
    thinned = [record._replace(used=record.used[::stride]) for record in records]
    penalty = smoothness(terms, fold(terms, thinned, spreads), strength)
    with threadpool_limits(1, "blas"):
        at = _evaluate(terms, thinned, spreads, penalty)
        damping, trials = 0.1, 1
        for _ in range(steps):
            jacobian = _jacobian(at, thinned, spreads)
            residual = at.matrix[:, -1] - at.matrix[:, :-1] @ at.weights
            curvature, slope = jacobian.T @ jacobian, jacobian.T @ residual
            before = at
            for factor in SETTINGS.dampings:
                scaled = np.maximum(
                    np.diag(curvature), 1e-12 * max(float(np.max(np.diag(curvature))), 1e-300)
                )
                move = np.linalg.solve(curvature + damping * factor * np.diag(scaled), slope)
                trial = _evaluate(
                    _moved(at.terms, np.asarray(move, dtype=np.float64)), thinned, spreads, penalty
                )
                trials += 1
                if trial.loss < at.loss:
                    at, damping = trial, damping * factor * 0.5
                    break
            if at is before:
                break
            if before.loss - at.loss < SETTINGS.enough * before.loss:
                break
    return at.terms, trials


def _evaluate(terms: MemoryTerms, records: Sequence[MemoryRecord], spreads: Array, penalty: Array) -> _Point:
    blocks = [weighted_rows(terms, r, terms.states(r), r.used, spreads) for r in records]
    matrix = np.vstack(blocks)
    factor = triangular(matrix)
    weights = solve(factor, penalty)
    return _Point(terms, matrix, weights, factor.loss(weights) + float(np.sum((penalty @ weights) ** 2)))


def _shapes(terms: MemoryTerms) -> tuple[int, int, int]:
    """Numbers of ranges, of inner knots of all profiles and of relaxation times."""
    return len(terms.ranges), terms.profiles.size, len(terms.relaxation)


def _moved(terms: MemoryTerms, move: Array) -> MemoryTerms:
    """The terms after a move of the logarithms of ranges and times, and of the knots of profiles; no shape more than doubles."""
    n, g, _ = _shapes(terms)
    limited = np.clip(move, -np.log(2.0), np.log(2.0))
    profiles = terms.profiles + limited[n : n + g].reshape(terms.profiles.shape)
    return replace(
        terms,
        ranges=terms.ranges * np.exp(limited[:n]),
        profiles=np.clip(profiles, 0.0, 1.0),
        relaxation=terms.relaxation * np.exp(limited[n + g :]),
    )


def _jacobian(at: _Point, records: Sequence[MemoryRecord], spreads: Array) -> Array:
    """Change of the force with every shape, less what the weights above zero make up for (n_rows, n_shapes)."""
    terms = at.terms
    n, g, m = _shapes(terms)
    width, knots = terms.slip_width, terms.profiles.shape[1] if n else 0
    first = terms.layout.slip_start
    jacobian = np.zeros((len(at.matrix), n + g + m))
    kinds: list[
        tuple[Array, list[tuple[int, slice]]]
    ] = []  # a change of all shapes of a kind, and whose columns tell each
    slips = [slice(first + i * width, first + (i + 1) * width) for i in range(n)]
    moves = np.zeros((1 + knots + (m > 0), n + g + m))
    moves[0, :n] = SETTINGS.step
    kinds.append((moves[0], list(enumerate(slips))))
    for knot in range(knots):
        places = n + knot + knots * np.arange(n)
        # inwards, where a knot is at its upper bound
        moves[1 + knot, places] = np.where(
            terms.profiles[:, knot] > 1.0 - SETTINGS.step, -SETTINGS.step, SETTINGS.step
        )
        kinds.append((moves[1 + knot], list(zip(places.tolist(), slips, strict=True))))
    if m:
        moves[-1, n + g :] = SETTINGS.step
        start = first + n * width
        kinds.append((moves[-1], [(n + g + i, slice(start + i, start + i + 1)) for i in range(m)]))
    for move, owners in kinds:
        changed = _moved(terms, move)
        rows = np.vstack([weighted_rows(changed, r, changed.states(r), r.used, spreads) for r in records])
        for place, columns in owners:
            difference = rows[:, columns] - at.matrix[:, columns]
            jacobian[:, place] = difference @ at.weights[columns] / move[place]
    active = at.matrix[:, :-1][:, at.weights > 0.0]
    basis = np.asarray(qr(active, mode="economic")[0])
    return jacobian - basis @ (basis.T @ jacobian)
