"""The time of a file in seconds: numbers in any unit, dates, times of day, and what they are probably in where nobody says."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.record_files.column_map import name_and_unit
from bench.recording.clock import suspected_unit
from bench.recording.units import conversion

_NAMES = ("time", "t", "timestamp", "zeit", "datetime", "date")  # in the order in which they are preferred
_NAMED = re.compile(rf"(?P<name>{'|'.join(_NAMES)})(?:[ _](?P<unit>s|sec|ms|us|µs|ns))?")
_WORDS = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


@dataclass(frozen=True)
class TimesSettings:
    """Numbers of `bench.record_files.times`."""

    late: float = 1e8
    """Times from here on [s] count from 1970 and leave a double too few digits for a step; they are counted from their first."""


SETTINGS = TimesSettings()


class FileTimes(NamedTuple):
    """Times of a file."""

    seconds: NDArray[np.float64]
    """``(n,)`` [s]; not yet checked."""
    notes: tuple[str, ...] = ()
    """What was assumed."""
    doubt: str = ""
    """Why the times are probably in another unit than seconds, where nothing in the file says so."""
    start: str = ""
    """The first time as the file gives it, where the seconds are counted from it."""
    told: str = ""
    """Unit that the file tells."""


def time_source(headings: Iterable[str]) -> str:
    """The heading that is a time by its name; empty where there is none."""
    ranked = []
    for place, heading in enumerate(headings):
        match = _NAMED.fullmatch(name_and_unit(heading)[0].lower())
        if match:
            ranked.append((_NAMES.index(match["name"]), place, heading))
    return min(ranked)[2] if ranked else ""


def is_time(heading: str) -> bool:
    """Whether a heading is a time by its name: "time", "t", "Time [ms]", "timestamp_ns", …."""
    return bool(time_source((heading,)))


def file_times(values: NDArray, stated: str, heading: str, *, told: str = "") -> FileTimes:
    """The times of a column.

    Args:
        values: Numbers, dates or times of day, ``(n,)``.
        stated: Unit that somebody states; empty for what the file tells.
        heading: Name of the column; a unit at its end counts as told ("time_ms").
        told: Unit that the file tells; empty for none.

    Raises:
        UnitError: The unit is none of time.
    """
    if values.dtype.kind in "mM":
        if not len(values):
            return FileTimes(np.empty(0))
        steps = (values - values[0]).astype("m8[ns]")
        seconds = steps.astype(np.int64) / 1e9
        return FileTimes(np.where(np.isnat(values), np.nan, seconds), start=str(values[0]))
    match = _NAMED.fullmatch(name_and_unit(heading)[0].lower())
    told = told or (match["unit"] if match and match["unit"] else "")
    unit = stated or told
    notes: tuple[str, ...] = ()
    doubt = ""
    numbers = values.astype(float)
    if not unit and len(numbers) > 1 and np.isfinite(numbers).all():
        likely = suspected_unit(numbers)
        since_1970 = abs(float(numbers[0])) >= 1e11
        if likely and since_1970:
            unit = likely
            notes = (
                f"the times of '{heading}' (from {numbers[0]:.6g} on) are taken for {_WORDS[likely]} since 1970; head the column "
                f"'time [{likely}]' to say so",
            )
        elif likely:
            step = float(np.median(np.diff(numbers)))
            doubt = (
                f"the times of '{heading}' step by {step:.6g}, which would be {step:.6g} s: time in {likely}? Head the column "
                f"'time [{likely}]' if so, 'time [s]' if not"
            )
    scale, _ = conversion(unit or "s", "s")
    late = len(numbers) > 0 and abs(scale * float(numbers[0])) >= SETTINGS.late
    start = str(values[0]) + (f" {unit}" if unit else "") if late else ""
    if late:
        numbers = (values - values[0]).astype(float)  # integers are subtracted before a double rounds them
    return FileTimes(numbers if scale == 1.0 else _scaled(numbers, scale), notes, doubt, start, told)


def _scaled(numbers: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    # 0.001 is no double, 1000 is: dividing by it keeps decimals where they were meant
    inverse = round(1.0 / scale) if scale < 1.0 else 0
    return numbers / inverse if inverse and abs(inverse * scale - 1.0) < 1e-12 else numbers * scale
