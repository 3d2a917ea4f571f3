"""The errors of the bench: each says what came, what was expected and what to do.

Every error a user can cause derives from `BenchError`, so that a program can catch them all, and from the built-in
class that fits (`ValueError`, `KeyError`, …), so that code which knows nothing of the bench behaves as it would
expect. The command line prints the message of a `BenchError` and nothing else.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any


@dataclass(frozen=True)
class ErrorsSettings:
    """Numbers of `bench.errors`."""

    shown_names: int = 60
    """Names that a message lists at most; the nearest one is told in any case."""


SETTINGS = ErrorsSettings()


class BenchError(Exception):
    """Base class of all errors raised on purpose by the bench."""

    def __str__(self) -> str:  # KeyError would print the repr of its argument
        # one line, whatever line breaks the names in a file have
        return " ".join(str(self.args[0]).splitlines()) if self.args else ""


class UnknownNameError(BenchError, KeyError):
    """A name (law, joint, channel, rig, …) is not among the known ones.

    Args:
        kind: What the name stands for, as it should read in the message ("law", "joint of rig 'sdof'").
        name: The name that came.
        known: The names that would have been accepted.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        super().__init__(unknown_name(kind, name, known))


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """The sentence about a name that is not among the known ones, with the nearest of these."""
    names = sorted(map(str, known))
    near = nearest(str(name), names)
    hint = f" Did you mean '{near}'?" if near else ""
    more = f", … ({len(names)} in all)" if len(names) > SETTINGS.shown_names else ""
    listed = ", ".join(names[: SETTINGS.shown_names]) or "none"
    return f"unknown {kind} '{shortened(str(name))[1:-1]}'; known: {listed}{more}.{hint}"


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name that a misspelt one most resembles, capitals aside; empty where none does."""
    folded = {other.casefold(): other for other in known}
    near = difflib.get_close_matches(name[:100].casefold(), folded, n=1)
    return folded[near[0]] if near else ""


def shortened(value: Any, width: int = 60) -> str:
    """A value on one line of about `width` characters, whatever its size and depth, as it may stand in a message."""
    if isinstance(value, str):
        text = repr(value[: width + 1])
        return text if len(value) <= width else f"{text[:width]}…{text[0]}"
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 1000:
        return f"an integer of some {int(value.bit_length() * math.log10(2.0)) + 1} digits"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if not isinstance(value, Mapping | list | tuple):
        text = " ".join(repr(value).split())
        return text if len(text) <= width else f"{text[:width]}…"
    if isinstance(value, Mapping):
        opened, closed = "{}"
        parts = (f"{shortened(k, 20)}: {_inner(v, width // 3)}" for k, v in islice(value.items(), 4))
    else:
        opened, closed = "[]"
        parts = (_inner(item, width // 3) for item in islice(value, 6))
    text = opened
    for index, part in enumerate(parts):
        text += (", " if index else "") + part
        if len(text) > width:
            return f"{text[:width]}…{closed}"
    shown = 4 if isinstance(value, Mapping) else 6
    return text + (", …" if len(value) > shown else "") + closed


def _inner(value: Any, width: int) -> str:
    """A value within another one; what holds values itself is not opened, since it may nest without end."""
    if isinstance(value, Mapping):
        return "{…}" if value else "{}"
    if isinstance(value, list | tuple):
        return "[…]" if value else "[]"
    return shortened(value, width)


class ParameterError(BenchError, ValueError):
    """A parameter has a value outside its range, the wrong shape or is not finite."""


class UnitError(BenchError, ValueError):
    """A unit is unknown or does not fit the quantity it was given for."""


class RecordingError(BenchError, ValueError):
    """A record cannot be used as it is: gaps, NaN, time going backwards, a missing channel, a wrong length."""


class FileFormatError(BenchError, ValueError):
    """A file cannot be read: corrupted, truncated, or not of the format its name says."""


class DocumentError(FileFormatError, ParameterError):
    """An entry of a document (a rig, a plan, a nominal model, …) is not what its schema asks for."""


class UnknownEntryError(DocumentError, UnknownNameError):
    """A document has an entry, or names something, that is not known; the message tells the nearest known name."""

    def __init__(self, message: str) -> None:
        Exception.__init__(self, message)


class ModelError(BenchError, ValueError):
    """An MJCF model does not hold what an element, sensor or actuator refers to."""


class NativeError(BenchError, RuntimeError):
    """The native layer refuses: untested MuJoCo layout, foreign callback, model of another process."""


class SimulationError(BenchError, RuntimeError):
    """A simulation produced numbers that are not finite.

    Attributes:
        time: Time of the last good state [s].
        element: Name of the element with the largest force there, or None.
    """

    def __init__(self, message: str, *, time: float, element: str | None = None) -> None:
        super().__init__(message)
        self.time = time
        self.element = element


class IdentificationError(BenchError, ValueError):
    """An identification cannot be carried out on the data given (too short, not exciting, singular)."""


class MissingPackageError(BenchError, ImportError):
    """A package of an extra is not installed."""


class RangeWarning(UserWarning):
    """A reduced-order model was used outside the range of the data it was identified from."""


class RecordWarning(UserWarning):
    """Something in a record's file was assumed, repaired or left out, or is doubtful; the text says what."""
