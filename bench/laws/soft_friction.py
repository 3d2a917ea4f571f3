"""Coulomb friction that creeps at rest: one family with its softness a parameter, MuJoCo's `frictionloss` among it.

``f = Fc sat((v + tau a) / vc)``, saturated at one either way. Below the limit the contact does not stick, it creeps: a constant load F
moves it at ``v = vc F / Fc``, as a damper Fc/vc would let it. With the lead time tau the force turns round before the velocity
does, by tau. The two limits of the family are Coulomb friction over a small velocity (tau = 0), as simulators round the sign
function, and for vc and tau to zero the exact, set-valued law.

MuJoCo's `frictionloss` is this law, with both. Its constraint asks for the acceleration ``a_ref = -b v`` and gives the force
``f = -(a - a_ref) / R``, saturated at the loss: ``f = sat((a + b v) / R)``. So ``tau = 1 / b`` and ``vc = Fc R / b``, where

| of MuJoCo | is |
|---|---|
| b | ``2 / (dmax timeconst)`` of a `solreffriction` (timeconst, dampratio), whatever the ratio; ``-damping / dmax`` of a direct one |
| R | ``(1 - d0) / d0`` times the inverse inertia of the joint at the reference position (`dof_invweight0`) |
| d0, dmax | the first two numbers of `solimpfriction`: the constraint has no position, so the others do nothing |

With the defaults (0.02 s; 0.9, 0.95) ``tau`` is 9.5 ms and ``vc`` 1.06e-3 s times Fc over the inertia; at rest the joint carries nine times
its own inertia besides. Neither depends on the step (but for `refsafe`, which makes the time constant two steps at least).

The acceleration holds the force itself, so that this is an equation for it. The simulator of the diagnosis solves it; in a model it
belongs as `frictionloss`. The kernel, which sees no acceleration, is the force of steady motion (a = 0).

`coulomb` rounds the sign function by a tanh; `lugre` and `dahl` spring back after presliding, which this law does not.

References:
    E. Todorov 2014, Convex and analytically-invertible dynamics with contacts and constraints, ICRA (soft constraints, eqs. 9-13);
    MuJoCo documentation, Computation, "Friction loss" and "Parameters"; Oden & Martins 1985 (regularisation).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.coulomb import LIMIT


@kernel
def force(t, q, v, z, theta, f):
    """``f = Fc sat(v / vc)``."""
    f[0] += theta[0] * min(max(v[0] / theta[1], -1.0), 1.0)


SOFT_COULOMB = ForceLaw(
    name="soft_coulomb",
    parameters=(
        LIMIT,
        Parameter(
            "creep_velocity", "m/s", 1e-3, (1e-9, math.inf), "velocity vc of creep at the limit", "rad/s"
        ),
        Parameter(
            "lead_time",
            "s",
            0.0,
            (0.0, math.inf),
            "time tau by which the force turns round before the velocity",
        ),
    ),
    force=force,
    equation="f = Fc sat((v + tau a) / vc); as an element a = 0",
    reference="Todorov 2014, ICRA, eqs. 9-13; Oden & Martins 1985",
    smoothness="continuous",
)
