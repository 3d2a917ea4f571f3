"""Friction whose limit changes: with displacement, with time, or with a normal force that is an input.

All three are Coulomb friction regularised by ``tanh(v / vr)`` (creep, error and stiffness at rest as in
`bench.laws.coulomb`, with the momentary limit) and none has memory:

- `load_dependent_friction`: limit ``Fc + mu_k |q|``, a wedge or a leaf spring that presses harder the farther
  it is pushed. The loop in the f-q plane is a bow tie; with Fc = 0 there is no friction at the centre, so the
  mass always comes to rest there.
- `time_varying_friction`: limit ``Fc max(1 + depth sin(2 pi frequency t + phase), 0)``, the rig of the
  dissertation with its stepper motor left to run. Time is the clock of the record.
- `controlled_friction`: limit ``mu max(N, 0)`` where the normal force N is the law's input (an actuator's
  control); a negative N opens the contact.

References:
    Tasbihgoo 2006, section 2.2.3 and figs. 2.9, 2.10 (normal force modulated by a motor); Anderson & Ferri
    1990, J. Sound Vib. 140(2) (amplitude-dependent limit).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.coulomb import LIMIT, REGULARISATION


@kernel
def force_load_dependent(t, q, v, z, theta, f):
    """``f = (mu_k |q| + Fc) tanh(v / vr)``."""
    fade = math.exp(-2.0 * abs(v[0]) / theta[2])
    f[0] += (theta[0] * abs(q[0]) + theta[1]) * math.copysign((1.0 - fade) / (1.0 + fade), v[0])


@kernel
def force_time_varying(t, q, v, z, theta, f):
    """``f = Fc max(1 + depth sin(2 pi frequency t + phase), 0) tanh(v / vr)``."""
    modulation = 1.0 + theta[1] * math.sin(2.0 * math.pi * theta[2] * t + theta[3])
    fade = math.exp(-2.0 * abs(v[0]) / theta[4])
    f[0] += theta[0] * max(modulation, 0.0) * math.copysign((1.0 - fade) / (1.0 + fade), v[0])


@kernel
def force_controlled(t, q, v, z, theta, f):
    """``f = mu max(N, 0) tanh(v / vr)``, N = q[1]."""
    fade = math.exp(-2.0 * abs(v[0]) / theta[1])
    f[0] += theta[0] * max(q[1], 0.0) * math.copysign((1.0 - fade) / (1.0 + fade), v[0])


LOAD_DEPENDENT_FRICTION = ForceLaw(
    name="load_dependent_friction",
    parameters=(
        Parameter(
            "slope", "N/m", 200.0, (0.0, math.inf), "growth of the limit with displacement, mu_k", "N m/rad"
        ),
        Parameter("limit", "N", 0.0, (0.0, math.inf), "constant part of the limit, Fc", "N m"),
        REGULARISATION,
    ),
    force=force_load_dependent,
    equation="f = (mu_k |q| + Fc) tanh(v / vr)",
    reference="Anderson & Ferri 1990, J. Sound Vib. 140(2), 287-304",
    smoothness="continuous",
)

TIME_VARYING_FRICTION = ForceLaw(
    name="time_varying_friction",
    parameters=(
        LIMIT,
        Parameter(
            "depth", "1", 0.5, (0.0, math.inf), "modulation over the mean limit; above 1 the contact opens"
        ),
        Parameter("frequency", "Hz", 0.1, (0.0, math.inf), "modulation frequency"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase at t = 0"),
        REGULARISATION,
    ),
    force=force_time_varying,
    equation="f = Fc max(1 + depth sin(2 pi frequency t + phase), 0) tanh(v / vr)",
    reference="Tasbihgoo 2006, section 2.2.3, figs. 2.9 and 2.10",
)

CONTROLLED_FRICTION = ForceLaw(
    name="controlled_friction",
    parameters=(
        Parameter(
            "mu", "1", 0.3, (0.0, math.inf), "friction coefficient (times the radius if rotational)", "m"
        ),
        REGULARISATION,
    ),
    force=force_controlled,
    equation="f = mu max(N, 0) tanh(v / vr), N = q[1] an input [N]",
    reference="Tasbihgoo 2006, section 2.1, fig. 2.3 (friction actuator)",
    n_coordinates=2,
    n_inputs=1,
)
