"""CSV files as laboratories write them: preamble, headings with units, any delimiter, decimal commas, gzip."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.errors import FileFormatError
from bench.record_files.column_map import Variable, name_and_unit

_COMMENTS = ("#", "%")


class _Layout(NamedTuple):
    delimiter: str
    decimal: str
    headings: list[str]
    skip: int
    """Lines before the first line of numbers."""


def read_csv(path: Path) -> dict[str, Variable]:
    """The columns of a CSV file by heading, with the unit where the heading tells it: "force [kip]", "force (kip)".

    Lines before the table that begin with "#" or "%" are passed over, but the last of them is taken for the headings
    where the table has none (as `numpy.savetxt` writes them). A table without any headings has columns "0", "1", ….
    Delimiters are comma, semicolon and tab; with the latter two, decimal commas are understood. Empty cells are NaN.

    Args:
        path: Path of the file, gzipped where it ends in ".gz".

    Raises:
        FileFormatError: Empty, headings only, ragged lines, the same heading twice, or damaged compression.
    """
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.csv as pc  # noqa: PLC0415

    text = _text(path)
    lines = text.splitlines()
    layout = _layout(lines, path)
    body = "\n".join(lines[layout.skip :]).encode()
    try:
        table = pc.read_csv(
            pa.BufferReader(body),
            read_options=pc.ReadOptions(column_names=layout.headings, use_threads=False),
            parse_options=pc.ParseOptions(delimiter=layout.delimiter),
            convert_options=pc.ConvertOptions(decimal_point=layout.decimal),
        )
    except pa.ArrowInvalid as error:
        line = _ragged(lines, layout)
        where = f" at line {line}" if line else f" ({error})"
        raise FileFormatError(
            f"'{path}' is no table of {len(layout.headings)} columns{where}: every line must have as many cells as the first; "
            "complete or remove that line (a file cut off in writing ends this way)"
        ) from None
    variables = {}
    for heading, column in zip(layout.headings, table.columns, strict=True):
        empty = pa.types.is_null(column.type)
        values = np.full(len(column), np.nan) if empty else np.asarray(column.to_numpy())
        variables[heading] = Variable(values, name_and_unit(heading)[1])
    return variables


def first_text(path: Path, heading: str) -> str:
    """Where a column that should hold numbers does not, for a message: "line 12 holds 'abc'".

    Args:
        path: Path of the CSV file.
        heading: Heading of the column.
    """
    lines = _text(path).splitlines()
    layout = _layout(lines, path)
    column = layout.headings.index(heading)
    for number, line in enumerate(lines[layout.skip :], start=layout.skip + 1):
        cells = line.split(layout.delimiter)
        if line.strip() and column < len(cells) and not _is_number(cells[column], layout.decimal):
            return f"line {number} holds '{cells[column].strip()}'"
    return "it holds dates or text"


def _text(path: Path) -> str:
    raw = path.read_bytes()
    if path.suffix.lower() == ".gz":
        try:
            raw = gzip.decompress(raw)
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise FileFormatError(
                f"'{path}' is no complete gzip file ({error}); restore it from its source, or drop the suffix "
                ".gz if it is plain text"
            ) from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:  # instruments write degree signs and mu in the Windows encoding
        text = raw.decode("latin-1")
    if "\0" in text:
        raise FileFormatError(f"'{path}' is no text file; give it the suffix of what it is")
    return text


def _layout(lines: list[str], path: Path) -> _Layout:
    comment, first = "", 0
    while first < len(lines) and (not lines[first].strip() or lines[first].lstrip().startswith(_COMMENTS)):
        comment = lines[first].strip() or comment
        first += 1
    if first == len(lines):
        raise FileFormatError(f"'{path}' holds no table: it is empty{' but for comments' if comment else ''}")
    top = lines[first]
    delimiter = max(",;\t", key=top.count)
    after = next((line for line in lines[first + 1 :] if line.strip()), top)
    decimal = "," if delimiter != "," and "," in after else "."
    cells = [cell.strip().strip('"') for cell in top.split(delimiter)]
    if all(_is_number(cell, decimal) for cell in cells):
        words = [cell.strip().strip('"') for cell in comment.lstrip("".join(_COMMENTS)).split(delimiter)]
        named = len(words) == len(cells) and all(words) and comment != ""
        headings, skip = (words if named else [str(i) for i in range(len(cells))]), first
    else:
        headings, skip = cells, first + 1
    twice = {heading for heading in headings if headings.count(heading) > 1}
    if twice:
        raise FileFormatError(
            f"'{path}' has several columns headed '{sorted(twice)[0]}'; give each its own heading"
        )
    if not any(line.strip() for line in lines[skip:]):
        raise FileFormatError(
            f"'{path}' has headings ({', '.join(headings[:8])}) but no line of numbers; was the test recorded?"
        )
    return _Layout(delimiter, decimal, headings, skip)


def _is_number(cell: str, decimal: str) -> bool:
    cell = cell.strip().strip('"')
    try:
        float((cell.replace(decimal, ".") if decimal != "." else cell) or "nan")
    except ValueError:
        return cell in ("NA", "N/A", "null", "NULL", "#N/A")
    return True


def _ragged(lines: list[str], layout: _Layout) -> int:
    for number, line in enumerate(lines[layout.skip :], start=layout.skip + 1):
        if line.strip() and line.count(layout.delimiter) != len(layout.headings) - 1:
            return number
    return 0
