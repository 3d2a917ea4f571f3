"""What differs from record to record, and no channel tells by what: found, and not explained.

Friction of another limit in each record is as certain as its fit that something has changed between them; that it is friction whose
normal force, pressure or temperature changed, and what it will be in another record, is for a channel to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from bench.discrepancy.effects.read_off import DIFFERS
from bench.discrepancy.judgement.finding import Finding
from bench.discrepancy.settings import CoarseSettings
from bench.discrepancy.verdict import NamedEffect, Ranked

Told = TypeVar("Told", NamedEffect, Ranked)


def not_certain_where_untold(finding: Finding, settings: CoarseSettings) -> Finding:
    """A finding in which friction that differs between records has no more than the probability of what is open, and that is said.

    Args:
        finding: What was found.
        settings: That probability.
    """
    if all(effect.name != DIFFERS for effect in (*finding.named, *finding.nearest)):
        return finding
    (own, *_) = [effect for effect in (*finding.named, *finding.nearest) if effect.name == DIFFERS]
    limits = ", ".join(f"{limit.value:.4g}" for limit in own.parameters.values())
    unit = next(iter(own.parameters.values())).unit
    note = (
        f"friction differs from record to record ({limits} {unit} in the order of the records) and no channel tells by what: in a judging "
        "record its limit was read off that record; state what was changed (pressure, normal force, temperature) as a channel of the role "
        '"scheduling"'
    )
    return replace(
        finding,
        named=_open(finding.named, settings.untold),
        nearest=_open(finding.nearest, settings.untold),
        ranking=tuple(sorted(_open(finding.ranking, settings.untold), key=lambda entry: -entry.probability)),
        notes=(*finding.notes, note),
    )


def _open(entries: Sequence[Told], most: float) -> tuple[Told, ...]:
    return tuple(
        replace(entry, probability=min(entry.probability, most)) if entry.name == DIFFERS else entry
        for entry in entries
    )
