"""The lines of a text file in blocks, unpacked and in one encoding, so that the size of a file is no size of memory."""

from __future__ import annotations

import codecs
import gzip
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bench.errors import FileFormatError
from bench.limits import ReadingLimits, size_text
from bench.record_files.dialect import Dialect, cells_of, is_number


@dataclass(frozen=True)
class LinesSettings:
    """Numbers of `bench.record_files.lines`."""

    block: int = 4 * 2**20
    """Bytes that are read at a time."""


LINES_SETTINGS = LinesSettings()
_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


def blocks_of(path: Path, limits: ReadingLimits) -> Iterator[bytes]:
    """The text in UTF-8, in blocks of whole lines; the last may lack its line break."""
    carried, total, returns = b"", 0, False
    decoder: codecs.IncrementalDecoder | None = None
    for number, raw in enumerate(_raw(path)):
        chunk = raw
        if number == 0:
            for mark, name in _MARKS:
                if chunk.startswith(mark):
                    decoder = codecs.getincrementaldecoder(name)(errors="replace")
                    break
        if decoder is not None:
            chunk = decoder.decode(chunk).encode("utf-8", "replace")
        total += len(chunk)
        if total > limits.text_bytes:
            raise FileFormatError(
                f"'{path}' holds more than {size_text(limits.text_bytes)} of text, which is the most that is read; cut it into parts"
            )
        if b"\0" in chunk:
            raise FileFormatError(f"'{path}' is no text file; give it the suffix of what it is")
        if number == 0:
            returns = b"\n" not in chunk and b"\r" in chunk
        if returns:  # lines that end as on old Macintoshes
            chunk = chunk.replace(b"\r", b"\n")
        head, found, tail = (carried + chunk).rpartition(b"\n")
        carried = tail
        if len(carried) > limits.line_bytes:
            raise FileFormatError(
                f"'{path}' has a line longer than {size_text(limits.line_bytes)}, which no table has; give the file the suffix of "
                "what it is"
            )
        if found:
            yield head + found
    if carried:
        yield carried


def _raw(path: Path) -> Iterator[bytes]:
    packed = path.suffix.lower() == ".gz"
    try:
        with gzip.open(path, "rb") if packed else path.open("rb") as stream:
            while chunk := stream.read(LINES_SETTINGS.block):
                yield chunk
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise FileFormatError(
            f"'{path}' is no complete gzip file ({error}); restore it from its source, or drop the suffix "
            ".gz if it is plain text"
        ) from None
    except OSError as error:
        raise FileFormatError(f"'{path}' cannot be read: {error.strerror or error}") from None


def decoded(text: bytes) -> str:
    """Text of a block."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:  # instruments write degree signs and mu in the Windows encoding
        return text.decode("cp1252", "replace")


def cut_off(last: bytes, above: list[bytes], dialect: Dialect) -> str:
    """Why a last line without a line break must have been cut off in writing; empty where nothing tells."""
    if not last.strip():
        return ""
    cells = cells_of(decoded(last), dialect.delimiter)
    rows = [cells_of(decoded(row), dialect.delimiter) for row in above if row.strip()]
    width = len(dialect.columns)
    rows = [row for row in rows if len(row) == width]
    left_out = "the file was cut off in writing, and that line is left out"
    if not rows:
        return ""
    if len(cells) < width and any(row[-1] for row in rows):
        return f"the last line has no line break and {len(cells)} of {width} cells: {left_out}"
    k = len(cells) - 1
    cell, others = cells[k], [row[k] for row in rows if row[k]]
    if k >= width or dialect.columns[k].kind == "text" or not others:
        return ""
    told = f"the last line has no line break and ends in '{cell[:40]}'"
    if dialect.columns[k].kind in ("number", "long") and not is_number(cell, dialect.decimal):
        return f"{told}, which is no whole number: {left_out}" if len(rows) > 1 else ""
    exponents = {len(other) - other.lower().index("e") for other in others if "e" in other.lower()}
    if exponents and "e" in cell.lower() and len(cell) - cell.lower().index("e") < min(exponents):
        return f"{told}, whose exponent is shorter than any above: {left_out}"
    # a number of all its digits is that short in fewer than one of twenty rows
    if len(others) >= 20 and len(cell) < min(map(len, others)):
        return f"{told}, which has fewer digits than the {len(others)} numbers above: {left_out}"
    return ""
