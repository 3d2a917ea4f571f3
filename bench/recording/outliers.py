"""Samples that a logger made up: single outliers, and short dropouts in which a channel reads zero or holds its last value.

A sample is predicted by the cubic through its two neighbours on either side. Where one channel is off by many times what is usual about
it, and goes on as if nothing had been once a few samples are taken out, these were never measured. What several channels show at
once, what happens over and over in a record (impacts, switching), and what does not heal (a step) belongs to the record. A channel
that changes with every sample, and jumps to a value that it holds, or jumps back from it, was not read meanwhile, however often.

References:
    F. R. Hampel, J. Am. Stat. Assoc. 69 (1974) 383-393 (departures in units of the median of absolute ones).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
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
        longest_dropout: The same of a hold that a jump leads to, or away from; what is longer is no gap that neighbours tell anything of.
        steady: Part of the changes from sample to sample that may be none in a channel that has dropouts: one that is held between its
            samples, or has coarse steps, stands still as a rule.
        abrupt: Changes of the sample before by which a jump is one: what friction stops comes to rest by changes that get smaller.
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
    longest_dropout: int = 64
    steady: float = 0.2
    abrupt: float = 2.0
    most: float = 1e-3
    fewest: int = 3


SETTINGS = OutlierSettings()


class OutlierRun(NamedTuple):
    """Successive samples, the last one included."""

    first: int
    last: int


def outliers(
    values: Array, settings: OutlierSettings = SETTINGS, *, asked: Collection[int] = ()
) -> list[list[OutlierRun]]:
    """Runs of samples of each channel that were never measured.

    Args:
        values: Samples on a uniform clock, ``(n, n_channels)``.
        settings: What counts as one.
        asked: Channels that hold what was asked for: a pause in them is none of the logger.

    Returns:
        One list a channel.
    """
    n, count = values.shape
    if n < settings.block:
        return [[] for _ in range(count)]
    lost = [[] if c in asked else dropouts(column, settings) for c, column in enumerate(values.T)]
    values = np.column_stack([bridged(column, runs) for column, runs in zip(values.T, lost, strict=True)])
    size = [_departure(column, settings) for column in values.T]
    found = [_runs(column, own, settings) for column, own in zip(values.T, size, strict=True)]
    alone: list[list[OutlierRun]] = []
    for c, runs in enumerate(found):
        column, others = values[:, c], [size[k] for k in range(count) if k != c]
        kept = [run for run in runs if _held(column, run) or not _shared(run, others, settings)]
        few = len(kept) <= max(settings.fewest, settings.most * n)
        alone.append([run for run in kept if few and (_held(column, run) or _aside(column, run, settings))])
    return [sorted((*more, *runs)) for more, runs in zip(lost, alone, strict=True)]


def dropouts(column: Array, settings: OutlierSettings = SETTINGS) -> list[OutlierRun]:
    """Runs of a channel (n,) that changes with every sample, in which it holds a value to which, or from which, it jumps.

    What it holds at an end of its range is clipped, and was there.
    """
    change = np.diff(column)
    still = change == 0.0
    if not still.any() or np.mean(still) > settings.steady:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    usual = 1.4826 * float(np.median(np.abs(np.diff(change))))
    least = max(settings.clear * usual, settings.large * float(np.std(column)))
    out = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if first > 1 and last < len(column) - 2 and last - first < settings.longest_dropout:
            away = abs(change[first - 1]) - settings.abrupt * abs(change[first - 2])
            back = abs(change[last]) - settings.abrupt * abs(change[last + 1])
            ranged = column[first] != 0.0 and column[first] in (column.min(), column.max())
            if max(away, back) > least and not ranged:
                out.append(OutlierRun(int(first), int(last)))
    return out


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
    """Replace a run by the cubic through as many samples as half of its own on either side, two at least, in place."""
    beside = np.arange(1, max(2, (run.last - run.first + 1) // 2) + 1)
    known = np.concatenate([run.first - beside[::-1], run.last + beside])
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
