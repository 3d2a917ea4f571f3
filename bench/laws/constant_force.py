"""A constant force: weight, preload or the offset of an amplifier.

Positive when it opposes positive displacement, as every law. Unlike a bias of the force sensor, it moves the
joint's rest position, by ``F0/k``.

References:
    Worden & Tomlinson 2001, ch. 2.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = F0``."""
    f[0] += theta[0]


CONSTANT_FORCE = ForceLaw(
    name="constant_force",
    parameters=(
        Parameter("F0", "N", 1.0, (-math.inf, math.inf), "force that opposes positive displacement", "N m"),
    ),
    force=force,
    equation="f = F0",
    reference="Worden & Tomlinson 2001, ch. 2",
)
