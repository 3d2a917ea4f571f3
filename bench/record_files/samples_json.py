"""JSON files that hold a list of samples, each a table of numbers, as Rhoban's bam and many small loggers write them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import FileFormatError
from bench.record_files.column_map import Variable


def read_samples(path: Path) -> tuple[dict[str, Variable], tuple[str, ...]]:
    """The columns of a list of samples: the file itself is the list, or the longest list of tables in it.

    Lists of numbers within a sample become columns "name_0", "name_1", …; the same numbers beside the list are passed over and noted.

    Raises:
        FileFormatError: It is no JSON, or holds no such list.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError, RecursionError) as error:
        raise FileFormatError(f"'{path}' is no JSON: {error}") from None
    rows, beside = _rows(document)
    if len(rows) < 2:
        raise FileFormatError(
            f'\'{path}\' holds no list of samples; a list of tables such as [{{"time": 0.0, "position": 0.1}}, …] is expected'
        )
    columns: dict[str, list[float]] = {}
    for k, row in enumerate(rows):
        for name, value in _flat(row):
            columns.setdefault(name, [np.nan] * k).append(value)
        for values in columns.values():
            values.extend([np.nan] * (k + 1 - len(values)))
    notes = (f"beside the samples: {', '.join(beside[:12])}; not used",) if beside else ()
    return {name: Variable(np.array(values)) for name, values in columns.items()}, notes


def _rows(document: Any) -> tuple[list[dict[str, Any]], list[str]]:
    if isinstance(document, list):
        return [row for row in document if isinstance(row, dict)], []
    if not isinstance(document, dict):
        return [], []
    lists = {key: value for key, value in document.items() if isinstance(value, list) and value and isinstance(value[0], dict)}  # fmt: skip
    if not lists:
        return [], []
    chosen = max(lists, key=lambda key: len(lists[key]))
    beside = [f"{key} = {value}" for key, value in document.items() if isinstance(value, (int, float, str))]
    return lists[chosen], beside


def _flat(row: dict[str, Any]) -> list[tuple[str, float]]:
    out = []
    for name, value in row.items():
        if isinstance(value, (bool, int, float)):
            out.append((name, float(value)))
        elif isinstance(value, list):
            out += [(f"{name}_{i}", float(x)) for i, x in enumerate(value) if isinstance(x, (int, float))]
    return out
