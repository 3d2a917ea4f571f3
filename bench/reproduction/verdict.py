"""What may be said of a quantity of the dissertation beside ours, and the rows that say it.

A row states what is printed and where, ours, the tolerance with its reason, and one of four verdicts. Four rules:

* Every row that is judged is judged by a rule fixed by the source or by a statistic, never by what came out.
* Where a seed was chosen, the verdict is that of the median over `seeds`, not of the record shown.
* A row whose quantity was put in, directly or by choosing parameters, says so in `chosen`; it is no evidence.
* A row of which the text prints nothing is a check of our own; it says nothing of the dissertation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class VerdictSetup:
    """Numbers of `bench.reproduction.verdict`."""

    seeds: range = range(1, 11)
    """Seeds of the excitations over which a spread is told."""
    good_fit: float = 5.0
    """NMSE below which a fit counts as good [%] (Worden and Tomlinson 2001; section 3.4.2 of the text)."""


VERDICT_SETUP = VerdictSetup()

AXIS_REASON = (
    "the text prints an axis, not extremes: data lie inside an axis's ends and beyond its last label but one, "
    "or a smaller axis would have been drawn"
)
OWN = "not in the text: a check of our own"
"""Source of rows of which the dissertation prints nothing."""


class RowVerdict(StrEnum):
    """What may be said of a row."""

    HOLDS = "holds"
    SHAPE = "holds in shape"
    FAILS = "does not hold"
    NOT_COMPARABLE = "not comparable"


class Row(NamedTuple):
    """One quantity of the dissertation beside ours.

    Attributes:
        quantity: What it is.
        unit: Its unit; empty for what has none.
        printed: What is printed, as text; empty where the text prints nothing.
        source: Figure, page and kind of what is printed: axis label, number, sentence; `OWN` where nothing is printed.
        ours: Ours, as text: that of the record shown.
        spread: The same over `seeds`; empty where no seed was chosen.
        tolerance: When it holds, as text; empty where it cannot be judged.
        reason: Why this tolerance; where it cannot be judged, why not.
        verdict: The verdict.
        chosen: What was chosen, searched or put in so that it comes out; empty where nothing was.
        deviation: Deviation from the printed value [%]; None where that has no meaning.
        why: Why it does not hold or holds in shape only, as far as known.
    """

    quantity: str
    unit: str
    printed: str
    source: str
    ours: str
    spread: str
    tolerance: str
    reason: str
    verdict: RowVerdict
    chosen: str = ""
    deviation: float | None = None
    why: str = ""

    @property
    def own(self) -> bool:
        """Whether this is a check of our own."""
        return not self.printed

    @property
    def holds(self) -> bool | None:
        """Whether it holds, in shape included; None where it cannot be judged."""
        if self.verdict is RowVerdict.NOT_COMPARABLE:
            return None
        return self.verdict is not RowVerdict.FAILS

    def cells(self) -> tuple[str, ...]:
        """The row as text, in the order of `HEADER`."""
        quantity = f"{self.quantity} [{self.unit}]" if self.unit else self.quantity
        printed = f"{self.printed} ({self.source})" if self.printed else f"({self.source})"
        tolerance = f"{self.tolerance}: {self.reason}" if self.tolerance else self.reason
        verdict = self.verdict.value + (f" (chosen: {self.chosen})" if self.chosen else "")
        return quantity, printed, self.ours, self.spread, tolerance, verdict

    def to_dict(self) -> dict[str, Any]:
        """The row as JSON values."""
        return self._asdict() | {"verdict": self.verdict.value, "own": self.own, "holds": self.holds}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Row:
        """The row from the values of `to_dict`."""
        plain = {name: values[name] for name in cls._fields if name != "verdict"}
        return cls(**plain, verdict=RowVerdict(values["verdict"]))


HEADER = ("quantity", "printed (where)", "ours", "over ten seeds", "tolerance and its reason", "verdict")
"""Headings of the cells of a row."""


def spread_text(values: ArrayLike) -> str:
    """Median, least and largest of values over seeds."""
    array = np.asarray(values, dtype=float)
    return f"{np.median(array):.3g} ({array.min():.3g} … {array.max():.3g})"


def axis_row(
    quantity: str,
    unit: str,
    axis: float,
    inner: float,
    values: ArrayLike,
    *,
    source: str,
    below: tuple[float, float] | None = None,
    seeds: Sequence[ArrayLike] = (),
    chosen: str = "",
    why: str = "",
) -> Row:
    """The range of a record beside a printed axis.

    Args:
        quantity: What it is.
        unit: Its unit.
        axis: Last label of the printed axis.
        inner: Its last label but one.
        values: The record (n,), of which the smallest and the largest value count.
        source: Where the axis is printed.
        below: The same of the negative end, without sign; as of the positive end where None.
        seeds: Records of other seeds, (n,) each; the verdict is that of their median ends.
        chosen: As of `Row`.
        why: As of `Row`.
    """
    ends = np.array([[-float(np.min(record)), float(np.max(record))] for record in (values, *seeds)])
    judged = np.median(ends[1:], axis=0) if len(seeds) else ends[0]
    spread = ""
    if len(seeds):
        (least_low, least_high), (most_low, most_high) = ends[1:].min(axis=0), ends[1:].max(axis=0)
        spread = f"{-most_low:.3g} to {-least_low:.3g} … {least_high:.3g} to {most_high:.3g}"
    low, inner_low = below or (axis, inner)
    outer, least = np.array([low, axis]), np.array([inner_low, inner])
    inside = bool(np.all((judged >= least) & (judged <= outer)))
    between = f"both ends between {inner:g} and {axis:g}"
    if below is not None:
        between = f"low end between -{low:g} and -{inner_low:g}, high end between {inner:g} and {axis:g}"
    return Row(
        quantity,
        unit,
        f"±{axis:g}" if below is None else f"-{low:g} … {axis:g}",
        f"{source}, axis labels",
        f"{-ends[0, 0]:.3g} … {ends[0, 1]:.3g}",
        spread,
        between + (", median of the seeds" if len(seeds) else ""),
        AXIS_REASON,
        RowVerdict.HOLDS if inside else RowVerdict.FAILS,
        chosen,
        100.0 * float(np.max(judged / outer) - 1.0),
        why,
    )


def value_row(
    quantity: str,
    unit: str,
    printed: float | str | None,
    ours: float,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    shape: tuple[float, float] | None = None,
    source: str = "",
    tolerance: str = "",
    reason: str = "",
    seeds: ArrayLike = (),
    chosen: str = "",
    verdict: RowVerdict | None = None,
    why: str = "",
) -> Row:
    """A value beside a printed one; it holds where it lies between `low` and `high`.

    Args:
        quantity: What it is.
        unit: Its unit.
        printed: The printed value, or what is said of it; None where the text prints nothing.
        ours: Ours, of the record shown.
        low: Least value that holds.
        high: Largest value that holds.
        shape: Limits within which it still holds in shape.
        source: Where it is printed.
        tolerance: The tolerance in words; made from the limits where empty.
        reason: Why this tolerance, or why it cannot be judged.
        seeds: The value over seeds (m,); the verdict is that of their median.
        chosen: As of `Row`.
        verdict: Given where the limits do not decide it.
        why: As of `Row`.
    """
    values = np.asarray(seeds, dtype=float)
    judged = float(np.median(values)) if values.size else ours
    required = math.isfinite(low) or math.isfinite(high)
    if required and not tolerance:
        tolerance = _limits(low, high) + (", median of the seeds" if values.size else "")
    if verdict is None:
        verdict = RowVerdict.NOT_COMPARABLE
        if required:
            verdict = RowVerdict.HOLDS if low <= judged <= high else RowVerdict.FAILS
            if verdict is RowVerdict.FAILS and shape is not None and shape[0] <= judged <= shape[1]:
                verdict = RowVerdict.SHAPE
    number = printed if isinstance(printed, float | int) else None
    return Row(
        quantity,
        unit,
        "" if printed is None else (printed if isinstance(printed, str) else f"{printed:g}"),
        source or OWN,
        f"{ours:.4g}",
        spread_text(values) if values.size else "",
        tolerance,
        reason,
        verdict,
        chosen,
        float(100.0 * (judged / number - 1.0)) if number else None,
        why,
    )


def _limits(low: float, high: float) -> str:
    if math.isfinite(low) and math.isfinite(high):
        return f"{low:.4g} … {high:.4g}"
    return f"at most {high:.4g}" if math.isfinite(high) else f"at least {low:.4g}"


def one_of_ours(
    quantity: str,
    unit: str,
    printed: float,
    ours: float,
    seeds: ArrayLike,
    *,
    source: str,
    shape: tuple[float, float] | None = None,
    shape_text: str = "",
    chosen: str = "",
    why: str = "",
) -> Row:
    """A printed value of one record beside ours over seeds: it holds where the printed record could be one of ours.

    Args:
        quantity: What it is.
        unit: Its unit.
        printed: The printed value.
        ours: Ours, of the record shown.
        seeds: Ours over seeds (m,).
        source: Where it is printed.
        shape: Limits within which our median still holds in shape.
        shape_text: These limits in words.
        chosen: As of `Row`.
        why: As of `Row`.
    """
    values = np.asarray(seeds, dtype=float)
    verdict = RowVerdict.HOLDS if values.min() <= printed <= values.max() else RowVerdict.FAILS
    if (
        verdict is RowVerdict.FAILS
        and shape is not None
        and shape[0] <= np.median(values) <= shape[1]
        and shape[0] <= printed <= shape[1]
    ):
        verdict = RowVerdict.SHAPE
    also = f"; in shape where {shape_text}" if shape_text else ""
    return value_row(
        quantity,
        unit,
        printed,
        ours,
        source=source,
        tolerance="the printed value lies within the range of our seeds" + also,
        reason="one laboratory record, whose scatter is unknown, against ours, whose scatter is told",
        seeds=values,
        chosen=chosen,
        verdict=verdict,
        why=why,
    )


def fact_row(
    quantity: str,
    ours: str,
    holds: bool,
    *,
    printed: str = "",
    source: str = "",
    tolerance: str = "",
    reason: str = "",
    spread: str = "",
    chosen: str = "",
    shape: bool = False,
    why: str = "",
) -> Row:
    """Something that is so or is not; `shape` tells whether what is not so still is so in shape."""
    verdict = RowVerdict.HOLDS if holds else (RowVerdict.SHAPE if shape else RowVerdict.FAILS)
    return Row(
        quantity, "", printed, source or OWN, ours, spread, tolerance, reason, verdict, chosen, None, why
    )


def told_row(
    quantity: str, unit: str, ours: str, reason: str, *, printed: str = "", source: str = "", spread: str = ""
) -> Row:
    """A quantity that cannot be judged, and why not."""
    return Row(quantity, unit, printed, source or OWN, ours, spread, "", reason, RowVerdict.NOT_COMPARABLE)
