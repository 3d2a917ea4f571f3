"""Rounding to the steps of a converter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.measurement.base import Stage


@dataclass(frozen=True)
class Quantisation(Stage, name="quantisation"):
    """Rounding to multiples of a step, zero among them (mid-tread), halves to the even multiple.

    Attributes:
        step: Step, in the unit of the channel.
    """

    step: float

    def __post_init__(self) -> None:
        self._real("step", above=0.0)

    @classmethod
    def from_bits(cls, bits: int, *, full_scale: float) -> Quantisation:
        """The step of a converter of ``2^bits`` codes over ``-full_scale … +full_scale``.

        Args:
            bits: Bits of the converter, 1 to 48.
            full_scale: Largest magnitude it converts, in the unit of the channel. Saturation is the stage `Clipping`.

        Raises:
            ParameterError: One of the two is out of range.
        """
        if isinstance(bits, bool) or not isinstance(bits, int) or not 1 <= bits <= 48:
            raise ParameterError(
                f"a converter of {bits!r} bits came; a whole number from 1 to 48 is expected"
            )
        if not (np.isfinite(full_scale) and full_scale > 0.0):
            raise ParameterError(f"full_scale is {full_scale!r}; a positive number is expected")
        return cls(2.0 * full_scale / 2**bits)

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> Quantisation:
        """The stage itself, having no memory."""
        return self

    def process(self, x: NDArray[np.float64]) -> None:
        """Round the samples ``(k,)`` in place."""
        np.divide(x, self.step, out=x)
        np.rint(x, out=x)
        np.multiply(x, self.step, out=x)
