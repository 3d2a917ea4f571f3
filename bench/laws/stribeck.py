"""Coulomb friction that weakens with velocity (Stribeck effect), regularised at rest.

``f = Fc (1 + s exp(-(v/vs)^2)) tanh(v / vr)``: the breakaway level is ``Fc (1 + s)``, the sliding level at
``v >> vs`` is ``Fc``. The falling branch acts as negative damping and drives stick-slip; what regularisation
changes most is therefore the stick phase, and the regularisation velocity vr must lie well below vs (the
largest force reached is ``Fc (1 + s)`` only for vr << vs: a tenth of the boost is lost at vr = vs/10, 0.3 %
at vs/100). Creep and stiffness at rest are those of `coulomb`, with the limit ``Fc (1 + s)``.

Memoryless, unlike `lugre`, which has the same curve in steady sliding, and presliding displacement and
frictional lag besides. No viscous term: add `linear_damping`.

References:
    Stribeck 1902; Bo & Pavelescu 1982, Wear 82; Armstrong-Helouvry et al. 1994, Automatica 30(7).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.coulomb import LIMIT, REGULARISATION


@kernel
def force(t, q, v, z, theta, f):
    """``f = Fc (1 + s exp(-(v/vs)^2)) tanh(v / vr)``."""
    ratio = v[0] / theta[2]
    fade = math.exp(-2.0 * abs(v[0]) / theta[3])
    f[0] += (
        theta[0]
        * (1.0 + theta[1] * math.exp(-ratio * ratio))
        * math.copysign((1.0 - fade) / (1.0 + fade), v[0])
    )


STRIBECK = ForceLaw(
    name="stribeck",
    parameters=(
        LIMIT,
        Parameter("boost", "1", 0.5, (0.0, math.inf), "s: breakaway force over sliding force, less one"),
        Parameter(
            "stribeck_velocity",
            "m/s",
            0.05,
            (1e-9, math.inf),
            "velocity vs over which friction weakens",
            "rad/s",
        ),
        REGULARISATION,
    ),
    force=force,
    equation="f = Fc (1 + s exp(-(v/vs)^2)) tanh(v / vr)",
    reference="Stribeck 1902; Bo & Pavelescu 1982; Armstrong-Helouvry et al. 1994",
)
