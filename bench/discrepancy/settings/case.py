"""Thresholds of the room `case`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class CaseSettings:
    """Reading of records and what is read off single channels."""

    lattice: float = setting(
        0.02,
        "Distance from a lattice point that still counts as on it.",
        "Rounding of a text file leaves as much.",
        unit="steps",
    )
    repeated: float = setting(
        0.5,
        "Part of the samples that repeat an earlier value before a lattice is looked for.",
        "Quantisation makes values repeat; continuous noise does not.",
    )
    idle_bins: int = setting(
        16,
        "Frequency bins whose power is compared with the noise at a time.",
        "Chi-squared of 32 degrees of freedom: its spread is a quarter.",
        unit="bins",
    )
    idle_surprise: float = setting(
        1e-3,
        "Probability with which noise alone may be taken for a load.",
        "Error of the first kind, stated as such.",
    )
