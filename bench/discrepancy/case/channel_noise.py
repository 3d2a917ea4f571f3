"""Noise of a channel, read off its samples where it is not stated: its flattest spectrum, and its quantisation.

A converter of step q leaves the samples on multiples of q, and an error of variance ``q^2 / 12`` that no fit removes
(Widrow's pseudo-noise).

References:
    B. Widrow, I. Kollar, Quantization Noise, 2008, ch. 4.
    G. Blom, Statistical Estimates and Transformed Beta-Variables, 1958 (expected order statistics).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gamma

from bench.arrays import Array
from bench.discrepancy.settings import DEFAULT, CaseSettings


@dataclass(frozen=True)
class ChannelNoiseSettings:
    """Numbers of `bench.discrepancy.case.channel_noise`."""

    parts: int = 8
    """Parts of the upper half of a spectrum, the flattest of which is taken for noise."""
    hann: float = 1.94
    """Ordinates of a periodogram with Hann's window that tell as much as an independent one: the sum of their squared correlations."""


SETTINGS = ChannelNoiseSettings()


def noise_floor(x: Array) -> float:
    """White noise of a channel whose noise is not stated, from the flattest eighth of the upper half of its spectrum.

    The least of several means is smaller than what it is a mean of. Ordinates of noise are exponential, so that each mean is one of a gamma
    distribution, whose least of eight is expected near the quantile of 5 / 66 (Blom): the floor is divided by that.
    """
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) ** 2 / (len(x) * 0.375)
    upper = spectrum[len(spectrum) // 2 :]
    blocks = [np.mean(block) for block in np.array_split(upper, SETTINGS.parts)]
    independent = max(len(upper) / SETTINGS.parts / SETTINGS.hann, 1.0)
    least = float(gamma.ppf((1.0 - 0.375) / (SETTINGS.parts + 0.25), independent)) / independent
    return float(np.sqrt(max(min(blocks) / least, (1e-6 * np.std(x)) ** 2, 1e-300)))


def quiet_noise(x: Array) -> float:
    """White noise of a channel from the median size of its third differences, which jumps now and then do not move.

    A contact or a reversal of friction leaves an acceleration with power at all frequencies, of which the flattest quarter of a spectrum
    knows nothing; between them there is noise alone. Third differences of white noise have twenty times its variance.
    """
    if len(x) < 8:
        return float("inf")
    return float(np.median(np.abs(np.diff(x, 3))) / (0.6745 * np.sqrt(20.0)))


def noise_of_logs(logs: Iterable[Array], *, jumps: bool) -> float:
    """White noise of a channel whose noise is not stated, the largest that any of its logs shows.

    Args:
        logs: Samples (n,) of every record.
        jumps: Whether what is logged follows contacts and reversals of friction at once, as a current does: what their jumps leave at all
            frequencies is no noise (`quiet_noise`).
    """
    return max(min(noise_floor(x), quiet_noise(x)) if jumps else noise_floor(x) for x in logs)


def quantisation_step(samples: NDArray[np.float64], *, settings: CaseSettings = DEFAULT.case) -> float:
    """Step of the lattice on which all samples lie; zero where there is none.

    Args:
        samples: (n,).
        settings: `CaseSettings` of the diagnosis.
    """
    values = np.unique(samples)
    if len(values) < 3 or len(values) > (1.0 - settings.repeated) * len(samples):
        return 0.0
    gaps = np.diff(values)
    # a text file may print the same lattice point in two ways that differ in the last digit
    gaps = gaps[gaps > 1e-7 * float(np.ptp(values))]
    step = float(gaps.min())
    multiples = np.round(gaps / step)
    step = float(gaps.sum() / multiples.sum())
    if np.max(np.abs(gaps / step - np.round(gaps / step))) > settings.lattice:
        return 0.0
    return step


def raised_noise(
    noise: float, samples: NDArray[np.float64], *, settings: CaseSettings = DEFAULT.case
) -> float:
    """Noise of a channel with that of its quantisation, where the latter is the coarser one.

    Args:
        noise: One-sigma noise as stated.
        samples: (n,).
        settings: `CaseSettings` of the diagnosis.
    """
    step = quantisation_step(samples, settings=settings)
    if step <= noise:
        return noise
    return float(np.hypot(noise, step / np.sqrt(12.0)))
