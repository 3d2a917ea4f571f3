"""Dampers without memory: linear, asymmetric, quadratic and power-law.

- `linear_damping`: ``c v``. The damper of `linear` alone, for fits in which stiffness and damping are
  separate effects.
- `asymmetric_damping`: its own constant in either direction, as vehicle dampers have by design (rebound and
  jounce) and drives by their gears.
- `quadratic_damping`: ``c2 v |v|``, turbulent drag; equivalent linear damping at amplitude X and frequency
  omega ``8/(3 pi) c2 omega X``.
- `power_law_damping`: ``C sgn(v) |v|^n``, the design model of fluid dampers (n from 0.3 to 1 by the shape of
  the orifices; above 1 is admitted). For n < 1 the exact law has infinite slope at rest; it is taken as
  ``C v (v^2 + v0^2)^((n-1)/2)``, which differs from it by the relative amount ``(1-n)/2 (v0/v)^2`` for v >>
  v0 (5e-7 (1-n) at v = 1000 v0) and is smooth, with slope ``C v0^(n-1)`` at rest. The unit of C depends on n;
  here C is given as the force at 1 m/s (1 rad/s), which has the same number. Rate-dependent only: a real
  damper's stiffness, its friction and the play of its clevises need elements of their own, and the
  dissertation shows the design model to fail under random excitation (fig. 3.10).

`coulomb` is the limit n = 0 of the power law, `linear_damping` is n = 1, `quadratic_damping` n = 2.

References:
    Tasbihgoo 2006, eq. 3.2; Soong & Constantinou 1994, Passive and Active Structural Vibration Control, ch.
    3; Morison et al. 1950; Dixon 2007, The Shock Absorber Handbook, ch. 8 (asymmetry).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force_linear(t, q, v, z, theta, f):
    """``f = c v``."""
    f[0] += theta[0] * v[0]


@kernel
def force_asymmetric(t, q, v, z, theta, f):
    """``f = c+ v`` for v > 0, ``c- v`` for v < 0."""
    f[0] += (theta[0] if v[0] > 0.0 else theta[1]) * v[0]


@kernel
def force_quadratic(t, q, v, z, theta, f):
    """``f = c2 v |v|``."""
    f[0] += theta[0] * v[0] * abs(v[0])


@kernel
def force_power_law(t, q, v, z, theta, f):
    """``f = C v (v^2 + v0^2)^((n-1)/2)``."""
    f[0] += theta[0] * v[0] * (v[0] * v[0] + theta[2] * theta[2]) ** (0.5 * (theta[1] - 1.0))


LINEAR_DAMPING = ForceLaw(
    name="linear_damping",
    parameters=(
        Parameter("damping", "N s/m", 10.0, (-math.inf, math.inf), "viscous constant c", "N m s/rad"),
    ),
    force=force_linear,
    equation="f = c v",
    reference="Rayleigh 1877, The Theory of Sound, section 81",
)

_CONSTANT = (-math.inf, math.inf)

ASYMMETRIC_DAMPING = ForceLaw(
    name="asymmetric_damping",
    parameters=(
        Parameter("damping_positive", "N s/m", 10.0, _CONSTANT, "c+, constant for v > 0", "N m s/rad"),
        Parameter("damping_negative", "N s/m", 5.0, _CONSTANT, "c-, constant for v < 0", "N m s/rad"),
    ),
    force=force_asymmetric,
    equation="f = c+ v for v > 0, c- v for v < 0",
    reference="Dixon 2007, The Shock Absorber Handbook, ch. 8",
    smoothness="continuous",
)

QUADRATIC_DAMPING = ForceLaw(
    name="quadratic_damping",
    parameters=(
        Parameter("c2", "N s^2/m^2", 20.0, (-math.inf, math.inf), "quadratic coefficient", "N m s^2/rad^2"),
    ),
    force=force_quadratic,
    equation="f = c2 v |v|",
    reference="Morison et al. 1950; Worden & Tomlinson 2001, ch. 2",
    smoothness="continuous",
)

POWER_LAW_DAMPING = ForceLaw(
    name="power_law_damping",
    parameters=(
        Parameter("C", "N", 20.0, (0.0, math.inf), "force at 1 m/s (1 rad/s): C in N (s/m)^n", "N m"),
        Parameter("n", "1", 0.5, (0.05, 3.0), "velocity exponent"),
        Parameter(
            "regularisation_velocity", "m/s", 1e-3, (1e-9, math.inf), "v0, rounds the law at rest", "rad/s"
        ),
    ),
    force=force_power_law,
    equation="f = C v (v^2 + v0^2)^((n-1)/2), which is C sgn(v) |v|^n for |v| >> v0",
    reference="Tasbihgoo 2006, eq. 3.2; Soong & Constantinou 1994",
)
