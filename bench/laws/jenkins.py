"""Elastic slider (Jenkins element) and many of them in parallel (Iwan model).

A Jenkins element is a spring in series with a Coulomb slider: force ``k v`` a second until the limit Fy,
constant there, and elastic again at once when the motion turns back. Its exact rate form jumps at yield,
which costs Runge-Kutta steps their order and leaves an overshoot of up to ``k |v| dt``. The form here yields
over the last fraction w (`transition`) of the limit::

    z' = k v (1 - u^2) while z v > 0 and u > 0, else k v;   u = (|z|/Fy - 1 + w) / w

whose rising branch is known: ``z = Fy (1 - w + w tanh(k (q - q0) / (w Fy)))``. Against the exact slider the
force is at most 0.24 w Fy too small (at the corner), the limit is kept exactly, and the loop of a motion of
amplitude X well beyond yield has the area ``4 Fy (X - Fy/k) - (2 ln 2 - 1) w^2 Fy^2/k``. Where a step is too
coarse for the corner (``|v| dt > 1.4 w Fy/k``) the force stays bounded by Fy and the error is that of the
exact form, of the order of ``k |v| dt``.

`iwan` is Segalman's four-parameter model: sliders with a power-law density of strengths and one more group
that all yield at the largest. The parameters are the force at which everything slides, the tangent stiffness
at zero load, the exponent chi of the density (the energy lost a cycle grows with amplitude to the power 3 +
chi) and the ratio beta of the slope of the last group to the rest. chi = 0 and beta = 0 is Iwan's uniform
distribution of 1966, with the backbone ``K q - K^2 q^2 / (4 F)``. The density is cut into groups of equal
stiffness, each represented by one slider of the group's mean strength, so that K and F are exact for every
number of sliders; the backbone is a polygon about the exact curve, at most ``F/(4 n^2)`` above it for chi =
beta = 0.

Rate-independent like `bouc_wen` and `dahl`, but these lack the memory of partial loops (they drift under
small cycles on a mean load; Iwan's loops close, by Masing's rule).

References:
    Jenkins 1962, Br. J. Appl. Phys. 13, 30-32; Iwan 1966, J. Appl. Mech. 33(4), 893-900; Segalman 2005, J.
    Appl. Mech. 72(5), 752-760.
"""

from __future__ import annotations

import math
from functools import lru_cache

from bench.errors import ParameterError
from bench.laws.base import ForceLaw, Parameter, kernel

MAX_SLIDERS = 200
"""Most sliders of an Iwan law: beyond some tens the backbone no longer changes visibly."""


@kernel
def force(t, q, v, z, theta, f):
    """``f = z``, kept within the limit."""
    f[0] += max(-theta[1], min(theta[1], z[0]))


@kernel
def rate(t, q, v, z, theta, zdot):
    """``z' = k v (1 - u^2)`` in the transition to sliding, ``k v`` otherwise."""
    slide = 0.0
    if z[0] * v[0] > 0.0:
        u = (abs(z[0]) / theta[1] - 1.0 + theta[2]) / theta[2]
        if u > 0.0:
            slide = min(u * u, 2.0)
    zdot[0] = theta[0] * v[0] * (1.0 - slide)


@kernel
def force_iwan(t, q, v, z, theta, f):
    """Sum of the slider forces, each kept within its limit."""
    n = int(theta[0])
    chi = theta[3]
    largest = theta[1] * (1.0 + theta[4]) / (theta[2] * (theta[4] + (chi + 1.0) / (chi + 2.0)))
    spread = theta[2] / (1.0 + theta[4])
    power = (chi + 2.0) / (chi + 1.0)
    scale = spread * largest / power
    below = 0.0
    for i in range(n):
        above = ((i + 1.0) / n) ** power
        limit = scale * (above - below)
        below = above
        f[0] += max(-limit, min(limit, z[i]))
    limit = theta[4] * spread * largest
    f[0] += max(-limit, min(limit, z[n]))


@kernel
def rate_iwan(t, q, v, z, theta, zdot):
    """Rate of each slider force, as for the Jenkins element."""
    n = int(theta[0])
    chi = theta[3]
    width = theta[5]
    largest = theta[1] * (1.0 + theta[4]) / (theta[2] * (theta[4] + (chi + 1.0) / (chi + 2.0)))
    spread = theta[2] / (1.0 + theta[4])
    power = (chi + 2.0) / (chi + 1.0)
    scale = spread * largest / power
    below = 0.0
    for i in range(n + 1):
        if i < n:
            above = ((i + 1.0) / n) ** power
            limit = scale * (above - below)
            below = above
            stiffness = spread / n
        else:
            limit = theta[4] * spread * largest
            stiffness = theta[4] * spread
        slide = 0.0
        if limit > 0.0 and z[i] * v[0] > 0.0:
            u = (abs(z[i]) / limit - 1.0 + width) / width
            if u > 0.0:
                slide = min(u * u, 2.0)
        zdot[i] = stiffness * v[0] * (1.0 - slide)


JENKINS = ForceLaw(
    name="jenkins",
    parameters=(
        Parameter("stiffness", "N/m", 2000.0, (0.0, math.inf), "elastic stiffness k", "N m/rad"),
        Parameter("limit", "N", 5.0, (1e-12, math.inf), "sliding force Fy", "N m"),
        Parameter("transition", "1", 0.1, (1e-3, 1.0), "part w of the limit over which sliding sets in"),
    ),
    force=force,
    rate=rate,
    states=("z [N]",),
    equation="f = z, z' = k v (1 - u^2) while z v > 0 and u > 0, else k v; u = (|z|/Fy - 1 + w)/w",
    reference="Jenkins 1962, Br. J. Appl. Phys. 13; Iwan 1966; yield rounded",
    smoothness="continuous",
)


@lru_cache(maxsize=64)
def iwan_law(n_sliders: int = 10) -> ForceLaw:
    """Iwan law with `n_sliders` for the power-law density, and one for the group that yields last.

    Args:
        n_sliders: Number of sliders that represent the density, 1 to `MAX_SLIDERS`.

    Raises:
        ParameterError: `n_sliders` is outside its range.
    """
    if not 1 <= n_sliders <= MAX_SLIDERS:
        raise ParameterError(f"an Iwan law takes 1 to {MAX_SLIDERS} sliders; {n_sliders} came")
    return ForceLaw(
        name="iwan",
        parameters=(
            Parameter("limit", "N", 5.0, (1e-12, math.inf), "force at which every slider slides, F_S", "N m"),
            Parameter(
                "stiffness", "N/m", 2000.0, (1e-9, math.inf), "tangent stiffness at zero load, K_T", "N m/rad"
            ),
            Parameter("chi", "1", 0.0, (-0.9, 5.0), "exponent of the density of strengths"),
            Parameter(
                "beta", "1", 0.0, (0.0, math.inf), "stiffness of the group that yields last over the rest"
            ),
            Parameter("transition", "1", 0.2, (1e-3, 1.0), "part w of each limit over which sliding sets in"),
        ),
        force=force_iwan,
        rate=rate_iwan,
        states=tuple(f"z{i + 1} [N]" for i in range(n_sliders + 1)),
        equation="f = sum z_i; Jenkins sliders with strengths phi of density R phi^chi, 0 < phi < phi_max, + S delta(phi_max)",
        reference="Iwan 1966; Segalman 2005, J. Appl. Mech. 72(5)",
        smoothness="continuous",
        header=(float(n_sliders),),
    )


IWAN = iwan_law()
