"""Dead-space: springs that act only beyond a clearance, on both sides, unequally, or on one side.

With ``ds(u) = sign(u) max(|u| - clearance, 0)`` the two-sided gap is ``f = k ds(q - offset)``; `clearance` is
the free travel to *each* side, so that the total play is twice the clearance. A contact may carry a damper as
well, active only while the contact is closed. The contact never pulls: where the damper of a separating
contact would make the force change sign, the force is zero (a Kelvin-Voigt contact without this clipping
sticks to the wall for the last moment before it opens). With damping the force jumps by ``c v`` when the
contact closes, so the law is then discontinuous and a Runge-Kutta step that closes a contact is of first
order; without it the law has a kink only, and such steps are of second order.

`gap` is symmetric about its offset; `asymmetric_gap` has its own stiffness and clearance on each side;
`one_sided_stop` is open on the other side. None of them has stiffness inside the clearance: put a `linear`
element beside them for that. For play that also remembers where it is (backlash with a friction-held
intermediate body) see `jenkins_backlash`. Valid for penetrations small against the clearance's own geometry;
there is no wave propagation and no plastic indentation.

References:
    Tasbihgoo 2006, section 2.2.2 (two springs and an adjustable gap) and appendix B.1 (the deck's
    dead-space).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``f = k ds(q - offset) + c v`` in contact, never pulling."""
    x = q[0] - theta[3]
    if x > theta[1]:
        f[0] += max(theta[0] * (x - theta[1]) + theta[2] * v[0], 0.0)
    elif x < -theta[1]:
        f[0] += min(theta[0] * (x + theta[1]) + theta[2] * v[0], 0.0)


@kernel
def force_asymmetric(t, q, v, z, theta, f):
    """``f = k+ (q - d+)`` beyond d+, ``k- (q + d-)`` beyond -d-, with damping in contact, never pulling."""
    if q[0] > theta[2]:
        f[0] += max(theta[0] * (q[0] - theta[2]) + theta[4] * v[0], 0.0)
    elif q[0] < -theta[3]:
        f[0] += min(theta[1] * (q[0] + theta[3]) + theta[4] * v[0], 0.0)


@kernel
def force_one_sided(t, q, v, z, theta, f):
    """``f = s max(k p + c p', 0)`` for a penetration ``p = s (q - position) > 0``, s the side."""
    side = 1.0 if theta[3] >= 0.0 else -1.0
    penetration = side * (q[0] - theta[1])
    if penetration > 0.0:
        f[0] += side * max(theta[0] * penetration + theta[2] * side * v[0], 0.0)


_STIFFNESS = Parameter("stiffness", "N/m", 10000.0, (0.0, math.inf), "contact stiffness k", "N m/rad")
_DAMPING = Parameter(
    "damping", "N s/m", 0.0, (0.0, math.inf), "contact damping c, closed contact only", "N m s/rad"
)

GAP = ForceLaw(
    name="gap",
    parameters=(
        _STIFFNESS,
        Parameter("clearance", "m", 0.002, (0.0, math.inf), "free travel to each side", "rad"),
        _DAMPING,
        Parameter("offset", "m", 0.0, (-math.inf, math.inf), "centre of the clearance", "rad"),
    ),
    force=force,
    equation="f = k ds(q - offset) + c v in contact (never pulling), ds(u) = sign(u) max(|u| - clearance, 0)",
    reference="Tasbihgoo 2006, section 2.2.2 and appendix B.1",
    smoothness="continuous",
)

ASYMMETRIC_GAP = ForceLaw(
    name="asymmetric_gap",
    parameters=(
        Parameter(
            "stiffness_positive", "N/m", 10000.0, (0.0, math.inf), "contact stiffness for q > 0", "N m/rad"
        ),
        Parameter(
            "stiffness_negative", "N/m", 5000.0, (0.0, math.inf), "contact stiffness for q < 0", "N m/rad"
        ),
        Parameter("clearance_positive", "m", 0.002, (0.0, math.inf), "free travel for q > 0", "rad"),
        Parameter("clearance_negative", "m", 0.003, (0.0, math.inf), "free travel for q < 0", "rad"),
        _DAMPING,
    ),
    force=force_asymmetric,
    equation="f = k+ (q - d+) for q > d+, k- (q + d-) for q < -d-, else 0; + c v in contact (never pulling)",
    reference="Tasbihgoo 2006, section 2.2.2, with two different springs",
    smoothness="continuous",
)

ONE_SIDED_STOP = ForceLaw(
    name="one_sided_stop",
    parameters=(
        _STIFFNESS,
        Parameter("position", "m", 0.002, (-math.inf, math.inf), "where contact begins", "rad"),
        _DAMPING,
        Parameter("side", "1", 1.0, (-1.0, 1.0), "+1: contact above the position, -1: below it"),
    ),
    force=force_one_sided,
    equation="f = s max(k p + c p', 0) for p = s (q - position) > 0, else 0; s = side",
    reference="Brogliato 2016, Nonsmooth Mechanics, ch. 2 (compliant unilateral contact)",
    smoothness="continuous",
)
