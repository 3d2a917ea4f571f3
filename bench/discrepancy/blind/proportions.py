"""Shares with their intervals, and how well stated probabilities agree with them.

Shares come with Wilson's interval, since most bands hold a few dozen cases.

References:
    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212 (interval).
    M. P. Naeini, G. F. Cooper, M. Hauskrecht, AAAI 2015 (expected calibration error).
    J. Bröcker, L. A. Smith, Weather and Forecasting 22 (2007) 651-661 (what a reliability diagram scatters by).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest


class Share(NamedTuple):
    """A share with its 95 % interval.

    Attributes:
        value: Hits over cases; NaN without cases.
        n: Number of cases.
        low, high: Ends of Wilson's interval.
    """

    value: float
    n: int
    low: float
    high: float


def share_of(hits: Iterable[bool]) -> Share:
    """Share of hits with Wilson's 95 % interval."""
    flags = list(hits)
    if not flags:
        return Share(math.nan, 0, math.nan, math.nan)
    found = binomtest(sum(flags), len(flags))
    low, high = found.proportion_ci(0.95, method="wilson")
    return Share(found.statistic, len(flags), float(low), float(high))


def reliability(hits: Sequence[tuple[float, bool]], bins: int = 10) -> list[tuple[float, float, int]]:
    """Bins of stated probability that hold a case: mean stated, share true, count."""
    if not hits:
        return []
    stated = np.array([p for p, _ in hits])
    true = np.array([h for _, h in hits], dtype=float)
    which = np.minimum((stated * bins).astype(int), bins - 1)
    return [
        (float(stated[which == b].mean()), float(true[which == b].mean()), int(np.sum(which == b)))
        for b in sorted(set(which.tolist()))
    ]


def calibration_error(hits: Sequence[tuple[float, bool]], bins: int = 10) -> float:
    """Expected calibration error: mean distance between stated and observed frequency, weighed by bin counts."""
    if not hits:
        return math.nan
    return float(sum(abs(stated - true) * n for stated, true, n in reliability(hits, bins)) / len(hits))


def calibration_interval(
    hits: Sequence[tuple[float, bool]], bins: int = 10, draws: int = 1000
) -> tuple[float, float]:
    """95 % interval of the expected calibration error: percentiles over names drawn with replacement.

    Args:
        hits: Stated probabilities, and whether they came true.
        bins: Bins.
        draws: Draws.
    """
    if not hits:
        return math.nan, math.nan
    picks = np.random.default_rng(0).integers(len(hits), size=(draws, len(hits)))
    errors = [calibration_error([hits[i] for i in row], bins) for row in picks]
    low, high = np.percentile(errors, [2.5, 97.5])
    return float(low), float(high)


def calibration_scatter(
    stated: Sequence[float] | NDArray[np.float64], bins: int = 10, draws: int = 400
) -> float:
    """Expected calibration error that so many probabilities have if every one of them is exact: that of a few dozen is far from zero.

    Args:
        stated: Probabilities.
        bins: Bins.
        draws: Draws of what comes true.
    """
    if not len(stated):
        return math.nan
    rng, p = np.random.default_rng(0), np.asarray(stated, dtype=float)
    errors = [
        calibration_error(
            [(float(x), bool(hit)) for x, hit in zip(p, rng.random(len(p)) < p, strict=True)], bins
        )
        for _ in range(draws)
    ]
    return float(np.mean(errors))
