"""Channels held against one another, and against their nominal prediction: factors, signs and shifts, a sentence each.

References:
    J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, section 5.2 (delay from the phase of a cross-spectrum).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.checks.scales import observed, parallel
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.settings import DEFAULT, ChecksSettings

UNITS = {
    1000.0: "m against mm", 100.0: "m against cm", 39.3701: "m against inch", 25.4: "inch against mm",
    9.80665: "m/s^2 against g", 9806.65: "mm/s^2 against g", 386.089: "inch/s^2 against g", 57.2958: "rad against degrees",
    4.44822: "N against lbf",
}  # fmt: skip
"""Factors that a mistaken unit leaves."""


def comparison_notes(problem: Problem) -> list[str]:
    """Factors, signs and shifts between channels, a sentence each; where there are none, those against the nominal model.

    Args:
        problem: Records and nominal model on all degrees of freedom.
    """
    found = list(_between_channels(problem))
    return found if found or problem.driven else list(_against_model(problem))


class ChannelComparison(NamedTuple):
    """Two channels of the same motion, over the frequencies at which both are strong.

    Attributes:
        factor: RMS of the first over that of the second, derivatives taken into account.
        correlation: In [-1, 1].
        lag: Time by which the first lags the second [s].
        drift: Change of the lag from start to end [s].
        steady: Part of the variation of the lag over the pieces of the record that a straight line explains.
    """

    factor: float
    correlation: float
    lag: float
    drift: float
    steady: float


def compare_channels(
    first: Array,
    second: Array,
    *,
    orders: tuple[int, int],
    noise: tuple[float, float],
    step: float,
    settings: ChecksSettings = DEFAULT.checks,
) -> ChannelComparison | None:
    """Compare two channels that measure derivatives of one motion.

    Args:
        first: (n,) samples.
        second: (n,) samples.
        orders: Derivative that each measures.
        noise: Their noise.
        step: Time between samples [s].
        settings: `ChecksSettings` of the diagnosis.

    Returns:
        The comparison; None where there is no frequency at which both are strong.
    """
    whole = _cross(first, second, orders, noise, step, settings=settings)
    if whole is None:
        return None
    factor, correlation, lag = whole
    pieces = []
    for part in np.array_split(np.arange(len(first)), settings.pieces):
        local = _cross(first[part], second[part], orders, noise, step, settings=settings)
        if local is not None:
            pieces.append((float(np.mean(part)), local[2]))
    drift = steady = 0.0
    if len(pieces) >= settings.pieces // 2:
        x, y = np.array(pieces).T
        slope, offset = np.polyfit(x, y, 1)
        drift = float(slope * len(first))
        steady = 1.0 - float(np.var(y - slope * x - offset) / max(np.var(y), 1e-300))
    return ChannelComparison(factor, correlation, lag, drift, steady)


def _cross(
    first: Array,
    second: Array,
    orders: tuple[int, int],
    noise: tuple[float, float],
    step: float,
    *,
    settings: ChecksSettings,
):
    """Factor, correlation and lag from the cross-spectrum of two windowed channels."""
    n = len(first)
    window = np.hanning(n)
    omega = 2.0 * np.pi * np.fft.rfftfreq(n, step)
    x, y = (np.fft.rfft((c - c.mean()) * window) for c in (first, second))
    floor = 0.375 * n
    strong = (np.abs(x) ** 2 > settings.strong * noise[0] ** 2 * floor) & (
        np.abs(y) ** 2 > settings.strong * noise[1] ** 2 * floor
    )
    # the window leaks a strong resonance into the lowest and highest frequencies, where a derivative magnifies it
    strong &= (np.abs(x) > 0.01 * np.abs(x).max()) | (np.abs(y) > 0.01 * np.abs(y).max())
    strong[:3] = False
    if np.count_nonzero(strong) < 4:
        return None
    x, y, omega = x[strong], y[strong], omega[strong]
    x = x * (1j * omega) ** (orders[1] - orders[0])
    cross = np.conj(x) * y
    correlation = float(np.real(cross.sum()) / np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2)))
    sign = 1.0 if correlation >= 0.0 else -1.0
    weight = np.abs(cross)
    lag = float(np.sum(weight * omega * np.angle(sign * cross)) / np.sum(weight * omega**2))
    aligned = np.real(np.sum(cross * np.exp(-1j * omega * lag)))
    correlation = float(aligned / np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2)))
    return float(np.sqrt(np.sum(np.abs(x) ** 2) / np.sum(np.abs(y) ** 2))), correlation, lag


def _between_channels(problem: Problem) -> Iterator[str]:
    """Notes on pairs of channels that measure the same motion: unit, sign, lag, clock."""
    levels = dict(zip(problem.structure.channels, problem.noise, strict=True))
    for first, second in combinations(observed(problem), 2):
        if first.order == second.order or not np.isclose(abs(parallel(first.row, second.row)), 1.0):
            continue
        for record in problem.records:
            pair = compare_channels(
                record.values[first.channel],
                record.values[second.channel],
                orders=(first.order, second.order),
                noise=(levels.get(first.channel, first.noise), levels.get(second.channel, second.noise)),
                step=record.step,
                settings=problem.settings.checks,
            )
            if pair is not None:
                yield from _pair_notes(
                    first.channel, second.channel, pair, record, settings=problem.settings.checks
                )


def _pair_notes(
    first: str, second: str, pair: ChannelComparison, record: CaseRecord, *, settings: ChecksSettings
) -> Iterator[str]:
    if abs(pair.correlation) < settings.shape:
        return
    if pair.correlation < 0.0:
        yield f"'{first}' and '{second}' have opposite signs; turn one of them round"
    unit = unit_factor(pair.factor, settings.factor_between_channels)
    if unit:
        yield f"'{first}' is {pair.factor:.4g} times what '{second}' says: {unit}? Check the units of the two"
    if abs(pair.lag) > record.step:
        late, early = (first, second) if pair.lag > 0.0 else (second, first)
        yield f"'{late}' lags '{early}' by {1e3 * abs(pair.lag):.3g} ms in '{record.name}'; align the channels if that is known"
    if abs(pair.drift) > 2.0 * record.step and pair.steady > settings.shape:
        yield (
            f"the lag between '{first}' and '{second}' changes by {1e3 * pair.drift:.3g} ms along '{record.name}': "
            "their clocks drift apart; resample one of them"
        )


def _against_model(problem: Problem) -> Iterator[str]:
    """Notes on responses that are the nominal prediction but for a unit, a sign or a shift of all channels.

    None where nothing holds the motion: what a load moves in excess of missing friction drifts away, whatever the units. There the load
    that the motion implies is compared (`checks.scales`).
    """
    if problem.windowed:
        return
    settings = problem.settings.checks
    for i, record in enumerate(problem.records):
        predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
        scaled: dict[str, list[str]] = {}
        turned = []
        moving = [
            c
            for c, name in enumerate(problem.structure.channels)
            if min(np.std(predicted[:, c]), np.std(record.values[name])) > 10.0 * problem.noise[c]
        ]
        for c in moving:
            name = problem.structure.channels[c]
            correlation = float(np.corrcoef(predicted[:, c], record.values[name])[0, 1])
            factor = float(np.std(record.values[name]) / np.std(predicted[:, c]))
            unit = unit_factor(factor, settings.factor_to_model)
            if unit and (abs(correlation) > settings.shape or not 0.02 < factor < 50.0):
                scaled.setdefault(f"{factor:.3g} times what the nominal model predicts: {unit}?", []).append(
                    name
                )
            if correlation < -settings.shape:
                turned.append(name)
        for text, names in scaled.items():
            yield f"{quoted(names)} is {text} Check its unit, and that of the load"
        if turned:
            whose = "the load" if len(turned) == len(moving) > 1 else quoted(turned)
            yield f"{quoted(turned)} runs against what the nominal model predicts; check the sign of {whose}"
        elif not scaled:
            yield from _shifted(problem, i, predicted)


def _shifted(problem: Problem, index: int, predicted: Array) -> Iterator[str]:
    """A shift of all channels against a measured load, that the nominal parameters cannot imitate."""
    settings = problem.settings.checks
    record = problem.records[index]
    orders = {o.order for o in problem.structure.observers}
    measured = any(problem.case.channel(name).role == "measured" for name in problem.structure.loads)
    if len(orders) < 2 or len(problem.nominal) > 6 or not measured or not record.at_rest:
        return
    scale = np.array([np.std(record.values[name]) for name in problem.structure.channels])
    columns = []
    for p in np.flatnonzero(problem.spread > 0.0):
        moved = np.zeros(len(problem.nominal))
        moved[p] = 0.1
        columns.append(10.0 * (problem.simulate((), moved, record) - predicted) / scale)
    responses = np.column_stack([record.values[name] for name in problem.structure.channels]) / scale
    shifts = np.arange(-settings.shifts, settings.shifts + 1)
    model = predicted / scale
    powers = np.sum(responses**2) + np.sum(model**2) - 2.0 * _correlated(responses, model, shifts)
    if columns:
        basis, _ = np.linalg.qr(np.column_stack([column.ravel() for column in columns]))
        for direction in basis.T:
            imitated = direction.reshape(responses.shape)
            powers -= (_correlated(responses, imitated, shifts) - np.sum(imitated * model)) ** 2
    best = int(shifts[int(np.argmin(powers))])
    still = powers[settings.shifts]
    if abs(best) > 1 and min(powers) < 0.1 * still and still > 1e-3 * responses.size:
        verb = "lag" if best > 0 else "lead"
        yield (
            f"all responses {verb} the measured load by {1e3 * abs(best) * record.step:.3g} ms in '{record.name}'; "
            "the load was recorded on another clock, or is a command: align it, or give it the role command"
        )


def _correlated(first: Array, second: Array, shifts: NDArray[np.int64]) -> Array:
    """Sum over samples and channels of ``first[k + s] second[k]`` for every shift s."""
    size = len(first) + int(np.abs(shifts).max())
    spectra = (np.fft.rfft(x, size, axis=0) for x in (first, second))
    product = next(spectra) * np.conj(next(spectra))
    return np.asarray(np.fft.irfft(product.sum(axis=1), size)[shifts], dtype=np.float64)


def unit_factor(factor: float, tolerance: float) -> str:
    """Name of the mistaken unit that a factor, or its inverse, suggests; empty where there is none.

    Args:
        factor: Ratio of two magnitudes.
        tolerance: Relative.
    """
    if not (np.isfinite(factor) and factor > 0.0):
        return ""
    distance, name = min((abs(abs(np.log(factor)) - np.log(known)), name) for known, name in UNITS.items())
    return name if distance < np.log1p(tolerance) else ""


def quoted(names: Iterable[str]) -> str:
    """Names in quotes, joined."""
    return " and ".join(f"'{name}'" for name in names)
