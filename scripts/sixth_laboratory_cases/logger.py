"""What the logger makes of a signal: white and slow noise, steps of a converter, and a clock that jitters."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter
from third_laboratory_cases.logger import Table

from bench.arrays import Array
from sixth_laboratory_cases.case import AUTHOR, Case, Channel, Signals
from sixth_laboratory_cases.signals import Generator

JITTER = 0.01
"""Standard deviation of the times of the samples, as a fraction of a sample."""
CORNER = 3.0
"""Frequency [Hz] up to which the slow part of the noise goes."""


def jittered(rng: Generator, n: int, interval: float) -> Array:
    """Times [s] (n,) at which samples are taken that should be an interval [s] apart."""
    late = JITTER * interval * rng.standard_normal(n)
    return np.maximum(np.arange(n) * interval + late, 0.0)


def disturbed(rng: Generator, n: int, interval: float, slow: float) -> Array:
    """Gaussian noise (n,) of unit size at samples an interval [s] apart, a part of whose variance is slow; that starts small."""
    white = rng.standard_normal(n)
    pole = np.exp(-2.0 * np.pi * CORNER * interval)
    coloured = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal(n))
    return np.asarray(np.sqrt(1.0 - slow) * white + np.sqrt(slow) * coloured)


def read(channel: Channel, signal: Array, step: float, t: Array, rng: Generator) -> Array:
    """What a channel reads (n,) at some times [s] (n,) of a signal that is given at each step [s]."""
    clean = channel.scale * np.interp(t, np.arange(signal.size) * step, signal)
    # the mean interval as the clock has it, end to end
    noise = disturbed(rng, t.size, (t[-1] - t[0]) / (t.size - 1), channel.slow)
    out = clean + channel.noise * noise
    return np.round(out / channel.resolution) * channel.resolution if channel.resolution else out


def logged(case: Case, number: int, signals: Signals) -> Table:
    """One of the records of a case as it is logged."""
    rng = np.random.default_rng([AUTHOR, case.number, number, 1])
    n = (len(case.loads[number]) - 1) // case.substeps
    even, taken = np.arange(n) / case.rate, jittered(rng, n, 1.0 / case.rate)
    columns = {
        name: read(channel, signals[channel.signal], case.step(), even if channel.commanded() else taken, rng)
        for name, channel in case.channels.items()
    }
    return Table(even, columns)
