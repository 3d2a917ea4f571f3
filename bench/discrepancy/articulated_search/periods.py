"""Whole numbers of periods in a turn: those beside one that a screening promised."""

from __future__ import annotations

import numpy as np

from bench.discrepancy.articulated_search.fitting import ArticulatedFit, Others, fit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings

PERIODS = "periods_per_turn"
"""Whole number among the parameters of a periodic effect."""


def beside(
    problem: ArticulatedProblem, found: ArticulatedFit, others: Others, settings: SearchSettings
) -> ArticulatedFit:
    """A fit whose last effect is periodic, with the next whole numbers of periods in a turn for as long as they are likelier.

    Over the range of a joint two neighbouring numbers differ by a fraction of a period, which a phase and a wrong gain of the encoder make
    up for; screened one at a time, with what else is missing still in the residuals, they are hardly told apart.
    """
    names = [p.name for p in found.hypothesis[-1].effect.parameters]
    if PERIODS not in names:
        return found
    placed, first = found.hypothesis[-1], len(found.vector) - len(names)
    sine, cosine, at = (first + names.index(name) for name in ("sine", "cosine", PERIODS))
    grid = placed.effect.parameters[names.index(PERIODS)].grid
    while True:
        starts = []
        for n in (found.vector[at] + d for d in (-2, -1, 1, 2)):
            if n in grid:
                # the same torque in the middle of the range: A sin(n q + phase)
                turn = (found.vector[at] - n) * placed.scales.middle
                vector = found.vector.copy()
                vector[sine] = found.vector[sine] * np.cos(turn) - found.vector[cosine] * np.sin(turn)
                vector[cosine] = found.vector[sine] * np.sin(turn) + found.vector[cosine] * np.cos(turn)
                vector[at] = n
                starts.append(vector)
        new = fit(
            problem, found.hypothesis, np.array(starts), scale=found.scale, iterations=settings.iterations, others=others,
        )  # fmt: skip
        if new.log_posterior <= found.log_posterior + settings.rise:
            return found
        found = new
