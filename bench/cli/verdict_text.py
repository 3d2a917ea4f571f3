"""A verdict for people, at the console."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from bench.discrepancy.verdict import Verdict


def summary(verdict: Verdict) -> list[Any]:
    """A verdict for people: sentences and tables to print.

    Args:
        verdict: The verdict.
    """
    from bench.discrepancy.judgement.shares import closed_words, interval, probability

    parts: list[Any] = [verdict.explanation]
    for effects, title in (
        (verdict.named, "Missing from the model"),
        (verdict.nearest, "What comes nearest"),
    ):
        if not effects:
            continue
        table = Table("effect", "where", "probability", "closes", "parameters", title=title)
        for effect in effects:
            values = "\n".join(
                f"{name} = {p.value:.5g} ± {p.std:.2g} {p.unit if p.unit != '1' else ''}".rstrip()
                for name, p in effect.parameters.items()
            )
            where = " ".join(dict.fromkeys(text for text in (effect.where, effect.channel) if text))
            closes = interval(effect.closed, effect.closed_ci95)
            table.add_row(effect.name, where, probability(effect.probability), closes, Text(values))
        parts.append(table)
    for gap in verdict.gaps:
        label = f"{gap.dof}: {gap.metric}" if gap.dof else gap.metric
        table = Table("model", "NRMSE", "closed", title=f"How far the gap shrinks ({label})")
        steps = gap.steps or (("nominal", gap.before), ("after", gap.after))
        for name, value in steps[:-1]:
            table.add_row(name, f"{value:.3g}", "" if value == gap.before else closed_words(gap, value))
        table.add_row(steps[-1][0], f"{steps[-1][1]:.3g}", closed_words(gap))
        table.add_row("noise alone", f"{gap.noise_floor:.3g}", "")
        parts.append(table)
    if verdict.left:
        parts.append(verdict.left)
    for names in verdict.indistinguishable:
        parts.append(f"These records cannot tell {' from '.join(names)}.")
    proposal = verdict.next_excitation
    if proposal.get("reason"):
        parts.append(proposal["reason"])
    if proposal.get("separates") and proposal.get("excitation"):
        parts.append(
            f"To separate {' from '.join(proposal['separates'])}: {proposal['excitation']}, peak load "
            f"{proposal['peak_load']:.3g}, {proposal['duration_s']:.3g} s; power {100 * proposal['power']:.0f} %."
        )
    return parts
