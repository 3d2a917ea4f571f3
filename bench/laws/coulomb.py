"""Coulomb friction, regularised at rest: equal or unequal limits for the two directions.

``f = Fc tanh(v / vr)``. The exact law is set-valued at rest: any force between -Fc and Fc that keeps the body
from moving. The regularised one cannot hold a load: under a constant force F below the limit the body creeps
at ``v = vr artanh(F / Fc)`` (0.55 vr at half the limit), and turns the stick phases of a forced motion into
such creep. Measured on a mass on a spring (natural frequency 3 Hz) driven at 1 Hz with twice the limit, at
rest for 45 % of the time, against an event-driven solution of the exact law: rms error of the displacement
over its rms 1.6 % for vr/v_peak = 1e-2, 0.20 % for 1e-3 and 0.024 % for 1e-4; of the velocity twice that.
(Driven at 2 Hz, where it hardly stops, 0.9, 0.11 and 0.012 %.) The default of 1 mm/s suits joints that move
at some 0.1 m/s and more; choose vr at a hundredth of the peak velocity, or less.

The price of a small vr is a stiff equation: at rest the law is a damper Fc/vr, and RK4 needs
``dt < 2.78 m vr / Fc`` on a mass m. Where the engine can do better (a MuJoCo joint with `frictionloss`), use
an element with ``exact=True``.

The kernels write ``tanh x`` as ``sgn x (1 - e) / (1 + e)``, ``e = exp(-2 |x|)``: the same to rounding of the limit, and a third
quicker where the velocity changes sign at every other call.

`coulomb` has no velocity weakening (`stribeck`), no displacement before sliding (`dahl`, `lugre`, `jenkins`)
and a constant normal force (`load_dependent_friction`, `time_varying_friction`, `controlled_friction`).
`asymmetric_coulomb` has one limit a direction, as belts, seals and gear trains of real drives do; a constant
force plus `coulomb` gives the same curve outside the regularised zone, but not at rest.

References:
    Coulomb 1785; Oden & Martins 1985, Comput. Methods Appl. Mech. Eng. 52 (regularisation); Tasbihgoo 2006,
    section 2.2.3.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel

LIMIT = Parameter("limit", "N", 5.0, (0.0, math.inf), "Coulomb friction force Fc", "N m")
REGULARISATION = Parameter(
    "regularisation_velocity",
    "m/s",
    1e-3,
    (1e-9, math.inf),
    "velocity vr below which sgn v is smoothed; creep under load F: vr artanh(F/Fc)",
    "rad/s",
)


@kernel
def force(t, q, v, z, theta, f):
    """``f = Fc tanh(v / vr)``."""
    fade = math.exp(-2.0 * abs(v[0]) / theta[1])
    f[0] += theta[0] * math.copysign((1.0 - fade) / (1.0 + fade), v[0])


@kernel
def force_asymmetric(t, q, v, z, theta, f):
    """``f = F+ tanh(v / vr)`` for v > 0, ``F- tanh(v / vr)`` for v < 0."""
    limit = theta[0] if v[0] >= 0.0 else theta[1]
    fade = math.exp(-2.0 * abs(v[0]) / theta[2])
    f[0] += limit * math.copysign((1.0 - fade) / (1.0 + fade), v[0])


COULOMB = ForceLaw(
    name="coulomb",
    parameters=(LIMIT, REGULARISATION),
    force=force,
    equation="f = Fc tanh(v / vr)",
    reference="Coulomb 1785; Oden & Martins 1985; Tasbihgoo 2006, section 2.2.3",
)

ASYMMETRIC_COULOMB = ForceLaw(
    name="asymmetric_coulomb",
    parameters=(
        Parameter("limit_positive", "N", 5.0, (0.0, math.inf), "friction force for v > 0", "N m"),
        Parameter(
            "limit_negative", "N", 3.0, (0.0, math.inf), "magnitude of the friction force for v < 0", "N m"
        ),
        REGULARISATION,
    ),
    force=force_asymmetric,
    equation="f = F+ tanh(v / vr) for v >= 0, F- tanh(v / vr) for v < 0",
    reference="Armstrong-Helouvry, Dupont & Canudas de Wit 1994, Automatica 30(7)",
    smoothness="continuous",
)
