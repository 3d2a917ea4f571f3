"""Linear spring and damper in parallel (Kelvin-Voigt element)."""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = k q + c v``."""
    f[0] += theta[0] * q[0] + theta[1] * v[0]


LINEAR = ForceLaw(
    name="linear",
    parameters=(
        Parameter("stiffness", "N/m", 1000.0, (-math.inf, math.inf), "spring constant k", "N m/rad"),
        Parameter("damping", "N s/m", 1.0, (-math.inf, math.inf), "viscous constant c", "N m s/rad"),
    ),
    force=force,
    equation="f = k q + c v",
    reference="Tasbihgoo 2006, eq. 4.2; Kelvin-Voigt element",
)
