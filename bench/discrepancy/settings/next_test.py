"""Thresholds of the room `next_test`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class NextTestSettings:
    """The excitation that tells rivals apart."""

    odds: float = setting(99.0, "Odds at which a rival counts as decided.", "99 %.")
    decided: float = setting(
        9.2,
        "Log odds of the present records above which no further test is proposed.",
        "Ten thousand to one.",
        unit="log odds",
    )
    finalists: int = setting(
        4,
        "Excitations whose merit is computed in full.",
        "The others fall out by the difference of the rivals' responses alone.",
    )
    draws: int = setting(4000, "Draws of the log Bayes factor behind a power.", "A power known to a percent.")
    samples: int = setting(
        20_000,
        "Longest proposed record, shorter with more degrees of freedom.",
        "Simulations are what the search costs.",
        unit="samples",
    )
    others: int = setting(3, "Further rivals that are held against the chosen excitation.", "A cost cut-off.")
    barely: float = setting(
        0.9,
        "Part of the largest displacement from which a clearance counts as hardly exceeded.",
        "Convention.",
    )
    detectable: float = setting(
        25.0, "Gain in chi-squared from which an effect shows.", "Five standard deviations.", unit="chi2"
    )
    insensitive: float = setting(
        0.1,
        "Force over the largest load that an effect may have without showing before sensitivity is called low.",
        "Convention.",
    )
    probe: float = setting(
        0.02,
        "Force of the probe by which sensitivity is measured, over the RMS load.",
        "Small enough to be linear.",
    )
    reach: float = setting(
        1.5,
        "Largest proposed displacement and velocity over the largest measured ones.",
        "What the rig has shown to bear, and a half.",
    )
    margin: float = setting(
        0.97,
        "Part of a limit that a scaled excitation aims at.",
        "Rivals differ in their responses by some percent.",
    )
    scalings: int = setting(
        6, "Simulations in which an excitation is scaled down to its limits.", "A cost cut-off."
    )
    levels: tuple[float, ...] = setting(
        (1.0, 0.3), "Parts of the feasible size that are tried.", "Some effects show at small motions only."
    )
