"""Samples that were dropped while the times were numbered through: all signals jump at once where nothing is said to be missing.

A linear prediction of every channel from the last samples of all of them leaves what is new in a sample: noise, and what drives the
specimen. A dropout leaves much in all channels at one place, displacements included, which a blow or a step of the load does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class JumpSettings:
    """When a jump of all channels counts as a dropout.

    `scripts/dropouts.py` counts false alarms and hits over random records: none of 200 sound ones is doubted at any setting tried (clear 3
    to 12, apart 1.2 to 3), and 20, 37 and 32 % of dropouts of 3, 10 and 30 samples are found at these. Smaller numbers find up to 7 %
    more; since a false alarm sends a user to look for samples that are not missing, they are kept on the safe side.

    Attributes:
        order: Samples that a prediction looks back: a vibration of two modes and the filters of a measuring chain need six to eight.
        fewest: Shortest record that is looked at: a prediction of three channels has 31 coefficients each.
        clear: Least size of a jump in every channel, in standard deviations of what is usually new in a sample.
        apart: How much larger a jump must be than what happens at all other places, and a leap than the steps about it: records in
            which all channels jump now and then (pulses, impacts) are none in which samples are missing.
        most: Most places that are told; where more stand out, jumps belong to the record.
        looked: Samples on either side of a leap in which nothing like it may happen.
    """

    order: int = 10
    fewest: int = 200
    clear: float = 5.0
    apart: float = 2.0
    most: int = 3
    looked: int = 200_000


JUMPS = JumpSettings()


def hidden_dropouts(values: NDArray[np.float64], settings: JumpSettings = JUMPS) -> list[int]:
    """Samples before which others seem to be missing, by a jump in all channels at once.

    Args:
        values: Samples on a clock that says nothing of it, ``(n, n_channels)``; constant channels do not count.
        settings: When a jump counts.

    Returns:
        Indices of the first samples after each jump, at most `settings.most`; empty for fewer than two channels.
    """
    order = settings.order
    if len(values) < settings.fewest:
        return []
    with np.errstate(all="ignore"):
        spread = np.array([np.std(column) for column in values.T])
        level = np.array([np.max(np.abs(column)) for column in values.T])
        moving = np.flatnonzero(np.isfinite(spread) & (spread > 1e-12 * level))
        if len(moving) < 2 or not np.isfinite(level).all():
            return []
        leaps = _leaps(values, moving, settings)
        if not 0 < len(leaps) <= settings.most:
            return []
        part = slice(max(0, leaps[0] - settings.looked), leaps[-1] + settings.looked)
        if part.stop - part.start > 4 * settings.looked:
            part = slice(max(0, leaps[0] - settings.looked), leaps[0] + settings.looked)
        scaled = (values[part][:, moving] - np.mean(values[part][:, moving], axis=0)) / spread[moving]
        news = _news(scaled, order)
    places = [k - part.start - order for k in leaps if order + 3 <= k - part.start < len(scaled)]
    sizes = [float(np.max(news[max(0, k - 1) : k + 3])) for k in places]
    for k in places:
        news[max(0, k - 2 * order) : k + 2 * order] = 0.0
    usual = float(np.max(news))
    return [
        k + part.start + order
        for k, size in zip(places, sizes, strict=True)
        if size > max(settings.clear, settings.apart * usual)
    ]


def _leaps(values: NDArray[np.float64], moving: NDArray[np.intp], settings: JumpSettings) -> list[int]:
    """Samples at which two channels, or half of them, leap away from their neighbours out of motion.

    Across a dropout a signal goes in one step where it went in several before. A load that is switched or a stop that is hit
    bends all signals and lets none but accelerations leap. Out of rest, a leap is a start.
    """
    from scipy.ndimage import maximum_filter1d  # noqa: PLC0415

    order, apart = settings.order, settings.apart
    count = np.zeros(len(values) - 1, dtype=np.uint16)
    for column in moving:
        steps = np.abs(np.diff(values[:, column]))
        # the largest of the order steps before each, and after each
        before = maximum_filter1d(steps, order, origin=order // 2 - 1, mode="constant")
        before = np.concatenate([[np.inf], before[:-1]])
        after = maximum_filter1d(steps, order, origin=-(order // 2), mode="constant")
        after = np.concatenate([after[1:], [np.inf]])
        count += (
            (steps > apart * before) & (steps > apart * after) & (before > 1e-3 * np.std(values[:, column]))
        )
    return [int(k) + 1 for k in np.flatnonzero(count >= max(2, (len(moving) + 1) // 2))[: settings.most + 1]]


def _news(scaled: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """Of each sample from the `order`-th on, the least unexpected channel's departure in robust standard deviations."""
    n = len(scaled)
    shifted = [scaled[order - k - 1 : n - k - 1] for k in range(order)]
    past, now = np.hstack([*shifted, np.ones((n - order, 1))]), scaled[order:]
    thin = max(1, n // 50_000)
    coefficients = np.linalg.lstsq(past[::thin], now[::thin], rcond=1e-10)[0]
    residual = np.abs(now - past @ coefficients)
    # 1.4826 times the median of absolute values is the standard deviation of Gaussian numbers
    size = 1.4826 * np.median(residual, axis=0)
    return np.min(residual / np.maximum(size, 1e-9), axis=1)
