"""Pure time delay, of whole or broken numbers of samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.measurement.base import Stage, kernels


@dataclass(frozen=True)
class Delay(Stage, name="delay"):
    """A delay, as of transmission or of a converter.

    Whole numbers of samples are exact. Between samples, the polynomial through the `order + 1` samples around the point is
    evaluated (Lagrange fractional delay): with order 3 and ten samples a cycle the error of a sine is below 0.5 % of its
    amplitude. Delays below one sample (order 3) have no sample on the far side and are extrapolated to within that polynomial.

    Attributes:
        time: Delay [s].
        order: Order of the polynomial: 1, 3, 5 or 7.
        before: What the input was before the record: "steady" (its first value) or "zero".

    References:
        Laakso, Välimäki, Karjalainen, Laine 1996, "Splitting the unit delay", eq. 42.
    """

    time: float
    order: int = 3
    before: Literal["steady", "zero"] = "steady"

    def __post_init__(self) -> None:
        self._real("time", "s", at_least=0.0)
        self._integer("order", at_least=1, at_most=7)
        if self.order % 2 == 0:
            raise self._fail("order", "1, 3, 5 or 7")
        self._choice("before", ("steady", "zero"))

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> DelayMemory:
        """An empty line of the length the delay needs."""
        samples = self.time * sample_rate
        if abs(samples - round(samples)) < 1e-9 * max(
            1.0, samples
        ):  # 0.003 s at 1 kHz is 3 samples, up to rounding
            samples = float(round(samples))
            base, coefficients = int(samples), np.ones(1)
        else:
            base = max(0, int(np.floor(samples)) - (self.order - 1) // 2)
            coefficients = lagrange(samples - base, self.order)
        ring = np.zeros(base + coefficients.size)
        return DelayMemory(
            coefficients, base, ring, np.zeros(1, dtype=np.int64), started=self.before == "zero"
        )


@dataclass
class DelayMemory:
    """Coefficients of the taps, their common delay in samples, the ring of past samples and the place of the next."""

    coefficients: NDArray[np.float64]
    base: int
    ring: NDArray[np.float64]
    position: NDArray[np.int64]
    started: bool

    def process(self, x: NDArray[np.float64]) -> None:
        """Delay the next samples ``(k,)`` in place."""
        if not self.started and x.size:
            self.ring[:] = x[0]
            self.started = True
        kernels().delay_line(x, self.coefficients, self.base, self.ring, self.position)


def lagrange(delay: float, order: int) -> NDArray[np.float64]:
    """Weights ``(order + 1,)`` of the samples 0 … `order` steps ago that give the value `delay` steps ago."""
    taps = np.arange(order + 1)
    return np.array([np.prod([(delay - j) / (k - j) for j in taps if j != k]) for k in taps], dtype=float)
