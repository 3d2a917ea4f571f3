"""The catalogue of articulated models: what may be missing at a joint, a body, a drive or an encoder."""

from __future__ import annotations

from bench.discrepancy.articulated_effects.drive_effects import DRIVE_EFFECTS
from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.articulated_effects.encoder_effects import ENCODER_EFFECTS
from bench.discrepancy.articulated_effects.mechanical_effects import MECHANICAL_EFFECTS
from bench.errors import UnknownNameError

CATALOGUE: tuple[ArticulatedEffect, ...] = (*MECHANICAL_EFFECTS, *DRIVE_EFFECTS, *ENCODER_EFFECTS)
"""All effects."""


def effect(name: str) -> ArticulatedEffect:
    """Return an effect by name.

    Raises:
        UnknownNameError: There is none.
    """
    for entry in CATALOGUE:
        if entry.name == name:
            return entry
    raise UnknownNameError("effect of articulated models", name, [e.name for e in CATALOGUE])
