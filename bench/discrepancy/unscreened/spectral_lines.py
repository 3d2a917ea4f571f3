"""Lines in the spectrum of a signal: harmonic parts of a frequency that no grid can hold, found and read off.

References:
    B. G. Quinn & E. J. Hannan, The Estimation and Tracking of Frequency, Cambridge University Press 2001, ch. 3 (maximum of the
    periodogram).
    EN 50160:2010, section 4.2.1 (frequency of the mains).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import minimize_scalar

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.effect import FreeParameter
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.settings.search_parts import HarmonicForceSettings


class SpectralLine(NamedTuple):
    """A harmonic part of a signal, ``amplitude cos(2 pi frequency t + phase)``.

    Attributes:
        frequency: [Hz].
        amplitude: In the unit of the signal.
        phase: At time zero of the record's clock [rad].
    """

    frequency: float
    amplitude: float
    phase: float


def lines_of(
    time: Array,
    signal: Array,
    loads: Sequence[Array] = (),
    *,
    settings: HarmonicForceSettings = DEFAULT.search.harmonic,
) -> list[SpectralLine]:
    """The lines in the spectrum of a signal that stand out of what lies about them, the largest first.

    Args:
        time: (n,), uniform.
        signal: (n,) the signal.
        loads: (n,) each: where they are harmonic, their own lines and multiples of these do not count.
        settings: `HarmonicForceSettings` of the diagnosis.
    """
    resolution = 1.0 / (len(signal) * float(time[1] - time[0]))
    loaded = [frequency for load in loads for frequency in _harmonics(time, load, settings)]

    def by_a_load(frequency: float) -> bool:
        multiples = [max(round(frequency / own), 1) * own for own in loaded]
        return any(abs(frequency - multiple) < settings.lobe * resolution for multiple in multiples)

    free = [
        part(time, signal, frequency)
        for frequency, _ in _lines(time, signal, settings)
        if not by_a_load(frequency)
    ]
    return sorted(free, key=lambda line: -line.amplitude)


def _lines(time: Array, signal: Array, settings: HarmonicForceSettings) -> list[tuple[float, float]]:
    """Frequency [Hz] and power of every line of a signal."""
    centred = (signal - signal.mean()) * np.hanning(len(signal))
    resolution = 1.0 / (len(signal) * float(time[1] - time[0]))
    height, power = _heights(centred, settings)
    least = math.log(len(height) / settings.false_alarm) / math.log(2.0)
    peaks = [
        i
        for i in np.flatnonzero(height > least)
        if power[i] == power[max(i - settings.lobe, 0) : i + settings.lobe + 1].max()
    ]

    def refined(peak: int) -> float:
        found = minimize_scalar(
            lambda frequency: -abs(np.exp(-2j * math.pi * frequency * time) @ centred),
            bounds=((peak - 1) * resolution, (peak + 1) * resolution),
            method="bounded",
            options={"xatol": 1e-4 * resolution},
        )
        return float(found.x)

    return [(refined(int(peak)), float(power[peak])) for peak in peaks]


def _harmonics(time: Array, load: Array, settings: HarmonicForceSettings) -> list[float]:
    """Frequencies of the lines of a load that is made of them for the most part; none of any other."""
    lines = _lines(time, load, settings)
    held = sum(part(time, load, frequency).amplitude ** 2 / 2.0 for frequency, _ in lines)
    return [frequency for frequency, _ in lines] if held > settings.harmonic * float(np.var(load)) else []


def _heights(windowed: Array, settings: HarmonicForceSettings) -> tuple[Array, Array]:
    """Power of every bin over the larger of the medians of its neighbours on both sides, and that power itself."""
    power = np.abs(np.fft.rfft(windowed)) ** 2
    n, far = len(power), settings.neighbours + settings.lobe
    if n <= far:
        return np.zeros(n), power
    medians = np.median(sliding_window_view(np.pad(power, far, mode="reflect"), settings.neighbours), axis=1)
    about = np.maximum(medians[:n], medians[far + settings.lobe + 1 :][:n])
    height = power / np.maximum(about, np.finfo(float).tiny)
    height[: settings.lobe] = 0.0  # a mean or a drift is no line
    return height, power


def part(time: Array, signal: Array, frequency: float) -> SpectralLine:
    """The harmonic part of a signal at a frequency, by least squares.

    Args:
        time: (n,).
        signal: (n,).
        frequency: [Hz].
    """
    angle = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.cos(angle), -np.sin(angle), np.ones(len(time))])
    c, s, _ = np.linalg.lstsq(basis, signal, rcond=None)[0]
    return SpectralLine(frequency, float(np.hypot(c, s)), float(np.arctan2(s, c)))


def resolution_of(record: CaseRecord) -> float:
    """Distance of two frequencies that a record tells apart [Hz]."""
    return 1.0 / (len(record) * record.step)


def frequencies_of(records: Sequence[CaseRecord]) -> float:
    """Number of frequencies that a record tells apart, on average."""
    return sum(len(record) // 2 for record in records) / len(records)


def common_lines(
    found: Mapping[str, Sequence[SpectralLine]], resolution: float
) -> list[dict[str, SpectralLine]]:
    """Lines that all records have at one frequency, by record, the strongest first.

    Args:
        found: Lines of every record.
        resolution: How far the frequencies of one line may lie apart [Hz].
    """
    groups = []
    for line in next(iter(found.values()), ()):
        if not all(found.values()):
            break
        nearest = {
            name: min(lines, key=lambda own: abs(own.frequency - line.frequency))
            for name, lines in found.items()
        }
        if all(abs(own.frequency - line.frequency) < resolution for own in nearest.values()):
            groups.append(nearest)
    return sorted(groups, key=lambda group: -sum(own.amplitude**2 for own in group.values()))


def frequency_parameter(
    name: str, frequency: float, resolution: float, settings: HarmonicForceSettings
) -> FreeParameter:
    """The frequency of a line, known to about the resolution of its record.

    Args:
        name: Of the parameter.
        frequency: Of the line [Hz].
        resolution: Of the record [Hz].
        settings: How far it may be drawn.
    """
    spread, middle = resolution / frequency, math.log(frequency)
    ends = (middle - settings.drawn * spread, middle + settings.drawn * spread)
    return FreeParameter(name, mean=middle, std=spread, bounds=ends, unit="Hz")


def phase_parameters(names: Sequence[str]) -> list[FreeParameter]:
    """The phase of a line in every record."""
    bounds = (-3.0 * math.pi, 3.0 * math.pi)
    return [
        FreeParameter(f"phase_{name}", signed=True, std=math.pi, bounds=bounds, unit="rad") for name in names
    ]


def of_the_mains(frequency: float, settings: HarmonicForceSettings) -> bool:
    """Whether a frequency [Hz] is that of the mains or a multiple of it."""
    return any(
        abs(frequency / (mains * k) - 1.0) < settings.mains_tolerance
        for mains in settings.mains
        for k in range(1, settings.multiples + 1)
    )


def frequency_prior(frequency: float, count: float, settings: HarmonicForceSettings) -> float:
    """Log prior of a line's frequency [Hz]: as likely as not of the mains or a multiple of it, else one of so many that are told apart."""
    mains = 1.0 / (len(settings.mains) * settings.multiples) if of_the_mains(frequency, settings) else 0.0
    return math.log(0.5 / count + 0.5 * mains)
