"""Thresholds of the room `model`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ModelSettings:
    """What is read off a user's own MJCF."""

    negligible: float = setting(
        1e-9,
        "Part of the largest entry below which a coefficient read off a model counts as zero.",
        "Rounding of some matrix products.",
    )
    fast: float = setting(
        0.6 * 16.0,
        "Phase that a mode runs through in a sample from which a free run cannot follow it.",
        "Sixteen steps a sample of a phase of 0.6.",
        unit="rad",
    )
    gravity_step: float = setting(
        1e-4,
        "Angle either way of the differences that a tangent is taken by.",
        "A cube root of rounding; a spline's own slope is good to fewer digits.",
        unit="rad",
    )
    gravity_agreement: float = setting(
        1e-9,
        "Part of the largest torque that one joint's may depend on the position of another.",
        "Rounding of inverse dynamics.",
    )
    gravity_at_rest: float = setting(
        1e-6,
        "Part of the largest torque that may be left at the reference position.",
        "What a user writes with six digits.",
    )
    poses: int = setting(
        200, "Measured positions of a record at which contacts are looked for.", "A cost cut-off."
    )
    clipped_parts: int = setting(
        64,
        "Parts that the way between two samples is cut into where a load meets a limit on it.",
        "A corner is misplaced by less than a hundredth of a sample.",
    )
    large_mass: float = setting(
        1e6,
        "Mass behind a prescribed motion over all that moves with it.",
        "What it carries moves it by a millionth; nine digits are left above rounding.",
    )
    newton_steps: int = setting(
        20, "Steps of Newton's method towards the position of rest.", "Quadratic convergence needs five."
    )
    contradicts: float = setting(
        5.0,
        "Stated standard deviations beyond which a nominal value contradicts the model.",
        "Chance does not take it there in any number of cases.",
        unit="sigmas",
    )
