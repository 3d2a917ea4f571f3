"""Thresholds of the room `fitting`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class FittingSettings:
    """Estimation of parameters."""

    state_rounds: int = setting(
        20,
        "Most Gauss-Newton steps towards the initial states.",
        "Three settle a window; a long record of a hardening spring takes ten.",
    )
    state_singular: float = setting(
        1e-8,
        "Relative size below which a combination of initial states is invisible to the channels and left alone.",
        "Square root of machine precision.",
    )
    nominal_reach: float = setting(
        20.0,
        "Longest step of a fit in nominal parameters.",
        "Responses are nearly linear in them.",
        unit="sigmas",
    )
    effect_reach: float = setting(
        2.0,
        "Longest step of a fit in the parameters of effects.",
        "Responses are not linear in shapes.",
        unit="sigmas",
    )
