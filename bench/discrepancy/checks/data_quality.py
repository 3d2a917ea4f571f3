"""Whether a case can be diagnosed at all, and what limits the diagnosis: bad input said plainly, with what to do.

What makes every verdict meaningless is refused (`refuse`). What only limits a verdict becomes a note (`notes`) beside it.
Notes that compare a channel with another, or with the nominal model, look for what no missing force does: a constant
factor that is that of a unit, a sign, a shift in time. An effect that the diagnosis can name itself may be noted too.

References:
    J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, section 5.2 (delay from the phase of a cross-spectrum).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor, quantisation_step, quiet_noise
from bench.discrepancy.checks.scales import observed
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.settings import DEFAULT, ChecksSettings, DiagnosisSettings
from bench.errors import IdentificationError, RecordingError

UNITS = {
    1000.0: "m against mm", 100.0: "m against cm", 39.3701: "m against inch", 25.4: "inch against mm",
    9.80665: "m/s^2 against g", 9806.65: "mm/s^2 against g", 386.089: "inch/s^2 against g", 57.2958: "rad against degrees",
    4.44822: "N against lbf",
}  # fmt: skip
"""Factors that a mistaken unit leaves."""


def refuse(problem: Problem) -> None:
    """Refuse records that no diagnosis can use.

    Args:
        problem: Records and nominal model on all degrees of freedom.

    Raises:
        RecordingError: Nothing moves the rig, nothing is measured, or two channels are one and the same.
        IdentificationError: The nominal model diverges.
    """
    records = problem.records
    for record in records:
        names = list(record.values)
        for i, first in enumerate(names):
            for second in names[:i]:
                if np.ptp(record.values[first]) > 0.0 and np.array_equal(
                    record.values[first], record.values[second]
                ):
                    raise RecordingError(
                        f"'{second}' and '{first}' are the same numbers in '{record.name}'; "
                        "one column was copied: correct the file, or take one channel out of nominal.json"
                    )
    loads, responses = problem.structure.loads, problem.structure.channels
    if all(record.at_rest for record in records) and all(_constant(r, loads) for r in records):
        raise RecordingError(
            f"{_quoted(loads)} never changes in the identification records, so nothing excites the rig; "
            'give a record with a load, or list those that start in motion under "starts_in_motion" in nominal.json'
        )
    if all(_constant(record, responses) for record in records):
        raise RecordingError(
            f"{_quoted(responses)} never changes in the identification records; "
            "look whether the sensor was connected and the columns are the right ones"
        )
    for record in records:
        predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
        if not np.isfinite(predicted).all() or np.abs(predicted).max() > 1e100:
            slow, fast = _resonances(problem)
            raise IdentificationError(
                f"the nominal model diverges in '{record.name}': its natural frequencies are {slow:.3g} to {fast:.3g} Hz, the "
                f"sample rate is {1.0 / record.step:.4g} Hz; check sign and unit of stiffness, damping and mass"
            )


def notes(case: Case, problem: Problem) -> tuple[str, ...]:
    """What limits a diagnosis, a sentence each.

    Args:
        case: The case.
        problem: Its identification records and nominal model on all degrees of freedom.
    """
    found: list[str] = [note for record in (*case.identification, *case.validation) for note in record.notes]
    for check in (_unstated, _short, _clock, _repeated, _saturated, _understated, _still, _tipping):
        found += check(case, problem)
    channels = tuple(_between_channels(problem))
    found += channels
    if not problem.driven and not channels:
        found += _against_model(problem)
    return tuple(dict.fromkeys(found))


def doubts(case: Case, problem: Problem) -> tuple[str, ...]:
    """Those of `notes` that speak of a fault of the records rather than of what was left open; arguments as there."""
    found: list[str] = []
    for check in (_short, _clock, _repeated, _saturated, _understated, _still, _tipping):
        found += check(case, problem)
    channels = tuple(_between_channels(problem))
    found += channels
    if not problem.driven and not channels:
        found += _against_model(problem)
    return tuple(dict.fromkeys(found))


def _unstated(case: Case, problem: Problem) -> Iterator[str]:
    for name in problem.structure.channels:
        if case.channel(name).noise_std is None:
            yield f"the noise of '{name}' is not stated; its high-frequency floor is taken instead"


def _tipping(case: Case, problem: Problem) -> Iterator[str]:
    """Pendulums that swing to where gravity drives them further."""
    structure, values = problem.structure, problem.nominal
    tangent = structure.at(values).stiffness
    for spring in structure.springs:
        angle = np.linspace(-spring.reach, spring.reach, problem.settings.checks.angles)
        bent = spring.slope_along(spring.coefficients(values), np.outer(angle, spring.row))
        limit = _first_loss(angle, bent + float(spring.row @ tangent @ spring.row))
        for record in case.identification + case.validation:
            reached = float(np.abs(problem.motion_of(record).position @ spring.row).max())
            if reached > limit:
                name = structure.dofs[int(np.argmax(np.abs(spring.row)))]
                yield (
                    f"'{name}' swings to {np.degrees(reached):.0f} degrees in '{record.name}'; beyond {np.degrees(limit):.0f} gravity "
                    "drives it on, and a free run leaves it there on the least error: swing it less"
                )


def _first_loss(angle: np.ndarray, stiffness: np.ndarray) -> float:
    """Smallest angle at which the stiffness changes its sign [rad], by straight lines between points; infinite without one."""
    crossings = np.flatnonzero(np.signbit(stiffness[1:]) != np.signbit(stiffness[:-1]))
    rise = stiffness[crossings + 1] - stiffness[crossings]
    zeros = angle[crossings] - stiffness[crossings] * (angle[crossings + 1] - angle[crossings]) / rise
    return float(np.min(np.abs(zeros), initial=np.inf))


def _short(case: Case, problem: Problem) -> Iterator[str]:
    settings = problem.settings.checks
    slow, fast = _resonances(problem)
    if problem.driven or slow <= 0.0:
        return
    for record in (*case.identification, *case.validation):
        periods = slow * len(record) * record.step
        if periods < settings.periods:
            yield (
                f"'{record.name}' lasts {periods:.2g} periods of the {slow:.3g} Hz resonance; "
                f"at least {settings.periods} are wanted to tell effects apart"
            )
        if fast * record.step * settings.samples_a_period > 1.0:
            yield (
                f"'{record.name}' has {1.0 / (fast * record.step):.2g} samples a period of the {fast:.3g} Hz resonance; "
                f"sample at {settings.samples_a_period * fast:.3g} Hz or more"
            )


def _clock(case: Case, problem: Problem) -> Iterator[str]:
    stated = case.options.get("sample_rate_hz")
    if not isinstance(stated, int | float):
        return
    for record in (*case.identification, *case.validation):
        if abs(stated * record.step - 1.0) > problem.settings.checks.rate:
            yield (
                f"nominal.json says {stated:.6g} Hz, the time column of '{record.name}' {1.0 / record.step:.6g} Hz; "
                "the time column was taken: check which clock is right"
            )


def _repeated(case: Case, problem: Problem) -> Iterator[str]:
    for judged in case.validation:
        for record in case.identification:
            n = min(len(judged), len(record))
            same = [
                name
                for name in problem.structure.channels
                if np.ptp(record.values[name][:n]) > 0.0
                and np.array_equal(record.values[name][:n], judged.values[name][:n])
            ]
            if same:
                yield (
                    f"'{judged.name}' repeats '{record.name}': the gap is then judged on the data it was found with; "
                    "give another record for judging"
                )


def _saturated(case: Case, problem: Problem) -> Iterator[str]:
    for record in (*case.identification, *case.validation):
        for name in (*problem.structure.loads, *problem.structure.channels):
            noise = case.channel(name).noise_std or 0.0
            if _levelled(record.values[name], noise, settings=problem.settings):
                yield (
                    f"'{name}' in '{record.name}' dwells at its extreme: "
                    "it may be saturated; a wider range or a smaller load would show"
                )


def _levelled(samples: Array, noise: float, *, settings: DiagnosisSettings) -> bool:
    """Whether a channel dwells at its upper or lower extreme as a clipped one does."""
    step = quantisation_step(samples, settings=settings.case)
    width = max(4.0 * noise, 0.005 * float(np.ptp(samples)), 1.01 * step)
    for signed in (samples, -samples):
        depth = float(signed.max()) - signed
        top = np.mean(depth <= width)
        below = np.mean((depth > width) & (depth <= 2.0 * width))
        if (
            settings.checks.levelled < top < settings.checks.square
            and top > settings.checks.neighbours * below
        ):
            return True
    return False


def _understated(case: Case, problem: Problem) -> Iterator[str]:
    for c, name in enumerate(problem.structure.channels):
        stated = case.channel(name).noise_std
        floor = min(
            min(noise_floor(record.values[name]), quiet_noise(record.values[name]))
            for record in problem.records
        )
        unit = case.channel(name).unit
        if stated and floor > problem.settings.checks.understated * max(stated, problem.noise[c]):
            yield (
                f"the noise stated for '{name}' is {stated:.3g} {unit}, but nowhere in its spectrum is there less than "
                f"{floor:.3g} {unit}; measure it at rest, or everything will look like an effect"
            )


def _still(case: Case, problem: Problem) -> Iterator[str]:
    quiet = set(problem.structure.channels)
    silent = set(problem.structure.channels)
    for record in problem.records:
        predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
        for c, name in enumerate(problem.structure.channels):
            if np.std(predicted[:, c]) > problem.noise[c]:
                quiet.discard(name)
            if np.std(record.values[name]) > 2.0 * problem.noise[c]:
                silent.discard(name)
    for name in sorted(silent):
        yield f"'{name}' hardly rises above its noise in any identification record; it says little: excite more strongly"
    for name in sorted(quiet - silent):
        yield (
            f"the nominal model predicts less than the noise for '{name}', yet it moves; check the load's unit and role, "
            "and that the record starts at rest"
        )


class Comparison(NamedTuple):
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


def compare(
    first: Array,
    second: Array,
    *,
    orders: tuple[int, int],
    noise: tuple[float, float],
    step: float,
    settings: ChecksSettings = DEFAULT.checks,
) -> Comparison | None:
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
    return Comparison(factor, correlation, lag, drift, steady)


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
        if first.order == second.order or not np.array_equal(np.abs(first.row), np.abs(second.row)):
            continue
        for record in problem.records:
            pair = compare(
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
    first: str, second: str, pair: Comparison, record: CaseRecord, *, settings: ChecksSettings
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
    """Notes on responses that are the nominal prediction but for a unit, a sign or a shift of all channels."""
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
            yield f"{_quoted(names)} is {text} Check its unit, and that of the load"
        if turned:
            whose = "the load" if len(turned) == len(moving) > 1 else _quoted(turned)
            yield f"{_quoted(turned)} runs against what the nominal model predicts; check the sign of {whose}"
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


def _constant(record: CaseRecord, names: Iterable[str]) -> bool:
    return all(np.ptp(record.values[name]) == 0.0 for name in names)


def _resonances(problem: Problem) -> tuple[float, float]:
    """Slowest and fastest undamped natural frequency of the nominal model [Hz], zero where nothing restores."""
    linear = problem.structure.at(problem.nominal)
    if problem.driven or not np.any(linear.mass):
        return 0.0, 0.0
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    return float(frequencies.min()), float(frequencies.max())


def _quoted(names: Iterable[str]) -> str:
    return " and ".join(f"'{name}'" for name in names)
