"""Text files as laboratories and spreadsheets write them, read block by block, so that the size of a file is no size of memory."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError
from bench.limits import READING_LIMITS, ReadingLimits
from bench.record_files.column_map import Variable, name_and_unit
from bench.record_files.dialect import WHITE, Column, Dialect, cells_of, dialect_of, is_number
from bench.record_files.lines import (
    LINES_SETTINGS,
    blocks_of,
    cut_off,
    decoded,
)


@dataclass(frozen=True)
class TextSettings:
    """Numbers of `bench.record_files.text`."""

    head: int = 5000
    """Lines in which a table has to begin."""
    above: int = 1000
    """Rows above the last one that it is compared with, to see whether it was cut."""


SETTINGS = TextSettings()


class TextTable(NamedTuple):
    """What a text file holds."""

    variables: dict[str, Variable]
    notes: tuple[str, ...]
    """What was left out or doubtful, one sentence each."""


class _Block(NamedTuple):
    """Whole lines of the table."""

    text: bytes
    line: int
    """Number of its first line in the file, from 1."""


def read_csv(
    path: Path, wanted: Callable[[str], bool] | None = None, *, limits: ReadingLimits = READING_LIMITS
) -> TextTable:
    """The columns of a text table by heading, with the unit where heading or a row of units tell it: "force [kip]", "force (kip)".

    Found by itself: the delimiter (comma, semicolon, tab, bar, blanks), decimal commas, quotes, UTF-8 with or without a byte-order
    mark, UTF-16, the Windows encoding, lines above the table, a row of units, delimiters at the ends of lines. Lines that begin
    with "#" or "%" are comments, but the last of them above the table is taken for the headings where it has none (as
    `numpy.savetxt` writes them). A table without any headings has columns "0", "1", …. Empty cells are NaN. Dates in ISO 8601 and
    times of day become `datetime64` and `timedelta64`.

    Args:
        path: Path of the file, gzipped where it ends in ".gz".
        wanted: Which headings are wanted; the other columns are empty in what is returned. None for all.
        limits: What the file may cost.

    Raises:
        FileFormatError: Empty, headings only, ragged lines, the same heading twice, text among the numbers of a column that is
            wanted, damaged compression, or beyond the limits.
    """
    blocks = blocks_of(path, limits)
    first = next(blocks, b"")
    lines = decoded(first).split("\n", SETTINGS.head)[: SETTINGS.head]
    dialect = dialect_of([line.rstrip("\r") for line in lines], path.name)
    if len(dialect.columns) > limits.columns:
        raise FileFormatError(
            f"'{path}' has {len(dialect.columns)} columns, and at most {limits.columns} are read; cut it into parts"
        )
    body = _body(first, blocks, dialect)
    chosen = [
        c for c in dialect.columns if c.kind != "text" and c.heading and (wanted is None or wanted(c.heading))
    ]
    reader = _Reader(path, dialect, chosen, limits)
    for block in body:
        reader.take(block)
    values = reader.values()
    variables: dict[str, Variable] = {}
    for column in dialect.columns:
        _, told = name_and_unit(column.heading)
        unit = column.unit or told
        if column.heading in values:
            variables[column.heading] = Variable(values[column.heading], unit)
        elif column.heading:
            empty = np.empty(0, dtype="U1" if column.kind == "text" else float)
            variables[column.heading] = Variable(empty, unit, column.sample)
        elif wanted is None and column.kind != "text" and reader.fills(column):
            reader.notes.append("a column without a heading is left out")
    return TextTable(variables, tuple(reader.notes))


def _body(first: bytes, blocks: Iterator[bytes], dialect: Dialect) -> Iterator[_Block]:
    """The lines of numbers, block by block."""
    start = 0
    for _ in range(dialect.skip):
        start = first.index(b"\n", start) + 1
    line = dialect.skip + 1
    block = first[start:]
    while True:
        if block:
            yield _Block(block, line)
        line += block.count(b"\n")
        following = next(blocks, None)
        if following is None:
            return
        block = following


class _Reader:
    """Turns blocks of lines into columns of numbers."""

    def __init__(self, path: Path, dialect: Dialect, chosen: list[Column], limits: ReadingLimits) -> None:
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.csv as pc  # noqa: PLC0415

        self.path, self.dialect, self.chosen, self.limits = path, dialect, chosen, limits
        self.notes: list[str] = []
        self._comments = 0
        self._rows = 0
        self._parts: dict[str, list[NDArray[Any]]] = {column.heading: [] for column in chosen}
        self._above: deque[bytes] = deque(maxlen=SETTINGS.above)
        kinds = {"number": pa.float64(), "long": pa.int64()}
        names = [str(k) for k in range(len(dialect.columns))]
        numbered = {column.heading: name for column, name in zip(dialect.columns, names, strict=True)}
        self._places = {column.heading: numbered[column.heading] for column in chosen}
        self._options: dict[str, Any] = {
            "read_options": pc.ReadOptions(
                column_names=names, use_threads=False, block_size=2 * LINES_SETTINGS.block + limits.line_bytes
            ),
            "parse_options": pc.ParseOptions(
                delimiter="\t" if dialect.delimiter == WHITE else dialect.delimiter
            ),
            "convert_options": pc.ConvertOptions(
                decimal_point=dialect.decimal,
                column_types={self._places[c.heading]: kinds.get(c.kind, pa.string()) for c in chosen},
                include_columns=list(self._places.values()) or names[:1],
                strings_can_be_null=True,
            ),
        }
        if not chosen:
            self._options["convert_options"].column_types = {names[0]: pa.string()}

    def take(self, block: _Block) -> None:
        """Read the lines of a block."""
        text, cut = self._whole(block.text)
        if cut:
            self.notes.append(cut)
        if not text.strip():
            return
        table = self._table(text, block.line)
        self._rows += table.num_rows
        if self._rows * max(len(self.chosen), 1) > self.limits.numbers:
            raise FileFormatError(
                f"'{self.path}' holds more than {self.limits.numbers} numbers in the {len(self.chosen)} columns that are wanted; "
                "cut it into parts, or name fewer columns"
            )
        for column in self.chosen:
            self._parts[column.heading].append(
                self._numbers(table.column(self._places[column.heading]), column, block)
            )

    def values(self) -> dict[str, NDArray[Any]]:
        """The columns, without empty rows at the end."""
        if self._comments:
            self.notes.append(
                f"{self._comments} line{'s' * (self._comments > 1)} within the table begin{'s' * (self._comments == 1)} with "
                "'#' or '%' and are left out as comments"
            )
        if not self._rows:
            raise FileFormatError(
                f"'{self.path}' has headings ({', '.join(self.dialect.headings[:8])[:200]}) but no line of numbers; was the test "
                "recorded?"
            )
        out: dict[str, NDArray[Any]] = {}
        for heading in list(self._parts):
            out[heading] = np.concatenate(self._parts.pop(heading))
        last = max((_filled(values) for values in out.values()), default=0)
        return {heading: values[:last] for heading, values in out.items()} if last else out

    def fills(self, column: Column) -> bool:
        """Whether a column without a heading has cells, as far as the last rows tell."""
        k = self.dialect.columns.index(column)
        rows = (cells_of(decoded(row), self.dialect.delimiter) for row in self._above)
        return any(len(row) > k and row[k] for row in rows)

    def _whole(self, text: bytes) -> tuple[bytes, str]:
        """The block without comments, and without a last line that was cut off in writing; and what to say of that line."""
        cut = ""
        if b"#" in text or b"%" in text:
            lines = text.split(b"\n")
            kept = [line for line in lines if not line.lstrip().startswith((b"#", b"%"))]
            self._comments += len(lines) - len(kept)
            text = b"\n".join(kept)
        if not text.endswith((b"\n", b"\r")):
            head, _, last = text.rpartition(b"\n")
            above = [*self._above, *head.split(b"\n")[-SETTINGS.above :]]
            cut = cut_off(last, above, self.dialect)
            text = head + b"\n" if cut else text
        self._above.extend(text.rsplit(b"\n", SETTINGS.above)[1:])
        if self.dialect.delimiter == WHITE:
            text = re.sub(rb"[ \t]+", b"\t", re.sub(rb"(?m)^[ \t]+|[ \t\r]+$", b"", text))
        return text, cut

    def _table(self, text: bytes, line: int) -> Any:
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.csv as pc  # noqa: PLC0415

        try:
            return pc.read_csv(pa.BufferReader(text), **self._options)
        except pa.ArrowInvalid as error:
            # lines of blanks are no rows, and rows may end with more delimiters than the others
            tidy = self._tidied(text)
            if tidy != text:
                try:
                    return pc.read_csv(pa.BufferReader(tidy), **self._options)
                except pa.ArrowInvalid:
                    pass
            raise self._refusal(text, line, error) from None

    def _tidied(self, text: bytes) -> bytes:
        delimiter = self.dialect.delimiter.encode()
        rows = []
        for row in text.split(b"\n"):
            bare = row.rstrip(b"\r")
            surplus = bare.count(delimiter) - len(self.dialect.columns) + 1
            while surplus > 0 and bare.endswith(delimiter):
                bare, surplus = bare[:-1], surplus - 1
            if bare.strip(b" "):
                rows.append(bare)
        return b"\n".join(rows) + b"\n"

    def _refusal(self, text: bytes, line: int, error: BaseException) -> FileFormatError:
        """The error that names the first line that does not fit."""
        dialect = self.dialect
        delimiter = "\t" if dialect.delimiter == WHITE else dialect.delimiter
        for number, row in enumerate(decoded(text).split("\n"), start=line):
            if not row.strip():
                continue
            cells = cells_of(row, delimiter)
            if len(cells) != len(dialect.columns):
                return self._ragged(f" at line {number}")
            for column in self.chosen:
                cell = cells[int(self._places[column.heading])]
                if column.kind in ("number", "long") and not is_number(cell, dialect.decimal):
                    return self._wrong_cell(column, f"line {number} holds '{cell[:60]}'")
        return self._ragged(f" ({str(error).splitlines()[0][:200]})")

    def _ragged(self, where: str) -> FileFormatError:
        return FileFormatError(
            f"'{self.path}' is no table of {len(self.dialect.columns)} columns{where}: every line must have as many cells as the "
            "first; complete or remove that line (a file cut off in writing ends this way)"
        )

    def _wrong_cell(self, column: Column, where: str) -> FileFormatError:
        return FileFormatError(
            f"column '{column.heading}' of '{self.path.name}' does not hold numbers only: {where}; correct that cell, or name the "
            "columns that are wanted with columns={channel name: heading}"
        )

    def _numbers(self, column: Any, described: Column, block: _Block) -> NDArray[Any]:
        import pyarrow as pa  # noqa: PLC0415
        from pyarrow import compute  # noqa: PLC0415

        if described.kind in ("number", "long"):
            return column.to_numpy(zero_copy_only=False)
        try:
            text = compute.replace_substring(column, ",", ".")
            if described.kind == "clock":
                text = compute.binary_join_element_wise("1970-01-01T", text, "")
                return (
                    text.cast(pa.timestamp("ns")).to_numpy(zero_copy_only=False).astype("i8").astype("m8[ns]")
                )
            text = compute.replace_substring_regex(text, r"^(\d\d)\.(\d\d)\.(\d{4})", r"\3-\2-\1")
            text = compute.replace_substring_regex(text, r"^(\d{4})/(\d\d)/(\d\d)", r"\1-\2-\3")
            kind = pa.timestamp("ns", "UTC" if described.kind == "zoned" else None)
            return text.cast(kind).cast(pa.timestamp("ns")).to_numpy(zero_copy_only=False)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, ValueError, OverflowError) as error:
            where = f"from line {block.line} on, {str(error).splitlines()[0][:120]}"
            raise self._wrong_cell(described, where) from None


def _filled(values: NDArray[Any]) -> int:
    """Number of rows up to the last that is not empty."""
    bad = (
        np.isnat(values[::-1])
        if values.dtype.kind in "mM"
        else np.isnan(values[::-1])
        if values.dtype.kind == "f"
        else None
    )
    if bad is None or not bad.size:
        return len(values)
    return len(values) - int(np.argmin(bad)) if not bad.all() else 0
