"""Whether a case can be diagnosed at all, and what limits the diagnosis: bad input said plainly, with what to do.

What makes every verdict meaningless is refused (`refuse_unusable`). What only limits a verdict becomes a note (`notes`) beside it.
Notes that compare a channel with another, or with the nominal model (`checks.channel_comparison`), look for what no missing force
does: a constant factor that is that of a unit, a sign, a shift in time. An effect that the diagnosis can name itself may be noted too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor, quantisation_step, quiet_noise
from bench.discrepancy.case.schema import RIGS
from bench.discrepancy.checks.channel_comparison import comparison_notes, quoted
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.settings import DiagnosisSettings
from bench.errors import IdentificationError, RecordingError


def refuse_unusable(problem: Problem) -> None:
    """Refuse records that no diagnosis can use.

    Args:
        problem: Records and nominal model on all degrees of freedom.

    Raises:
        RecordingError: A record is too short, nothing moves the rig, nothing is measured, or two channels are one and the same.
        IdentificationError: The nominal model diverges.
    """
    records, least = problem.records, problem.settings.checks.shortest
    for record in (*problem.case.identification, *problem.case.validation):
        if len(record) < least:
            raise RecordingError(
                f"record '{record.name}' has {len(record)} samples; at least {least} are needed: give a longer record"
            )
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
            f"{quoted(loads)} never changes in the identification records, so nothing excites the rig; "
            'give a record with a load, or list those that start in motion under "starts_in_motion" in nominal.json'
        )
    if all(_constant(record, responses) for record in records):
        raise RecordingError(
            f"{quoted(responses)} never changes in the identification records; "
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
    found += comparison_notes(problem)
    return tuple(dict.fromkeys(found))


def untried_points(problem: Problem) -> tuple[str, ...]:
    """Sensors of a model of one's own that move with several joints and along no place where effects were tried, a sentence each.

    Args:
        problem: Its records and nominal model on all degrees of freedom.
    """
    structure = problem.structure
    if problem.case.rig in RIGS or problem.driven:
        return ()
    rows = [place.rows[0] for place in structure.places if len(place.rows) == 1]
    places = [row / np.linalg.norm(row) for row in rows]
    found: dict[str, str] = {}
    for observer in structure.observers:
        along = observer.row / (np.linalg.norm(observer.row) or 1.0)
        # one and the same coordinate, but for a factor and rounding
        if np.count_nonzero(along) > 1 and not any(np.isclose(abs(along @ place), 1.0) for place in places):
            moving = [dof for dof, share in zip(structure.dofs, along, strict=True) if share != 0.0]
            found[observer.channel] = f"{', '.join(moving[:-1])} and {moving[-1]}"
    return tuple(
        f"'{channel}' moves with {dofs} together, and effects were tried along joints and fixed tendons only: for a force between that "
        "point and the frame, add a fixed tendon over these joints to the model"
        for channel, dofs in found.items()
    )


def doubts(case: Case, problem: Problem) -> tuple[str, ...]:
    """Those of `notes` that speak of a fault of the records rather than of what was left open; arguments as there."""
    found: list[str] = []
    for check in (_short, _clock, _repeated, _saturated, _understated, _still, _tipping):
        found += check(case, problem)
    found += comparison_notes(problem)
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
            and _cut_off(depth, width, settings.checks.approach)
        ):
            return True
    return False


def _cut_off(depth: Array, width: float, approach: float) -> bool:
    """Whether a signal would mostly have gone on beyond its extreme where it reaches it, rather than come to rest or jump there.

    It goes on where the course of what lies within so many widths before, at least a few samples, is beyond the extreme by a width
    before it has come as far again.

    Args:
        depth: Samples (n,) below the extreme.
        width: Of the band that counts as the extreme.
        approach: Widths.
    """
    inside = depth <= width
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    beyond, dwelt = 0, 0
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if first < 4:
            continue
        far = np.flatnonzero(depth[:first][::-1] > approach * width)
        count = max(int(far[0]) if len(far) else first, 4)
        before, after = np.arange(first - count, first), np.arange(first, min(end, first + count))
        course = np.polynomial.Polynomial.fit(before, depth[before], 2 if count > 4 else 1)
        dwelt += end - first
        if float(course(after).min()) < -width:
            beyond += end - first
    return 2 * beyond > dwelt


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
