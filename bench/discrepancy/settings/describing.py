"""A field of settings: its default, what it means, why it has that value, and its unit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields, is_dataclass
from typing import Any, NamedTuple

CONVENTION = "Convention."
"""Reason of a value that rests on neither a derivation nor a study."""


class DescribedSetting(NamedTuple):
    """One setting.

    Attributes:
        path: Names from the whole settings down to it, joined by dots.
        default: Its value where nothing else is asked for.
        meaning: What it decides.
        reason: Derivation, source or study of the value.
        unit: Unit; "1" for a plain number.
    """

    path: str
    default: Any
    meaning: str
    reason: str
    unit: str


def setting(default: Any, meaning: str, reason: str = CONVENTION, *, unit: str = "1") -> Any:
    """A field of a frozen dataclass of settings.

    Args:
        default: Its value where nothing else is asked for.
        meaning: What it decides, a sentence.
        reason: Derivation, source or study of the value, a sentence.
        unit: Unit; "1" for a plain number.
    """
    return field(default=default, metadata={"meaning": meaning, "reason": reason, "unit": unit})


def described(settings: Any, prefix: str = "") -> Iterator[DescribedSetting]:
    """Every setting of an object of settings and of those within it, in the order they are written.

    Args:
        settings: An object of a dataclass whose fields are made by `setting`, or hold such objects.
        prefix: Path of the object.
    """
    for entry in fields(settings):
        value, path = getattr(settings, entry.name), f"{prefix}{entry.name}"
        if is_dataclass(value):
            yield from described(value, f"{path}.")
        else:
            yield DescribedSetting(
                path, value, entry.metadata["meaning"], entry.metadata["reason"], entry.metadata["unit"]
            )
