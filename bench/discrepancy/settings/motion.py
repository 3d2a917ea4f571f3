"""Thresholds of the room `motion`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class RecordMemorySettings:
    """How long a component may remember what was before its record."""

    width: float = setting(
        0.01,
        "Way back from a turning point, over the reach of the motion, that makes a reversal.",
        "Convention.",
    )
    reversals: int = setting(
        2,
        "Reversals after which a slider has been dragged both ways and where it stood before is forgotten.",
        "Convention.",
    )
    longest: float = setting(0.25, "Part of a record that may be left out for that, at most.", "Convention.")


@dataclass(frozen=True)
class MotionSettings:
    """The measured motion: smoothing and differentiation."""

    rest: float = setting(1e-6, "Part of the noise below which a channel is at rest.", "Rounding.")
    jerk_intensities: tuple[float, ...] = setting(
        tuple(float(x) for x in 10.0 ** np.arange(-2.0, 3.1, 1.0)),
        "Multiples of a first guess of the jerk intensity that are compared by likelihood.",
        "Decades over what a motion may be.",
    )
    loose: float = setting(
        300.0,
        "Standard deviation of the mean position where none is measured, over the motion.",
        "A prior without weight.",
    )
    doubt: float = setting(
        4.5,
        "Standard deviations of the velocity of a prescribed motion below which its direction is in doubt.",
        "A record has dozens of reversals, and one sample on the wrong side is off by all of the friction.",
        unit="sigmas",
    )
    most_in_doubt: float = setting(
        0.7, "Part of a record that may be in doubt.", "A motion so slow or so noisy is compared as it is."
    )
    reversal: float = setting(
        2.0,
        "Way back of a prescribed motion, over its noise, from which it counts as a reversal.",
        "Less is noise.",
        unit="sigmas",
    )
    edge_error: float = setting(
        1.5,
        "Error of a prescribed velocity, over its median, from which samples at an end of a record are not compared.",
        "Smoothers know less at an end.",
    )
    edge_width: int = setting(
        9, "Samples over which it is averaged.", "A window of the smoother.", unit="samples"
    )
    tracking: float = setting(
        3.0,
        "Cycles a record of the loop that holds the acceleration behind a prescribed position to this position.",
        "What an integral drifts by lies below them; a motion worth diagnosing goes through many more.",
    )
    memory: RecordMemorySettings = field(default_factory=RecordMemorySettings)
