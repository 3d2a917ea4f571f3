"""The verdict on an articulated model in a sentence or two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.discrepancy.articulated_judgement.whiteness import Astray, Coloured
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.verdict import Gap, NamedEffect, VerdictKind, by_name, widest_of

NOISE_UNSTATED = (
    "What is left looks like the noise that the channels show at high frequencies, whose size nobody stated."
)


def words_of(
    kind: VerdictKind,
    effects: Sequence[NamedEffect],
    explained: float,
    left: str,
    gaps: Sequence[Gap],
    acted_on: Sequence[Gap],
) -> str:
    """The verdict in words.

    Args:
        kind: Verdict.
        effects: What is named, or nearest.
        explained: Part of the discrepancy of the judging records that is closed in all.
        left: What is left beside noise, see `left_of`; empty where nothing is.
        gaps: Of the judged coordinates.
        acted_on: Those of the joints that the effects act on.
    """
    names = " and ".join(f"{e.name} ({e.where})" for e in effects) if len(effects) <= 3 else by_name(effects)
    if kind == "none" and left:
        return f"Nothing is missing that the records could tell: no effect of the catalogue improves on the judging records. {left}"
    if kind == "none":
        return (
            "The stated uncertainties and the noise explain the records; nothing is missing from the model."
        )
    if kind == "effect" and not left:
        return f"Missing from the model: {names}. With it the records are explained to within their noise."
    if kind == "effect":
        return f"Missing from the model: {names}, which closes {closed_where(gaps, acted_on)}. {left}"
    if effects:
        return (
            f"Something is missing from the model, and no effect of the catalogue closes most of it; the nearest is {names}, "
            f"with {100.0 * explained:.3g} %. {left}".rstrip()
        )
    keep = ""
    before, after = (sum(getattr(gap, end) ** 2 for gap in gaps) for end in ("before", "after"))
    if after > before:
        keep = "Its own numbers, estimated from the other records, leave more of these than as stated: keep what is stated."
    elif after < before:
        share = 100.0 * (1.0 - after / before)
        keep = f"Its own numbers, estimated from the other records, close {share:.3g} % of the discrepancy by themselves."
    sentences = (
        "Something is missing from the model, and no effect of the catalogue improves on the judging records.",
        left,
        keep,
    )
    return " ".join(sentence for sentence in sentences if sentence)


def closed_where(gaps: Sequence[Gap], acted_on: Sequence[Gap]) -> str:
    """What is closed of the gap that stands furthest out of its noise where effects act, and how much of that by the model's own numbers.

    Another joint may be further off, and re-estimated numbers alone set that right: of the effects it says nothing.

    Args:
        gaps: Of the judged coordinates.
        acted_on: Those of the joints that the effects act on.
    """
    gap = widest_of(acted_on)
    of_joint = "" if gap is widest_of(gaps) else f" of joint '{gap.dof}'"
    words = f"{100.0 * gap.closed:.3g} % of the discrepancy{of_joint} on the judging records"
    alone = (gap.before**2 - gap.parameters_only**2) / max(gap.before**2 - gap.noise_floor**2, 1e-300)
    if alone < 0.5 * gap.closed:
        return words
    own = 100.0 * min(alone, gap.closed)
    return f"{words}, of which the model's own numbers, estimated anew, close {own:.3g} % by themselves"


def left_of(
    problem: ArticulatedProblem, final: ArticulatedFit, left: Coloured | None, lost: Astray | None
) -> str:
    """What a fit leaves, in words.

    Args:
        problem: Records for identification.
        final: The fit.
        left: What it leaves of a motion beside noise in the judging records, if anything.
        lost: A joint whose free runs in them go astray, if any.
    """
    if lost is not None:
        return (
            f"Joint '{problem.joints[lost.joint].name}' is still {lost.error:.3g} off in free runs, {lost.times:.3g} times what noise and "
            "the uncertainty of the parameters leave: something more is missing, or the noise is larger than stated."
        )
    j = int(np.argmax(final.reduced))
    times, where = float(np.sqrt(final.reduced[j])), ""
    if left is not None:
        j, times = left.joint, float(np.sqrt(left.power))
        where = f" below {left.below:.3g} Hz in '{left.record}'"
    return (
        f"Joint '{problem.joints[j].name}' still leaves {times:.3g} times its noise{where}: "
        "something more is missing, or the noise is larger than stated."
    )
