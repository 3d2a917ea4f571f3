"""How much of what a joint may meet a motion has visited: states, and memory.

A reduced-order joint generalises to motions whose states and whose past its records held. Both are counted in tables of cells over
scaled features of the motion alone, so that neither the joint nor its force need be known:

| table | features | what it is for |
|---|---|---|
| states of axis i | displacement, velocity | springs, gaps, dampers |
| states of axes i and j | both displacements, both velocities | coupling |
| memory of axis i at range r | displacement, direction of motion, stop | friction and hysteresis that reverse over r |

The *stop* of range r follows the displacement between -r and r, ``e' = q'`` within and 0 at an end that is pushed against: whatever
rate-independent memory a joint has, of Preisach's kind, is a function of stops of all ranges (Krejci 1996).

The merit of a motion that has entered cell c of the tables n_c times is ``sum_c log(1 + n_c)`` [nat]. That is ``log det(I + F)``, the
merit of `bench.excitation.information`, for a joint of whose force nothing is known but that it is constant in each cell: as many
unknowns of unit prior variance as there are cells, and each entry one observation of that variance, since the force varies within a
cell about as much as from one to the next. Staying in a cell tells nothing new, nor does going to and fro between two of them, as
noise at an edge does; states beyond the range are not counted.

References:
    Krejci 1996, Hysteresis, Convexity and Dissipation in Hyperbolic Equations; Johnson, Moore and Ylvisaker 1990 and Pronzato and
    Mueller 2012, Statistics and Computing 22 (space-filling designs).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numba
import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.errors import ParameterError


@dataclass(frozen=True)
class CoverageSettings:
    """Numbers of `bench.excitation.coverage`.

    Attributes:
        states: Cells along each displacement and velocity, odd, so that rest lies amid one and noise does not leave it: a fifth of
            the half-range each, which tells the inside of a dead-space from its walls.
        stops: Cells along each stop, odd for the same reason: both ends, where it slips, the middle and two between.
        ranges: Ranges of the stops over the half-range of the displacement: reversals within a few counts of a sensor, and
            ones that take half the motion to forget, a factor of three to four apart.
        still: Speed over the half-range of the velocity below which a motion has no direction: three deviations of a velocity's
            noise on the environments' rigs.
    """

    states: int = 9
    stops: int = 5
    ranges: tuple[float, ...] = (0.04, 0.15, 0.5)
    still: float = 0.05

    def __post_init__(self) -> None:
        odd = all(count >= 3 and count % 2 for count in (self.states, self.stops))
        if not odd or not all(0.0 < r <= 1.0 for r in self.ranges) or not 0.0 <= self.still < 1.0:
            raise ParameterError(
                f"states {self.states}, stops {self.stops}, ranges {self.ranges} and still {self.still:g} came; odd numbers of at least "
                "3 cells, ranges in (0, 1] and a share below 1 are expected"
            )


class Coverage:
    """Books on what several motions of a joint have visited.

    Attributes:
        n_cells: Cells of all tables.
        merit: Merit of each motion so far (n,) [nat].
    """

    def __init__(
        self,
        displacement: Sequence[float],
        velocity: Sequence[float],
        n: int = 1,
        settings: CoverageSettings | None = None,
    ) -> None:
        """Open the books.

        Args:
            displacement: Half-range of each axis (k,) [m, rad].
            velocity: Half-range of each axis' rate (k,) [m/s, rad/s].
            n: Motions followed.
            settings: The tables.

        Raises:
            ParameterError: Half-ranges that are not positive, or not one of each an axis.
        """
        chosen = settings or CoverageSettings()
        half = np.array([displacement, velocity], dtype=float) if len(displacement) == len(velocity) else None
        if half is None or not half.size or not np.all(np.isfinite(half) & (half > 0.0)):
            raise ParameterError(
                f"half-ranges {displacement} and {velocity} came; a positive one of displacement and velocity each axis is expected"
            )
        k, r = half.shape[1], len(chosen.ranges)
        self._half = half
        self._ranges, self._still = np.array(chosen.ranges), chosen.still
        # features: displacements, velocities, directions, then the stops of each axis
        self._bins = np.array([chosen.states] * 2 * k + [3] * k + [chosen.stops] * k * r, dtype=np.int64)
        tables = [(i, k + i, -1, -1) for i in range(k)]
        tables += [(i, j, k + i, k + j) for i, j in combinations(range(k), 2)]
        tables += [(i, 2 * k + i, 3 * k + i * r + m, -1) for i in range(k) for m in range(r)]
        self._tables = np.array(tables, dtype=np.int64)
        sizes = [int(np.prod([self._bins[f] for f in table if f >= 0])) for table in tables]
        self._starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self.n_cells = int(self._starts[-1])
        self._counts = np.zeros((n, self.n_cells), dtype=np.int32)
        self._recent = np.full((n, len(tables), 2), -1, dtype=np.int64)
        self._stops = np.zeros((n, k, r))
        self._last = np.zeros((n, k))
        self.merit = np.zeros(n)

    def begin(self, places: NDArray[np.int64]) -> None:
        """Start some motions anew, at rest at zero, with nothing visited."""
        self._counts[places] = 0
        self.merit[places] = 0.0
        self.rest(places)

    def rest(self, places: NDArray[np.int64]) -> None:
        """A new record of some motions begins, at rest at zero; what was visited stays."""
        self._recent[places] = -1
        self._stops[places], self._last[places] = 0.0, 0.0

    def visited(self) -> Array:
        """Share of the cells that each motion has visited (n,) [1]."""
        return np.mean(self._counts > 0, axis=1)

    def take(self, places: NDArray[np.int64], displacement: Array, velocity: Array) -> Array:
        """Follow some motions further.

        Args:
            places: Motions (m,).
            displacement: Displacements (m, n_samples, k) [m, rad].
            velocity: Velocities (m, n_samples, k) [m/s, rad/s].

        Returns:
            Growth of the merit (m,) [nat].
        """
        k = self._half.shape[1]
        if displacement.shape != velocity.shape or displacement.shape[::2] != (len(places), k):
            raise ParameterError(
                f"displacements {displacement.shape} and velocities {velocity.shape} came; ({len(places)}, n_samples, {k}) are expected"
            )
        q = np.ascontiguousarray(displacement / self._half[0])
        v = np.ascontiguousarray(velocity / self._half[1])
        books = (self._counts, self._recent, self._stops, self._last)
        growth = _follow(
            np.asarray(places, dtype=np.int64), q, v, self._ranges, self._still, self._bins, self._tables, self._starts, *books
        )  # fmt: skip
        self.merit[places] += growth
        return growth

    def most_covering(
        self, motions: Sequence[tuple[Array, Array]], n: int, *, after: Sequence[tuple[Array, Array]] = ()
    ) -> tuple[int, ...]:
        """Records that together visit most, chosen one after the other: each the one that adds most to those before it.

        The merit has diminishing returns (it is submodular), so that this keeps at least 1 - 1/e of the best choice's growth
        (Nemhauser, Wolsey and Fisher 1978). The books are those of one motion, begun anew; they end with what was chosen.

        Args:
            motions: Displacements and velocities (n_samples, k) of each candidate, from rest.
            n: How many to choose.
            after: Records that are there already.

        Returns:
            Places among the candidates, in the order chosen.

        Raises:
            ParameterError: More are asked for than there are candidates, or the books are of several motions.
        """
        if not 0 <= n <= len(motions) or len(self.merit) != 1:
            raise ParameterError(
                f"{n} of {len(motions)} records were asked for, with books on {len(self.merit)} motion(s); no more than there are, and "
                "books on one, are expected"
            )
        only = np.zeros(1, dtype=np.int64)
        self.begin(only)
        for motion in after:
            self._record(motion)
        chosen: list[int] = []
        for _ in range(n):
            counts, merit = self._counts.copy(), self.merit.copy()
            gains = np.full(len(motions), -np.inf)
            for i in (i for i in range(len(motions)) if i not in chosen):
                gains[i] = self._record(motions[i])
                self._counts[:], self.merit[:] = counts, merit
            chosen.append(int(np.argmax(gains)))
            self._record(motions[chosen[-1]])
        return tuple(chosen)

    def _record(self, motion: tuple[Array, Array]) -> float:
        """Growth of the merit by a further record of the only motion."""
        only = np.zeros(1, dtype=np.int64)
        self.rest(only)
        return float(self.take(only, motion[0][None], motion[1][None])[0])


@numba.njit(cache=True, error_model="numpy")
def _follow(places, q, v, ranges, still, bins, tables, starts, counts, recent, stops, last):
    """Growth of the merit (m,) along scaled motions (m, n, k); books are written."""
    m, n, k = q.shape
    r = len(ranges)
    growth = np.zeros(m)
    features = np.zeros(len(bins))
    for row in range(m):
        place = places[row]
        for sample in range(n):
            for i in range(k):
                x = q[row, sample, i]
                features[i] = x
                features[k + i] = v[row, sample, i]
                speed = abs(v[row, sample, i])
                features[2 * k + i] = 0.0 if speed <= still else np.sign(v[row, sample, i])
                for j in range(r):
                    e = min(max(stops[place, i, j] + x - last[place, i], -ranges[j]), ranges[j])
                    stops[place, i, j] = e
                    features[3 * k + i * r + j] = e / ranges[j]
                last[place, i] = x
            for table in range(len(tables)):
                cell = _cell(features, bins, tables[table])
                here, before = recent[place, table]
                if cell < 0 or cell == here:
                    continue
                recent[place, table, 0], recent[place, table, 1] = cell, here
                if cell == before:
                    continue
                at = starts[table] + cell
                counts[place, at] += 1
                growth[row] += np.log((1.0 + counts[place, at]) / counts[place, at])
    return growth


@numba.njit(cache=True, error_model="numpy", inline="always")
def _cell(features, bins, table):
    """Cell of a table that features lie in; -1 where one of them lies beyond its range."""
    cell = 0
    for place in range(len(table)):
        feature = table[place]
        if feature < 0:
            break
        x = features[feature]
        if not -1.0 <= x <= 1.0:
            return -1
        count = bins[feature]
        cell = cell * count + min(int(0.5 * (x + 1.0) * count), count - 1)
    return cell
