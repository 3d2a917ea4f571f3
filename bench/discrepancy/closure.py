"""Nonparametric closures: what an effect outside the catalogue looks like, and how far a free model of it gets.

A closure is an effect like any other, except that its law promises nothing: a polynomial surface in displacement and
velocity, a stiffness modulated in time. They are fitted on top of the best catalogued explanation, by the same fits,
and serve only to state how much of the gap a free model closes and what the missing force looks like.
"""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.effect import Effect, FreeParameter, Scales, Values
from bench.laws.base import ForceLaw, Parameter, kernel

POWERS = ((0, 0), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (5, 0), (4, 1), (0, 5))
"""Powers of displacement and velocity of the surface; (1, 0) and (0, 1) are the nominal stiffness and damping."""

CYCLES = tuple(math.log(c) for c in np.arange(1.0, 240.0, 0.8))
"""Logarithms of the cycles a record at which a modulation is looked for; a record resolves about one cycle."""


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


@kernel
def modulated_force(t, q, v, z, theta, f):
    """``f = k (1 + a cos(w t + phi)) q - k q``, in cosine and sine parts."""
    f[0] += (theta[0] * math.cos(theta[2] * t) + theta[1] * math.sin(theta[2] * t)) * q[0]


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
_MODULATED = ForceLaw(
    "modulated_stiffness",
    (
        Parameter("cosine", "N/m", 1.0, rotational="N m/rad"),
        Parameter("sine", "N/m", 0.0, rotational="N m/rad"),
        Parameter("omega", "rad/s", 1.0),
    ),
    modulated_force,
    equation="f = (a cos(w t) + b sin(w t)) q",
)


def _surface_theta(values: Values, scales: Scales) -> Values:
    return np.concatenate([[scales.position, scales.velocity], values])


def _modulated_theta(values: Values, scales: Scales) -> Values:
    return np.array([values[0], values[1], 2.0 * np.pi * values[2]])


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
    Effect(
        "modulated_stiffness",
        "closure",
        "joint",
        (
            FreeParameter("cosine", "stiffness", signed=True, std=0.5),
            FreeParameter("sine", "stiffness", signed=True, std=0.5),
            FreeParameter(
                "frequency", "1/duration", mean=math.log(20.0), std=1.5, bounds=(-1.0, 8.0), grid=CYCLES
            ),
        ),
        _MODULATED.equation,
        law=_MODULATED,
        theta=_modulated_theta,
        n_linear=2,
    ),
)
