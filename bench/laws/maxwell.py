"""Maxwell branch: a spring and a damper in series, for stress relaxation.

The force relaxes with the time constant tau after a step, and under harmonic motion at omega has the storage
stiffness ``k1 w^2/(1 + w^2)`` and the loss stiffness ``k1 w/(1 + w^2)``, ``w = omega tau``: no force in slow
motion, a spring k1 in fast motion. One branch covers about one decade of frequency; put several elements side
by side for more, and a `linear` element beside them for the static stiffness (standard linear solid).
`linear` has its spring and damper in parallel (Kelvin-Voigt) and cannot relax.

References:
    Maxwell 1867; Ferry 1980, Viscoelastic Properties of Polymers, ch. 3.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = z``."""
    f[0] += z[0]


@kernel
def rate(t, q, v, z, theta, zdot):
    """``z' = k1 v - z / tau``."""
    zdot[0] = theta[0] * v[0] - z[0] / theta[1]


MAXWELL = ForceLaw(
    name="maxwell",
    parameters=(
        Parameter("stiffness", "N/m", 1000.0, (0.0, math.inf), "spring constant k1", "N m/rad"),
        Parameter("relaxation_time", "s", 0.02, (1e-9, math.inf), "tau: damping of the branch over k1"),
    ),
    force=force,
    rate=rate,
    states=("z [N]",),
    equation="f = z, z' = k1 v - z / tau",
    reference="Maxwell 1867; Ferry 1980, ch. 3",
)
