"""The force of a joint with memory as a sum of non-negative weights times columns, and the weights by least squares.

Given the ranges and profiles of its slip elements, the hidden states of a joint with memory follow from the motion alone, and its
force is linear in all other parameters, whose bounds are zero: the best weights are those of a convex problem, non-negative least
squares. Samples are folded into a triangular factor block by block, so that the number of weights, not of samples, sets the cost.

References:
    Lawson & Hanson 1974, Solving Least Squares Problems, ch. 23; Golub & Pereyra 1973 (separable least squares).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeqrf  # pyrefly: ignore[missing-module-attribute]
from scipy.optimize import nnls
from threadpoolctl import threadpool_limits

from bench.arrays import Array
from bench.laws.evaluate import evaluate
from bench.laws.memory import memory_law
from bench.laws.memory_layout import Direction, MemoryLayout


@dataclass(frozen=True)
class MemoryTermsSettings:
    """Numbers of `bench.identification.memory_terms`."""

    block: int = 4096


SETTINGS = MemoryTermsSettings()


class MemoryRecord(NamedTuple):
    """One record of a joint: what it is fitted to."""

    time: Array  # [s] (n,)
    displacement: Array  # (n, k)
    velocity: Array  # (n, k)
    force: Array  # (n, k)
    acceleration: Array  # (n, k), or (n, 0) where the mass is known
    used: NDArray[np.int64]  # samples fitted


@dataclass(frozen=True)
class MemoryTerms:
    """A layout with what its force is not linear in, and whether the limits of its slip elements may differ.

    Attributes:
        layout: The layout.
        ranges: Range of each slip element (n_slips,) [unit of s].
        profiles: Inner knots of each slip profile (n_slips, max(profile - 1, 0)) [1].
        relaxation: Relaxation time of each Maxwell element (n_maxwells,) [s].
        unequal: Whether the limits of the slip elements may be unequal.
        n_masses: Masses to be found along with the joint: as many as it has coordinates, or none.
        substeps: Integration steps of the hidden states a sample.
    """

    layout: MemoryLayout
    ranges: Array
    profiles: Array
    relaxation: Array
    unequal: bool = False
    n_masses: int = 0
    substeps: int = 1

    def theta(self, stiffness: float = 0.0) -> Array:
        """Parameters with all weights at `stiffness` (n_parameters,): enough to integrate the hidden states."""
        layout = self.layout
        slips = [
            np.concatenate([[r, 0.5], np.full(layout.parts, stiffness), h])
            for r, h in zip(self.ranges, self.profiles, strict=True)
        ]
        maxwells = [np.array([stiffness, tau]) for tau in self.relaxation]
        return np.concatenate([np.full(layout.slip_start, stiffness), *slips, *maxwells])

    def states(self, record: MemoryRecord) -> Array:
        """Hidden states along a record (n, n_states), from rest."""
        law = memory_law(self.layout)
        if law.rate is None:
            return np.zeros((len(record.time), 0))
        motion = (record.time, record.displacement, record.velocity)
        return evaluate(law, self.theta(), *motion, substeps=self.substeps).states

    def columns(
        self, record: MemoryRecord, states: Array, rows: NDArray[np.int64]
    ) -> list[tuple[int, Array]]:
        """Direction and force along it of a unit of every weight, at some samples: (direction, (n_rows,)).

        Masses come last, with the direction -1 - i for coordinate i.
        """
        layout = self.layout
        q, v, z = record.displacement[rows], record.velocity[rows], states[rows]
        along = [q @ np.array(d.vector) for d in layout.directions]
        rates = [v @ np.array(d.vector) for d in layout.directions]
        found: list[tuple[int, Array]] = []
        for i in layout.potentials:
            found += [(i, column) for column in _cells(along[i], layout.directions[i], layout.cells)]
        for i, gate in layout.gated:
            d = layout.directions[gate]
            hats = _hats((along[gate] - d.low) / (d.high - d.low), layout.knots)
            found += [(i, hat * rates[i]) for hat in hats]
        for i in layout.speeds:
            hats = _hats(np.abs(rates[i]) / layout.directions[i].speed, layout.speed_knots)
            found += [(i, hat * rates[i]) for hat in hats]
        for m, (i, r) in enumerate(zip(layout.slips, self.ranges, strict=True)):
            found += [(i, column) for column in self._slip_columns(np.clip(z[:, m], -r, r), r)]
        for m, i in enumerate(layout.maxwells):
            found.append((i, z[:, len(layout.slips) + m]))
        return found + [(-1 - i, record.acceleration[rows, i]) for i in range(self.n_masses)]

    def _slip_columns(self, e: Array, r: float) -> list[Array]:
        parts = self.layout.parts
        size = 2.0 * r / parts
        ramps = [size * np.clip((e + r) / size - b, 0.0, 1.0) for b in range(parts)]
        if self.unequal:
            return ramps + [ramp - size for ramp in ramps]  # phi = 0, then phi = 1
        # limits alike and an odd force: a part and its mirror image share one stiffness
        half = [ramps[b] + ramps[parts - 1 - b] - size for b in range(parts // 2)]
        return half + ([ramps[parts // 2] - 0.5 * size] if parts % 2 else [])

    def parameters(self, weights: Array) -> Array:
        """Parameters of the law (n_parameters,) from the weights of the columns."""
        layout = self.layout
        theta, at = [weights[: layout.slip_start]], layout.slip_start
        for r, h in zip(self.ranges, self.profiles, strict=True):
            if self.unequal:
                up, down = weights[at : at + layout.parts], weights[at + layout.parts : at + 2 * layout.parts]
                whole = float(np.sum(up + down))
                k, phi = up + down, float(np.sum(down)) / whole if whole > 0.0 else 0.5
                at += 2 * layout.parts
            else:
                half = weights[at : at + (layout.parts + 1) // 2]
                k, phi = np.concatenate([half, half[: layout.parts // 2][::-1]]), 0.5
                at += len(half)
            theta += [np.array([r, phi]), k, h]
        for tau in self.relaxation:
            theta.append(np.array([weights[at], tau]))
            at += 1
        return np.concatenate(theta)

    def without(self, negligible: NDArray[np.bool_]) -> MemoryTerms:
        """The terms without those all of whose weights are negligible (n_weights,); directions stay."""
        layout, at = self.layout, 0

        def kept(count: int, width: int) -> list[int]:
            nonlocal at
            groups = negligible[at : at + count * width].reshape(count, width)
            at += count * width
            return np.flatnonzero(~np.all(groups, axis=1)).tolist()

        potentials = kept(len(layout.potentials), layout.cells)
        gated = kept(len(layout.gated), layout.knots)
        speeds = kept(len(layout.speeds), layout.speed_knots)
        slips = kept(len(layout.slips), self.slip_width)
        maxwells = kept(len(layout.maxwells), 1)
        smaller = replace(
            layout,
            potentials=tuple(layout.potentials[i] for i in potentials),
            gated=tuple(layout.gated[i] for i in gated),
            speeds=tuple(layout.speeds[i] for i in speeds),
            slips=tuple(layout.slips[i] for i in slips),
            maxwells=tuple(layout.maxwells[i] for i in maxwells),
        )
        return replace(
            self,
            layout=smaller,
            ranges=self.ranges[slips],
            profiles=self.profiles[slips],
            relaxation=self.relaxation[maxwells],
        )

    def n_weights(self) -> int:
        """Number of weights, masses included."""
        layout = self.layout
        return layout.slip_start + len(layout.slips) * self.slip_width + len(layout.maxwells) + self.n_masses

    @property
    def slip_width(self) -> int:
        """Weights of a slip element."""
        return 2 * self.layout.parts if self.unequal else (self.layout.parts + 1) // 2


class Factor(NamedTuple):
    """Samples folded into a triangular factor: ``|A w - y|^2 = |R w - b|^2 + rest``, for outputs of unit spread."""

    R: Array  # (n_weights, n_weights)
    b: Array  # (n_weights,)
    rest: float
    total: float  # sum of squares of y

    def loss(self, weights: Array) -> float:
        """Sum of squares that weights leave."""
        return float(np.sum((self.R @ weights - self.b) ** 2) + self.rest)


def fold(terms: MemoryTerms, records: Sequence[MemoryRecord], spreads: Array) -> Factor:
    """Fold the samples of records, each output over its spread (k,), into a triangular factor."""
    n_weights = terms.n_weights()
    factor = np.zeros((0, n_weights + 1))
    total = 0.0
    with threadpool_limits(1, "blas"):  # small products, which threads only slow down
        for record in records:
            states = terms.states(record)
            for start in range(0, len(record.used), SETTINGS.block):
                block = weighted_rows(
                    terms, record, states, record.used[start : start + SETTINGS.block], spreads
                )
                total += float(np.sum(block[:, -1] ** 2))
                factor = _triangle(np.vstack([factor, block]))
    return _factor(factor, total)


def triangular(matrix: Array) -> Factor:
    """Columns and forces (n_rows, n_weights + 1) as a triangular factor."""
    return _factor(_triangle(matrix.copy()), float(np.sum(matrix[:, -1] ** 2)))


def _factor(triangle: Array, total: float) -> Factor:
    n_weights = triangle.shape[1] - 1
    last = triangle[n_weights, -1] if len(triangle) > n_weights else 0.0
    padded = np.zeros((n_weights, n_weights + 1))
    padded[: min(len(triangle), n_weights)] = triangle[:n_weights]
    return Factor(padded[:, :-1], padded[:, -1], float(last**2), total)


def weighted_rows(
    terms: MemoryTerms, record: MemoryRecord, states: Array, rows: NDArray[np.int64], spreads: Array
) -> Array:
    """Columns of all weights, then the forces, at some samples, over the spreads of the outputs: (k n_rows, n_weights + 1)."""
    vectors = [np.array(d.vector) for d in terms.layout.directions]
    matrix = np.zeros((len(spreads), len(rows), terms.n_weights() + 1))
    for c, (place, column) in enumerate(terms.columns(record, states, rows)):
        if place < 0:
            matrix[-1 - place, :, c] = column / spreads[-1 - place]
            continue
        for o in np.flatnonzero(vectors[place]):
            matrix[o, :, c] = vectors[place][o] / spreads[o] * column
    matrix[:, :, -1] = (record.force[rows] / spreads).T
    return matrix.reshape(-1, terms.n_weights() + 1)


def _triangle(matrix: Array) -> Array:
    packed, *_ = dgeqrf(np.asfortranarray(matrix), overwrite_a=1)
    return np.triu(packed[: matrix.shape[1]])


def solve(factor: Factor, penalty: Array | None = None) -> Array:
    """Non-negative weights of least squares (n_weights,), with further rows that penalise them."""
    size = np.linalg.norm(factor.R, axis=0)
    size[size <= 1e-12 * size.max(initial=0.0)] = 0.0
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    matrix, right = factor.R * inverse, factor.b
    if penalty is not None:
        matrix = np.vstack([matrix, penalty * inverse])
        right = np.concatenate([right, np.zeros(len(penalty))])
    return nnls(matrix, right, maxiter=50 * matrix.shape[1])[0] * inverse


def smoothness(terms: MemoryTerms, factor: Factor, strength: float) -> Array:
    """Rows that penalise differences of neighbouring weights of a potential, a damping or a slip element.

    A difference counts as much as that share `strength` of what the term's largest column gives: relative to the data, so that no
    unit of force or length enters.
    """
    layout = terms.layout
    groups = [layout.cells] * len(layout.potentials) + [layout.knots] * len(layout.gated)
    groups += [layout.speed_knots] * len(layout.speeds)
    half = terms.slip_width // 2 if terms.unequal else terms.slip_width
    groups += [half] * (len(layout.slips) * (2 if terms.unequal else 1))
    size = np.linalg.norm(factor.R, axis=0)
    rows, at = [], 0
    for width in groups:
        scale = strength * float(size[at : at + width].max(initial=0.0))
        for b in range(at, at + width - 1):
            row = np.zeros(len(size))
            row[b], row[b + 1] = scale, -scale
            rows.append(row)
        at += width
    return np.array(rows).reshape(-1, len(size))


def _hats(x: Array, knots: int) -> list[Array]:
    """Piecewise linear functions that are 1 at one of the knots over [0, 1], the outermost constant beyond."""
    place = np.clip(x, 0.0, 1.0) * (knots - 1)
    return [np.clip(1.0 - np.abs(place - b), 0.0, None) for b in range(knots)]


def _cells(s: Array, direction: Direction, cells: int) -> list[Array]:
    """Overlap of each cell with the way from 0 to s; the first and the last cell reach to infinity."""
    edges = np.linspace(direction.low, direction.high, cells + 1)
    edges[0], edges[-1] = -np.inf, np.inf
    return [np.clip(s, a, b) - np.clip(0.0, a, b) for a, b in pairwise(edges)]
