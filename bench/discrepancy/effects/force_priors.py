"""Priors that the forces of the catalogue share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.discrepancy.effects.effect import FreeParameter


@dataclass(frozen=True)
class ForcePriors:
    """Numbers of `bench.discrepancy.effects.catalogue`."""

    amplitude: Mapping[str, Any] = field(
        default_factory=lambda: {"mean": math.log(0.2), "std": 1.5, "bounds": (-9.0, 5.0)}
    )
    signed: Mapping[str, Any] = field(
        default_factory=lambda: {"signed": True, "mean": 0.0, "std": 0.6, "bounds": (-30.0, 30.0)}
    )
    slow: float = 1e-3
    """Regularising velocity of friction that goes back into a rig, as a part of the largest velocity of the records."""


FORCE_PRIORS = ForcePriors()

FRICTION = FreeParameter("friction_force", "force", **FORCE_PRIORS.amplitude)
