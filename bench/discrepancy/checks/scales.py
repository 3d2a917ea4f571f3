"""Factors and signs that no missing force makes, between channels of one motion and against the nominal model; looked for before any fit.

Position, velocity and acceleration of one coordinate are derivatives of one another whatever forces act, so between two of them a
gross factor or a sign is one of the recording. Against the nominal model the bands of the spectrum decide: a wrong or missing force
changes the ratio of measured to predicted response from band to band, a unit changes it by one and the same factor in all of them; and
a resonance in the wrong place turns the sign only between the two places, a turned sensor turns it everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.case.single_axis import motion_channels
from bench.discrepancy.checks.bands import (
    SUSPECTS,
    Bands,
    Pair,
    bands_between,
    common_factor,
    compare_channels,
    spectra,
)
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.nominal_elements import own_force
from bench.discrepancy.settings import ChecksSettings, ScaleSettings
from bench.errors import UnitError
from bench.recording.units import conversion, read_as, si_unit


class Observed(NamedTuple):
    """A channel that measures motion: its name, the derivative that it measures, of which coordinate (n_dof,), and its noise."""

    channel: str
    order: int
    row: Array
    noise: float


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
            ratio = parallel(row, other)
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


def parallel(row: Array, other: Array) -> float:
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
    derived = {
        1: "the derivative",
        2: "the second derivative",
        -1: "the integral",
        -2: "the double integral",
    }[orders]
    if pair.sign < -0.5 and abs(np.log(pair.factor)) < np.log(3.0):
        return (
            f"'{name}' and '{other}' have opposite signs in '{record.name}': turn one of the columns round (times -1), or its sensor "
            "in the model"
        )
    clock = pair.factor ** (1.0 / orders)
    for power, unit in ((1e3, "ms"), (1e6, "us"), (1e9, "ns")):
        if abs(np.log(clock * power)) < np.log(1.25) or abs(np.log(clock / power)) < np.log(1.25):
            return (
                f"'{name}' is {pair.factor:.4g} times {derived} of '{other}' in '{record.name}', as with times in {unit}: give the column "
                "'time' in seconds, or correct the units of the two channels"
            )
    wrong = f"'{name}' is {_times(pair.factor)} {derived} of '{other}' in '{record.name}'"
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
