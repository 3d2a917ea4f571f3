"""When two records of one signal were taken: their shift, and how it grows along the record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from bench.arrays import Array


@dataclass(frozen=True)
class TimingSettings:
    """Numbers of `bench.discrepancy.precheck.timing`."""

    blocks: int = 8
    """Blocks of a record, each left out in turn, whose scatter is the error of the estimates: errors of a model run through samples."""
    steps: int = 30
    """Most steps of Gauss and Newton: from the peak of the correlation it takes three, of a clock that runs far off some more."""
    settled: float = 0.01
    """Change of the shift, in samples, at which they end: far below the part of a sample from which a shift counts."""
    reach: float = 0.25
    """Part of the record up to which a shift is looked for."""
    samples: float = 1.5
    """Samples up to which a shift may be one of the clock of the record: its step, and half of one of an input that is held over it."""
    certain: float = 5.0
    """Standard errors from which a shift is told."""


SETTINGS = TimingSettings()


class Timing(NamedTuple):
    """How a signal is shifted against another.

    Attributes:
        lag: Time by which the first is later than the second, in the middle of the record [s].
        drift: Change of that from start to end [s].
        lag_std, drift_std: Standard errors [s].
        left: Power that the shifted signal leaves of the first, over what the unshifted one does.
    """

    lag: float
    drift: float
    lag_std: float
    drift_std: float
    left: float

    def least(self, step: float) -> float:
        """Lag [s] from which one counts, samples taken every `step` seconds."""
        return max(SETTINGS.samples * step, SETTINGS.certain * self.lag_std)

    def drifts(self, step: float) -> bool:
        """Whether the shift grows along the record."""
        return abs(self.drift) > max(SETTINGS.samples * step, SETTINGS.certain * self.drift_std)


def timing(first: Array, second: Array, step: float, beside: Array) -> Timing | None:
    """How the first signal is shifted against the second; None where that cannot be told.

    The model is ``first(t) = g second(t - lag - drift (t - t_mean) / T) + what is beside``, by least squares.

    Args:
        first: (n,) samples.
        second: (n,) samples.
        step: Time between samples [s].
        beside: (n, k) other signals, multiples of which the first may hold.
    """
    n = len(first)
    if min(np.std(first), np.std(second)) == 0.0:
        return None
    clock = np.arange(n) * step
    centred = (clock - clock.mean()) / (n * step)
    curve = CubicSpline(clock, second)
    slope = curve.derivative()
    lag, drift = _coarse(first, second) * step, 0.0
    for _ in range(SETTINGS.steps):
        at = clock - lag - drift * centred
        inside = (at >= 0.0) & (at <= clock[-1])
        at = np.clip(at, 0.0, clock[-1])
        rate, now = slope(at), curve(at)
        columns = np.column_stack([-rate, -rate * centred, now, np.ones(n), beside])
        parts = [part[inside[part]] for part in np.array_split(np.arange(n), SETTINGS.blocks)]
        squares = np.array([columns[p].T @ columns[p] for p in parts])
        sides = np.array([columns[p].T @ (first - now)[p] for p in parts])
        moved = _solved(squares.sum(axis=0), sides.sum(axis=0))
        if moved is None:
            return None
        lag, drift = lag + float(moved[0]), drift + float(moved[1])
        if abs(moved[0]) + abs(moved[1]) < SETTINGS.settled * step:
            break
    else:
        return None
    without = [
        _solved(squares.sum(axis=0) - a, sides.sum(axis=0) - b) for a, b in zip(squares, sides, strict=True)
    ]
    left_out = np.array([one[:2] for one in without if one is not None])
    if len(left_out) < SETTINGS.blocks:
        return None
    spread = np.sqrt((SETTINGS.blocks - 1) * np.var(left_out, axis=0))
    still, moved_on = (
        _rest(first[inside], np.column_stack([x, np.ones(n), beside])[inside]) for x in (second, now)
    )
    return Timing(lag, drift, float(spread[0]), float(spread[1]), moved_on / max(still, 1e-300))


def _rest(first: Array, columns: Array) -> float:
    """Power of a signal (n,) that multiples of others (n, k) leave."""
    found, *_ = np.linalg.lstsq(columns, first, rcond=None)
    return float(np.sum((first - columns @ found) ** 2))


def _coarse(first: Array, second: Array) -> int:
    """Samples by which the first is later than the second, by the peak of their correlation."""
    n = len(first)
    correlation = signal.correlate(first - first.mean(), second - second.mean(), method="fft")
    reach = max(round(SETTINGS.reach * n), 1)
    window = correlation[n - 1 - reach : n + reach]
    return int(np.argmax(window)) - reach


def _solved(squares: Array, side: Array) -> Array | None:
    """Solution of normal equations, their columns scaled; None where these are not independent."""
    scale = np.sqrt(np.maximum(np.diag(squares), 1e-300))
    try:
        found = np.linalg.solve(squares / np.outer(scale, scale), side / scale) / scale
    except np.linalg.LinAlgError:
        return None
    return found if np.isfinite(found).all() else None
