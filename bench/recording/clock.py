"""The one uniform clock of a record: checked, named where it fails, repaired where asked.

A laboratory file's times are rounded when printed and jitter when recorded; a record that passes the check below is
put on an exactly uniform clock ``start + k / sample_rate``, which is what filters, spectra and integrators assume.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError


@dataclass(frozen=True)
class ClockSettings:
    """Numbers of `bench.recording.clock`."""

    jitter: float = 0.01
    """Largest deviation of a sample from the uniform clock, as a fraction of the step, that is taken for uniform. A sample that is
    late by a hundredth of a step errs, on a sine of ten samples a period, by 2π/10 * 0.01 = 0.6 % of the amplitude: below the noise
    of the sensors of this field. Times printed with a resolution finer than a fiftieth of the step pass."""
    longest_repair: int = 10
    """Most successive samples that are interpolated: beyond, a repair would invent data rather than bridge a dropout."""


CLOCK_SETTINGS = ClockSettings()


def grid(start: float, sample_rate: float, n: int) -> NDArray[np.float64]:
    """The uniform clock ``start + k / sample_rate`` [s], ``(n,)``, read-only."""
    time = start + np.arange(n) / sample_rate
    time.flags.writeable = False
    return time


def samples_between(
    time: NDArray[np.float64], sample_rate: float, start: float | None, stop: float | None
) -> tuple[int, int]:
    """First sample at or after `start`, and first at or after `stop`; None for the ends of the record.

    Raises:
        RecordingError: Fewer than two samples lie there, or a time is NaN.
    """

    def place(at: float) -> int:
        if math.isnan(at):
            raise RecordingError("a time to cut the record at is NaN; a number of seconds is expected")
        steps = (at - float(time[0])) * sample_rate
        # one part in a million of a step, as in `Recording.scored`
        return math.ceil(min(max(steps, -1.0), len(time) + 1.0) - 1e-6)

    places = (0 if start is None else place(start), len(time) if stop is None else place(stop))
    first, last = (min(max(at, 0), len(time)) for at in places)
    if last - first < 2:
        raise RecordingError(
            f"fewer than two samples lie in {start} <= t < {stop} s; the record goes from {time[0]:.9g} to "
            f"{time[-1]:.9g} s in steps of {1.0 / sample_rate:.6g} s"
        )
    return first, last


def uniform_clock(
    time: ArrayLike, *, sample_rate: float = 0.0, jitter: float = CLOCK_SETTINGS.jitter
) -> tuple[float, float]:
    """Start [s] and sample rate [Hz] of a uniform clock, or an error that says where it is not uniform.

    Args:
        time: Times of the samples [s], ``(n,)``.
        sample_rate: Sample rate that the clock must have [Hz]; 0 to find it.
        jitter: Largest deviation accepted, as a fraction of the step.

    Raises:
        RecordingError: Not increasing, gaps, not uniform, not finite, fewer than two samples.
    """
    t = increasing(time)
    places = clock_places(t, sample_rate)
    refuse_gaps(t, places)
    return float(t[0]), rate_of(t, places, sample_rate, jitter)


def refuse_gaps(t: NDArray[np.float64], places: NDArray[np.int64]) -> None:
    """Refuse a clock with missing samples, and say where they are.

    Raises:
        RecordingError: Samples are missing.
    """
    if places[-1] >= len(places):
        raise RecordingError(
            f"the record has gaps: {gap_text(t, places)}. Cut the record there, or bridge short gaps with gaps='interpolate'"
        )


def increasing(time: ArrayLike) -> NDArray[np.float64]:
    """Times as an array ``(n,)`` that increases.

    Raises:
        RecordingError: No numbers, not finite, fewer than two, standing still or going backwards; says where.
    """
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


def clock_places(t: NDArray[np.float64], sample_rate: float) -> NDArray[np.int64]:
    """Place of each sample on the uniform clock ``(n,)``; the median step is blind to gaps in less than half of the record.

    Args:
        t: Increasing times [s], ``(n,)``.
        sample_rate: Sample rate that the clock must have [Hz]; 0 to find it.

    Raises:
        RecordingError: The sample rate is no finite number > 0.
    """
    if not (math.isfinite(sample_rate) and sample_rate >= 0.0):
        raise RecordingError(f"sample_rate is {sample_rate}; a finite number > 0 [Hz] is expected")
    steps = np.diff(t)
    step = 1.0 / sample_rate if sample_rate > 0.0 else float(np.median(steps))
    ratios = steps / step if step > 0.0 else np.full(len(steps), np.inf)
    if not np.all(np.isfinite(ratios)) or float(np.sum(ratios)) > 2.0**53:
        raise RecordingError(
            f"the steps of time go from {steps.min():.3g} to {steps.max():.3g} s, which no clock does; repair the times, or give "
            "sample_rate instead"
        )
    # a step of less than half the usual one stays a step: it is jitter, which rate_of measures and refuses
    places = np.concatenate([[0], np.cumsum(np.maximum(np.rint(ratios), 1.0))]).astype(np.int64)
    if places[-1] >= len(t) and not sample_rate and _is_jitter(t):
        return np.arange(len(t))
    return places


def _is_jitter(t: NDArray[np.float64]) -> bool:
    """Whether steps of more than 1.5 are two samples that jitter, one early and one late, and nothing is missing.

    A missing sample shifts all that come after it by a whole step: the line that fits best then leaves half a step on either side.
    """
    k = np.arange(len(t), dtype=float)
    slope = float(np.sum((k - k.mean()) * (t - t.mean())) / np.sum((k - k.mean()) ** 2))
    late = (t - t.mean()) / slope - (k - k.mean())
    return len(t) > 20 and float(np.max(np.abs(late - np.median(late)))) < 0.35


def rate_of(t: NDArray[np.float64], places: NDArray[np.int64], sample_rate: float, jitter: float) -> float:
    """The sample rate [Hz], once the times have been found to lie on its clock.

    Args:
        t: Increasing times [s], ``(n,)``.
        places: Place of each on the clock, ``(n,)``.
        sample_rate: Rate that the clock must have [Hz]; 0 to find it.
        jitter: Largest deviation accepted, as a fraction of the step.

    Raises:
        RecordingError: A sample lies further off the clock; says which.
    """
    rate = sample_rate or roundest(t, places)
    late = lateness(t, places, rate)
    k = int(np.argmax(np.abs(late)))
    if abs(late[k]) > jitter:
        raise not_uniform(t, late, rate, k, jitter)
    return rate


def lateness(t: NDArray[np.float64], places: NDArray[np.int64], rate: float) -> NDArray[np.float64]:
    """How much later each sample comes than the clock says ``(n,)``, as a fraction of the step."""
    return (t - t[0]) * rate - places


def not_uniform(
    t: NDArray[np.float64], late: NDArray[np.float64], rate: float, k: int, allowed: float
) -> RecordingError:
    """The error about the sample that lies furthest off the clock."""
    return RecordingError(
        f"the clock is not uniform: sample {k} at t = {t[k]:.9g} s lies {100.0 * abs(late[k]):.3g} % of a step off a clock "
        f"of {rate:.9g} Hz, and {100.0 * allowed:g} % are allowed. Interpolate the record onto a uniform clock, give "
        "sample_rate instead of the time if the times are only rounded, or allow more with jitter="
    )


def roundest(t: NDArray[np.float64], places: NDArray[np.int64]) -> float:
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


def gap_text(t: NDArray[np.float64], places: NDArray[np.int64]) -> str:
    """How many samples are missing, and after which times."""
    missing = np.diff(places) - 1
    where = np.flatnonzero(missing)
    shown = ", ".join(f"{missing[i]} after t = {t[i]:.9g} s" for i in where[:5])
    more = f", and {where.size - 5} more gaps" if where.size > 5 else ""
    total = int(missing.sum())
    return f"{total} sample{'s' * (total != 1)} missing ({shown}{more})"


def suspected_unit(t: NDArray[np.float64]) -> str:
    """The unit that times which were taken for seconds are more likely in: "ms", "us", "ns", or "" where seconds it is.

    Since 1970 less than 1e11 s have passed, and more than 1e11 ms. Otherwise the step tells: a test bench samples more often than
    twice a second, and at 2 Hz to 2 kHz a step is 0.5 to 500 ms, and so on by thousands.

    Args:
        t: Times ``(n,)``, n >= 2, as numbers.
    """
    first, step = abs(float(t[0])), float(np.median(np.diff(t)))
    for least, unit in ((1e17, "ns"), (1e14, "us"), (1e11, "ms")):
        if first >= least:
            return unit
    for least, unit in ((5e5, "ns"), (5e2, "us"), (0.5, "ms")):
        if step >= least:
            return unit
    return ""
