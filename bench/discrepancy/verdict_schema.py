"""The verdict as a document: what `jointbench diagnose --json` writes.

Its models are read off `Verdict`. Numbers that are not finite stand in JSON as null, probabilities never do. Results that are scored
may come from elsewhere: they may leave out what they do not know, but hold nothing else.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, Strict

from bench.discrepancy.verdict import (
    Estimate,
    Gap,
    Location,
    NamedEffect,
    NominalEstimate,
    Ranked,
    Split,
    Verdict,
)
from bench.documents import AS_NUMBER, Document, Entry, Label, Listed, Name, Number, Probability, Text
from bench.documents.derived import entry_of

_ENTRIES: dict[type[Any], tuple[str, tuple[str, ...]]] = {
    Estimate: ("an estimate", ("value",)),
    NamedEffect: ("a named effect", ("name", "probability")),
    NominalEstimate: ("a nominal parameter", ("name",)),
    Ranked: ("a ranked effect", ("name", "probability")),
    Location: ("a location", ()),
    Split: ("a split", ()),
    Gap: ("a gap", ()),
}
"""The entries of a verdict: what each is, and what one that comes from elsewhere needs."""
NumberOrNull = Annotated[float | None, Strict(), Field(allow_inf_nan=False), AS_NUMBER]
"""A number; null where it is not finite."""
Interval = Annotated[tuple[NumberOrNull, NumberOrNull], Strict(False)]


class RegionEntry(Entry):
    """A region of the state space: its limits by coordinate, and what else is known of it."""

    model_config = ConfigDict(extra="allow")
    entry_name = "a region"
    entry_open = True
    displacement: Interval | None = None
    """Limits of the displacement; null for none."""
    velocity: Interval | None = None
    """Limits of the velocity."""
    share: NumberOrNull = None
    """Part of the squared force there."""
    force: NumberOrNull = None
    """Mean force there."""
    effect: Label = ""
    """Named effect that acts there."""


_REPLACED: dict[str, Any] = {
    "name": Name, "probability": Probability, "theta": Listed[Number], "regions": Listed[RegionEntry]
}  # fmt: skip


def _kinds(*, partial: bool) -> Any:
    """Kinds of the fields of a verdict, or of one that may leave out what it does not know."""
    known: dict[type[Any], Any] = {}

    def own(hint: Any) -> Any:
        if hint is float:
            return NumberOrNull
        if hint == dict[str, float]:
            return dict[str, Probability]
        if hint in _ENTRIES and hint not in known:
            kind, needed = _ENTRIES[hint]
            name = f"{'Scored' if partial else ''}{hint.__name__}Entry"
            known[hint] = entry_of(
                hint, own, kind=kind, name=name, replaced=_REPLACED, needed=needed if partial else None
            )
        return known.get(hint) if isinstance(hint, type) else None

    return own


VerdictDocument = entry_of(
    Verdict, _kinds(partial=False), kind="a verdict", name="VerdictDocument", base=Document
)
"""A verdict as a diagnosis writes it."""
ResultDocument = entry_of(
    Verdict,
    _kinds(partial=True),
    kind="a result",
    name="ResultDocument",
    base=Document,
    replaced={
        "verdict": Literal["effect", "none", "unknown", "failed"],
        "indistinguishable": Listed[Listed[Label]],
    },
    needed=("verdict", "named"),
    error=(Text, ""),
)
"""A verdict as it is scored: a diagnosis that ended in an error says "failed" and the "error"."""
