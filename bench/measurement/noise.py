"""White Gaussian noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage, generator


@dataclass(frozen=True)
class Noise(Stage, name="noise"):
    """Independent normal numbers added to the samples.

    Attributes:
        std: Standard deviation of a sample, in the unit of the channel. A density of ``d`` unit/sqrt(Hz) up
            to half the sample rate ``fs`` is ``std = d sqrt(fs / 2)``.
    """

    std: float
    random: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._real("std", at_least=0.0)

    def start(self, sample_rate: float, rng: np.random.Generator | None) -> NoiseMemory:
        """The start of the noise sequence."""
        return NoiseMemory(self.std, generator(self, rng))


@dataclass
class NoiseMemory:
    """Standard deviation and generator."""

    std: float
    rng: np.random.Generator

    def process(self, x: NDArray[np.float64]) -> None:
        """Add noise to the next samples ``(k,)`` in place."""
        # numpy draws normal numbers one after the other, so that blocks of any size continue one sequence.
        np.add(x, self.std * self.rng.standard_normal(x.size), out=x)
