"""Which column of a foreign file is which channel."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, UnknownNameError

_INDEXED = re.compile(r"^(?P<name>.+?)\[(?P<index>[^\[\]]*)\]$")
_BRACKETED = re.compile(r"^(?P<name>.*?\S)\s*[\[(](?P<unit>[^\[\]()]*)[\])]$")


@dataclass(frozen=True)
class ColumnMap:
    """Names the columns of a laboratory file: one map serves all files of a campaign.

    A source is the name of a column or array ("Load Cell 1"), of a field of a MATLAB struct ("run.force"), of an HDF5
    data set ("test_3/force"), or one line of a larger array ("data[:, 2]", as NumPy would write it).

    Attributes:
        columns: Source by channel name.
        units: Unit by channel name; those that the file itself tells may be left out.
        quantities: Quantity of some channels, one of `bench.recording.SI_UNITS`.
        roles: Role of some channels, one of `bench.recording.ROLES`.
        time: Source of the time; "" for the column named "time" or "t".
        time_unit: Unit of the time; "" for what the file tells, else seconds.
        sample_rate: Samples a second [Hz], for a file without a time; 0 to find it from the time.
    """

    columns: Mapping[str, str]
    units: Mapping[str, str] = field(default_factory=dict)
    quantities: Mapping[str, str] = field(default_factory=dict)
    roles: Mapping[str, str] = field(default_factory=dict)
    time: str = ""
    time_unit: str = ""
    sample_rate: float = 0.0


class Variable(NamedTuple):
    """One column or array of a file."""

    values: NDArray
    """Any shape; whatever the file holds."""
    unit: str = ""
    """What the file tells of its unit."""
    sample: str = ""
    """Of a column of text, where it begins: "line 5 holds 'abc'"."""


def name_and_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a heading such as "force [kip]" or "force (kip)"; the unit is "" where it tells none."""
    match = _BRACKETED.match(heading.strip())
    return (match["name"], match["unit"].strip()) if match else (heading.strip(), "")


def base_name(source: str) -> str:
    """Name of the array that a source takes its line from."""
    match = _INDEXED.match(source)
    return match["name"].strip() if match else source


def find(
    variables: Mapping[str, Variable], source: str, *, file: str, kinds: str = "biuf"
) -> tuple[NDArray, str]:
    """Values ``(n,)`` and unit of a source.

    Args:
        variables: What the file holds, by name.
        source: Column, array or line of an array.
        file: Name of the file, for messages.
        kinds: Kinds of NumPy that are accepted; the values keep theirs.

    Raises:
        UnknownNameError: The file has no such column or array.
        FileFormatError: The index does not fit the array, the result is no line of numbers.
    """
    exact = _lookup(variables, source)
    if exact is not None:
        return _line(exact, exact.values, source, file, kinds), exact.unit
    match = _INDEXED.match(source)
    variable = _lookup(variables, match["name"].strip()) if match else None
    if match is None or variable is None:
        raise UnknownNameError(f"column of '{file}'", source, [name[:60] for name in list(variables)[:60]])
    try:
        index = tuple(slice(None) if part.strip() == ":" else int(part) for part in match["index"].split(","))
        values = np.asarray(variable.values)[index]
    except (ValueError, IndexError, OverflowError):
        raise FileFormatError(
            f"'{source}' does not fit '{match['name']}' of '{file}', an array of shape {np.shape(variable.values)}; "
            "one ':' and one number a further dimension are expected, counted from 0, as in 'data[:, 2]'"
        ) from None
    return _line(variable, values, source, file, kinds), variable.unit


def _lookup(variables: Mapping[str, Variable], name: str) -> Variable | None:
    if name in variables:
        return variables[name]
    short = [heading for heading in variables if name_and_unit(heading)[0] == name]
    return variables[short[0]] if len(short) == 1 else None


def _line(variable: Variable, values: NDArray, source: str, file: str, kinds: str) -> NDArray:
    if variable.sample:
        raise FileFormatError(
            f"column '{source}' of '{file}' does not hold numbers: {variable.sample}; correct that cell, or name another column"
        )
    line = np.squeeze(np.asarray(values))
    if line.dtype.kind not in kinds:
        raise FileFormatError(
            f"'{source}' of '{file}' does not hold real numbers (it is {line.dtype}); choose another column"
        )
    if line.ndim != 1:
        single = "a single line, of one number; at least two are expected" if line.ndim == 0 else (
            f"shape {np.shape(values)}; name one line of it, as in '{source}[:, 0]', with columns={{channel name: source}}"
        )  # fmt: skip
        raise FileFormatError(f"'{source}' of '{file}' has {single}")
    return line
