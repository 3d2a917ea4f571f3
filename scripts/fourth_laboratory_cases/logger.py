"""What the logger makes of a signal: coloured noise, a clock that jitters, and samples that freeze."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from third_laboratory_cases.case import Signals
from third_laboratory_cases.logger import Table

from bench.arrays import Array
from fourth_laboratory_cases.case import Case

SETTLED = 200
"""Samples before the coloured noise that are discarded."""


def coloured(rng: np.random.Generator, n: int, share: float = 0.35, pole: float = 0.9) -> Array:
    """Gaussian noise (n,) of unit variance, of which a share is coloured by a filter of first order with this pole."""
    drawn = rng.standard_normal(n + SETTLED)
    gain = math.sqrt(1 - pole * pole)
    slow, _ = lfilter([gain], [1.0, -pole], drawn[1:], zi=[pole * drawn[0]])
    return math.sqrt(1 - share) * rng.standard_normal(n) + math.sqrt(share) * slow[SETTLED - 1 :]


def jittered(rng: np.random.Generator, t: Array, jitter: float) -> Array:
    """True times [s] (n,) of samples that a clock takes early or late by a time of this deviation [s]; the ends are exact."""
    off = jitter * np.clip(coloured(rng, len(t), 0.2, 0.8), -3, 3)
    off[0] = off[-1] = 0.0
    return np.clip(t + off, 0.0, t[-1])


def noise_levels(case: Case, records: Mapping[str, Signals]) -> dict[str, float]:
    """Standard deviation of the noise of each channel in SI units, from the signals of all records."""
    return {
        name: channel.noise_std(np.concatenate([each[channel.signal] for each in records.values()]))
        for name, channel in case.channels.items()
    }


def logged(
    case: Case, stem: str, signals: Signals, levels: Mapping[str, float], rng: np.random.Generator
) -> Table:
    """A record as it is logged, from its signals at each step; the generator draws the clock, then the noise of each channel."""
    even = np.arange((len(signals["t"]) - 1) // case.clock.substeps + 1) / case.clock.rate
    true = jittered(rng, even, case.jitter / case.clock.rate)
    columns = {}
    for name, channel in case.channels.items():
        clean = CubicSpline(signals["t"], signals[channel.signal])(true)
        columns[name] = (clean + levels[name] * coloured(rng, len(true))) * channel.scale
    freeze = case.freeze
    if freeze is not None and freeze.stem == stem:
        first = int(freeze.where * len(even))
        columns[freeze.channel][first : first + freeze.samples] = columns[freeze.channel][first - 1]
    return Table(true if case.true_times else even, columns)
