"""The one uniform clock of a record: checked, named where it fails, repaired where asked.

A laboratory file's times are rounded when printed and jitter when recorded; a record that passes the check below is
put on an exactly uniform clock ``start + k / sample_rate``, which is what filters, spectra and integrators assume.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError

JITTER = 0.01
"""Largest deviation of a sample from the uniform clock, as a fraction of the step, that is taken for uniform.

A sample that is late by a hundredth of a step errs, on a sine of ten samples a period, by 2π/10 * 0.01 = 0.6 % of the
amplitude: below the noise of the sensors of this field. Times printed with a resolution finer than a fiftieth of the
step pass.
"""

LONGEST_REPAIR = 10
"""Most successive samples that are interpolated: beyond, a repair would invent data rather than bridge a dropout."""


def grid(start: float, sample_rate: float, n: int) -> NDArray[np.float64]:
    """The uniform clock ``start + k / sample_rate`` [s], ``(n,)``, read-only."""
    time = start + np.arange(n) / sample_rate
    time.flags.writeable = False
    return time


def uniform_clock(
    time: ArrayLike, *, sample_rate: float = 0.0, jitter: float = JITTER
) -> tuple[float, float]:
    """Start [s] and sample rate [Hz] of a uniform clock, or an error that says where it is not uniform.

    Args:
        time: Times of the samples [s], ``(n,)``.
        sample_rate: Sample rate that the clock must have [Hz]; 0 to find it.
        jitter: Largest deviation accepted, as a fraction of the step.

    Raises:
        RecordingError: Not increasing, gaps, not uniform, not finite, fewer than two samples.
    """
    t = _increasing(time)
    places = _places(t, sample_rate)
    missing = np.diff(places) - 1
    if np.any(missing > 0):
        raise RecordingError(
            f"the record has gaps: {_gap_text(t, missing)}. Cut the record there, or bridge short gaps with gaps='interpolate'"
        )
    return float(t[0]), _rate(t, places, sample_rate, jitter)


def repair(
    time: ArrayLike, values: NDArray[np.float64], *, sample_rate: float = 0.0, jitter: float = JITTER
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], dict[str, Any]]:
    """Bridge dropped samples and values that are not finite by shape-preserving interpolation.

    Piecewise cubic Hermite interpolation (PCHIP) passes through the neighbours and never overshoots them, so that a
    repaired dropout cannot become the peak of a record. Samples that are there keep their values.

    Args:
        time: Times of the samples [s], ``(n,)``.
        values: ``(n, n_channels)``, NaN or infinite where a sample is lost.
        sample_rate: Sample rate that the clock must have [Hz]; 0 to find it.
        jitter: Largest deviation from the repaired clock accepted, as a fraction of the step.

    Returns:
        Uniform time ``(m,)`` [s], sample rate [Hz], values ``(m, n_channels)``, and a report: the number of
        missing samples, each gap as (time of the last sample before it, samples), values lost by column.

    Raises:
        RecordingError: More than `LONGEST_REPAIR` successive samples are lost, or some at either end; not increasing,
            not uniform.
    """
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415

    t = _increasing(time)
    places = _places(t, sample_rate)
    missing = np.diff(places) - 1
    rate = _rate(t, places, sample_rate, jitter)
    n = int(places[-1]) + 1
    clock = grid(float(t[0]), rate, n)
    filled = np.full((n, values.shape[1]), np.nan)
    filled[places] = values
    lost: dict[int, int] = {}
    for column in range(values.shape[1]):
        good = np.isfinite(filled[:, column])
        if good.all():
            continue
        _refuse_long(clock, good)
        known = np.flatnonzero(good)
        filled[~good, column] = PchipInterpolator(known, filled[known, column])(np.flatnonzero(~good))
        lost[column] = int(np.count_nonzero(~np.isfinite(values[:, column])))
    gaps = [[float(t[i]), int(missing[i])] for i in np.flatnonzero(missing)]
    report = {"method": "pchip", "missing_samples": int(missing.sum()), "gaps": gaps, "values": lost}
    return clock, rate, filled, report


def _increasing(time: ArrayLike) -> NDArray[np.float64]:
    try:
        t = np.asarray(time, dtype=float)
    except (TypeError, ValueError):
        raise RecordingError("the times are no numbers; an array (n,) of seconds is expected") from None
    if t.ndim != 1 or t.size < 2:
        raise RecordingError(f"time has shape {t.shape}; (n,) with n >= 2 is expected")
    if not np.all(np.isfinite(t)):
        raise RecordingError(
            f"time is not finite at sample {int(np.argmin(np.isfinite(t)))}; cut the record there, "
            "or leave the time out and give sample_rate"
        )
    steps = np.diff(t)
    if np.any(steps <= 0.0):
        k = int(np.argmax(steps <= 0.0)) + 1
        if steps[k - 1] == 0.0:
            raise RecordingError(
                f"time stands still: t = {t[k]:.9g} s comes twice, at samples {k - 1} and {k}; drop the duplicate, "
                "or give sample_rate instead of the time if it was printed with too few digits"
            )
        raise RecordingError(
            f"time goes backwards: from t = {t[k - 1]:.9g} s to {t[k]:.9g} s at sample {k}; "
            "sort the record, or cut it where the next one begins"
        )
    return t


def _places(t: NDArray[np.float64], sample_rate: float) -> NDArray[np.int64]:
    """Place of each sample on the uniform clock; the median step is blind to gaps in less than half of the record."""
    if not (math.isfinite(sample_rate) and sample_rate >= 0.0):
        raise RecordingError(f"sample_rate is {sample_rate}; a finite number > 0 [Hz] is expected")
    steps = np.diff(t)
    step = 1.0 / sample_rate if sample_rate > 0.0 else float(np.median(steps))
    # a step of less than half the usual one stays a step: it is jitter, which _rate measures and refuses
    return np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / step), 1.0))]).astype(np.int64)


def _rate(t: NDArray[np.float64], places: NDArray[np.int64], sample_rate: float, jitter: float) -> float:
    """The sample rate [Hz], once the times have been found to lie on its clock."""
    rate = sample_rate or _roundest(t, places)
    late = (t - t[0]) * rate - places
    k = int(np.argmax(np.abs(late)))
    if abs(late[k]) > jitter:
        raise RecordingError(
            f"the clock is not uniform: sample {k} at t = {t[k]:.9g} s lies {100.0 * abs(late[k]):.3g} % of a step off a clock "
            f"of {rate:.9g} Hz, and {100.0 * jitter:g} % are allowed. Interpolate the record onto a uniform clock, give "
            "sample_rate instead of the time if the times are only rounded, or allow more with jitter="
        )
    return rate


def _roundest(t: NDArray[np.float64], places: NDArray[np.int64]) -> float:
    """The sample rate with the fewest digits that the clock cannot tell from its own.

    Last minus first time gives 1024.0000003 Hz for a clock of 1024 Hz printed with six decimals. Any rate that drifts
    over the whole record by no more than the times scatter anyway is as good, and the roundest of them is what was meant.
    """
    rate = float(places[-1] / (t[-1] - t[0]))
    rounding = 4.0 * float(np.spacing(np.max(np.abs(t)))) * rate
    scatter = float(np.max(np.abs((t - t[0]) * rate - places)))
    allowed = max(rounding, scatter)
    for digits in range(1, 17):
        rounder = float(f"{rate:.{digits}g}")
        if abs(rounder / rate - 1.0) * float(places[-1]) <= allowed:
            return rounder
    return rate


def _gap_text(t: NDArray[np.float64], missing: NDArray[np.int64]) -> str:
    where = np.flatnonzero(missing)
    shown = ", ".join(f"{missing[i]} after t = {t[i]:.9g} s" for i in where[:5])
    more = f", and {where.size - 5} more gaps" if where.size > 5 else ""
    total = int(missing.sum())
    return f"{total} sample{'s' * (total != 1)} missing ({shown}{more})"


def _refuse_long(clock: NDArray[np.float64], good: NDArray[np.bool_]) -> None:
    if not (good[0] and good[-1]):
        edge = clock[0] if not good[0] else clock[-1]
        raise RecordingError(
            f"values are lost at the end of the record (t = {edge:.9g} s), where nothing can be interpolated; cut them off"
        )
    known = np.flatnonzero(good)
    lost = np.diff(known) - 1
    k = int(np.argmax(lost))
    if lost[k] > LONGEST_REPAIR:
        raise RecordingError(
            f"{lost[k]} successive samples are lost after t = {clock[known[k]]:.9g} s; at most {LONGEST_REPAIR} are "
            "interpolated. Cut the record there and use the parts"
        )
