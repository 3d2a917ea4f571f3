"""A harmonic force of a frequency of its own, found as a line in the spectrum of the force that the records lack.

No grid can hold its frequency, which has to be right to a part of the resolution of the record: it is read off the missing force along
the measured motion, and the effect that has it competes with those of the catalogue. Its phase is a property of a record, as an initial
state is, since nobody starts a record with the machine: fitted in the records for identification, read off the others. So is its
frequency where it differs between records, as the speed of a rotor does; its force is then that of an unbalance, which grows with the
square of the speed. Otherwise force and frequency are what the records for identification say.

Lines at multiples of the frequency of a harmonic load are left to the load: a nonlinear force makes them.

References:
    B. G. Quinn & E. J. Hannan, The Estimation and Tracking of Frequency, Cambridge University Press 2001, ch. 3 (maximum of the
    periodogram).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import minimize_scalar

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values
from bench.discrepancy.effects.read_off import AMPLITUDE, HARMONIC
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.settings.search_parts import HarmonicForceSettings
from bench.discrepancy.unscreened.missing_force import missing_force
from bench.laws.harmonic_force import HARMONIC_FORCE


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


def with_harmonic_force(search: Search, size: int = 1) -> None:
    """Fit a harmonic force, at the place where it takes most away, where there is one and nothing explains the records yet.

    Args:
        search: Fits so far; the new one is added.
        size: Number of effects: it stands alone, or beside the best that are one fewer.
    """
    problem = search.problem
    if consistent(search.ranked()[0]):
        return
    found = [
        (place, lines)
        for place in problem.structure.places
        if len(place.rows) == 1
        for lines in _lines_at(problem, place)
    ]
    if not found:
        return
    best = max(found, key=lambda one: sum(line.amplitude**2 for line in one[1].values()))[0]
    bases = [f for f in search.ranked(size - 1) if all(p.effect.name != HARMONIC for p in f.hypothesis)]
    for base in bases[:1]:
        still = base.vector if size > 1 else np.zeros(len(problem.nominal))
        for placed, eta in (_begun(problem, *one) for one in found if one[0] is best):
            converge(search, [((*base.hypothesis, placed), np.concatenate([still, eta]))])


def _begun(problem: Problem, place: Place, lines: Mapping[str, SpectralLine]) -> tuple[Placed, Array]:
    """The effect with the lines that were found, and its parameters to start from."""
    placed = Placed(_effect(problem, place, lines), place)
    force = next(iter(lines.values())).amplitude
    eta = [AMPLITUDE.eta(force, problem.scales_of(placed))]
    eta += [p.mean for p in placed.effect.parameters if p.name.startswith("frequency")]
    eta += [line.phase for line in lines.values()]
    return placed, np.array(eta)


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
        _part(time, signal, frequency)
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
    held = sum(_part(time, load, frequency).amplitude ** 2 / 2.0 for frequency, _ in lines)
    return [frequency for frequency, _ in lines] if held > settings.harmonic * float(np.var(load)) else []


def _part(time: Array, signal: Array, frequency: float) -> SpectralLine:
    """The harmonic part (least squares) of a signal at a frequency."""
    angle = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.cos(angle), -np.sin(angle), np.ones(len(time))])
    c, s, _ = np.linalg.lstsq(basis, signal, rcond=None)[0]
    return SpectralLine(frequency, float(np.hypot(c, s)), float(np.arctan2(s, c)))


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


def _lines_at(problem: Problem, place: Place) -> list[dict[str, SpectralLine]]:
    """Lines at a place, one for each record for identification: the largest that all have at one frequency, and the largest of each."""
    found = {r.name: _lines_in(problem, r, missing_force(problem, r, place)) for r in problem.records}
    if not all(found.values()):
        return []
    resolution = max(1.0 / (len(record) * record.step) for record in problem.records)
    groups = []
    for line in next(iter(found.values())):
        nearest = {
            name: min(lines, key=lambda own: abs(own.frequency - line.frequency))
            for name, lines in found.items()
        }
        if all(abs(own.frequency - line.frequency) < resolution for own in nearest.values()):
            groups.append(nearest)
    common = sorted(groups, key=lambda group: -sum(own.amplitude**2 for own in group.values()))[:1]
    largest = {name: lines[0] for name, lines in found.items()}
    return [*common, largest] if largest not in common else common


def _lines_in(problem: Problem, record: CaseRecord, lacking: Array) -> list[SpectralLine]:
    """Lines of the force (n,) that a record lacks, but for those that its loads, or the motion prescribed, make."""
    drives = problem.structure.channels if problem.driven else problem.structure.loads
    loads = [record.values[name] for name in drives if name in record.values]
    return lines_of(record.time, lacking, loads, settings=problem.settings.search.harmonic)


def _effect(problem: Problem, place: Place, lines: Mapping[str, SpectralLine]) -> Effect:
    """The effect with the lines that were found, of one frequency where the records agree on it."""
    settings = problem.settings.search.harmonic
    records = {record.name: record for record in problem.records}
    resolution = {name: 1.0 / (len(record.time) * record.step) for name, record in records.items()}
    told = [line.frequency for line in lines.values()]
    one = max(told) - min(told) < max(resolution.values())
    own = ["frequency"] if one else [f"frequency_{name}" for name in lines]
    frequencies = []
    for parameter, name in zip(own, lines, strict=False):
        middle = float(np.mean(told)) if one else lines[name].frequency
        spread = resolution[name] / middle
        ends = (math.log(middle) - settings.drawn * spread, math.log(middle) + settings.drawn * spread)
        frequencies.append(
            FreeParameter(parameter, mean=math.log(middle), std=spread, bounds=ends, unit="Hz")
        )
    phases = [
        FreeParameter(
            f"phase_{name}", signed=True, std=math.pi, bounds=(-3.0 * math.pi, 3.0 * math.pi), unit="rad"
        )
        for name in lines
    ]
    judging = {}
    for record in problem.case.validation:
        lacking = missing_force(problem, record, place)
        judging[record.name] = (record.time, lacking, _lines_in(problem, record, lacking))
    order, count, tried = list(lines), len(frequencies), sum(len(r.time) // 2 for r in records.values())

    def of_record(values: Values, record: str) -> Values:
        force, first = values[0], values[1]
        if record in lines:
            i = order.index(record)
            frequency, phase = values[1 + i % count], values[1 + count + i]
        elif record in judging:
            time, lacking, own_lines = judging[record]
            frequency = first if one or not own_lines else own_lines[0].frequency
            phase = _part(time, lacking, frequency).phase
        else:
            frequency, phase = first, 0.0
        return np.array([force * (frequency / first) ** 2, frequency, phase])

    def theta(values: Values, scales: Scales) -> Values:
        return of_record(values, order[0])

    known = effect_named(HARMONIC)
    return replace(
        known, site="joint", parameters=(AMPLITUDE, *frequencies, *phases), law=HARMONIC_FORCE, theta=theta,
        of_record=of_record, rate_bound=lambda values, scales: 2.0 * math.pi * float(np.max(values[1 : 1 + count])),
        # one of so many frequencies was chosen
        log_prior=known.log_prior - count * math.log(tried / len(records)),
    )  # fmt: skip
