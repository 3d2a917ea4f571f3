"""Factors and signs that no missing force makes, between channels of one motion and against the nominal model; looked for before any fit.

Position, velocity and acceleration of one coordinate are derivatives of one another whatever forces act, so between two of them a
gross factor or a sign is one of the recording. Against the nominal model the bands of the spectrum decide: a wrong or missing force
changes the ratio of measured to predicted response from band to band, a unit changes it by one and the same factor in all of them; and
a resonance in the wrong place turns the sign only between the two places, a turned sensor turns it everywhere.

References:
    J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, chapter 6 (coherence, gain and phase from cross-spectra).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.case.single_axis import motion_channels
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.nominal_elements import own_force
from bench.discrepancy.settings import DEFAULT, ChecksSettings, ScaleSettings
from bench.errors import UnitError
from bench.recording.units import conversion, read_as, si_unit

Array = NDArray[np.float64]


class Spectra(NamedTuple):
    """Averaged spectra of two signals at frequencies [Hz], and which of these count."""

    frequency: Array
    first: Array
    second: Array
    cross: NDArray[np.complex128]
    counts: NDArray[np.bool_]


class Observed(NamedTuple):
    """A channel that measures motion: its name, the derivative that it measures, of which coordinate (n_dof,), and its noise."""

    channel: str
    order: int
    row: Array
    noise: float


class Pair(NamedTuple):
    """Two channels of one motion: the second over the first, derivatives taken into account, and how sure that is."""

    factor: float
    sign: float


class Bands(NamedTuple):
    """Measured over predicted in bands of a third of an octave: log ratios, correlations, middle frequencies [Hz]."""

    ratios: Array
    correlations: Array
    frequencies: Array


SUSPECTS = {
    "m": ("mm", "cm", "um", "in", "ft"), "rad": ("deg", "rev", "mrad"), "m/s": ("mm/s", "cm/s", "in/s", "km/h"),
    "rad/s": ("deg/s", "rpm"), "m/s^2": ("g", "mm/s^2", "cm/s^2", "in/s^2", "mg"), "rad/s^2": ("deg/s^2",),
    "N": ("kN", "mN", "lbf", "kgf", "gf"), "N m": ("N mm", "N cm", "mN m", "kN m", "lbf in", "lbf ft", "kgf cm", "ozf in"),
}  # fmt: skip
"""SI units, and those that a column labelled with them may really be in."""


def suspicions(declared: Case, problem: Problem, settings: ScaleSettings | None = None) -> tuple[str, ...]:
    """Factors and signs that stand between the records and any diagnosis, a sentence each with the line to change.

    Args:
        declared: The case as declared, for its units.
        problem: Its identification records and nominal model, in the units of the model.
        settings: When a factor counts.
    """
    chosen = settings or problem.settings.checks.scales
    between = tuple(dict.fromkeys(_between(declared, problem, chosen)))
    if between or problem.driven:
        return between
    return tuple(dict.fromkeys(_against_model(declared, problem, chosen)))


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
        min(settings.cycles * len(first) // peak, len(first) // 2), len(first) // settings.segments, 64
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
    factor = np.sqrt(np.sum(found.second[use]) / np.sum(found.first[use] * np.abs(derivative) ** 2))
    return Pair(float(factor), float(np.median(np.cos(np.angle(lowest)))))


def observed(problem: Problem) -> list[Observed]:
    """Channels that measure motion, a prescribed one included, with their noise as it shows."""
    if problem.driven:
        records = problem.records
        return [
            Observed(
                name, order, np.ones(1), max(shown_noise(problem.case, name, record) for record in records)
            )
            for order, name in motion_channels(problem.case).items()
        ]
    return [
        Observed(
            o.channel,
            o.order,
            o.row,
            max(shown_noise(problem.case, o.channel, record) for record in problem.records),
        )
        for o in problem.structure.observers
    ]


def shown_noise(case: Case, name: str, record: CaseRecord) -> float:
    """Noise of a channel as it shows; what is stated may be in a unit that is wrong."""
    floor = noise_floor(record.values[name])
    return min(case.channel(name).noise_std or floor, floor)


def _between(declared: Case, problem: Problem, settings: ScaleSettings) -> Iterator[str]:
    """Pairs of channels that measure derivatives of one coordinate."""
    channels = observed(problem)
    odd: dict[str, list[tuple[str, Pair, int, CaseRecord]]] = {}
    agreeing: set[str] = set()
    for i, (first, low, row, level) in enumerate(channels):
        for second, high, other, second_level in channels[i + 1 :]:
            ratio = _parallel(row, other)
            if low == high or ratio == 0.0:
                continue
            for record in problem.records:
                pair = compare_channels(
                    record.values[first], record.values[second], orders=(low, high), noise=(level, second_level),
                    step=record.step, settings=settings,
                )  # fmt: skip
                if pair is None:
                    continue
                pair = Pair(pair.factor / abs(ratio), pair.sign * np.sign(ratio))
                if grossly_apart(pair, settings):
                    odd.setdefault(second, []).append((first, pair, high - low, record))
                    odd.setdefault(first, []).append(
                        (second, Pair(1.0 / pair.factor, pair.sign), low - high, record)
                    )
                else:
                    agreeing |= {first, second}
    blamed = [name for name in odd if name not in agreeing] or list(odd)
    told: set[frozenset[str]] = set()
    for name in blamed:
        for other, pair, orders, record in odd[name]:
            if frozenset((name, other)) not in told:
                told.add(frozenset((name, other)))
                yield pair_words(
                    declared, name, other, pair, orders, record, settings=problem.settings.checks
                )


def _parallel(row: Array, other: Array) -> float:
    """Second row over the first where they read one coordinate; zero where they do not."""
    at = int(np.argmax(np.abs(row)))
    ratio = float(other[at] / row[at]) if row[at] else 0.0
    return ratio if np.allclose(other, ratio * row, atol=1e-9 * float(np.abs(other).max())) else 0.0


def grossly_apart(pair: Pair, settings: ScaleSettings) -> bool:
    """Whether two channels of one motion are apart by what no calibration leaves."""
    return abs(np.log(pair.factor)) > np.log(settings.gross) or pair.sign < -0.5


def pair_words(
    declared: Case,
    name: str,
    other: str,
    pair: Pair,
    orders: int,
    record: CaseRecord,
    *,
    settings: ChecksSettings,
) -> str:
    """What is wrong between two channels of one motion, with the line to change.

    Args:
        declared: The case as declared, for its units.
        name: The channel of the higher order.
        other: The other one.
        pair: The first over the second.
        orders: By how many derivatives they differ.
        record: Where.
        settings: `ChecksSettings` of the diagnosis.
    """
    kin = {1: "the derivative", 2: "the second derivative", -1: "the integral", -2: "the double integral"}[
        orders
    ]
    if pair.sign < -0.5 and abs(np.log(pair.factor)) < np.log(3.0):
        return (
            f"'{name}' and '{other}' have opposite signs in '{record.name}': turn one of the columns round (times -1), or its sensor "
            "in the model"
        )
    clock = pair.factor ** (1.0 / orders)
    for power, unit in ((1e3, "ms"), (1e6, "us"), (1e9, "ns")):
        if abs(np.log(clock * power)) < np.log(1.25) or abs(np.log(clock / power)) < np.log(1.25):
            return (
                f"'{name}' is {pair.factor:.4g} times {kin} of '{other}' in '{record.name}', as with times in {unit}: give the column "
                "'time' in seconds, or correct the units of the two channels"
            )
    wrong = f"'{name}' is {_times(pair.factor)} {kin} of '{other}' in '{record.name}'"
    hints = [
        hint
        for who, factor in ((name, pair.factor), (other, 1.0 / pair.factor))
        if (hint := suggestion(declared, who, factor, settings.calibration))
    ]
    remedy = " or ".join(hints) or (
        f"multiply the column '{name}' by {1.0 / pair.factor:.4g} or '{other}' by {pair.factor:.4g}, whichever is wrong"
    )
    return f"{wrong}: {remedy}"


def _times(factor: float) -> str:
    return f"{factor:.4g} times" if factor >= 1.0 else f"1/{1.0 / factor:.4g} of"


def suggestion(declared: Case, name: str, factor: float, tolerance: float = 1.25) -> str:
    """What to write for the unit of a channel whose numbers are `factor` times too large; empty where no unit is known for it.

    Args:
        declared: The case as declared.
        name: The channel.
        factor: Its numbers over those that the other channels, or the model, expect.
        tolerance: Ratio up to which a factor is that of a unit.
    """
    unit = declared.channel(name).unit
    own = si_unit(unit) if unit else ""
    if not own:
        return ""
    own = own if own in SUSPECTS else next((si for si in SUSPECTS if _fits(unit, si)), own)
    if own not in SUSPECTS:
        return ""
    present = conversion(*read_as(unit, (own,)))[0]
    near = [
        (abs(np.log(conversion(*read_as(candidate, (own,)))[0] * factor / present)), candidate)
        for candidate in (own, *SUSPECTS[own])
        if candidate != unit
    ]
    distance, best = min(near)
    if distance > np.log(tolerance):
        return ""
    return f'is \'{name}\' in {best} ({unit} against {best})? Then write "unit": "{best}" at nominal.json, channels, "{name}"'


def _fits(unit: str, si: str) -> bool:
    try:
        read_as(unit, (si,))
    except UnitError:
        return False
    return True


def _against_model(declared: Case, problem: Problem, settings: ScaleSettings) -> Iterator[str]:
    """Responses that are the nominal model's but for a factor or a sign."""
    found: dict[str, list[tuple[float, float]]] = {}
    clear: set[str] = set()
    for record in problem.records:
        for name, bands in _measured_over_predicted(problem, record, settings).items():
            factor, sign = common_factor(bands, settings)
            if factor == 1.0 and sign > 0.0:
                clear.add(name)
            else:
                found.setdefault(name, []).append((factor, sign))
    odd = {name: _typical(values) for name, values in found.items() if name not in clear}
    channels, loads = problem.structure.channels, problem.structure.loads
    alike = len(odd) == len(channels) > 1 and len({sign for _, sign in odd.values()}) == 1
    if alike and np.ptp([np.log(factor) for factor, _ in odd.values()]) < np.log(settings.unit):
        yield model_words(declared, channels, loads, *_typical(list(odd.values())))
    else:
        for name, (factor, sign) in odd.items():
            yield model_words(declared, (name,), loads, factor, sign)


def _typical(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Factor and sign of several findings: the geometric mean, and minus where all of them are turned."""
    return float(np.exp(np.mean([np.log(f) for f, _ in found]))), -1.0 if all(
        s < 0.0 for _, s in found
    ) else 1.0


def common_factor(bands: Bands, settings: ScaleSettings = DEFAULT.checks.scales) -> tuple[float, float]:
    """The factor and the sign that all bands have in common; (1, 1) where they have none.

    Args:
        bands: Measured over predicted.
        settings: When a factor counts.
    """
    ratios = bands.ratios
    if len(ratios) < 3:
        return 1.0, 1.0
    middle = float(np.median(ratios))
    describes = settings.better * float(np.sum((ratios - middle) ** 2)) < float(np.sum(ratios**2))
    wide = bands.frequencies[-1] >= 2.0**settings.octaves * bands.frequencies[0]
    turned = wide and bool(np.all(bands.correlations < 0.0)) and float(np.median(bands.correlations)) < -0.5
    agrees = float(np.median(np.abs(bands.correlations))) > settings.coherence
    gross = abs(middle) > np.log(settings.any_factor) or (
        agrees and abs(middle) > np.log(settings.gross) and _is_of_a_unit(middle, settings)
    )
    return (float(np.exp(middle)) if describes and gross else 1.0), (-1.0 if turned else 1.0)


def _is_of_a_unit(log_factor: float, settings: ScaleSettings) -> bool:
    known = {
        abs(float(np.log(conversion(*read_as(unit, (si,)))[0])))
        for si, units in SUSPECTS.items()
        for unit in units
    }
    return any(abs(abs(log_factor) - one) < np.log(settings.unit) for one in known)


def _measured_over_predicted(
    problem: Problem, record: CaseRecord, settings: ScaleSettings
) -> Mapping[str, Bands]:
    """Bands of every response that both the record and the nominal model move, by channel."""
    if not record.at_rest:
        return {}  # an initial state that is estimated from the record carries its factor into the prediction
    if problem.windowed:
        return _implied_loads(problem, record, settings)
    predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
    out = {}
    for c, name in enumerate(problem.structure.channels):
        if not np.isfinite(predicted[:, c]).all():
            continue
        noise = (0.0, shown_noise(problem.case, name, record))
        bands = bands_between(spectra(predicted[:, c], record.values[name], record.step, noise, settings))
        if bands is not None:
            out[name] = bands
    return out


def _implied_loads(problem: Problem, record: CaseRecord, settings: ScaleSettings) -> Mapping[str, Bands]:
    """The same where free runs drift: the load that the measured motion implies, over that measured, for one degree of freedom."""
    structure = problem.structure
    if len(structure.dofs) != 1 or len(structure.loads) != 1 or not structure.inputs[0, 0]:
        return {}
    values = problem.split((), np.zeros(len(problem.nominal)))[0]
    linear, motion = structure.at(values), problem.motion_of(record)
    force = (
        motion.acceleration @ linear.mass
        + motion.velocity @ linear.damping
        + motion.position @ linear.stiffness
    )
    force = force + own_force(structure, values, motion, record.step)
    implied = np.asarray(force[:, 0] / structure.inputs[0, 0], dtype=np.float64)
    load = record.values[structure.loads[0]]
    bands = bands_between(spectra(load, implied, record.step, (float(problem.load_noise[0]), 0.0), settings))
    return {} if bands is None else dict.fromkeys(structure.channels[:1], bands)


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


def model_words(
    declared: Case, names: Sequence[str], loads: Sequence[str], factor: float, sign: float
) -> str:
    """A factor or sign that responses have against the nominal model; one that all have in common is likelier one of the load."""
    load, what = (" and ".join(f"'{one}'" for one in several) for several in (loads, names))
    verb = "are" if len(names) > 1 else "is"
    if factor == 1.0:
        return (
            f"{what} {'run' if len(names) > 1 else 'runs'} against what the nominal model predicts from {load}, at all frequencies: "
            f"turn the sign of {load if len(names) > 1 else what} (column times -1), or the axis in the model"
        )
    suspects = [(one, 1.0 / factor) for one in loads]
    suspects = suspects if len(names) > 1 else [(names[0], factor), *suspects]
    hints = [hint for one, times in suspects if (hint := suggestion(declared, one, times))]
    remedy = " or ".join(hints) or "no unit that is known makes it"
    return (
        f"{what} {verb} {'minus ' if sign < 0.0 else ''}{_times(factor)} what the nominal model predicts from {load}, at all frequencies "
        f"alike: {remedy}; else correct the values of the parameters"
    )
