"""Kinds of values that documents hold: numbers, names, lists and tables, each with what it says in a JSON Schema.

All are strict: text is no number, true is no number, and a number is no text. Whole numbers may be written as 3.0, and NumPy's
scalars count as Python's, so that programs can pass what they have computed.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, FailFast, Field, Strict, StringConstraints
from pydantic_core import PydanticCustomError

T = TypeVar("T")


@dataclass(frozen=True)
class KindsSettings:
    """Numbers of `bench.documents.kinds`."""

    most_entries: int = 10_000
    """Entries of one table at most: each is a name that somebody gave, and each may be wrong and has to be told."""


SETTINGS = KindsSettings()


def any_of(*kinds: Any) -> Any:
    """The union of kinds that are made at run time."""
    return functools.reduce(operator.or_, kinds)


class _FirstOnly(FailFast):
    """Stop at the first member that does not fit; hashable, so that unions can hold lists."""

    def __hash__(self) -> int:
        return hash(type(self))


def _plain(value: Any) -> Any:
    return value.item() if type(value).__module__ == "numpy" and hasattr(value, "item") else value


def _whole(value: Any) -> Any:
    value = _plain(value)
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _few(value: Any) -> Any:
    if isinstance(value, Mapping) and len(value) > SETTINGS.most_entries:
        raise PydanticCustomError(
            "bench",
            "{text}",
            {"text": f"{len(value)} entries came; at most {SETTINGS.most_entries} are expected"},
        )
    return dict(value) if isinstance(value, Mapping) else value


AS_NUMBER = BeforeValidator(_plain)
"""Last among the marks of a number that has further bounds than these here."""
AS_WHOLE = BeforeValidator(_whole)
"""The same of a whole number."""
Number = Annotated[float, Strict(), Field(allow_inf_nan=False), AS_NUMBER]
"""A finite number; text and `true` are none."""
Positive = Annotated[float, Strict(), Field(gt=0.0, allow_inf_nan=False), AS_NUMBER]
"""A finite number above zero."""
NotNegative = Annotated[float, Strict(), Field(ge=0.0, allow_inf_nan=False), AS_NUMBER]
"""A finite number, zero or above."""
Probability = Annotated[float, Strict(), Field(ge=0.0, le=1.0), AS_NUMBER]
"""A number from zero to one."""
Limit = Annotated[float, Strict(), Field(gt=0.0, allow_inf_nan=True), AS_NUMBER]
"""A positive number or infinity, which stands for no limit (TOML can write it)."""
Whole = Annotated[int, Strict(), AS_WHOLE]
"""A whole number."""
Count = Annotated[int, Strict(), Field(ge=0), AS_WHOLE]
"""A whole number, zero or above."""
Flag = Annotated[bool, Strict(), AS_NUMBER]
"""True or false; 0 and 1 are numbers."""
Text = Annotated[str, Strict()]
"""Any text."""
Name = Annotated[
    str, Strict(), StringConstraints(min_length=1, max_length=256, pattern=r"^[^\x00-\x1f\x7f]+$")
]
"""Text that names something: not empty, one line, at most 256 characters."""
Label = Annotated[str, Strict(), StringConstraints(max_length=256, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A name, or nothing."""
Listed = Annotated[tuple[T, ...], Strict(False), _FirstOnly()]
"""Any number of values; a tuple in the model."""
Table = Annotated[dict[Name, T], BeforeValidator(_few)]
"""Values by name."""
NumberPair = Annotated[tuple[Number, Number], Strict(False)]
"""Two numbers, mostly the lowest and the highest."""
