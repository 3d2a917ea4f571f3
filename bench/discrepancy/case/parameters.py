"""Nominal parameters of ``nominal.json``: how well each is known, and what parts of one type have in common.

What is off in one of five servos of a robot, say, is off in all, and each differs a little besides.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from bench.documents import Entry, Label, NotNegative, Number, Positive, refuse, telling
from bench.recording.units import check_unit
from bench.rig.bodies import BODIES


def _known_unit(unit: str) -> str:
    if unit:
        with telling():
            check_unit(unit)
    return unit


Unit = Annotated[Label, Field(max_length=64), AfterValidator(_known_unit)]


class ParameterEntry(Entry):
    """A nominal parameter."""

    entry_name = "a nominal parameter"
    entry_misnomers = {"sigma": "std", "uncertainty": "std", "stdev": "std", "nominal": "value"}  # noqa: RUF012  (read only)
    entry_hints = {  # noqa: RUF012
        "value": 'as {"value": 2.1, "std": 0.02, "unit": "kg"}',
    }

    value: Number
    """Nominal value."""
    std: NotNegative | None = None
    """One-sigma uncertainty; 0 to mean certain."""
    factor: Annotated[Number, Field(gt=1.0)] | None = None
    """Instead of std, of joints and drives of an MJCF: the factor to within which a positive value is known, one sigma of its logarithm;
    10 of a gain of which the order of magnitude is known."""
    unit: Unit = ""
    """Unit."""
    alike: Label = ""
    """Type of the part that it belongs to, "STS3215" of every such servo: numbers of one kind of parts of one type are off together."""
    each: Positive | None = None
    """One-sigma scatter of the parts of that type about their common value, which std counts in; a factor where factor is stated."""

    @model_validator(mode="after")
    def _is_known_to_something(self) -> ParameterEntry:
        if self.std is None and self.factor is None:
            refuse(
                "a nominal parameter needs std (its one-sigma uncertainty; write 0 to mean certain) or a factor"
            )
        if self.std is not None and self.factor is not None:
            refuse(f"std {self.std:g} and factor {self.factor:g} came; one of them says how well it is known")
        if self.factor is not None and self.value <= 0.0:
            refuse(f"value {self.value:g} came; what is known to within a factor is positive", "value")
        return self


def check_types(parameters: Mapping[str, ParameterEntry], *, own: bool) -> None:
    """Refuse types of parts of which nothing follows.

    Args:
        parameters: The parameters by name.
        own: Whether the rig is an MJCF.
    """
    kinds = Counter((name.partition(":")[0], entry.alike) for name, entry in parameters.items())
    factors = Counter(
        (name.partition(":")[0], entry.alike)
        for name, entry in parameters.items()
        if entry.factor is not None
    )
    for name, entry in parameters.items():
        kind = name.partition(":")[0]
        said, key = "", (kind, entry.alike)
        spread, known = ("std", entry.std or 0.0) if entry.factor is None else ("factor", entry.factor)
        if entry.factor is not None and (not own or kind in BODIES):
            said = (
                "what is known to within a factor are numbers of joints and drives of an MJCF; give std here"
            )
        elif (entry.each is None) == bool(entry.alike):
            said = "alike and each belong together: a type, and the one-sigma scatter of its parts about their common value"
        elif entry.each is not None and entry.each >= known:
            said = f"each is {entry.each:g} and {spread} {known:g}; {spread} counts the scatter of the parts in and has to be larger"
        elif entry.each is not None and spread == "factor" and entry.each <= 1.0:
            said = f"each is {entry.each:g}; beside a factor it is one, too, and larger than 1"
        elif entry.alike and (not own or kind in BODIES):
            said = "parts of one type are joints and drives of an MJCF; leave alike and each out here"
        elif entry.alike and kinds[key] < 2:
            said = f"no other '{kind}:…' is of type '{entry.alike}'; state it of two at least, or leave alike and each out"
        elif entry.alike and factors[key] not in (0, kinds[key]):
            said = (
                f"some '{kind}:…' of type '{entry.alike}' have a factor and some a std; state the same of all"
            )
        if said:
            refuse(said, "parameters", name, "alike" if entry.alike or entry.each is not None else "factor")
