"""Reading a JSON or TOML document: what it may cost, and what no document of any kind may hold.

Files and texts are refused, with the place, before a schema sees them: too large, nested too deeply, a key twice in one table,
integers that no floating-point number holds, NaN and infinity in JSON, text that is no Unicode, and of course what does not parse.
"""

from __future__ import annotations

import json
import math
import re
import stat
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from bench.errors import DocumentError, FileFormatError, shortened


@dataclass(frozen=True)
class DocumentLimits:
    """What a document may cost.

    Attributes:
        json_bytes: Largest JSON text. A list of as many empty tables as fit takes 0.7 GB, of the 2 GB that a refusal may cost.
        toml_bytes: Largest TOML text: `tomllib` takes up to 2 s a megabyte, and people write these by hand.
        toml_line: Longest line of it: the time for one dotted key grows with the square of its parts.
        entries: Most values, counted by brackets and commas before anything is parsed.
        depth: Deepest nesting; signals of signals are the deepest that a schema allows, five or six deep in practice.
        digits: Longest integer: the largest power of ten that a double holds.
        finite: Whether JSON may hold finite numbers only.
    """

    json_bytes: int = 32 * 2**20
    toml_bytes: int = 2**20
    toml_line: int = 20_000
    entries: int = 4_000_000
    depth: int = 64
    digits: int = 308
    finite: bool = True


LIMITS = DocumentLimits()
"""The limits that every document is read within."""


class _LongInteger(NamedTuple):
    """Stands for an integer that is not worth parsing, until the place where it is can be told."""

    digits: int


class _Doubled(dict[str, Any]):
    """A table of a JSON text in which a key comes twice."""

    key = ""


def load_document(path: str | Path, *, limits: DocumentLimits = LIMITS) -> dict[str, Any]:
    """Read a JSON (``.json``) or TOML document.

    Args:
        path: The file.
        limits: What it may cost.

    Raises:
        FileFormatError: It cannot be read, is neither, or is too large.
        DocumentError: It holds what no document may hold; the message names the place.
    """
    file = Path(path)
    is_json = file.suffix.lower() == ".json"
    text = read_text(file, limits.json_bytes if is_json else limits.toml_bytes)
    return parse_json(text, str(file), limits=limits) if is_json else _parse_toml(text, str(file), limits)


def read_text(path: str | Path, most: int) -> str:
    """Text of a regular file of at most `most` bytes, UTF-8 with or without a byte-order mark.

    Raises:
        FileFormatError: It is no such file.
    """
    file = Path(path)
    try:
        state = file.stat()
        if not stat.S_ISREG(state.st_mode):
            raise FileFormatError(
                f"cannot read {file}: it is {'a folder' if stat.S_ISDIR(state.st_mode) else 'no regular file'}"
            )
        if state.st_size > most:
            raise FileFormatError(
                f"cannot read {file}: it has {state.st_size} bytes, and a document has at most {most}"
            )
        with file.open("rb") as stream:
            content = stream.read(most + 1)
        return content[:most].decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"cannot read {file}: byte {error.start} is no UTF-8 text") from error
    except FileFormatError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FileFormatError(f"cannot read {shortened(str(file), 200)[1:-1]}: {reason}") from error


def parse_json(text: str, where: str, *, limits: DocumentLimits = LIMITS) -> dict[str, Any]:
    """The table of entries that a JSON text holds.

    Args:
        text: The text.
        where: What it is, for messages: mostly the path of its file.
        limits: What it may cost.

    Raises:
        FileFormatError: It is no JSON, or too large.
        DocumentError: It holds what no document may hold; the message names the place.
    """
    values = text.count(",") + text.count("[") + text.count("{")
    if len(text) > limits.json_bytes or values > limits.entries:
        raise FileFormatError(
            f"cannot read {where} as JSON: {len(text)} characters with some {values} values; at most {limits.json_bytes} and "
            f"{limits.entries} are expected of a document"
        )
    try:
        document = json.loads(
            text,
            parse_int=lambda digits: (
                int(digits) if len(digits) <= limits.digits else _LongInteger(len(digits))
            ),
            object_pairs_hook=_table,
        )
    except RecursionError:
        raise FileFormatError(f"cannot read {where} as JSON: {_too_deep(limits)}") from None
    except ValueError as error:
        raise FileFormatError(f"cannot read {where} as JSON: {error}") from error
    return _checked(document, where, limits, finite=limits.finite)


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) == len(pairs):
        return table
    doubled = _Doubled(table)
    seen: set[str] = set()
    doubled.key = next(key for key, _ in pairs if key in seen or seen.add(key))
    return doubled


def _parse_toml(text: str, where: str, limits: DocumentLimits) -> dict[str, Any]:
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > limits.toml_line:
            raise FileFormatError(
                f"cannot read {where} as TOML: line {number} has {len(line)} characters; at most {limits.toml_line} are expected"
            )
        long = re.search(rf"(?<![\w.])[+-]?\d[\d_]{{{limits.digits},}}(?![\w.])", line)
        if long:
            raise FileFormatError(
                f"cannot read {where} as TOML: line {number} has an integer of {len(long[0])} digits; a number of at most "
                f"{limits.digits} is expected"
            )
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise FileFormatError(f"cannot read {where} as TOML: {_too_deep(limits)}") from None
    except (ValueError, OverflowError) as error:
        raise FileFormatError(f"cannot read {where} as TOML: {' '.join(str(error).split())}") from error
    return _checked(document, where, limits, finite=False)


def _too_deep(limits: DocumentLimits) -> str:
    return f"it is nested too deeply; at most {limits.depth} levels are expected"


def _checked(document: Any, where: str, limits: DocumentLimits, *, finite: bool) -> dict[str, Any]:
    """The document, once nothing in it is what none may hold."""
    if not isinstance(document, dict):
        raise DocumentError(f"{where} holds {_came(document)}; a table of entries is expected")
    left: list[tuple[Any, Any, int]] = [(document, (), 1)]
    while left:
        node, way, depth = left.pop()
        if depth > limits.depth:
            raise DocumentError(f"{where}: {_too_deep(limits)}")
        if isinstance(node, _Doubled):
            raise DocumentError(
                f"{_at(where, way)} the entry {shortened(node.key)} comes twice; one of them is expected"
            )
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            kind = type(value)
            if isinstance(key, str) and not _is_text(key):
                raise DocumentError(f"{_at(where, way)} the name {shortened(key)} is no Unicode text")
            if kind is str:
                if not _is_text(value):
                    raise DocumentError(f"{_at(where, (way, key))} {shortened(value)} is no Unicode text")
            elif kind is float:
                if finite and not math.isfinite(value):
                    raise DocumentError(f"{_at(where, (way, key))} {value} came; a finite number is expected")
            elif kind is _LongInteger:
                raise DocumentError(
                    f"{_at(where, (way, key))} an integer of {value.digits} digits came; a number of at most {limits.digits} "
                    "is expected"
                )
            elif kind in {dict, list, _Doubled}:
                left.append((value, (way, key), depth + 1))
    return document


def _is_text(value: str) -> bool:
    if value.isascii():
        return True
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _at(where: str, way: Any) -> str:
    steps: list[str | int] = []
    while way:
        way, step = way
        steps.append(step)
    place = spelt(tuple(reversed(steps)))
    return f"{where}: {place}:" if place else f"{where}:"


def spelt(path: tuple[str | int, ...]) -> str:
    """A path within a document as people write it: ``elements[0].parameters."gap.stiffness"``."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
            continue
        name = step if re.fullmatch(r"[\w:+$ -]{1,60}", step) else json.dumps(step[:60], ensure_ascii=True)
        text += f".{name}" if text else name
    return text


def _came(value: Any) -> str:
    if isinstance(value, _LongInteger):
        return f"an integer of {value.digits} digits"
    return "nothing (null)" if value is None else shortened(value)
