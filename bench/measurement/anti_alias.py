"""Butterworth low-pass of any order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.measurement.base import Stage, kernels


@dataclass(frozen=True)
class AntiAlias(Stage, name="anti_alias"):
    """Butterworth low-pass, as the analogue filter before a converter.

    Digital second-order sections of the bilinear transform, warped so that the gain at the cut-off is 1/sqrt(2) exactly.
    It runs at the rate of the record; to model a converter slower than that, keep every k-th sample of the output.

    Attributes:
        cutoff: Frequency of -3 dB [Hz].
        order: Order of the filter.
        before: What the input was before the record: "steady" (its first value) or "zero".
    """

    cutoff: float
    order: int = 4
    before: Literal["steady", "zero"] = "steady"

    def __post_init__(self) -> None:
        self._real("cutoff", "Hz", above=0.0)
        self._integer("order", at_least=1, at_most=20)
        self._choice("before", ("steady", "zero"))

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> AntiAliasMemory:
        """The filter at rest, or at the steady state of its first sample."""
        from scipy.signal import butter, sosfilt_zi  # noqa: PLC0415  (scipy.signal is slow to import)

        if self.cutoff >= 0.5 * sample_rate:
            raise ParameterError(
                f"the anti-alias filter has its cut-off at {self.cutoff:g} Hz, but the sample rate of {sample_rate:g} Hz "
                f"ends at {0.5 * sample_rate:g} Hz; lower the cut-off or raise the sample rate"
            )
        sections = np.ascontiguousarray(butter(self.order, self.cutoff, fs=sample_rate, output="sos"))
        steady = np.ascontiguousarray(sosfilt_zi(sections))
        return AntiAliasMemory(sections, steady, np.zeros_like(steady), started=self.before == "zero")


@dataclass
class AntiAliasMemory:
    """Sections ``(n_sections, 6)``, their state for a unit step, their state ``(n_sections, 2)``."""

    sections: NDArray[np.float64]
    steady: NDArray[np.float64]
    state: NDArray[np.float64]
    started: bool

    def process(self, x: NDArray[np.float64]) -> None:
        """Filter the next samples ``(k,)`` in place."""
        if not self.started and x.size:
            self.state[:] = self.steady * x[0]
            self.started = True
        kernels().second_order_sections(x, self.sections, self.state)
