"""The errors of the bench: each says what came, what was expected and what to do.

Every error a user can cause derives from `BenchError`, so that a program can catch them all, and from the built-in
class that fits (`ValueError`, `KeyError`, …), so that code which knows nothing of the bench behaves as it would
expect. The command line prints the message of a `BenchError` and nothing else.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class BenchError(Exception):
    """Base class of all errors raised on purpose by the bench."""

    def __str__(self) -> str:  # KeyError would print the repr of its argument
        return str(self.args[0]) if self.args else ""


class UnknownNameError(BenchError, KeyError):
    """A name (law, joint, channel, rig, …) is not among the known ones.

    Args:
        kind: What the name stands for, as it should read in the message ("law", "joint of rig 'sdof'").
        name: The name that came.
        known: The names that would have been accepted.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        names = sorted(known)
        near = difflib.get_close_matches(name, names, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        super().__init__(f"unknown {kind} '{name}'; known: {', '.join(names) or 'none'}.{hint}")


class ParameterError(BenchError, ValueError):
    """A parameter has a value outside its range, the wrong shape or is not finite."""


class UnitError(BenchError, ValueError):
    """A unit is unknown or does not fit the quantity it was given for."""


class RecordingError(BenchError, ValueError):
    """A record cannot be used as it is: gaps, NaN, time going backwards, a missing channel, a wrong length."""


class FileFormatError(BenchError, ValueError):
    """A file cannot be read: corrupted, truncated, or not of the format its name says."""


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


class RangeWarning(UserWarning):
    """A reduced-order model was used outside the range of the data it was identified from."""


class RecordWarning(UserWarning):
    """Something in a record's file was assumed, repaired or left out, or is doubtful; the text says what."""
