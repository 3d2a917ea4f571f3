"""An analogue lag behind a command: a variant of `actuator_lag`, which is fitted where that of a digital drive misses the noise.

A digital drive moves on once a sample, an amplifier or MuJoCo's activation all the time, by half a sample later. Along the measured
motion the two are one, so that the screening knows the first alone.
"""

from __future__ import annotations

import numpy as np

from bench.discrepancy.effects.sensor_actuator import ANALOGUE_LAG
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.model.placement import Placed


def with_analogue_lag(search: Search, size: int) -> None:
    """Fit an analogue lag in the place of a digital one in the foremost hypothesis of a size that has it, unless the first hypothesis
    leaves no more than the noise does on average, or loads are held between samples, where the lag is an analogue one already.

    Args:
        search: Fits so far; the new one is added.
        size: Number of effects of the hypotheses.
    """
    ranked = search.ranked(size)
    if search.problem.case.load_interpolation == "zero_order_hold" or not ranked:
        return
    first = ranked[0]
    fitted = next(
        (
            f
            for f in ranked
            if np.isfinite(f.cost)
            and any(p.effect.name == ANALOGUE_LAG.name and not p.effect.variant for p in f.hypothesis)
        ),
        None,
    )
    if fitted is None or first.chi2 - first.n_residuals < np.sqrt(2.0 * first.n_residuals):
        return
    hypothesis = tuple(
        Placed(ANALOGUE_LAG, p.place, p.target) if p.effect.name == ANALOGUE_LAG.name else p
        for p in fitted.hypothesis
    )
    converge(search, [(hypothesis, fitted.vector[None])])
