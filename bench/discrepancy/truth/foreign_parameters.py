"""Parameters that the forces of no catalogue share."""

from __future__ import annotations

import math

from bench.laws.base import Parameter


def stiffness(meaning: str) -> Parameter:
    """A stiffness that is the first parameter of a force."""
    return Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), meaning, "N m/rad")


def width(name: str, meaning: str) -> Parameter:
    """A displacement over which a force changes."""
    return Parameter(name, "m", 0.002, (1e-12, math.inf), meaning, "rad")
