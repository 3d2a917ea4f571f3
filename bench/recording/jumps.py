"""Samples that were dropped while the times were numbered through: all signals jump at once where nothing is said to be missing.

A linear prediction of every channel from the last samples of all of them leaves what is new in a sample: noise, and what drives the
specimen. A dropout leaves much in all channels at one place, displacements included, which a blow or a step of the load does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class JumpsSettings:
    """Numbers of `bench.recording.jumps`."""

    order: int = 10
    """Samples that a prediction looks back: a vibration of two modes and the filters of a measuring chain need six to eight."""
    fewest: int = 200
    """Shortest record that is looked at: a prediction of three channels has 31 coefficients each."""
    clear: float = 5.0
    """Least size of a jump in every channel, in standard deviations of what is usually new in a sample."""
    apart: float = 2.0
    """How much larger a jump must be than what happens at all other places: records in which all channels jump now and then (pulses,
    impacts) are none in which samples are missing."""
    most: int = 3
    """Most places that are told; where more stand out, jumps belong to the record."""
    looked: int = 200_000
    """Samples on either side of a leap in which nothing like it may happen."""


SETTINGS = JumpsSettings()


def hidden_dropouts(values: NDArray[np.float64]) -> list[int]:
    """Samples before which others seem to be missing, by a jump in all channels at once.

    Args:
        values: Samples on a clock that says nothing of it, ``(n, n_channels)``; constant channels do not count.

    Returns:
        Indices of the first samples after each jump, at most `most`; empty for fewer than two channels.
    """
    if len(values) < SETTINGS.fewest:
        return []
    with np.errstate(all="ignore"):
        spread = np.array([np.std(column) for column in values.T])
        level = np.array([np.max(np.abs(column)) for column in values.T])
        moving = np.flatnonzero(np.isfinite(spread) & (spread > 1e-12 * level))
        if len(moving) < 2 or not np.isfinite(level).all():
            return []
        leaps = _leaps(values, moving)
        if not 0 < len(leaps) <= SETTINGS.most:
            return []
        part = slice(max(0, leaps[0] - SETTINGS.looked), leaps[-1] + SETTINGS.looked)
        if part.stop - part.start > 4 * SETTINGS.looked:
            part = slice(max(0, leaps[0] - SETTINGS.looked), leaps[0] + SETTINGS.looked)
        scaled = (values[part][:, moving] - np.mean(values[part][:, moving], axis=0)) / spread[moving]
        news = _news(scaled)
    places = [
        k - part.start - SETTINGS.order for k in leaps if SETTINGS.order + 3 <= k - part.start < len(scaled)
    ]
    sizes = [float(np.max(news[max(0, k - 1) : k + 3])) for k in places]
    for k in places:
        news[max(0, k - 2 * SETTINGS.order) : k + 2 * SETTINGS.order] = 0.0
    usual = float(np.max(news))
    return [
        k + part.start + SETTINGS.order
        for k, size in zip(places, sizes, strict=True)
        if size > max(SETTINGS.clear, SETTINGS.apart * usual)
    ]


def _leaps(values: NDArray[np.float64], moving: NDArray[np.intp]) -> list[int]:
    """Samples at which two channels, or half of them, leap away from their neighbours out of motion.

    Across a dropout a signal goes in one step where it went in several before. A load that is switched or a stop that is hit
    bends all signals and lets none but accelerations leap. Out of rest, a leap is a start.
    """
    from scipy.ndimage import maximum_filter1d  # noqa: PLC0415

    count = np.zeros(len(values) - 1, dtype=np.uint16)
    for column in moving:
        steps = np.abs(np.diff(values[:, column]))
        # the largest of the ORDER steps before each, and after each
        before = maximum_filter1d(steps, SETTINGS.order, origin=SETTINGS.order // 2 - 1, mode="constant")
        before = np.concatenate([[np.inf], before[:-1]])
        after = maximum_filter1d(steps, SETTINGS.order, origin=-(SETTINGS.order // 2), mode="constant")
        after = np.concatenate([after[1:], [np.inf]])
        count += (
            (steps > SETTINGS.apart * before)
            & (steps > SETTINGS.apart * after)
            & (before > 1e-3 * np.std(values[:, column]))
        )
    return [int(k) + 1 for k in np.flatnonzero(count >= max(2, (len(moving) + 1) // 2))[: SETTINGS.most + 1]]


def _news(scaled: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each sample from the `order`-th on, the least unexpected channel's departure in robust standard deviations."""
    n = len(scaled)
    shifted = [scaled[SETTINGS.order - k - 1 : n - k - 1] for k in range(SETTINGS.order)]
    past, now = np.hstack([*shifted, np.ones((n - SETTINGS.order, 1))]), scaled[SETTINGS.order :]
    thin = max(1, n // 50_000)
    coefficients = np.linalg.lstsq(past[::thin], now[::thin], rcond=1e-10)[0]
    residual = np.abs(now - past @ coefficients)
    # 1.4826 times the median of absolute values is the standard deviation of Gaussian numbers
    size = 1.4826 * np.median(residual, axis=0)
    return np.min(residual / np.maximum(size, 1e-9), axis=1)
