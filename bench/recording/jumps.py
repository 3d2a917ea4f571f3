"""Samples that were dropped while the times were numbered through: all signals jump at once where nothing is said to be missing.

A linear prediction of every channel from the last samples of all of them leaves what is new in a sample: noise, and what drives the
specimen. A dropout leaves much in all channels at one place, displacements included, which a blow or a step of the load does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ORDER = 10
"""Samples that a prediction looks back: a vibration of two modes and the filters of a measuring chain need six to eight."""
FEWEST = 200
"""Shortest record that is looked at: a prediction of three channels has 31 coefficients each."""
CLEAR = 5.0
"""Least size of a jump in every channel, in standard deviations of what is usually new in a sample."""
APART = 2.0
"""How much larger a jump must be than what happens at all other places: records in which all channels jump now and then (pulses,
impacts) are none in which samples are missing."""
MOST = 3
"""Most places that are told; where more stand out, jumps belong to the record."""
_FITTED = 50_000
_BLOCK = 200_000


def hidden_dropouts(values: NDArray[np.float64]) -> list[int]:
    """Samples before which others seem to be missing, by a jump in all channels at once.

    Args:
        values: Samples on a clock that says nothing of it, ``(n, n_channels)``; constant channels do not count.

    Returns:
        Indices of the first samples after each jump, at most `MOST`; empty for fewer than two channels.
    """
    spread = np.std(values, axis=0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        moving = np.isfinite(spread) & (spread > 1e-12 * np.max(np.abs(values), axis=0, initial=0.0))
        if len(values) < FEWEST or np.count_nonzero(moving) < 2 or not np.isfinite(values).all():
            return []
        scaled = (values[:, moving] - np.mean(values[:, moving], axis=0)) / spread[moving]
    news = _news(scaled)
    places: list[int] = []
    left = news.copy()
    for _ in range(MOST + 1):
        k = int(np.argmax(left))
        places.append(k)
        left[max(0, k - 2 * ORDER) : k + 2 * ORDER] = 0.0
    usual = float(news[places[-1]])
    found = [k for k in places[:-1] if news[k] > max(CLEAR, APART * usual)]
    return sorted(k + ORDER for k in found if _in_motion(scaled, k + ORDER))


def _news(scaled: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each sample from the `ORDER`-th on, the least unexpected channel's departure in robust standard deviations."""
    n = min(len(scaled), _FITTED)
    past, now = _past(scaled[:n])
    coefficients = np.linalg.lstsq(past, now, rcond=1e-10)[0]
    parts = []
    for start in range(0, len(scaled) - ORDER, _BLOCK):
        past, now = _past(scaled[start : start + _BLOCK + ORDER])
        parts.append(np.abs(now - past @ coefficients))
    residual = np.concatenate(parts)
    # 1.4826 times the median of absolute values is the standard deviation of Gaussian numbers
    size = 1.4826 * np.median(residual[:: max(1, len(residual) // 1_000_000)], axis=0)
    return np.min(residual / np.maximum(size, 1e-9), axis=1)


def _past(scaled: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    n = len(scaled)
    shifted = [scaled[ORDER - k - 1 : n - k - 1] for k in range(ORDER)]
    return np.hstack([*shifted, np.ones((n - ORDER, 1))]), scaled[ORDER:]


def _in_motion(scaled: NDArray[np.float64], k: int) -> bool:
    """Whether all channels move before the jump: out of rest, a jump is a start."""
    before = scaled[max(0, k - 2 * ORDER) : k]
    return bool(np.all(np.ptp(before, axis=0) > 0.01))
