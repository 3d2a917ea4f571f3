"""What is done about clocks and values that are not quite sound: bridged, interpolated and said, or refused.

Everything that is changed in a record is told in a sentence (`Mended.notes`), which travels into the warnings of a verdict.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError
from bench.recording.clock import (
    CLOCK_SETTINGS,
    clock_places,
    gap_text,
    grid,
    increasing,
    lateness,
    not_uniform,
    refuse_gaps,
    roundest,
    uniform_clock,
)


@dataclass(frozen=True)
class MendingSettings:
    """Numbers of `bench.recording.mending`."""

    most_jitter: float = 0.3
    """Largest deviation of a sample from the uniform clock, as a fraction of the step, at which the record is still interpolated.
    Samples of a signal without content above half the sample rate determine it as long as none is off by a quarter of a step (Kadec
    1964); records of the field are sampled several times faster than that, which stretches the bound a little."""


SETTINGS = MendingSettings()


class Mended(NamedTuple):
    """A record on a uniform clock, and what was done to bring it there."""

    time: NDArray[np.float64]
    """Uniform times [s], ``(m,)``."""
    sample_rate: float
    """Samples a second [Hz]."""
    values: NDArray[np.float64]
    """``(m, n_channels)``."""
    report: dict[str, Any]
    """What was interpolated, for ``meta["repaired"]``; empty where nothing was."""
    notes: tuple[str, ...]
    """The same in sentences."""


def on_clock(
    time: ArrayLike,
    values: NDArray[np.float64],
    names: Sequence[str],
    *,
    sample_rate: float,
    jitter: float,
    mend: bool,
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], dict[str, Any]]:
    """Clock, sample rate and values of a record; with `mend` as `mended` leaves them, with its report, else as they are or an error."""
    if mend:
        return mended(time, values, names, sample_rate=sample_rate, jitter=jitter)[:4]
    start, rate = uniform_clock(time, sample_rate=sample_rate, jitter=jitter)
    return grid(start, rate, np.size(time)), rate, values, {}


def mended(
    time: ArrayLike,
    values: NDArray[np.float64],
    names: Sequence[str],
    *,
    sample_rate: float = 0.0,
    jitter: float = CLOCK_SETTINGS.jitter,
    bridge: bool = True,
) -> Mended:
    """A record on an exactly uniform clock: jitter interpolated away, dropped samples and values that are not finite bridged.

    Jitter of more than a hundredth of a step is taken for real: the record is interpolated from the times that were measured by a
    cubic spline, up to `most_jitter`. Times that are only rounded (all of them multiples of a decimal, none off by more than half
    of it) stay where they are. Dropouts are bridged by piecewise cubic Hermite interpolation (PCHIP), which passes through the
    neighbours and never overshoots them, so that a repaired dropout cannot become the peak of a record.

    Args:
        time: Times of the samples [s], ``(n,)``.
        values: ``(n, n_channels)``, NaN or infinite where a sample is lost.
        names: Names of the channels.
        sample_rate: Sample rate that the clock must have [Hz]; 0 to find it.
        jitter: Largest deviation that is taken for uniform, as a fraction of the step.
        bridge: Whether missing samples and lost values are bridged, or refused.

    Raises:
        RecordingError: More than `longest_repair` successive samples are lost, or some at either end; samples missing where they
            are not to be bridged; times not increasing, or further off a uniform clock.

    References:
        Kadec, M. I. (1964), The exact value of the Paley-Wiener constant, Doklady Akademii Nauk SSSR 155.
        Fritsch, F. N. and Carlson, R. E. (1980), Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17.
    """
    t = increasing(time)
    places = clock_places(t, sample_rate)
    if not bridge:
        refuse_gaps(t, places)
    rate, moved, notes = _settled(t, places, sample_rate, jitter)
    n = int(places[-1]) + 1
    if n - len(t) > CLOCK_SETTINGS.longest_repair * (
        len(t) - 1
    ):  # before memory is taken for a clock that is all gaps
        raise RecordingError(f"the record is mostly gaps: {gap_text(t, places)}. Cut it into its parts")
    clock = grid(float(t[0]), rate, n)
    if moved is not None or n > len(t) or (bridge and not np.isfinite(values).all()):
        values, lost = _interpolated(t, places, clock, values, moved is not None)
        report, more = _report(t, places, moved, lost, names)
        return Mended(clock, rate, values, report, (*notes, *more))
    return Mended(clock, rate, values, {}, tuple(notes))


def _settled(
    t: NDArray[np.float64], places: NDArray[np.int64], sample_rate: float, jitter: float
) -> tuple[float, float | None, list[str]]:
    """Sample rate [Hz], the jitter to be interpolated away (None for none), and what is to be said."""
    rate = sample_rate or roundest(t, places)
    late = lateness(t, places, rate)
    if float(np.max(np.abs(late))) <= jitter:
        return rate, None, []
    if not sample_rate:
        rate = _fitted_rate(t, places)
        late = lateness(t, places, rate)
    late = late - np.median(late)  # the first sample jitters, too
    worst = int(np.argmax(np.abs(late)))
    digit = _printed_digit(t)
    spread = float(np.ptp(late))
    # rounding moves no sample by more than half a digit, so that two differ by one at most; a little for the fit of the line
    if digit and spread <= 1.05 * digit * rate and spread < 1.0:
        return rate, None, [
            f"the times are rounded to {digit:.6g} s, up to {100.0 * abs(late[worst]):.3g} % of a step off: taken for a uniform "
            f"clock of {rate:.9g} Hz"
        ]  # fmt: skip
    if abs(late[worst]) > SETTINGS.most_jitter:
        raise not_uniform(t, late, rate, worst, SETTINGS.most_jitter)
    return rate, float(np.max(np.abs(late))), [
        f"the clock jitters by up to {100.0 * abs(late[worst]):.3g} % of a step (at t = {t[worst]:.6g} s; rms "
        f"{100.0 * float(np.std(late)):.2g} %): the record is interpolated onto a uniform clock of {rate:.9g} Hz"
    ]  # fmt: skip


def _fitted_rate(t: NDArray[np.float64], places: NDArray[np.int64]) -> float:
    """Sample rate of the line that fits all times best, as round as their scatter allows [Hz]."""
    k = places - places.mean()
    centred = t - t.mean()
    rate = float(np.sum(k * k) / np.sum(k * centred))
    scatter = float(np.std(centred * rate - k))
    # standard deviation of a slope from n scattered points
    uncertain = 2.0 * scatter / math.sqrt(float(np.sum(k * k)))
    for digits in range(1, 17):
        rounder = float(f"{rate:.{digits}g}")
        if abs(rounder / rate - 1.0) <= uncertain:
            return rounder
    return rate


def _printed_digit(t: NDArray[np.float64]) -> float:
    """The decimal, or the spacing of doubles, that all times are multiples of [s]; 0 where there is none coarser than 1e-12."""
    resolution = float(np.spacing(np.max(np.abs(t))))
    for digits in range(13):
        scaled = t * 10.0**digits
        if np.all(np.abs(scaled - np.rint(scaled)) <= 4.0 * resolution * 10.0**digits + 1e-9):
            return max(10.0**-digits, resolution)
    return resolution


def _interpolated(
    t: NDArray[np.float64],
    places: NDArray[np.int64],
    clock: NDArray[np.float64],
    values: NDArray[np.float64],
    moved: bool,
) -> tuple[NDArray[np.float64], dict[int, int]]:
    """Values on the clock ``(m, n_channels)``, and the number of values that were lost by column."""
    from scipy.interpolate import CubicSpline, PchipInterpolator  # noqa: PLC0415

    filled = np.full((len(clock), values.shape[1]), np.nan, order="F")
    filled[places] = values
    lost: dict[int, int] = {}
    for column in range(values.shape[1]):
        good = np.isfinite(filled[:, column])
        there = good[places]
        if not good.all():
            refuse_long(clock, good)
            lost[column] = int(np.count_nonzero(~there))
        known = np.flatnonzero(good)
        samples = filled[known, column]
        if moved:
            bad = np.flatnonzero(~good)
            at = t[there]
            filled[:, column] = CubicSpline(at, samples)(clock)
            if bad.size:
                filled[bad, column] = PchipInterpolator(at, samples)(clock[bad])
        elif not good.all():
            filled[~good, column] = PchipInterpolator(known, samples)(np.flatnonzero(~good))
    return filled, lost


def _report(
    t: NDArray[np.float64],
    places: NDArray[np.int64],
    moved: float | None,
    lost: dict[int, int],
    names: Sequence[str],
) -> tuple[dict[str, Any], list[str]]:
    missing = np.diff(places) - 1
    gaps = [[float(t[i]), int(missing[i])] for i in np.flatnonzero(missing)]
    counts = {names[column]: count for column, count in lost.items() if count}
    report: dict[str, Any] = {
        "method": "pchip",
        "missing_samples": int(missing.sum()),
        "gaps": gaps,
        "values": counts,
    }
    notes = []
    if gaps:
        notes.append(f"{gap_text(t, places)}: bridged by interpolation")
    if counts:
        listed = ", ".join(f"{count} of '{name}'" for name, count in list(counts.items())[:6])
        notes.append(f"values that are not finite are bridged by interpolation: {listed}")
    if moved is not None:
        report |= {"method": "cubic spline", "jitter": moved}
    return report, notes


def refuse_long(clock: NDArray[np.float64], good: NDArray[np.bool_]) -> None:
    """Refuse a channel in which too many successive samples are lost, or some at an end.

    Args:
        clock: Times [s], ``(n,)``.
        good: Whether each sample is there, ``(n,)``.

    Raises:
        RecordingError: Says where.
    """
    if not (good[0] and good[-1]):
        edge = clock[0] if not good[0] else clock[-1]
        raise RecordingError(
            f"values are lost at the end of the record (t = {edge:.9g} s), where nothing can be interpolated; cut them off"
        )
    known = np.flatnonzero(good)
    lost = np.diff(known) - 1
    k = int(np.argmax(lost))
    if lost[k] > CLOCK_SETTINGS.longest_repair:
        raise RecordingError(
            f"{lost[k]} successive samples are lost after t = {clock[known[k]]:.9g} s; at most {CLOCK_SETTINGS.longest_repair} are "
            "interpolated. Cut the record there and use the parts"
        )
