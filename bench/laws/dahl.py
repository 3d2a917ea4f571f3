"""Dahl friction: an elastic range that yields gradually to a sliding force, independent of the rate of motion.

The state is the friction force itself. Rate-independent: the loop in the f-q plane is the same at every
frequency, and there is no static level above the sliding one. For exponent 1 the monotonic curve from rest is
``f = Fc (1 - exp(-sigma q / Fc))``; a smaller exponent yields more abruptly (brittle materials, exponent 0 is
an ideal slider), a larger one more gradually. `lugre` adds the Stribeck effect and bristle damping;
`bouc_wen` with n = 1, ``beta = A / Fc``, gamma = 0 is the same law as exponent 1; `jenkins` has a straight
elastic branch.

References:
    Dahl 1968, The Aerospace Corporation, TOR-0158(3107-18)-1; Dahl 1976, AIAA Journal 14(12), 1675-1682.
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
    """``z' = sigma v |r|^i sgn r`` with ``r = 1 - (z / Fc) sgn v``."""
    reserve = 1.0 - z[0] / theta[1] if v[0] >= 0.0 else 1.0 + z[0] / theta[1]
    if theta[2] == 1.0:
        shape = reserve
    elif reserve >= 0.0:
        shape = reserve ** theta[2]
    else:
        shape = -((-reserve) ** theta[2])
    zdot[0] = theta[0] * v[0] * shape


DAHL = ForceLaw(
    name="dahl",
    parameters=(
        Parameter("stiffness", "N/m", 5000.0, (0.0, math.inf), "slope at zero force, sigma", "N m/rad"),
        Parameter("limit", "N", 5.0, (1e-12, math.inf), "sliding friction force Fc", "N m"),
        Parameter("exponent", "1", 1.0, (0.05, 10.0), "shape i of the yielding curve"),
    ),
    force=force,
    rate=rate,
    states=("z [N]",),
    equation="f = z, z' = sigma v |r|^i sgn(r), r = 1 - (z / Fc) sgn(v)",
    reference="Dahl 1976, AIAA Journal 14(12), 1675-1682",
    smoothness="continuous",
)
