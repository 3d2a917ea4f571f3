"""First-order lag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage, kernels


@dataclass(frozen=True)
class Lag(Stage, name="lag"):
    """First-order lag ``time_constant dy/dt + y = x``, as of a thermal sensor, an amplifier or a slow actuator.

    Solved exactly for an input of straight lines between the samples (ramp-invariant), which is of second order in the
    sample time for smooth inputs; holding the input between samples would add half a sample of delay.

    Attributes:
        time_constant: Time constant [s].
        before: What the input was before the record: "steady" (its first value) or "zero".
    """

    time_constant: float
    before: Literal["steady", "zero"] = "steady"

    def __post_init__(self) -> None:
        self._real("time_constant", "s", above=0.0)
        self._choice("before", ("steady", "zero"))

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> LagMemory:
        """The lag at rest, or at the steady state of its first sample."""
        step = 1.0 / (sample_rate * self.time_constant)
        pole = math.exp(-step)
        rise = -math.expm1(-step)
        return LagMemory(
            pole, 1.0 - rise / step, rise / step - pole, np.zeros(2), started=self.before == "zero"
        )


@dataclass
class LagMemory:
    """Weights of the last output, the input and the last input; last input and output ``(2,)``."""

    pole: float
    now: float
    previous: float
    state: NDArray[np.float64]
    started: bool

    def process(self, x: NDArray[np.float64]) -> None:
        """Lag the next samples ``(k,)`` in place."""
        if not self.started and x.size:
            self.state[:] = x[0]
            self.started = True
        kernels().first_order(x, self.pole, self.now, self.previous, self.state)
