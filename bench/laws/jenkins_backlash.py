"""Elastic-slip element with backlash: a friction slider driven through a spring that has a dead-space.

Differs from the Jenkins element (`jenkins`), whose spring engages at once, and from `gap`, whose dead-space stays at a
fixed place: here it travels with the slider, so that the loop crosses zero force along a soft plateau wherever motion
reverses. Differs from Bouc-Wen with pinching (`bouc_wen_pinching`) in having parameters a person can measure on a drawing.

Yielding is rounded: the slider takes up the share ``(|f|/limit)^sharpness`` of the motion, so that the element has a
continuous rate and keeps Runge-Kutta steps honest; large `sharpness` approaches set-valued slip.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = k0 u + k ds(u, clearance) + offset``."""
    u = z[0]
    engaged = abs(u) - theta[2]
    r = theta[1] * u
    if engaged > 0.0:
        r += theta[0] * math.copysign(engaged, u)
    f[0] += r + theta[6]


@kernel
def rate(t, q, v, z, theta, zdot):
    """``du/dt = v (1 - min(|r|/limit, 1)^sharpness)`` while loading, ``v`` while unloading."""
    u = z[0]
    engaged = abs(u) - theta[2]
    r = theta[1] * u
    if engaged > 0.0:
        r += theta[0] * math.copysign(engaged, u)
    zdot[0] = v[0]
    if r * v[0] > 0.0:
        limit = theta[3] if r > 0.0 else theta[4]
        share = abs(r) / limit
        zdot[0] = v[0] * (1.0 - share ** theta[5]) if share < 1.0 else 0.0


JENKINS_BACKLASH = ForceLaw(
    name="jenkins_backlash",
    parameters=(
        Parameter(
            "stiffness", "N/m", 6e6, (0.0, math.inf), "stiffness k once the backlash is taken up", "N m/rad"
        ),
        Parameter(
            "soft_stiffness", "N/m", 6e5, (0.0, math.inf), "stiffness k0 within the backlash", "N m/rad"
        ),
        Parameter("clearance", "m", 0.002, (0.0, math.inf), "half-width of the backlash", "rad"),
        Parameter(
            "limit_positive", "N", 1e4, (1e-12, math.inf), "slip force in the positive direction", "N m"
        ),
        Parameter(
            "limit_negative", "N", 1e4, (1e-12, math.inf), "slip force in the negative direction", "N m"
        ),
        Parameter("sharpness", "1", 3.0, (0.5, 50.0), "sharpness of the transition to slip"),
        Parameter("offset", "N", 0.0, (-math.inf, math.inf), "constant force", "N m"),
    ),
    force=force,
    rate=rate,
    states=("u [m]",),
    equation="f = k0 u + k ds(u) + offset; du/dt = v (1 - min(|f - offset|/limit, 1)^n) loading, v unloading",
    reference="Jenkins 1962 (elastic-slip element) with dead-space; cf. the banded rotary friction damper's backlash",
    smoothness="continuous",
)
