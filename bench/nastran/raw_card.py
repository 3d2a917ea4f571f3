"""A card as it is read: its place in the deck, its fields, and what every kind of card has."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, NamedTuple, TypeVar

from bench.errors import FileFormatError
from bench.nastran.numbers import parse_integer, parse_real

T = TypeVar("T")

Field = int | float | str | None
"""Content of one data field; None is blank."""


class DeckPlace(NamedTuple):
    """Where a piece of a deck stands."""

    source: str
    line: int

    def __str__(self) -> str:
        return f"{self.source}, line {self.line}"


class RawCard(NamedTuple):
    """A card whose lines are joined and split into fields, not yet interpreted."""

    name: str
    fields: tuple[str, ...]
    """Data fields in order, 8 to a line of small fields; blank ones are empty."""
    places: tuple[DeckPlace, ...]
    """Where each field stands."""
    place: DeckPlace

    def integer(self, i: int, what: str, default: int | None = None) -> int:
        """Data field i (from 0) as an integer; `default` where it is blank."""
        return self._value(i, what, parse_integer, default, "an integer")

    def real(self, i: int, what: str, default: float | None = None) -> float:
        """Data field i (from 0) as a real number; `default` where it is blank."""
        return self._value(i, what, _parse_finite, default, "a real number with a decimal point")

    def text(self, i: int, what: str, default: str | None = None) -> str:
        """Data field i (from 0) as a name of at most eight letters and digits; `default` where it is blank."""
        return self._value(i, what, _parse_name, default, "a name")

    def blank(self, i: int) -> bool:
        """Whether data field i (from 0) is blank or absent."""
        return i >= len(self.fields) or not self.fields[i]

    def fail(self, i: int, what: str, expected: str) -> FileFormatError:
        """The error that names line, card, field, what was found and what was expected."""
        found = "blank" if self.blank(i) else f"'{self.fields[i][:80]}'"
        place = self.places[i] if i < len(self.places) else self.place
        return FileFormatError(
            f"{place}: card {self.name}, field {i % 8 + 2} ({what}): {found} found, {expected} expected"
        )

    def _value(self, i: int, what: str, parse: Callable[[str], T], default: T | None, expected: str) -> T:
        if self.blank(i):
            if default is None:
                raise self.fail(i, what, expected)
            return default
        try:
            return parse(self.fields[i])
        except ValueError as error:
            raise self.fail(i, what, str(error)) from error


def _parse_finite(text: str) -> float:
    value = parse_real(text)
    if not math.isfinite(value):
        raise ValueError("a real number of at most 1.8+308")
    return value


def _parse_name(text: str) -> str:
    if not (text[0].isalpha() and text.isalnum() and len(text) <= 8):
        raise ValueError("a name of at most 8 letters and digits that begins with a letter")
    return text.upper()


class Card(ABC):
    """What every card offers: its name in field 1, and its data fields."""

    NAME: ClassVar[str] = ""

    @property
    def name(self) -> str:
        """Name in field 1."""
        return self.NAME

    @abstractmethod
    def fields(self) -> list[Field]:
        """Data fields in order, 8 to a line of small fields; None is blank."""
