"""When a diagnosis of a measured case is right, honest or wrong: written down in ``acceptance.json`` before the run."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Grade = Literal["right", "honest", "wrong"]
CERTAIN = 0.9
"""Probability from which a name is certain."""


@dataclass(frozen=True)
class Acceptance:
    """What is right of a case.

    Attributes:
        right: Names of effects, any one of these groups; an empty group where nothing is missing.
        also: Names that may stand beside them.
        nrmse: Largest discrepancy that may be left on the judging records; none where None.
        why: What is known of the case, and from whom.
    """

    right: tuple[frozenset[str], ...]
    also: frozenset[str] = frozenset()
    nrmse: float | None = None
    why: str = ""

    def grade(self, verdict: Mapping[str, Any]) -> Grade:
        """Grade a verdict.

        Right: a group is named, beside nothing but what may stand there, and what is left is small enough. Honest: *unknown*, a declared
        set that holds a right name, or no name that is certain and false. Wrong: a certain false name, or *none* over an effect.
        """
        named = {e["name"]: e["probability"] for e in verdict["named"]}
        kind, sets = verdict["verdict"], verdict.get("indistinguishable") or ()
        if kind == "none":
            return "right" if frozenset() in self.right else "wrong"
        if kind == "unknown":
            return "honest"
        after = verdict["gap"]["after"]
        small = self.nrmse is None or (after is not None and after <= self.nrmse)
        if any(group and group <= set(named) <= group | self.also for group in self.right) and small:
            return "right"
        known = self.also.union(*self.right)
        false = [name for name, p in named.items() if name not in known and p >= CERTAIN]
        return "wrong" if false and not self._declared(sets, named) else "honest"

    def _declared(self, sets: Sequence[Sequence[str]], named: Mapping[str, float]) -> bool:
        """Whether a declared set that a name stands in holds a right group as well."""
        labels = [{frozenset(label.split(" + ")) for label in entry} for entry in sets]
        groups = (*self.right, *(frozenset([name]) for group in self.right for name in group))
        return any(group in entry for entry in labels for group in groups) and bool(named)


FILE = Path(__file__).with_name("acceptance.json")
"""What was written down for the records that come with the bench and for the public ones."""


def acceptances(file: Path = FILE) -> dict[str, Acceptance]:
    """What is right, by the beginning of the cases' names.

    Args:
        file: JSON with "cases", name to "right", "also", "nrmse" and "why".
    """
    entries = json.loads(file.read_text(encoding="utf-8"))["cases"]
    return {
        name: Acceptance(
            tuple(frozenset(group) for group in entry["right"]), frozenset(entry.get("also", ())), entry.get("nrmse"), entry.get("why", "")
        )
        for name, entry in entries.items()
    }  # fmt: skip


def acceptance_of(name: str, known: Mapping[str, Acceptance]) -> Acceptance | None:
    """The entry whose name a case's begins with, the longest one; None where there is none."""
    own = [key for key in known if name.startswith(key)]
    return known[max(own, key=len)] if own else None
