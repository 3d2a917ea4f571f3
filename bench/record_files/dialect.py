"""How a text file writes its table: found in its first lines, since loggers and spreadsheets agree on nothing.

The delimiter, with the decimal mark, is the one by which the most cells are numbers. The table begins with the first line that has
numbers in every column that holds numbers; what stands directly above it, with as many cells, are its headings, and below these
perhaps a row of units. All above that is preamble.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bench.errors import FileFormatError, UnitError
from bench.recording.units import check_unit

COMMENTS = ("#", "%")
WHITE = " "
"""Stands for any run of blanks as the delimiter."""

_DELIMITERS = ("\t", ";", ",", "|", WHITE)  # in the order in which ties are settled


@dataclass(frozen=True)
class DialectSettings:
    """Numbers of `bench.record_files.dialect`."""

    shown: int = 60


SETTINGS = DialectSettings()
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_MISSING = frozenset(("NA", "N/A", "null", "NULL", "#N/A", "n/a", "-nan", "1.#QNAN", "-1.#IND"))
_DATE = re.compile(
    r"(?:\d{4}([-/])\d\d\1\d\d|\d\d\.\d\d\.\d{4})"
    r"(?:[T ]\d\d(?::\d\d(?::\d\d(?:[.,]\d{1,9})?)?)?)?(?P<zone>Z|[+-]\d\d(?::?\d\d)?)?"
)
_CLOCK = re.compile(r"\d\d:\d\d:\d\d(?:[.,]\d{1,9})?")
_LONG = re.compile(r"\d{16,19}")
"""Integers that a double would round: times in nanoseconds or microseconds since 1970."""
_BRACKETS = "[]()<>{} "


class Column(NamedTuple):
    """One column of a text table."""

    heading: str
    kind: str
    """ "number", "long" (integers beyond a double), "date", "zoned" (a date with its time zone), "clock" or "text"."""
    unit: str = ""
    """From a row of units."""
    sample: str = ""
    """Where a column of text begins, for messages: "line 5 holds 'abc'"."""


class Dialect(NamedTuple):
    """How a table is written."""

    delimiter: str
    decimal: str
    columns: tuple[Column, ...]
    skip: int
    """Lines before the first line of numbers."""

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of the columns."""
        return tuple(column.heading for column in self.columns)


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without blanks and quotes around them."""
    if delimiter == WHITE and '"' not in line:
        return line.split()
    try:
        row = next(
            csv.reader(
                [line.strip() if delimiter == WHITE else line], delimiter=delimiter, skipinitialspace=True
            ),
            [],
        )
    except csv.Error:
        return [line]
    return [cell.strip() for cell in row]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number, or stands for one that is missing."""
    if decimal != ".":
        cell = cell.replace(decimal, ".", 1) if "." not in cell else "text"
    return not cell or _NUMBER.fullmatch(cell) is not None or cell in _MISSING


def dialect_of(lines: Sequence[str], file: str) -> Dialect:
    """The dialect of a table from its first lines.

    Args:
        lines: The first lines of the file, whole.
        file: Name of the file, for messages.

    Raises:
        FileFormatError: There is no table, no line of numbers, or two columns have the same heading.
    """
    places = [i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(COMMENTS)]
    if not places:
        comments = any(line.strip() for line in lines)
        raise FileFormatError(
            f"'{file}' holds no table: it is empty{' but for comments' if comments else ''}"
        )
    delimiter, decimal, width = _best([lines[i] for i in places[-SETTINGS.shown :]])
    rows = {i: _trimmed(cells_of(lines[i], delimiter), width) for i in places}
    numeric = _numeric_columns([rows[i] for i in places[-SETTINGS.shown :]], width, decimal)
    kinds = {i: _row_kind(rows[i], width, numeric, decimal) for i in places}
    first = _first_of_numbers(places, kinds, rows, width, file)
    _refuse_ragged(places, kinds, rows, first, width, decimal, file)
    headings, units = _headings(lines, places, rows, kinds, first, width, delimiter, decimal)
    body = [i for i in places if i >= first]
    columns = []
    for k in range(width):
        kind = _column_kind([rows[i][k] for i in body if len(rows[i]) == width], decimal)
        sample = f"line {body[0] + 1} holds '{rows[body[0]][k][:60]}'" if kind == "text" else ""
        columns.append(Column(headings[k], kind, units[k], sample))
    twice = next((name for name, n in Counter(filter(None, headings)).items() if n > 1), None)
    if twice is not None:
        raise FileFormatError(
            f"'{file}' has several columns headed '{twice[:60]}'; give each its own heading"
        )
    return Dialect(delimiter, decimal, tuple(columns), first)


def _best(lines: list[str]) -> tuple[str, str, int]:
    """Delimiter, decimal mark and number of columns by which the most cells are numbers."""
    found: list[tuple[float, int, str, str]] = []
    for delimiter in _DELIMITERS:
        rows = [cells_of(line, delimiter) for line in lines]
        width = Counter(map(len, rows)).most_common(1)[0][0]
        chosen = [row for row in rows if len(row) == width]
        filled = [cell for row in chosen for cell in row if cell]
        quoted = any('"' in line for line in lines)
        for decimal in (".", ",") if delimiter != "," or quoted else (".",):
            numbers = sum(is_number(cell, decimal) or _is_time(cell) for cell in filled)
            share = numbers / max(len(filled), 1) * len(chosen) / len(rows)
            found.append((share, width, delimiter, decimal))
    tables = [candidate for candidate in found if candidate[1] > 1 and candidate[0] > 0.0]
    # the first of the best, in the order of the delimiters; without any numbers, the most cells
    best = max(tables, key=lambda c: c[0]) if tables else max(found, key=lambda c: (c[0], c[1]))
    return best[2], best[3], best[1]


def _is_time(cell: str) -> bool:
    return _DATE.fullmatch(cell) is not None or _CLOCK.fullmatch(cell) is not None


def _trimmed(row: list[str], width: int) -> list[str]:
    """A row without the empty cells that trailing delimiters leave beyond the width."""
    if len(row) <= width or any(row[width:]):
        return row
    return row[:width]


def _numeric_columns(rows: list[list[str]], width: int, decimal: str) -> list[int]:
    """Columns in which most rows hold numbers or times."""
    whole = [row for row in rows if len(row) == width]
    found = []
    for k in range(width):
        filled = [row[k] for row in whole if row[k]]
        hits = sum(is_number(cell, decimal) or _is_time(cell) for cell in filled)
        if filled and 2 * hits >= len(filled):
            found.append(k)
    return found


def _row_kind(row: list[str], width: int, numeric: list[int], decimal: str) -> str:
    if len(row) != width:
        return "other"
    hits = [bool(row[k]) and (is_number(row[k], decimal) or _is_time(row[k])) for k in range(width)]
    if numeric and any(hits) and all(hits[k] or not row[k] for k in numeric):
        return "numbers"
    return "mixed" if any(hits) else "text"


def _first_of_numbers(
    places: list[int], kinds: dict[int, str], rows: dict[int, list[str]], width: int, file: str
) -> int:
    """Line at which the table begins; a row with a wrong cell directly below headings is a row of the table."""
    at = next((n for n, i in enumerate(places) if kinds[i] == "numbers"), None)
    if at is None:
        last = [cell for cell in rows[places[-1]] if cell]
        what = (
            f"has headings ({', '.join(last[:8])[:200]}) but"
            if kinds[places[-1]] == "text" and len(last) > 1
            else "holds"
        )
        raise FileFormatError(f"'{file}' {what} no line of numbers; was the test recorded?")
    while (
        at > 1
        and kinds[places[at - 1]] == "mixed"
        and "text" in {kinds[i] for i in places[max(0, at - 3) : at - 1]}
    ):
        at -= 1
    return places[at]


def _refuse_ragged(
    places: list[int],
    kinds: dict[int, str],
    rows: dict[int, list[str]],
    first: int,
    width: int,
    decimal: str,
    file: str,
) -> None:
    """Refuse a table whose headings are more than its columns, or whose first rows of numbers have other numbers of cells."""
    above = [i for i in places if i < first]
    for n, i in enumerate(above):
        numbers = [cell for cell in rows[i] if cell]
        headed = any(kinds[j] == "text" for j in above[:n])
        if (
            kinds[i] == "other"
            and headed
            and len(numbers) > 1
            and all(is_number(cell, decimal) for cell in numbers)
        ):
            raise FileFormatError(
                f"'{file}' is no table of {width} columns at line {i + 1}: every line must have as many cells as the first; complete "
                "or remove that line"
            )
    if above and kinds[above[-1]] == "other" and len([cell for cell in rows[above[-1]] if cell]) > width > 1:
        raise FileFormatError(
            f"'{file}' has {len(rows[above[-1]])} names over {width} columns; give every column one name of its own"
        )


def _headings(
    lines: Sequence[str],
    places: list[int],
    rows: dict[int, list[str]],
    kinds: dict[int, str],
    first: int,
    width: int,
    delimiter: str,
    decimal: str,
) -> tuple[list[str], list[str]]:
    """Headings and units: of the lines directly above the table, of the last comment, or numbers in their order."""
    above: list[list[str]] = []
    for i in reversed([i for i in places if i < first]):
        row = rows[i]
        if len(row) == width - 1:  # the lines of numbers end with a delimiter, the headings do not
            row = [*row, ""]
        if len(row) != width or not any(row) or (kinds[i] == "mixed" and above) or kinds[i] == "numbers":
            break
        above.insert(0, row)
    units = [""] * width
    if above:
        if len(above) > 1 and _are_units(above[-1]):
            return above[-2], [cell.strip(_BRACKETS) for cell in above[-1]]
        if len(above) > 2 and _are_units(above[-2]):
            return above[-3], [cell.strip(_BRACKETS) for cell in above[-2]]
        return above[-1], units
    comment = next(
        (lines[i].strip() for i in range(first - 1, -1, -1) if lines[i].lstrip().startswith(COMMENTS)), ""
    )
    words = [word.strip(' "') for word in cells_of(comment.lstrip("".join(COMMENTS)).strip(), delimiter)]
    if comment and len(words) == width and all(words) and not all(is_number(word, decimal) for word in words):
        return words, units
    return [str(k) for k in range(width)], units


def _are_units(row: list[str]) -> bool:
    """Whether a row below the headings holds units: most of its cells are units that are known."""
    filled = [cell.strip(_BRACKETS) for cell in row if cell.strip(_BRACKETS + "-")]
    if not filled:
        return any(row)  # brackets and dashes only
    known = 0
    for cell in filled:
        try:
            check_unit(cell)
            known += 1
        except UnitError:
            continue
    return 2 * known > len(filled)


def _column_kind(cells: list[str], decimal: str) -> str:
    filled = [cell for cell in cells if cell]
    if not filled:
        return "number"
    if all(_LONG.fullmatch(cell) for cell in filled):
        return "long"
    if any(is_number(cell, decimal) for cell in filled):
        return "number"
    dates = [match for match in map(_DATE.fullmatch, filled) if match]
    if dates:
        return "zoned" if dates[0]["zone"] else "date"
    if any(_CLOCK.fullmatch(cell) for cell in filled):
        return "clock"
    return "text"
