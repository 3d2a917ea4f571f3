"""Bristle friction with Stribeck curve: LuGre, and its elasto-plastic form without drift in presliding.

The state z [m] is the mean deflection of bristles of stiffness sigma0. Steady sliding gives the Stribeck
curve ``g(v) sgn v + sigma2 v`` with ``g(v) = Fc (1 + s exp(-(v/vs)^2))``; small motion about rest gives a
spring sigma0 with damping sigma1 + sigma2; between them there are presliding hysteresis and frictional lag.
No regularisation is needed, since sigma0 z holds static loads.

- `lugre`: ``z' = v - sigma0 |v| z / g(v)``. Bristles creep from the first micrometre, so that under an
  oscillating load below breakaway the body drifts, which real joints do not.
- `elastoplastic_friction`: slip enters only above the fraction `breakaway_ratio` of the steady deflection
  ``g/sigma0`` and only while the deflection grows, so that there is a truly elastic range without drift.

Against their relatives: `dahl` is `lugre` without Stribeck effect and without sigma1; `jenkins` is elastic up
to the yield force and then slides, without a velocity dependence; `bouc_wen` with n = 1 and gamma = 0 is Dahl
again, with other symbols. Passive for ``sigma2 >= sigma1 s``; with more bristle damping than that the law can
feed energy in at fast reversals. The state relaxes at the rate ``sigma0 |v| / Fc``, so RK4 needs
``dt < 2.78 Fc / (sigma0 |v|)``: stiff bristles and fast motion ask for small steps.

References:
    Canudas de Wit, Olsson, Astrom & Lischinsky 1995, IEEE Trans. Autom. Control 40(3); Dupont, Hayward,
    Armstrong & Altpeter 2002, IEEE Trans. Autom. Control 47(5); Barabanov & Ortega 2000, IEEE Trans. Autom.
    Control 45(4) (passivity).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.coulomb import LIMIT


@kernel
def force(t, q, v, z, theta, f):
    """``f = sigma0 z + sigma1 z' + sigma2 v``."""
    ratio = v[0] / theta[4]
    g = theta[0] * (1.0 + theta[3] * math.exp(-ratio * ratio))
    slip = v[0] - theta[1] * abs(v[0]) * z[0] / g
    f[0] += theta[1] * z[0] + theta[2] * slip + theta[5] * v[0]


@kernel
def rate(t, q, v, z, theta, zdot):
    """``z' = v - sigma0 |v| z / g(v)``."""
    ratio = v[0] / theta[4]
    g = theta[0] * (1.0 + theta[3] * math.exp(-ratio * ratio))
    zdot[0] = v[0] - theta[1] * abs(v[0]) * z[0] / g


@kernel
def force_elastoplastic(t, q, v, z, theta, f):
    """``f = sigma0 z + sigma1 z' + sigma2 v`` with the elasto-plastic z'."""
    ratio = v[0] / theta[4]
    steady = theta[0] * (1.0 + theta[3] * math.exp(-ratio * ratio)) / theta[1]
    elastic = theta[6] * steady
    deflection = abs(z[0])
    if z[0] * v[0] <= 0.0 or deflection <= elastic:
        plastic = 0.0
    elif deflection >= steady:
        plastic = 1.0
    else:
        plastic = 0.5 + 0.5 * math.sin(math.pi * (deflection - 0.5 * (steady + elastic)) / (steady - elastic))
    slip = v[0] * (1.0 - plastic * deflection / steady)
    f[0] += theta[1] * z[0] + theta[2] * slip + theta[5] * v[0]


@kernel
def rate_elastoplastic(t, q, v, z, theta, zdot):
    """``z' = v (1 - alpha(z, v) |z| / z_steady)``, alpha from 0 (elastic) to 1 (sliding)."""
    ratio = v[0] / theta[4]
    steady = theta[0] * (1.0 + theta[3] * math.exp(-ratio * ratio)) / theta[1]
    elastic = theta[6] * steady
    deflection = abs(z[0])
    if z[0] * v[0] <= 0.0 or deflection <= elastic:
        plastic = 0.0
    elif deflection >= steady:
        plastic = 1.0
    else:
        plastic = 0.5 + 0.5 * math.sin(math.pi * (deflection - 0.5 * (steady + elastic)) / (steady - elastic))
    zdot[0] = v[0] * (1.0 - plastic * deflection / steady)


_PARAMETERS = (
    Parameter("limit", "N", LIMIT.default, (1e-12, math.inf), "sliding friction force Fc", "N m"),
    Parameter("bristle_stiffness", "N/m", 1e4, (1e-9, math.inf), "sigma0", "N m/rad"),
    Parameter("bristle_damping", "N s/m", 10.0, (0.0, math.inf), "sigma1", "N m s/rad"),
    Parameter("boost", "1", 0.2, (0.0, math.inf), "s: breakaway force over sliding force, less one"),
    Parameter(
        "stribeck_velocity", "m/s", 0.05, (1e-9, math.inf), "velocity vs over which friction weakens", "rad/s"
    ),
    Parameter("viscous", "N s/m", 2.0, (0.0, math.inf), "sigma2", "N m s/rad"),
)

LUGRE = ForceLaw(
    name="lugre",
    parameters=_PARAMETERS,
    force=force,
    rate=rate,
    states=("z [m]",),
    equation="f = sigma0 z + sigma1 z' + sigma2 v, z' = v - sigma0 |v| z / g(v), g = Fc (1 + s exp(-(v/vs)^2))",
    reference="Canudas de Wit, Olsson, Astrom & Lischinsky 1995, IEEE Trans. Autom. Control 40(3)",
    smoothness="continuous",
)

ELASTOPLASTIC_FRICTION = ForceLaw(
    name="elastoplastic_friction",
    parameters=(
        *_PARAMETERS,
        Parameter("breakaway_ratio", "1", 0.7, (0.0, 0.99), "purely elastic part of the steady deflection"),
    ),
    force=force_elastoplastic,
    rate=rate_elastoplastic,
    states=("z [m]",),
    equation="f = sigma0 z + sigma1 z' + sigma2 v, z' = v (1 - alpha(z, v) sigma0 |z| / g(v))",
    reference="Dupont, Hayward, Armstrong & Altpeter 2002, IEEE Trans. Autom. Control 47(5)",
    smoothness="continuous",
)
