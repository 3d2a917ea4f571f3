"""Springs that are not linear, or not constant: quadratic, cubic, drifting in time, periodic in position.

- `quadratic_stiffness`: ``k2 q^2``, even in q: it pushes towards negative q on both sides and gives an
  asymmetric response and even harmonics. It is not a restoring force: beyond ``k/k2`` it overcomes a linear
  spring k.
- `cubic_stiffness`: ``k3 q^3``, odd: hardening for k3 > 0 (Duffing), softening for k3 < 0, where together
  with a linear spring k the joint loses stability at ``|q| = sqrt(k/(3 |k3|))``. A `gap` also hardens, but
  with a sharp corner.
- `stiffness_drift`: ``rate (t - onset) q`` after the onset, a linear spring whose constant changes along the
  record (a bolt that loosens, a heating rubber). Time is the clock of the record; within one record, slow
  against the motion.
- `cogging`: ``amplitude sin(2 pi q / period + phase)``, the position-periodic force of slotted motors and
  gears; conservative.

References:
    Duffing 1918; Nayfeh & Mook 1979, Nonlinear Oscillations, ch. 4; Worden & Tomlinson 2001, Nonlinearity in
    Structural Dynamics, ch. 2; Hendershot & Miller 1994, Design of Brushless Permanent-Magnet Motors
    (cogging).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force_quadratic(t, q, v, z, theta, f):
    """``f = k2 q^2``."""
    f[0] += theta[0] * q[0] * q[0]


@kernel
def force_cubic(t, q, v, z, theta, f):
    """``f = k3 q^3``."""
    f[0] += theta[0] * q[0] * q[0] * q[0]


@kernel
def force_drift(t, q, v, z, theta, f):
    """``f = rate max(t - onset, 0) q``."""
    f[0] += theta[0] * max(t - theta[1], 0.0) * q[0]


@kernel
def force_cogging(t, q, v, z, theta, f):
    """``f = amplitude sin(2 pi q / period + phase)``."""
    f[0] += theta[0] * math.sin(2.0 * math.pi * q[0] / theta[1] + theta[2])


QUADRATIC_STIFFNESS = ForceLaw(
    name="quadratic_stiffness",
    parameters=(Parameter("k2", "N/m^2", 5e4, (-math.inf, math.inf), "quadratic coefficient", "N m/rad^2"),),
    force=force_quadratic,
    equation="f = k2 q^2",
    reference="Worden & Tomlinson 2001, ch. 2",
)

CUBIC_STIFFNESS = ForceLaw(
    name="cubic_stiffness",
    parameters=(Parameter("k3", "N/m^3", 1e7, (-math.inf, math.inf), "cubic coefficient", "N m/rad^3"),),
    force=force_cubic,
    equation="f = k3 q^3",
    reference="Duffing 1918; Tasbihgoo 2006, section 2.4.1 (term d)",
)

STIFFNESS_DRIFT = ForceLaw(
    name="stiffness_drift",
    parameters=(
        Parameter(
            "rate", "N/(m s)", 10.0, (-math.inf, math.inf), "change of stiffness a second", "N m/(rad s)"
        ),
        Parameter("onset", "s", 0.0, (-math.inf, math.inf), "time at which the drift begins"),
    ),
    force=force_drift,
    equation="f = rate max(t - onset, 0) q",
    reference="Worden & Tomlinson 2001, ch. 2",
)

COGGING = ForceLaw(
    name="cogging",
    parameters=(
        Parameter("amplitude", "N", 2.0, (0.0, math.inf), "peak force", "N m"),
        Parameter("period", "m", 0.02, (1e-9, math.inf), "pitch", "rad"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase at q = 0"),
    ),
    force=force_cogging,
    equation="f = amplitude sin(2 pi q / period + phase)",
    reference="Hendershot & Miller 1994",
)
