"""What the reproduction of one figure or table yields: rows beside the printed values, and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the whole that is done."""

RANGE_TOLERANCE = 15.0
"""Largest deviation of a range from the printed one [%]."""


class Row(NamedTuple):
    """One quantity of the dissertation beside ours.

    Attributes:
        quantity: What it is.
        unit: Its unit; empty for what has none.
        printed: The printed value or range as text; empty where the dissertation prints none.
        ours: Ours, as text.
        deviation: Deviation from the printed value [%]; None where that has no meaning.
        requirement: What must hold, as text; empty for a value that is only reported.
        holds: Whether it does; None for a value that is only reported.
    """

    quantity: str
    unit: str
    printed: str
    ours: str
    deviation: float | None = None
    requirement: str = ""
    holds: bool | None = None

    @property
    def verdict(self) -> str:
        """Yes, no or nothing."""
        return "" if self.holds is None else ("yes" if self.holds else "no")

    def cells(self) -> tuple[str, ...]:
        """The row as text, in the order of `HEADER`."""
        deviation = "" if self.deviation is None else f"{self.deviation:+.1f} %"
        quantity = f"{self.quantity} [{self.unit}]" if self.unit else self.quantity
        return (quantity, self.printed, self.ours, deviation, self.requirement, self.verdict)


HEADER = ("quantity", "printed", "ours", "deviation", "requirement", "holds")
"""Headings of the cells of a row."""


def range_row(quantity: str, unit: str, printed: float, values: ArrayLike) -> Row:
    """The range of a record beside a printed range about zero; both ends must lie within `RANGE_TOLERANCE`.

    Args:
        quantity: What it is.
        unit: Its unit.
        printed: Half of the printed range.
        values: The record (n,), of which the smallest and the largest value count.
    """
    low, high = float(np.min(values)), float(np.max(values))
    ends = [100.0 * (-low / printed - 1.0), 100.0 * (high / printed - 1.0)]
    worst = max(ends, key=abs)
    return Row(
        quantity,
        unit,
        f"±{printed:g}",
        f"{low:.3g} … {high:.3g}",
        worst,
        f"both ends within {RANGE_TOLERANCE:g} %",
        abs(worst) <= RANGE_TOLERANCE,
    )


def value_row(
    quantity: str,
    unit: str,
    printed: float | None,
    ours: float,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    requirement: str = "",
) -> Row:
    """A value beside a printed one; it holds where it lies between `low` and `high`.

    Args:
        quantity: What it is.
        unit: Its unit.
        printed: The printed value; None where there is none.
        ours: Ours.
        low: Least value required.
        high: Largest value required.
        requirement: The requirement in words; made from the limits where empty.
    """
    required = math.isfinite(low) or math.isfinite(high)
    if required and not requirement:
        if math.isfinite(low) and math.isfinite(high):
            requirement = f"{low:.4g} … {high:.4g}"
        else:
            requirement = f"at most {high:.4g}" if math.isfinite(high) else f"at least {low:.4g}"
    deviation = float(100.0 * (ours / printed - 1.0)) if printed else None
    return Row(
        quantity,
        unit,
        "" if printed is None else f"{printed:g}",
        f"{ours:.4g}",
        deviation,
        requirement,
        bool(low <= ours <= high) if required else None,
    )


def fact_row(quantity: str, ours: str, holds: bool, *, printed: str = "", requirement: str = "") -> Row:
    """Something that is so or is not."""
    return Row(quantity, "", printed, ours, None, requirement, bool(holds))


class Picture(NamedTuple):
    """A figure of an item.

    Attributes:
        name: Part of its file name.
        caption: What it shows, with the number of the printed figure.
        figure: The figure.
    """

    name: str
    caption: str
    figure: Figure


@dataclass(frozen=True)
class Item:
    """What one figure or table of the dissertation became.

    Attributes:
        text: How it was made, and what to make of it.
        rows: Quantities beside the printed ones.
        pictures: Figures.
    """

    text: str
    rows: tuple[Row, ...]
    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class Result:
    """An item as it was written.

    Attributes:
        identifier: Its name: "A1", …, "D4".
        title: Its title.
        text: As of `Item`.
        rows: As of `Item`.
        pictures: File name in the output folder and caption of each picture.
        seconds: Time that it took [s].
        version: Fingerprint of the code it was made with.
    """

    identifier: str
    title: str
    text: str
    rows: tuple[Row, ...]
    pictures: tuple[tuple[str, str], ...]
    seconds: float
    version: str

    @property
    def holds(self) -> bool:
        """Whether everything that must hold does."""
        return all(row.holds is not False for row in self.rows)

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON values."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        values["rows"] = [row._asdict() for row in self.rows]
        values["pictures"] = [{"file": file, "caption": caption} for file, caption in self.pictures]
        return values | {"holds": self.holds}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Result:
        """The result from the values of `to_dict`."""
        rows = tuple(Row(**row) for row in values["rows"])
        pictures = tuple((picture["file"], picture["caption"]) for picture in values["pictures"])
        plain = {key: values[key] for key in ("identifier", "title", "text", "seconds", "version")}
        return cls(**plain, rows=rows, pictures=pictures)
