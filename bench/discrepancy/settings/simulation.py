"""Thresholds of the room `simulation`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class SimulationSettings:
    """Steps of the integration."""

    max_substeps: int = setting(16, "Most integration steps a sample.", "A cost cut-off.")
    phase: float = setting(
        0.6,
        "Phase of a step.",
        "RK4 leaves a relative error of 1e-4 over one time constant, below any noise considered.",
        unit="rad",
    )
    slowest: float = setting(
        0.25,
        "Part of the largest speed that a free run may have anywhere.",
        "RK4 is stable up to a phase of 2.8.",
    )
    margin: float = setting(1.2, "How much faster than the measured motion a free run may be.", "Convention.")
    per_octave: int = setting(
        4, "Values of a rate within a factor of two.", "A cost cut-off: fewer tables of steps."
    )
