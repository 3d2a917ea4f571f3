"""A mass that the moving side of a joint carries on a spring: a tuned mass, an appendage, the second mode of a part.

The mass m_c is at y, the joint at q. With ``r = y - q`` and ``p = y'`` the spring and its damper take from the joint what moves the
mass,

    f = m_c p',  p' = -omega^2 r - 2 zeta omega (p - v),  r' = p - v.

``q`` is the position in the room. Far below its frequency it is dead weight, far above it the joint does not feel its inertia; it takes
energy from the joint's own resonance where the two are tuned to each other. It starts at rest in the room. A mass that stands *under* the
joint is a `base_flexibility`.

References:
    Den Hartog 1956, Mechanical Vibrations, section 3.2 (dynamic vibration absorber); Harris & Piersol 2002, ch. 6.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = m_c p'``."""
    omega = 2.0 * math.pi * theta[1]
    f[0] -= theta[0] * omega * (omega * z[0] + 2.0 * theta[2] * (z[1] - v[0]))


@kernel
def rate(t, q, v, z, theta, zdot):
    """``r' = p - v``, ``p' = -omega^2 r - 2 zeta omega (p - v)``."""
    omega = 2.0 * math.pi * theta[1]
    zdot[0] = z[1] - v[0]
    zdot[1] = -omega * (omega * z[0] + 2.0 * theta[2] * (z[1] - v[0]))


def spring_and_damper(mass: float, frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Stiffness [N/m or N m/rad] and damping under a carried mass, of its parameters.

    Examples:
        >>> spring_and_damper(0.5, 1.0 / math.pi, 0.25)
        (2.0, 0.5)
    """
    omega = 2.0 * math.pi * frequency
    return mass * omega**2, 2.0 * damping_ratio * omega * mass


CARRIED_MASS = ForceLaw(
    name="carried_mass",
    parameters=(
        Parameter("mass", "kg", 0.5, (0.0, math.inf), "m_c, on the spring", "kg m^2"),
        Parameter("frequency", "Hz", 8.0, (1e-6, math.inf), "of the mass, the joint held"),
        Parameter("damping_ratio", "1", 0.03, (0.0, math.inf), "zeta of the mass, the joint held"),
    ),
    force=force,
    rate=rate,
    states=("r [m]", "p [m/s]"),
    equation="f = m_c p', p' = -omega^2 r - 2 zeta omega (p - v), r' = p - v",
    reference="Den Hartog 1956, section 3.2",
)
