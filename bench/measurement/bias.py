"""Constant offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage


@dataclass(frozen=True)
class Bias(Stage, name="bias"):
    """A constant added to the signal, as of a bridge out of balance.

    Attributes:
        value: Offset, in the unit of the channel.
    """

    value: float

    def __post_init__(self) -> None:
        self._real("value")

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> Bias:
        """The stage itself, having no memory."""
        return self

    def process(self, x: NDArray[np.float64]) -> None:
        """Shift the samples ``(k,)`` in place."""
        np.add(x, self.value, out=x)
