"""Gain error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage


@dataclass(frozen=True)
class Gain(Stage, name="gain"):
    """Factor on the signal: an error of calibration (1.02), or a sign.

    Attributes:
        factor: Factor [1], not zero.
    """

    factor: float

    def __post_init__(self) -> None:
        self._real("factor", "1")
        if self.factor == 0.0:
            raise self._fail("factor", "a number other than 0")

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> Gain:
        """The stage itself, having no memory."""
        return self

    def process(self, x: NDArray[np.float64]) -> None:
        """Multiply the samples ``(k,)`` in place."""
        np.multiply(x, self.factor, out=x)
