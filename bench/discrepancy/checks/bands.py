"""Ratios of two signals, band by band, and the one factor or sign that describes them all.

References:
    J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, chapter 6 (coherence, gain and phase from cross-spectra).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from bench.arrays import Array
from bench.discrepancy.settings import DEFAULT, ScaleSettings
from bench.recording.units import conversion, read_as

SUSPECTS = {
    "m": ("mm", "cm", "um", "in", "ft"), "rad": ("deg", "rev", "mrad"), "m/s": ("mm/s", "cm/s", "in/s", "km/h"),
    "rad/s": ("deg/s", "rpm"), "m/s^2": ("g", "mm/s^2", "cm/s^2", "in/s^2", "mg"), "rad/s^2": ("deg/s^2",),
    "N": ("kN", "mN", "lbf", "kgf", "gf"), "N m": ("N mm", "N cm", "mN m", "kN m", "lbf in", "lbf ft", "kgf cm", "ozf in"),
}  # fmt: skip
"""SI units, and those that a column labelled with them may really be in."""


class Spectra(NamedTuple):
    """Averaged spectra of two signals at frequencies [Hz], and which of these count."""

    frequency: Array
    first: Array
    second: Array
    cross: NDArray[np.complex128]
    counts: NDArray[np.bool_]


class Pair(NamedTuple):
    """Two channels of one motion: the second over the first, derivatives taken into account, and how sure that is."""

    factor: float
    sign: float


class Bands(NamedTuple):
    """Measured over predicted in bands of a third of an octave: log ratios, correlations, middle frequencies [Hz]."""

    ratios: Array
    correlations: Array
    frequencies: Array


def spectra(
    first: Array, second: Array, step: float, noise: tuple[float, float], settings: ScaleSettings
) -> Spectra:
    """Averaged spectra of two signals (n,).

    Args:
        first: (n,).
        second: (n,).
        step: Time between samples [s].
        noise: Standard deviations of their white noise.
        settings: What counts.
    """
    # longer where the motion is so slow that its strongest frequency would drown in the mean
    peak = max(int(np.argmax(np.abs(np.fft.rfft(signal.detrend(x)))[1:])) + 1 for x in (first, second))
    length = max(
        min(settings.cycles * len(first) // peak, len(first) // 2),
        len(first) // settings.segments,
        min(64, len(first)),
    )

    def density(x: Array, y: Array):
        return signal.csd(x, y, 1.0 / step, "hann", length, detrend="linear")

    frequency, own = density(first, first)
    other, cross = density(second, second)[1], density(first, second)[1]
    own, other, cross = np.real(own), np.real(other), np.asarray(cross, dtype=np.complex128)
    counts = np.ones(len(frequency), dtype=bool)
    for power, level in ((own, noise[0]), (other, noise[1])):
        counts &= (power > settings.strong * 2.0 * level**2 * step) & (power > settings.leak * power.max())
    counts[:2] = False  # the mean, and what the window makes of it
    return Spectra(frequency, own, other, cross, counts)


def compare_channels(
    first: Array, second: Array, *, orders: tuple[int, int], noise: tuple[float, float], step: float,
    settings: ScaleSettings = DEFAULT.checks.scales,
) -> Pair | None:  # fmt: skip
    """The factor and sign between two channels of one motion; None where they have no frequency in common.

    Args:
        first: (n,) samples.
        second: (n,) samples.
        orders: Derivative that each measures.
        noise: Their noise.
        step: Time between samples [s].
        settings: When a factor counts.
    """
    found = spectra(first, second, step, noise, settings)
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.abs(found.cross) ** 2 / (found.first * found.second)
    use = found.counts & (coherence > settings.coherence)
    if np.count_nonzero(use) < 3:
        return None
    derivative = (2j * np.pi * found.frequency[use]) ** (orders[1] - orders[0])
    gain = found.cross[use] / found.first[use] / derivative
    # a delay turns the phase with frequency, so that the lowest ones tell the sign
    lowest = gain[: max(3, len(gain) // 4)]
    # a unit is one factor at all frequencies; what one sensor picks up besides, mains hum say, is at a few
    factor = np.sqrt(np.median(found.second[use] / (found.first[use] * np.abs(derivative) ** 2)))
    return Pair(float(factor), float(np.median(np.cos(np.angle(lowest)))))


def bands_between(found: Spectra) -> Bands | None:
    """The second signal over the first, in bands of a third of an octave."""
    if np.count_nonzero(found.counts) < 3:
        return None
    frequency = found.frequency[found.counts]
    number = np.floor(3.0 * np.log2(frequency / frequency[0])).astype(int)
    rows = []
    for band in np.unique(number):
        use = np.flatnonzero(found.counts)[number == band]
        first, second = found.first[use].sum(), found.second[use].sum()
        correlation = float(np.real(found.cross[use].sum()) / np.sqrt(first * second))
        rows.append((0.5 * np.log(second / first), correlation, float(np.mean(found.frequency[use]))))
    return Bands(*(np.array(column) for column in zip(*rows, strict=True)))


def common_factor(
    bands: Bands, settings: ScaleSettings = DEFAULT.checks.scales, *, more: bool = False
) -> tuple[float, float]:
    """The factor and the sign that all bands have in common; (1, 1) where they have none.

    Args:
        bands: Measured over predicted.
        settings: When a factor counts.
        more: Whether the first of the two may be more than the second for reasons of its own: a factor below one, however small, then
            counts only where both have the same course.
    """
    ratios = bands.ratios
    if len(ratios) < 3:
        return 1.0, 1.0
    middle = float(np.median(ratios))
    describes = settings.better * float(np.sum((ratios - middle) ** 2)) < float(np.sum(ratios**2))
    wide = bands.frequencies[-1] >= 2.0**settings.octaves * bands.frequencies[0]
    turned = wide and bool(np.all(bands.correlations < 0.0)) and float(np.median(bands.correlations)) < -0.5
    agrees = float(np.median(np.abs(bands.correlations))) > settings.coherence
    gross = abs(middle) > np.log(settings.any_factor) and (agrees or not (more and middle < 0.0))
    gross |= agrees and abs(middle) > np.log(settings.gross) and _is_of_a_unit(middle, settings)
    return (float(np.exp(middle)) if describes and gross else 1.0), (-1.0 if turned else 1.0)


def _is_of_a_unit(log_factor: float, settings: ScaleSettings) -> bool:
    known = {
        abs(float(np.log(conversion(*read_as(unit, (si,)))[0])))
        for si, units in SUSPECTS.items()
        for unit in units
    }
    return any(abs(abs(log_factor) - one) < np.log(settings.unit) for one in known)
