"""Samples that a logger made up: single outliers, and short dropouts in which a channel reads zero or holds its last value.

A sample is predicted by the cubic through its two neighbours on either side. Where one channel is off by many times what is usual about
it, and goes on as if nothing had been once a few samples are taken out, these were never measured. What several channels show at
once, what happens over and over in a record (impacts, switching), and what does not heal (a step) belongs to the record.

References:
    F. R. Hampel, J. Am. Stat. Assoc. 69 (1974) 383-393 (departures in units of the median of absolute ones).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.arrays import Array


@dataclass(frozen=True)
class OutlierSettings:
    """What counts as an outlier.

    Attributes:
        clear: Departure of a sample from its neighbours, in robust standard deviations of what is usual about it: white noise never
            comes there, and what has corners (bursts that begin, reversals of friction) does by a little.
        large: The same as a part of the channel's standard deviation; what is smaller than this does no harm.
        healed: Part of `clear` that may be left once the samples are taken out.
        aside: Part of its departure by which a sample is off from either side's own course, too.
        block: Samples over which what is usual is taken.
        longest: Successive samples that are taken out at most where they are no hold: what lasts longer may have been.
        longest_hold: The same of a hold.
        most: Part of a record that outliers are at most; and their number, in a short one. What is more frequent belongs to it.
        fewest: That number.
    """

    clear: float = 12.0
    large: float = 0.1
    healed: float = 0.4
    aside: float = 0.5
    block: int = 256
    longest: int = 1
    longest_hold: int = 10
    most: float = 5e-4
    fewest: int = 3


SETTINGS = OutlierSettings()


class OutlierRun(NamedTuple):
    """Successive samples, the last one included."""

    first: int
    last: int


def outliers(values: Array, settings: OutlierSettings = SETTINGS) -> list[list[OutlierRun]]:
    """Runs of samples of each channel that were never measured.

    Args:
        values: Samples on a uniform clock, ``(n, n_channels)``.
        settings: What counts as one.

    Returns:
        One list a channel.
    """
    n, count = values.shape
    if n < settings.block:
        return [[] for _ in range(count)]
    size = [_departure(column, settings) for column in values.T]
    found = [_runs(column, own, settings) for column, own in zip(values.T, size, strict=True)]
    alone: list[list[OutlierRun]] = []
    for c, runs in enumerate(found):
        column, others = values[:, c], [size[k] for k in range(count) if k != c]
        kept = [run for run in runs if _held(column, run) or not _shared(run, others, settings)]
        few = len(kept) <= max(settings.fewest, settings.most * n)
        alone.append([run for run in kept if few and (_held(column, run) or _aside(column, run, settings))])
    return alone


def bridged(column: Array, runs: Sequence[OutlierRun]) -> Array:
    """A channel (n,) with some runs of samples interpolated from their neighbours by cubics."""
    out = column.copy()
    for run in runs:
        _bridge(out, run)
    return out


def _expected(column: Array) -> Array:
    """Each sample (n - 4,) as the cubic through its neighbours has it, from the third to the last but two."""
    return (4.0 * (column[1:-3] + column[3:-1]) - column[:-4] - column[4:]) / 6.0


def _departure(column: Array, settings: OutlierSettings) -> Array:
    """Departure (n,) of each sample from its neighbours, one where it is `clear`."""
    n, off = len(column), np.zeros(len(column))
    spread = float(np.std(column))
    off[2:-2] = np.abs(column[2:-2] - _expected(column))
    blocks = np.array_split(off, max(n // settings.block, 1))
    usual = np.array([1.4826 * np.median(block) for block in blocks])
    padded = np.pad(usual, 1, mode="edge")
    usual = np.max([padded[:-2], padded[1:-1], padded[2:]], axis=0)
    least = np.repeat(usual, [len(block) for block in blocks]) * settings.clear
    return off / np.maximum(np.maximum(least, settings.large * spread), 1e-300)


def _runs(column: Array, size: Array, settings: OutlierSettings) -> list[OutlierRun]:
    """Runs of one channel that heal once they are taken out."""
    at = np.flatnonzero(size > 1.0)
    if len(at) == 0:
        return []
    limit = np.divide(np.abs(column - _smooth(column)), size, out=np.zeros(len(column)), where=size > 0.0)
    out = []
    for cluster in np.split(at, np.flatnonzero(np.diff(at) > settings.longest_hold + 3) + 1):
        low, high = int(cluster[0]), int(cluster[-1])
        tried = [
            OutlierRun(k, k + length - 1)
            for length in range(1, settings.longest + 1)
            for k in range(low, high + 2 - length)
        ]
        hold = _hold_within(column, low, high, settings.longest_hold)
        tried += [hold] if hold is not None and hold.last - hold.first < settings.longest_hold else []
        healed = [run for run in tried if _heals(column, run, float(limit[cluster].max()), settings)]
        if healed:
            out.append(min(healed, key=lambda run: (not _held(column, run), run.last - run.first)))
    return out


def _smooth(column: Array) -> Array:
    out = column.copy()
    out[2:-2] = _expected(column)
    return out


def _heals(column: Array, run: OutlierRun, limit: float, settings: OutlierSettings) -> bool:
    """Whether a channel goes on as if nothing had been without a run."""
    low, high = run.first - 6, run.last + 7
    if low < 0 or high > len(column):
        return False
    part = column[low:high].copy()
    _bridge(part, OutlierRun(run.first - low, run.last - low))
    return bool(np.max(np.abs(part[2:-2] - _expected(part))) < settings.healed * limit)


def _aside(column: Array, run: OutlierRun, settings: OutlierSettings) -> bool:
    """Whether a run is off from the straight course of either side by a good part of what it is off from the bridge between them."""
    bridge = bridged(column, [run])[run.first]
    before = 2.0 * column[run.first - 1] - column[run.first - 2] - column[run.first]
    after = 2.0 * column[run.last + 1] - column[run.last + 2] - column[run.last]
    return bool(min(abs(before), abs(after)) > settings.aside * abs(column[run.first] - bridge))


def _bridge(column: Array, run: OutlierRun) -> None:
    """Replace a run by the cubic through two samples on either side, in place."""
    known = np.array([run.first - 2, run.first - 1, run.last + 1, run.last + 2])
    inside = np.arange(run.first, run.last + 1)
    if known[0] < 0 or known[-1] >= len(column):
        column[inside] = column[np.clip(run.first - 1, 0, None)]
        return
    middle = 0.5 * (run.first + run.last)
    column[inside] = np.polyval(np.polyfit(known - middle, column[known], 3), inside - middle)


def _held(column: Array, run: OutlierRun) -> bool:
    """Whether all samples of a run are the same, or one that is exactly zero."""
    samples = column[run.first : run.last + 1]
    return bool(np.all(samples == samples[0]) and (len(samples) > 1 or samples[0] == 0.0))


def _hold_within(column: Array, low: int, high: int, reach: int) -> OutlierRun | None:
    """The longest run of equal samples about a cluster."""
    first, last = max(low - reach, 1), min(high + reach + 1, len(column) - 1)
    best = None
    k = first
    while k < last:
        end = k
        while end + 1 < last and column[end + 1] == column[k]:
            end += 1
        if end > k and (best is None or end - k > best.last - best.first):
            best = OutlierRun(k, end)
        k = end + 1
    return best


def _shared(run: OutlierRun, others: Sequence[Array], settings: OutlierSettings) -> bool:
    """Whether another channel departs from its neighbours at the same moment."""
    part = slice(max(run.first - 1, 0), run.last + 2)
    return any(float(np.max(size[part])) > settings.healed for size in others)
