"""Whether what an effect closes is its own, or that of something else: by how much it leaves, by how little it is, and by what it asks
of the nominal model.

No catalogue holds everything, and every rig has small things besides: a hidden resonator, hum in a reading, a stiffness that warms.
Either may be closed in part by a law that is not theirs, and the more of it where a nominal parameter makes up for the difference.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from bench.discrepancy.settings import DEFAULT, CoarseSettings, ErrorSettings


def outside(
    left: float,
    settings: CoarseSettings = DEFAULT.judgement.coarse,
    *,
    besides: float = 0.0,
    moved: ArrayLike = (),
) -> float:
    """Probability that something outside the catalogue is the cause of a discrepancy of which an explanation leaves a part.

    What stands outside leaves any part of the power beside the nearest effect, uniformly; the right effect leaves what small things
    make, a part that falls off exponentially. Bayes' rule does the rest.

    Args:
        left: Part of the power of the discrepancy that the explanation leaves.
        settings: Prior probability, and what small things leave.
        besides: Prior odds that the discrepancy is one that small things make, see `like_small_things`.
        moved: Stated standard deviations (n,) by which the explanation moves the nominal parameters, see `like_a_stand_in`.
    """
    m = settings.background
    prior = settings.outside / (1.0 - settings.outside) + besides
    odds = prior * m * float(np.exp(min(left, 1.0) / m))
    odds = max(odds, settings.unlike / (1.0 - settings.unlike)) * like_a_stand_in(moved, settings)
    return odds / (1.0 + odds)


def like_a_stand_in(moved: ArrayLike, settings: CoarseSettings = DEFAULT.judgement.coarse) -> float:
    """How much likelier nominal parameters lie where an explanation has them if its cause is not the right one.

    One of them, any, then makes up for what the cause cannot describe, and lies anywhere that is believed of it, uniformly. Where the
    cause is the right one, it lies where it was stated to, normally, but for those that were stated too surely, which lie anywhere, too.
    Parameters that stay where they were stated are no evidence for a cause: how often those are right was counted.

    Args:
        moved: Stated standard deviations (n,) by which they moved.
        settings: Within how many they are believed to move, and the share that is stated too surely.
    """
    moved = np.asarray(moved, dtype=float)
    if not moved.size:
        return 1.0
    anywhere = 0.5 / settings.within
    right = (1.0 - settings.stated_too_surely) * norm.pdf(moved) + settings.stated_too_surely * anywhere
    return max(1.0, float(np.mean(anywhere / right)))


def like_small_things(size: float, error: ErrorSettings = DEFAULT.likelihood.error) -> float:
    """How much likelier a part of a response is to be closed in place of small things of every rig than by an effect of its own.

    The power of small things falls off exponentially, about the square of the error of a right model. An effect may have any size, by
    its logarithm, from that error's least to the whole response. What is smaller than the error is no likelier an effect for that.

    Args:
        size: What is closed, as a part of the response (RMS).
        error: Size and least size of the error of a right model.
    """
    power = max(size / error.crude, 1.0) ** 2
    return float(power * np.exp(-power) * 2.0 * np.log(1.0 / error.least))


def stands_outside(
    size: float,
    settings: CoarseSettings = DEFAULT.judgement.coarse,
    error: ErrorSettings = DEFAULT.likelihood.error,
) -> bool:
    """Whether what a nominal model leaves, and no effect predicts, is likelier something that no catalogue holds than small things.

    Args:
        size: What it leaves, as a part of the response (RMS).
        settings: Prior probabilities.
        error: Size and least size of the error of a right model.
    """
    return settings.outside / (1.0 - settings.outside) > settings.besides * like_small_things(size, error)
