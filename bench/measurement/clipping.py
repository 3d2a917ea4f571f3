"""Saturation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage


@dataclass(frozen=True)
class Clipping(Stage, name="clipping"):
    """Saturation at the ends of the range of a sensor or converter.

    Attributes:
        low: Smallest value, in the unit of the channel.
        high: Largest value.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        self._real("low")
        self._real("high")
        if self.low >= self.high:
            raise self._fail("low", f"a number below high = {self.high:g}")

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> Clipping:
        """The stage itself, having no memory."""
        return self

    def process(self, x: NDArray[np.float64]) -> None:
        """Limit the samples ``(k,)`` in place."""
        np.clip(x, self.low, self.high, out=x)
