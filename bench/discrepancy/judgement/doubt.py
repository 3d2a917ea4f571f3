"""Whether what an effect closes is its own, or that of something else: by how much it leaves, and by how little it is.

No catalogue holds everything, and every rig has small things besides: a hidden resonator, mains hum, a stiffness that warms. Either may
be closed in part by a law that is not theirs.
"""

from __future__ import annotations

import numpy as np

from bench.discrepancy.settings import DEFAULT, CoarseSettings, ErrorSettings


def outside(
    left: float,
    settings: CoarseSettings = DEFAULT.judgement.coarse,
    *,
    small: float | None = None,
    besides: float = 0.0,
) -> float:
    """Probability that something outside the catalogue is the cause of a discrepancy of which an explanation leaves a part.

    What stands outside leaves any part of the power beside the nearest effect, uniformly; the right effect leaves what small things
    make, a part that falls off exponentially. Bayes' rule does the rest. Of a nominal model that stands alone, and of which no noise
    is stated, the parts are those of the power of the response, and what small things make of it is the error of a right model.

    Args:
        left: Part of the power of the discrepancy that the explanation leaves.
        settings: Prior probability, and what small things leave.
        small: What small things leave on average; that of the settings where None.
        besides: Prior odds that the discrepancy is one that small things make, see `like_small_things`.
    """
    m = settings.background if small is None else small
    prior = settings.outside / (1.0 - settings.outside) + besides
    odds = prior * m * float(np.exp(min(left, 1.0) / m))
    return max(odds / (1.0 + odds), settings.unlike)


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
