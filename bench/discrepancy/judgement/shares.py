"""Shares of a discrepancy in words: the same numbers in sentences, tables and pages."""

from __future__ import annotations

import math

from bench.discrepancy.prediction.validation_discrepancy import (
    DIVERGED_GAP,
)
from bench.discrepancy.settings import DEFAULT, JudgementSettings
from bench.discrepancy.verdict import Gap

SURE = 1.0 - 0.5 * 10**-3
"""Share that a percentage of one decimal would round to the whole."""


def percent(share: float) -> str:
    """A share between zero and one as a percentage that never claims the whole."""
    return "over 99.9 %" if share >= SURE else f"{100.0 * max(share, 0.0):.1f} %"


def closed_words(
    gap: Gap, value: float | None = None, *, settings: JudgementSettings = DEFAULT.judgement
) -> str:
    """How much of a discrepancy is closed, in words.

    Args:
        gap: The discrepancy of a coordinate.
        value: What is left at one of its steps; `gap.after`, with its interval, where None.
        settings: `JudgementSettings` of the diagnosis.
    """
    left = gap.after if value is None else value
    if gap.before <= settings.at_the_noise * gap.noise_floor:
        return "nothing to close: it is that of the noise"
    if left >= DIVERGED_GAP:
        return "none: it diverges"
    if left > gap.before:
        return f"none: it grows to {left / gap.before:.3g} times"
    share = (gap.before - left) / (gap.before - gap.noise_floor)
    return percent(share) if value is not None else interval(share, gap.closed_ci95)


def interval(share: float, ends: tuple[float, float]) -> str:
    """A share with its 95 % interval, neither beyond the whole.

    Args:
        share: At most one.
        ends: Of the interval.
    """
    if math.isnan(share):
        return "not computed"
    low, high = (min(end, 1.0) for end in ends)
    value = percent(share) if share >= 0.0 else ("below -100 %" if share < -1.0 else f"{100.0 * share:.1f} %")
    if low >= SURE or math.isnan(low) or math.isnan(high):
        return value
    lower = f"{100.0 * low:.1f}" if low >= -1.0 else "below -100"
    return f"{value} ({lower} to {'over 99.9' if high >= SURE else f'{100.0 * high:.1f}'})"


def probability(value: float | None) -> str:
    """A probability as text; none where none was computed."""
    if value is None or math.isnan(value):
        return "not computed"
    return f"{value:.3f}"
