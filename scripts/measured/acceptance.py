"""When a diagnosis of a measured case is right, honest or wrong: written down in ``acceptance.json`` before the run."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

Grade = Literal["right", "honest", "wrong"]
CERTAIN = 0.9
"""Probability from which a name is certain."""


class _Named(NamedTuple):
    """An effect that a verdict names."""

    name: str
    at: str
    """``name@place``."""


@dataclass(frozen=True)
class Acceptance:
    """What is right of a case.

    Attributes:
        right: Names of effects, any one of these groups; an empty group where nothing is missing. ``name@place`` asks for the place, too.
        also: Names that may stand beside them, likewise.
        nrmse: Largest discrepancy that may be left on the judging records; none where None.
        why: What is known of the case, and from whom.
        refusal: Words that a refusal to diagnose it has to hold to be right; none where no refusal is.
    """

    right: tuple[frozenset[str], ...]
    also: frozenset[str] = frozenset()
    nrmse: float | None = None
    why: str = ""
    refusal: tuple[str, ...] = ()

    def refused(self, message: str) -> Grade | Literal["refused"]:
        """Grade a refusal: right where that is what was asked for, and the message says what is wrong."""
        return "right" if self.refusal and all(word in message for word in self.refusal) else "refused"

    def grade(self, verdict: Mapping[str, Any]) -> Grade:
        """Grade a verdict.

        Right: a group is named, beside nothing but what may stand there, and what is left is small enough. Honest: *unknown*, a declared
        set that holds a right name, or no name that is certain and false. Wrong: a certain false name that no declared set holds together
        with one that may stand there, or *none* over an effect.
        """
        named = {
            _Named(e["name"], f"{e['name']}@{e.get('where', '')}"): e["probability"] for e in verdict["named"]
        }
        kind, sets = verdict["verdict"], verdict.get("indistinguishable") or ()
        if kind == "none":
            return "right" if frozenset() in self.right else "wrong"
        if kind == "unknown":
            return "honest"
        after = verdict["gap"]["after"]
        small = self.nrmse is None or (after is not None and after <= self.nrmse)
        if any(group and self._is(group, named) for group in self.right) and small:
            return "right"
        known = self.also.union(*self.right)
        told = {entry.partition("@")[0] for entry in known}
        false = [
            one
            for one, p in named.items()
            if p >= CERTAIN
            and not known & set(one)
            and not any(one.name in entry and told & set(entry) for entry in sets)
        ]
        return "wrong" if false and not self._declared(sets, bool(named)) else "honest"

    def _is(self, group: frozenset[str], named: Collection[_Named]) -> bool:
        """Whether a group is named, beside nothing but what may stand there."""
        missed = [entry for entry in group if not any(entry in one for one in named)]
        return not missed and all((group | self.also) & set(one) for one in named)

    def _declared(self, sets: Sequence[Sequence[str]], named: bool) -> bool:
        """Whether a declared set that a name stands in holds a right group as well; sets know of no places."""
        labels = [{frozenset(label.split(" + ")) for label in entry} for entry in sets]
        right = [frozenset(entry.partition("@")[0] for entry in group) for group in self.right]
        groups = (*right, *(frozenset([name]) for group in right for name in group))
        return any(group in entry for entry in labels for group in groups) and named


FILE = Path(__file__).with_name("acceptance.json")
"""What was written down for the records that come with the bench and for the public ones."""


def acceptances(file: Path = FILE) -> dict[str, Acceptance]:
    """What is right, by the beginning of the cases' names.

    Args:
        file: JSON with "cases", name to "right", "also", "nrmse", "why" and "refusal".
    """
    entries = json.loads(file.read_text(encoding="utf-8"))["cases"]
    return {
        name: Acceptance(
            tuple(frozenset(group) for group in entry["right"]), frozenset(entry.get("also", ())), entry.get("nrmse"),
            entry.get("why", ""), tuple(entry.get("refusal", ())),
        )
        for name, entry in entries.items()
    }  # fmt: skip


def acceptance_of(name: str, known: Mapping[str, Acceptance]) -> Acceptance | None:
    """The entry whose name a case's begins with, the longest one; None where there is none."""
    own = [key for key in known if name.startswith(key)]
    return known[max(own, key=len)] if own else None
