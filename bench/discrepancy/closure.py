"""Nonparametric closures: what an effect outside the catalogue looks like, and how far a free model of it gets.

A closure is an effect like any other, except that its law promises nothing: a polynomial surface in displacement and
velocity. It is fitted on top of the best catalogued explanation, by the same fits, and serves only to state how much of
the gap a free model closes and what the missing force looks like. It knows no effect in particular, and nothing of time:
a force that depends on the clock stays outside it, and the gap then says so.
"""

from __future__ import annotations

import numpy as np

from bench.discrepancy.effect import Effect, FreeParameter, Scales, Values
from bench.laws.base import ForceLaw, Parameter, kernel

POWERS = ((0, 0), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (5, 0), (4, 1), (0, 5))
"""Powers of displacement and velocity of the surface; (1, 0) and (0, 1) are the nominal stiffness and damping."""


@kernel
def surface_force(t, q, v, z, theta, f):
    """``f = sum c_ij x^i v^j`` over the powers of `POWERS`, x and v scaled by the first two parameters."""
    x = q[0] / theta[0]
    y = v[0] / theta[1]
    x2 = x * x
    y2 = y * y
    f[0] += (
        theta[2]
        + theta[3] * x2
        + theta[4] * x * y
        + theta[5] * y2
        + theta[6] * x2 * x
        + theta[7] * x2 * y
        + theta[8] * x * y2
        + theta[9] * y2 * y
        + theta[10] * x2 * x2 * x
        + theta[11] * x2 * x2 * y
        + theta[12] * y2 * y2 * y
    )


_SURFACE = ForceLaw(
    "polynomial_surface",
    (
        Parameter("position_scale", "m", 1.0, rotational="rad"),
        Parameter("velocity_scale", "m/s", 1.0, rotational="rad/s"),
        *(Parameter(f"c{i}{j}", "N", 0.0, rotational="N m") for i, j in POWERS),
    ),
    surface_force,
    equation="f = sum c_ij (q/Q)^i (v/V)^j",
)


def _surface_theta(values: Values, scales: Scales) -> Values:
    return np.concatenate([[scales.position, scales.velocity], values])


CLOSURES = (
    Effect(
        "polynomial_surface",
        "closure",
        "joint",
        tuple(FreeParameter(f"c{i}{j}", "force", signed=True, std=1.0) for i, j in POWERS),
        _SURFACE.equation,
        law=_SURFACE,
        theta=_surface_theta,
        n_linear=len(POWERS),
    ),
)
