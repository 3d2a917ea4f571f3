"""Parts of one type, five servos of a robot, say: what of them is off is off in all, and each differs a little besides."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Protocol

from bench.documents import refuse
from bench.rig.bodies import BODIES


class OfType(Protocol):
    """An entry of ``"parameters"`` that may say of which type of part it is."""

    @property
    def std(self) -> float:
        """One-sigma uncertainty."""
        ...

    @property
    def alike(self) -> str:
        """Type of the part; "" where none is stated."""
        ...

    @property
    def each(self) -> float | None:
        """One-sigma scatter of the parts of that type about their common value."""
        ...


def check_types(parameters: Mapping[str, OfType], *, own: bool) -> None:
    """Refuse types of parts of which nothing follows.

    Args:
        parameters: The parameters by name.
        own: Whether the rig is an MJCF.
    """
    kinds = Counter((name.partition(":")[0], entry.alike) for name, entry in parameters.items())
    for name, entry in parameters.items():
        kind = name.partition(":")[0]
        said = ""
        if (entry.each is None) == bool(entry.alike):
            said = "alike and each belong together: a type, and the one-sigma scatter of its parts about their common value"
        elif entry.each is not None and entry.each >= entry.std:
            said = f"each is {entry.each:g} and std {entry.std:g}; std counts the scatter of the parts in and has to be larger"
        elif entry.alike and (not own or kind in BODIES):
            said = "parts of one type are joints and drives of an MJCF; leave alike and each out here"
        elif entry.alike and kinds[kind, entry.alike] < 2:
            said = f"no other '{kind}:…' is of type '{entry.alike}'; state it of two at least, or leave alike and each out"
        if said:
            refuse(said, "parameters", name, "alike")
