"""Frozen descriptions that check themselves and travel as plain JSON or TOML.

Signals and measurement stages are frozen dataclasses of numbers, names and further descriptions.
`Described` gives each family of them one registry, a lossless round trip through `to_dict` and `from_dict`,
and checks of fields whose messages name the class, the field, its unit and the range.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from bench.errors import ParameterError


class Described:
    """Base of a family of frozen dataclasses with a registry.

    A family is opened by ``class Signal(Described, kind="signal")``; a member enters its registry by
    ``class Harmonic(Signal, name="harmonic")``.

    Attributes:
        kind: What a member is, as it reads in messages ("signal", "stage").
        name: Name of the member in the registry, the entry "type" of its dictionary.
    """

    kind: ClassVar[str] = "description"
    name: ClassVar[str] = ""
    _registry: ClassVar[dict[str, type[Any]]] = {}
    _family: ClassVar[type[Described]]

    def __init_subclass__(cls, *, kind: str | None = None, name: str | None = None, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if kind is not None:
            cls.kind = kind
            cls._registry = {}
            cls._family = cls
        if name is not None:
            if name in cls._registry:
                raise ParameterError(f"the {cls.kind} '{name}' exists already; choose another name")
            cls.name = name
            cls._registry[name] = cls

    @classmethod
    def registry(cls) -> Mapping[str, type[Self]]:
        """A read-only, live view of the members of the family by name."""
        return MappingProxyType(cls._registry)

    def to_dict(self) -> dict[str, Any]:
        """The description as numbers, strings, lists and dictionaries; fields that are None are left out."""
        data: dict[str, Any] = {"type": self.name}
        for field in fields(self):  # pyrefly: ignore[bad-argument-type]  (every member is a dataclass)
            value = getattr(self, field.name)
            if value is not None:
                data[field.name] = _encoded(value)
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The description that `to_dict` (or a section of a TOML file) stands for.

        Args:
            data: The entry "type" and the fields of that type; fields with a default may be absent.

        Raises:
            DocumentError: "type" is not in the registry, an entry is no field of it, one without default is missing, or a value is
                of the wrong kind or out of range.
            ParameterError: The type is another than the class this is called on.
        """
        from bench.documents import checked_as, schema_of  # noqa: PLC0415  (pydantic, for those who read documents)

        made = checked_as(schema_of("bench.signals").adapter(cls._family), data)
        if not isinstance(made, cls):
            raise ParameterError(f"a {cls.kind} '{cls.name}' is expected; one of type '{made.name}' came")
        return made

    def _set(self, field: str, value: Any) -> None:
        object.__setattr__(self, field, value)

    def _fail(self, field: str, expected: str) -> ParameterError:
        return ParameterError(
            f"{field} of {self.kind} '{self.name}' is {getattr(self, field)!r}; {expected} is expected"
        )

    def _real(
        self,
        field: str,
        unit: str = "",
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        optional: bool = False,
    ) -> None:
        """Turn a field into a finite float within its range, or raise `ParameterError`."""
        value = getattr(self, field)
        if value is None and optional:
            return
        expected = f"a finite number{f' above {above:g}' if above > -math.inf else ''}"
        expected += (
            f"{f' of at least {at_least:g}' if at_least > -math.inf else ''}{f' [{unit}]' if unit else ''}"
        )
        number = _number(value)
        if number is None or not (number > above and number >= at_least):
            raise self._fail(field, expected)
        self._set(field, number)

    def _reals(
        self, field: str, unit: str = "", *, above: float = -math.inf, length: int | None = None
    ) -> None:
        """Turn a field into a tuple of finite floats above a bound, or raise `ParameterError`."""
        value = getattr(self, field)
        count = "some" if length is None else str(length)
        expected = f"a list of {count} finite numbers{f' above {above:g}' if above > -math.inf else ''}"
        expected += f" [{unit}]" if unit else ""
        if isinstance(value, str | Mapping) or not isinstance(value, Sequence | np.ndarray):
            raise self._fail(field, expected)
        numbers = tuple(_number(entry) for entry in value)
        if not numbers or (length is not None and len(numbers) != length):
            raise self._fail(field, expected)
        if any(number is None or number <= above for number in numbers):
            raise self._fail(field, expected)
        self._set(field, numbers)

    def _integer(
        self, field: str, *, at_least: int, at_most: int | None = None, optional: bool = False
    ) -> None:
        """Turn a field into an int within its range, or raise `ParameterError`."""
        value = getattr(self, field)
        if value is None and optional:
            return
        number = _number(value)
        high = math.inf if at_most is None else at_most
        if number is None or number != int(number) or not at_least <= number <= high:
            limit = f"of at least {at_least}" if at_most is None else f"from {at_least} to {at_most}"
            raise self._fail(field, f"a whole number {limit}")
        self._set(field, int(number))

    def _flag(self, field: str) -> None:
        """Raise `ParameterError` unless a field is True or False."""
        if not isinstance(getattr(self, field), bool):
            raise self._fail(field, "true or false")

    def _choice(self, field: str, choices: tuple[str, ...]) -> None:
        """Raise `ParameterError` unless a field is one of some words."""
        if getattr(self, field) not in choices:
            raise self._fail(field, "one of " + ", ".join(f"'{choice}'" for choice in choices))


def _number(value: Any) -> float | None:
    """A finite real number as float; None for anything else, booleans and numbers in quotes among it."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        return None
    try:
        number = float(value)
    except OverflowError:  # an integer of more than 308 digits
        return None
    return number if math.isfinite(number) else None


def _encoded(value: Any) -> Any:
    if isinstance(value, Described):
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [_encoded(entry) for entry in value]
    return value
