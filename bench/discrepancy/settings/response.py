"""Thresholds of the room `response`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ResponseSettings:
    """Loads that drive a free run."""

    corners: int = setting(
        8,
        "Rows a sample of a load that is delayed.",
        "Between samples of straight lines lie corners, and those move with the delay.",
    )
    forgotten: float = setting(
        14.0,
        "Time constants of the slowest decay after which a start is forgotten.",
        "One part in a million.",
    )
    max_periods: int = setting(20, "Most periods of run-in.", "A cost cut-off.", unit="periods")
    integration: float = setting(
        0.02,
        "Error of the integration that is left, over the noise.",
        "A fit to 10 000 samples sees a hundredth of the noise.",
    )
    exact: float = setting(
        1e-4,
        "Relative error of the integration below which no record asks for more.",
        "A tenth of what the best of models leave.",
    )
