"""Bouc-Wen hysteresis in the dissertation's form, the force itself being the hidden state.

The force is bounded by the ultimate strength ``(A/(beta + gamma))^(1/n)`` and starts with the slope A.
``beta + gamma > 0`` softens, ``beta - gamma`` decides whether unloading is straight (0), bulging (> 0) or
pinched in (< 0); dissipative for ``beta >= |gamma|``. Larger n sharpens the yield towards a `jenkins`
element. The sign of gamma is the usual one of the literature and of the nonlinear benchmark; the
dissertation's eq. 2.3 prints the gamma-term with the opposite sign, so its ``gamma = -1`` (eq. 2.17) is
``gamma = 1`` here. Rate-independent; small cycles about a mean load drift (it violates Drucker's postulate),
which `iwan` does not. No elastic branch in parallel: add a `linear` element for the share alpha k of the
usual form.

Degradation and pinching are laws of their own in `bench.laws.bouc_wen_variants`.

References:
    Bouc 1967; Wen 1976, J. Eng. Mech. Div. 102(2); Tasbihgoo 2006, eq. 2.3; Ikhouane & Rodellar 2007, Systems
    with Hysteresis.
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
    """``dz/dt = A v - beta |v| |z|^(n-1) z - gamma v |z|^n``."""
    n = theta[3]
    r = z[0]
    magnitude = abs(r)
    if n == 1.0:
        power_less = 1.0
    elif magnitude > 0.0:
        power_less = magnitude ** (n - 1.0)
    else:
        power_less = 0.0
    zdot[0] = (
        theta[0] * v[0] - theta[1] * abs(v[0]) * power_less * r - theta[2] * v[0] * power_less * magnitude
    )


BOUC_WEN = ForceLaw(
    name="bouc_wen",
    parameters=(
        Parameter("A", "N/m", 1000.0, (-math.inf, math.inf), "initial stiffness", "N m/rad"),
        Parameter("beta", "1/m", 100.0, (-math.inf, math.inf), "loop width (unit for n = 1)", "1/rad"),
        Parameter("gamma", "1/m", 50.0, (-math.inf, math.inf), "loop skew (unit for n = 1)", "1/rad"),
        Parameter("n", "1", 1.0, (1.0, 20.0), "sharpness of yielding"),
    ),
    force=force,
    rate=rate,
    states=("z [N]",),
    equation="f = z, dz/dt = A v - beta |v| |z|^(n-1) z - gamma v |z|^n",
    reference="Bouc 1967; Wen 1976; Tasbihgoo 2006, eq. 2.3 with eta = nu = 1",
    smoothness="continuous",
)
