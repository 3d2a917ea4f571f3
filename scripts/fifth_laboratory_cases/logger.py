"""What the logger makes of a signal: white and coloured noise, hum, and a clock that jitters."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter
from third_laboratory_cases.logger import Table

from bench.arrays import Array
from fifth_laboratory_cases.case import Case, Signals


def jittered(rng: np.random.Generator, even: Array, rate: float, jitter: float) -> Array:
    """Times [s] (n,) at which samples are taken that should be at even times [s] at a rate [Hz], off by a fraction of a sample."""
    seconds = len(even) / rate
    return np.clip(even + jitter / rate * rng.normal(size=len(even)), 0.0, seconds - 1.0 / rate / 4)


def coloured(rng: np.random.Generator, n: int, std: float, pole: float) -> Array:
    """Gaussian noise (n,) that a filter of first order has coloured; it starts small."""
    return np.asarray(lfilter([np.sqrt(1 - pole * pole) * std], [1, -pole], rng.normal(size=n)))


def logged(case: Case, number: int, signals: Signals, *, noise: bool, background: bool) -> Table:
    """One of the records of a case as it is logged, with or without white noise and what the background makes of the readings."""
    rng = np.random.default_rng([case.seed, number, 7])
    even = np.arange(round(case.seconds * case.rate)) / case.rate
    t = jittered(rng, even, case.rate, case.jitter if background else 0.0)
    white = {name: rng.normal(size=len(t)) for name, channel in case.channels.items() if channel.noise > 0.0}
    columns, step = {}, 1 / case.rate / case.substeps
    for name, channel in case.channels.items():
        y = channel.scale * signals[channel.signal].sampled(t, step)
        if background:
            y = y * channel.gain
        if noise and name in white:
            y = y + channel.noise * white[name]
        if background and channel.coloured > 0.0:
            y = y + coloured(rng, len(t), channel.coloured, channel.pole)
        if background and channel.hum is not None:
            amplitude, frequency, phase = channel.hum
            y = y + amplitude * np.sin(2 * np.pi * frequency * t + phase)
        columns[name] = y
    return Table(even, columns)
