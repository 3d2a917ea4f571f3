"""Windows of time in which a force acts: steps of the force that a record lacks.

The missing force along the measured motion is cut into pieces of constant level, as many as pay (optimal partitioning of block
means; the price of a piece is that of its two numbers under the noise of the force, `price`). Pieces whose level stands out are
windows; their edges are set where the area under the measured force says, to a fraction of a sample.

References:
    B. Jackson et al., An algorithm for optimal partitioning of data on an interval, IEEE Signal Processing Letters 12 (2005) 105-108.
    R. Killick, P. Fearnhead, I. A. Eckley, J. Am. Stat. Assoc. 107 (2012) 1590-1598 (penalised cost).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.settings import DEFAULT, SearchSettings
from bench.discrepancy.simulation.stick_slip import Motion


class TimeWindows(NamedTuple):
    """Windows of one record.

    Attributes:
        start: (k,) [s], on the clock of the record.
        duration: (k,) [s].
        level: (k,) external force in each.
    """

    start: Array
    duration: Array
    level: Array

    def inside(self, time: Array) -> Array:
        """Force (n,) at times (n,)."""
        out = np.zeros(len(time))
        for start, duration, level in zip(*self, strict=True):
            out[(time >= start) & (time < start + duration)] = level
        return out


def windows_of(time: Array, force: Array, *, settings: SearchSettings = DEFAULT.search) -> TimeWindows | None:
    """Windows in a missing force.

    Args:
        time: (n,), uniform.
        force: (n,) external force that the model lacks.
        settings: `SearchSettings` of the diagnosis.

    Returns:
        The windows; None where pieces of constant force are no description of it.
    """
    factor = -(-len(force) // settings.timed.blocks)
    count = len(force) // factor
    means = force[: count * factor].reshape(count, factor).mean(axis=1)
    jumps = np.diff(means)
    variance = float((np.median(np.abs(jumps - np.median(jumps))) / 0.6745) ** 2 / 2.0)
    price = settings.timed.price * np.log(count) * max(variance, 1e-6 * float(np.var(means)))
    cuts = np.zeros(count + 1, dtype=np.int64)
    _partition(means, price, settings.timed.shortest, cuts)
    edges = [count]
    while edges[-1] > 0:
        edges.append(int(cuts[edges[-1]]))
    return _standing_out(time, force, [factor * edge for edge in reversed(edges)], factor, settings=settings)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _partition(means, price, shortest, cuts):
    """Where the last piece before each block begins, in the partition of least sum of squares plus a price for each piece."""
    n = means.shape[0]
    sums = np.zeros(n + 1)
    squares = np.zeros(n + 1)
    best = np.full(n + 1, np.inf)
    best[0] = -price
    for k in range(n):
        sums[k + 1] = sums[k] + means[k]
        squares[k + 1] = squares[k] + means[k] * means[k]
    for stop in range(shortest, n + 1):
        for start in range(stop - shortest + 1):
            total = sums[stop] - sums[start]
            cost = best[start] + squares[stop] - squares[start] - total * total / (stop - start) + price
            if cost < best[stop]:
                best[stop] = cost
                cuts[stop] = start


def _standing_out(
    time: Array, force: Array, edges: list[int], factor: int, *, settings: SearchSettings
) -> TimeWindows | None:
    """The pieces between edges whose level stands out, their edges refined; None where there are none or they explain little."""
    edges, levels, opened = _merged(force, edges, settings=settings)
    if not np.any(opened) or np.all(opened) or not _sudden(force, edges, levels, settings=settings):
        return None
    found = []
    for i in np.flatnonzero(opened):
        before = levels[i - 1] if i > 0 else levels[i]
        after = levels[i + 1] if i + 1 < len(levels) else levels[i]
        start = _edge(time, force, edges[i], before, levels[i], factor)
        stop = _edge(time, force, edges[i + 1], levels[i], after, factor)
        found.append((start, stop - start, levels[i]))
    windows = TimeWindows(*(np.array(column) for column in zip(*found, strict=True)))
    left = float(np.sum((force - windows.inside(time)) ** 2))
    return windows if left < (1.0 - settings.timed.share) * float(np.sum(force**2)) else None


def _merged(
    force: Array, edges: list[int], *, settings: SearchSettings
) -> tuple[list[int], Array, NDArray[np.bool_]]:
    """Edges of pieces, neighbours of like force and those that do not stand out made one; their levels, and whether they stand out."""
    levels = [float(np.median(force[a:b])) for a, b in pairwise(edges)]
    largest = max((abs(level) for level in levels), default=0.0)
    kept, out, opened = [edges[0]], [], []
    for stop, level in zip(edges[1:], levels, strict=True):
        stands = abs(level) > settings.timed.stands_out * largest
        if (
            out
            and stands == opened[-1]
            and (not stands or abs(level - out[-1]) < settings.timed.stair * abs(out[-1]))
        ):
            kept[-1] = stop
            out[-1] = float(np.median(force[kept[-2] : stop]))
            continue
        kept.append(stop)
        out.append(level)
        opened.append(stands)
    return kept, np.array(out), np.array(opened)


def _sudden(force: Array, edges: list[int], levels: Array, *, settings: SearchSettings) -> bool:
    """Whether most of the edges are steep."""
    steepness = []
    for i in range(1, len(levels)):
        before, after = levels[i - 1], levels[i]
        first, last = (edges[i - 1] + edges[i]) // 2, (edges[i] + edges[i + 1]) // 2
        height = (force[first:last] - before) / (after - before)
        inside = np.count_nonzero(
            (height > settings.timed.edge_middle[0]) & (height < settings.timed.edge_middle[1])
        )
        steepness.append(
            inside / (settings.timed.edge_middle[1] - settings.timed.edge_middle[0]) / (last - first)
        )
    return float(np.median(steepness)) < settings.timed.sudden


def _edge(time: Array, force: Array, edge: int, before: float, after: float, factor: int) -> float:
    """Time at which a step from one level to another has the area of the measured force about it."""
    step = time[1] - time[0]
    reach = 2 * factor + 2
    if edge == 0 or edge >= len(force) or before == after:
        return float(time[0] - step if edge == 0 else time[-1] + step)
    first, last = max(edge - reach, 0), min(edge + reach, len(force))
    share = np.clip((force[first:last] - before) / (after - before), -0.5, 1.5)
    return float(
        np.clip(time[first] + step * (last - first - 0.5 - np.sum(share)), time[first], time[last - 1])
    )


def follows_motion(
    windows: TimeWindows, time: Array, motion: Motion, row: Array, *, settings: SearchSettings
) -> bool:
    """Whether windows open and close with the motion along a coordinate (n_dof,), so that they are no matter of time."""
    inside = windows.inside(time)
    position, velocity, acceleration = (samples @ row for samples in motion)
    for signal in (position, velocity, acceleration):
        for shape in (signal, np.sign(signal), np.abs(signal)):
            if np.std(shape) > 0.0 and abs(np.corrcoef(inside, shape)[0, 1]) > settings.timed.follows_motion:
                return True
    return False
