"""Where a fit begins: an effect at a place, and parameters that a screening along the measured motion proposes."""

from __future__ import annotations

from typing import NamedTuple

from bench.arrays import Array
from bench.discrepancy.model.placement import Placed


class Point(NamedTuple):
    """A grid point of an effect, solved.

    Attributes:
        placed: The effect.
        gain: Decrease of chi-squared, nominal deviations and the base's parameters re-estimated.
        eta: Start for a fit.
    """

    placed: Placed
    gain: float
    eta: Array
