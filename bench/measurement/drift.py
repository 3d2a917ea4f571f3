"""Slow change of the offset."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage, generator, kernels


@dataclass(frozen=True)
class Drift(Stage, name="drift"):
    """An offset that starts at zero and grows steadily, wanders, or both.

    Attributes:
        rate: Steady growth, in the unit of the channel per s.
        random_walk: Standard deviation of the wandering part after one second, growing with the square root of time, in the
            unit of the channel per sqrt(s).
    """

    rate: float = 0.0
    random_walk: float = 0.0

    def __post_init__(self) -> None:
        self._real("rate", "unit/s")
        self._real("random_walk", "unit/sqrt(s)", at_least=0.0)

    @property
    def random(self) -> bool:  # pyrefly: ignore[bad-override]
        """Whether the offset wanders."""
        return self.random_walk > 0.0

    def start(self, sample_rate: float, rng: np.random.Generator | None) -> DriftMemory:
        """No offset yet."""
        return DriftMemory(
            self.rate / sample_rate,
            self.random_walk / math.sqrt(sample_rate),
            generator(self, rng) if self.random else None,
            np.zeros(1, dtype=np.int64),
            np.zeros(1),
        )


@dataclass
class DriftMemory:
    """Growth and standard deviation a sample, the generator, the samples so far and the offset they have led to."""

    slope: float
    step: float
    rng: np.random.Generator | None
    count: NDArray[np.int64]
    walk: NDArray[np.float64]

    def process(self, x: NDArray[np.float64]) -> None:
        """Shift the next samples ``(k,)`` in place."""
        # Normal numbers are drawn one after the other inside numpy too, so that blocks of any size continue one sequence.
        draws = np.zeros(x.size) if self.rng is None else self.rng.standard_normal(x.size)
        kernels().add_drift(x, self.slope, self.step, draws, self.count, self.walk)
