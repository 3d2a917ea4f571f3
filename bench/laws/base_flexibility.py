"""What a compliant base takes from the joint that stands on it: a hidden mass on a spring, seen from the joint.

- `base_flexibility`: a joint of stiffness k and damping c whose far end is not ground but a base of mass m_b on a
  spring k_b. The base moves by b, and the force on the moving side is ``k (q - b) + c (v - b')`` instead of
  ``k q + c v``. With w = b (k + k_b)/k the difference is ``-kappa (w + tau w')``, ``w'' + 2 zeta omega w' + omega^2 w
  = omega^2 (q + tau v)``, with ``kappa = k^2/(k + k_b)`` (the stiffness lost in slow motion), ``tau = c/k`` and
  ``omega^2 = (k + k_b)/m_b``. Used beside the joint's own spring and damper. ``q`` is the position in the room, not
  that relative to the base. A stiff base (omega far above the motion) is a mere loss of stiffness, which a
  smaller k says as well. A `maxwell` branch has one hidden state and no resonance.

References:
    Den Hartog 1956, Mechanical Vibrations, ch. 3 (two degrees of freedom); Ewins 2000, Modal Testing, section 3.2
    (grounded supports).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = -kappa (w + tau w')``."""
    f[0] -= theta[0] * (z[0] + theta[3] * z[1])


@kernel
def rate(t, q, v, z, theta, zdot):
    """``w'' = omega^2 (q + tau v - w) - 2 zeta omega w'``."""
    omega = 2.0 * math.pi * theta[1]
    zdot[0] = z[1]
    zdot[1] = omega * omega * (q[0] + theta[3] * v[0] - z[0]) - 2.0 * theta[2] * omega * z[1]


BASE_FLEXIBILITY = ForceLaw(
    name="base_flexibility",
    parameters=(
        Parameter("stiffness_loss", "N/m", 100.0, (0.0, math.inf), "kappa, lost in slow motion", "N m/rad"),
        Parameter("frequency", "Hz", 8.0, (1e-6, math.inf), "of the base, the joint's far end held"),
        Parameter("damping_ratio", "1", 0.03, (0.0, math.inf), "zeta of the base"),
        Parameter("lead", "s", 0.0, (0.0, math.inf), "tau: damping over stiffness of the joint on the base"),
    ),
    force=force,
    rate=rate,
    states=("w [m]", "w' [m/s]"),
    equation="f = -kappa (w + tau w'), w'' + 2 zeta omega w' + omega^2 w = omega^2 (q + tau v)",
    reference="Den Hartog 1956, ch. 3",
)
