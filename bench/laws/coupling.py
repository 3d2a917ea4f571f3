"""Laws that couple an axial coordinate ``x = q[0]`` in m with a torsional one ``theta = q[1]`` in rad of the same joint.

- `cross_stiffness`: ``f1 = k theta``, ``f2 = k x``, one constant for both, so that the coupling has the
  potential ``k x theta`` and neither gives nor takes energy (a helix, or shear centre off the axis). Stable
  only with ``k^2 < kx ktheta`` of the joint's own springs.
- `gap_coupling`: damping in one direction that sets in when the *other* direction has gone beyond its
  clearance. This is the coupling in the dissertation's finite-element deck, from which its figures and its
  network come. Dissipative.
- `printed_coupling`: the coupling as the text prints it, ``k0x x' theta`` while |x| is beyond the clearance
  and ``k0theta theta' x`` while |theta| is. The text's sentence speaks of the displacement of the other
  direction, its formula of the same one; the formula is followed, each term acting along its own velocity.
  The terms change sign with theta and x, so the law can feed energy in, and it jumps at the clearance; it is
  kept for comparison with the printed equation.
- `axial_torsional_joint`: the deck's whole joint, spring and damper, gap and `gap_coupling` for both
  directions, in one element; the defaults are the deck's numbers converted to SI. Equal to a `linear`, a
  `gap` and a `gap_coupling` element side by side.

References:
    Tasbihgoo 2006, eqs. 4.16 and 5.54 (printed form), appendix B.1 (deck), fig. 4.5.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel

POUND_FORCE = 4.4482216152605
"""Pound-force in newton, exact by definition."""

INCH = 0.0254
"""Inch in metre, exact by definition."""


@kernel
def force_cross(t, q, v, z, theta, f):
    """``f1 = k theta``, ``f2 = k x``."""
    f[0] += theta[0] * q[1]
    f[1] += theta[0] * q[0]


@kernel
def force_gap_coupling(t, q, v, z, theta, f):
    """``f1 = c1 x' max(|theta| - d_theta, 0)``, ``f2 = c2 theta' max(|x| - d_x, 0)``."""
    f[0] += theta[0] * v[0] * max(abs(q[1]) - theta[2], 0.0)
    f[1] += theta[1] * v[1] * max(abs(q[0]) - theta[3], 0.0)


@kernel
def force_printed(t, q, v, z, theta, f):
    """``f1 = k0x x' theta`` while |x| >= d_x, ``f2 = k0theta theta' x`` while |theta| >= d_theta."""
    if abs(q[0]) >= theta[3]:
        f[0] += theta[0] * v[0] * q[1]
    if abs(q[1]) >= theta[2]:
        f[1] += theta[1] * v[1] * q[0]


@kernel
def force_joint(t, q, v, z, theta, f):
    """``f1 = k x + c x' + kg ds(x) + cc x' |ds(theta)|`` and the like for the torque."""
    beyond_x = max(abs(q[0]) - theta[3], 0.0)
    beyond_theta = max(abs(q[1]) - theta[8], 0.0)
    signed_x = beyond_x if q[0] >= 0.0 else -beyond_x
    signed_theta = beyond_theta if q[1] >= 0.0 else -beyond_theta
    f[0] += theta[0] * q[0] + theta[1] * v[0] + theta[2] * signed_x + theta[4] * v[0] * beyond_theta
    f[1] += theta[5] * q[1] + theta[6] * v[1] + theta[7] * signed_theta + theta[9] * v[1] * beyond_x


CROSS_STIFFNESS = ForceLaw(
    name="cross_stiffness",
    parameters=(
        Parameter("stiffness", "N/rad", 500.0, (-math.inf, math.inf), "axial force a radian, torque a metre"),
    ),
    force=force_cross,
    equation="f1 = k theta, f2 = k x",
    reference="Betti 1872 (reciprocity); Timoshenko 1945, J. Franklin Inst. 239 (axial and torsional coupling)",
    n_coordinates=2,
)

_CLEARANCES = (
    Parameter("clearance_torsional", "rad", 0.2, (0.0, math.inf), "d_theta"),
    Parameter("clearance_axial", "m", 0.2 * INCH, (0.0, math.inf), "d_x"),
)

GAP_COUPLING = ForceLaw(
    name="gap_coupling",
    parameters=(
        Parameter(
            "c_axial",
            "N s/(m rad)",
            500.0 * POUND_FORCE / INCH,
            (0.0, math.inf),
            "c1, axial damping beyond d_theta",
        ),
        Parameter(
            "c_torsional", "N s/rad", 500.0 * POUND_FORCE, (0.0, math.inf), "c2, torsional damping beyond d_x"
        ),
        *_CLEARANCES,
    ),
    force=force_gap_coupling,
    equation="f1 = c1 x' max(|theta| - d_theta, 0), f2 = c2 theta' max(|x| - d_x, 0)",
    reference="Tasbihgoo 2006, appendix B.1",
    n_coordinates=2,
    smoothness="continuous",
)

PRINTED_COUPLING = ForceLaw(
    name="printed_coupling",
    parameters=(
        Parameter("k0_axial", "N s/(m rad)", 500.0 * POUND_FORCE / INCH, (-math.inf, math.inf), "k0x"),
        Parameter("k0_torsional", "N s/rad", 500.0 * POUND_FORCE, (-math.inf, math.inf), "k0theta"),
        *_CLEARANCES,
    ),
    force=force_printed,
    equation="f1 = k0x x' theta for |x| >= d_x, f2 = k0theta theta' x for |theta| >= d_theta, else 0",
    reference="Tasbihgoo 2006, eqs. 4.16 and 5.54",
    n_coordinates=2,
    smoothness="discontinuous",
)

AXIAL_TORSIONAL_JOINT = ForceLaw(
    name="axial_torsional_joint",
    parameters=(
        Parameter("k_axial", "N/m", 200.0 * POUND_FORCE / INCH, (0.0, math.inf), "spring"),
        Parameter("c_axial", "N s/m", 6.32 * POUND_FORCE / INCH, (0.0, math.inf), "damper"),
        Parameter(
            "k_gap_axial", "N/m", 1800.0 * POUND_FORCE / INCH, (0.0, math.inf), "spring beyond the clearance"
        ),
        Parameter("clearance_axial", "m", 0.2 * INCH, (0.0, math.inf), "free travel to each side"),
        Parameter(
            "c_coupling_axial",
            "N s/(m rad)",
            500.0 * POUND_FORCE / INCH,
            (0.0, math.inf),
            "damping beyond d_theta",
        ),
        Parameter("k_torsional", "N m/rad", 200.0 * POUND_FORCE * INCH, (0.0, math.inf), "spring"),
        Parameter("c_torsional", "N m s/rad", 6.32 * POUND_FORCE * INCH, (0.0, math.inf), "damper"),
        Parameter(
            "k_gap_torsional",
            "N m/rad",
            1800.0 * POUND_FORCE * INCH,
            (0.0, math.inf),
            "spring beyond the clearance",
        ),
        Parameter("clearance_torsional", "rad", 0.2, (0.0, math.inf), "free travel to each side"),
        Parameter(
            "c_coupling_torsional", "N s/rad", 500.0 * POUND_FORCE, (0.0, math.inf), "damping beyond d_x"
        ),
    ),
    force=force_joint,
    equation="f1 = k x + c x' + kg ds(x) + cc x' |ds(theta)|, f2 likewise with x and theta exchanged",
    reference="Tasbihgoo 2006, appendix B.1",
    n_coordinates=2,
    smoothness="continuous",
)
