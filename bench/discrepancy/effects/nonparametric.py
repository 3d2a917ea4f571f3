"""Nonparametric closures: what an effect outside the catalogue looks like, and how far a free model of it gets.

A closure is an effect like any other, except that its law promises nothing: a polynomial surface in displacement and
velocity, any force of the displacement, of the velocity or of both, any linear memory. It is fitted on top of the best catalogued
explanation or in its place, by the same fits, and serves only to state how much of the gap a free model closes and what the missing force
looks like. Beyond the motion it was fitted to it stays what it is at the edge: a polynomial that is followed out there throws a
free run off. It knows no effect in particular, and nothing of time: a force that depends on the clock stays outside it,
and the gap then says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numba
import numpy as np

from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values
from bench.discrepancy.numerics.cubic_spline import cubic, piece, spline_weights
from bench.laws.base import ForceLaw, Parameter, kernel

_inline: Any = numba.njit(error_model="numpy", nogil=True, forceinline=True)

POWERS = ((0, 0), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (5, 0), (4, 1), (0, 5))
"""Powers of displacement and velocity of the surface; (1, 0) and (0, 1) are the nominal stiffness and damping."""


class NonparametricLimits(NamedTuple):
    """Numbers of `bench.discrepancy.effects.nonparametric` that compiled code holds."""

    spans: int = 30
    """Pieces of a force of one variable."""
    warp: float = 2.0


NONPARAMETRIC_LIMITS = NonparametricLimits()
WARPED = math.sinh(NONPARAMETRIC_LIMITS.warp)
"""How much shorter they are about rest, where gaps, friction and snaps happen: equal steps of asinh(WARPED x) / WARP."""
PATCHES = (10, 14)
"""Pieces of a force of displacement and velocity along either."""


@dataclass(frozen=True)
class NonparametricSettings:
    """Numbers of `bench.discrepancy.effects.nonparametric`."""

    modes: int = 48
    """Independent shapes, at most, that a smooth surface is made of: the likeliest ones of its prior."""
    jitter: float = 1e-6
    """Part of a smooth curve's variance that is independent from value to value, so that rounding leaves it a covariance."""


SETTINGS = NonparametricSettings()
MEMORY = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Relaxation times of a free linear memory, by the time of one radian of the motion."""


@kernel
def surface_force(t, q, v, z, theta, f):
    """``f = sum c_ij x^i v^j`` over the powers of `POWERS`, x and v scaled by the first two parameters."""
    x = min(max(q[0] / theta[0], -1.0), 1.0)
    y = min(max(v[0] / theta[1], -1.0), 1.0)
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


@_inline
def _warped(x, pieces):
    """Place on a spline whose pieces are shorter about rest, counted from 0 to `pieces`."""
    a = abs(x) * WARPED
    # asinh, which the C library takes twice as long over
    return (
        0.5
        * pieces
        * (1.0 + math.copysign(math.log(a + math.sqrt(1.0 + a * a)), x) / NONPARAMETRIC_LIMITS.warp)
    )


@kernel
def curve_force(t, q, v, z, theta, f):
    """A force of one variable from -1 to 1: a cubic spline of `spans` pieces, shorter about rest, by its B-spline coefficients."""
    x = min(max(q[0] * theta[0] + v[0] * theta[1], -1.0), 1.0)
    f[0] += cubic(theta, 2, NONPARAMETRIC_LIMITS.spans, _warped(x, NONPARAMETRIC_LIMITS.spans))


_CURVE = ForceLaw(
    "free_curve",
    (
        Parameter("per_position", "1/m", 1.0, rotational="1/rad"),
        Parameter("per_velocity", "s/m", 0.0, rotational="s/rad"),
        *(Parameter(f"f{k}", "N", 0.0, rotational="N m") for k in range(NONPARAMETRIC_LIMITS.spans + 3)),
    ),
    curve_force,
    equation="f = cubic spline of coefficients f_k over q/Q, or over v/V",
)


@kernel
def memory_force(t, q, v, z, theta, f):
    """``f = sum c_i z_i``."""
    for i in range(len(MEMORY)):
        f[0] += theta[2 + i] * z[i]


@kernel
def memory_rate(t, q, v, z, theta, zdot):
    """``z_i' = (v/V - z_i) / tau_i``, the times spread over decades about that of one radian of the motion."""
    for i in range(len(MEMORY)):
        zdot[i] = (v[0] / theta[0] - z[i]) / (MEMORY[i] * theta[1])


@kernel
def patch_force(t, q, v, z, theta, f):
    """A force of displacement and velocity: bicubic spline of `PATCHES` by its B-spline coefficients, the velocity's shorter about rest."""
    u = 0.5 * PATCHES[0] * (1.0 + min(max(q[0] * theta[0], -1.0), 1.0))
    y = min(max(v[0] * theta[1], -1.0), 1.0)
    w = _warped(y, PATCHES[1])
    i, j = piece(u, PATCHES[0]), piece(w, PATCHES[1])
    along, across = spline_weights(u - i), spline_weights(w - j)
    for a in range(4):
        k = 2 + (i + a) * (PATCHES[1] + 3) + j
        row = (
            across[0] * theta[k]
            + across[1] * theta[k + 1]
            + across[2] * theta[k + 2]
            + across[3] * theta[k + 3]
        )
        f[0] += along[a] * row / 36.0


_PATCH = ForceLaw(
    "free_surface",
    (
        Parameter("per_position", "1/m", 1.0, rotational="1/rad"),
        Parameter("per_velocity", "s/m", 1.0, rotational="s/rad"),
        *(
            Parameter(f"f{i}_{j}", "N", 0.0, rotational="N m")
            for i in range(PATCHES[0] + 3)
            for j in range(PATCHES[1] + 3)
        ),
    ),
    patch_force,
    equation="f = bicubic spline of coefficients f_ij over q/Q and v/V",
)
_MEMORY = ForceLaw(
    "free_memory",
    (
        Parameter("velocity_scale", "m/s", 1.0, rotational="rad/s"),
        Parameter("time_scale", "s", 1.0, (1e-12, math.inf)),
        *(Parameter(f"c{i}", "N", 0.0, rotational="N m") for i in range(len(MEMORY))),
    ),
    memory_force,
    memory_rate,
    tuple(f"z{i} [1]" for i in range(len(MEMORY))),
    equation="f = sum c_i z_i, z_i' = (v/V - z_i) / tau_i",
)


def _surface_theta(values: Values, scales: Scales) -> Values:
    return np.concatenate([[scales.position, scales.velocity], values])


def _over_position(values: Values, scales: Scales) -> Values:
    return np.concatenate([[1.0 / scales.position, 0.0], values])


def _over_velocity(values: Values, scales: Scales) -> Values:
    return np.concatenate([[0.0, 1.0 / scales.velocity], values])


def _over_both(values: Values, scales: Scales) -> Values:
    return np.concatenate([[1.0 / scales.position, 1.0 / scales.velocity], values])


def _memory_theta(values: Values, scales: Scales) -> Values:
    return np.concatenate([[scales.velocity, scales.position / scales.velocity], values])


def _closure(
    name: str, law: ForceLaw, coefficients: Sequence[str], theta: Callable[[Values, Scales], Values]
) -> Effect:
    """A closure that is linear in its coefficients, forces all of them."""
    return Effect(
        name, "closure", "joint", tuple(FreeParameter(c, "force", signed=True, std=1.0) for c in coefficients), law.equation,
        law=law, theta=theta, n_linear=len(coefficients),
    )  # fmt: skip


_KNOTS = [f"f{k}" for k in range(NONPARAMETRIC_LIMITS.spans + 3)]
FREE_DISPLACEMENT = _closure("free_displacement", _CURVE, _KNOTS, _over_position)
FREE_VELOCITY = _closure("free_velocity", _CURVE, _KNOTS, _over_velocity)
FREE_SURFACE = _closure("free_surface", _PATCH, [p.name for p in _PATCH.parameters[2:]], _over_both)
FREE_MEMORY = _closure("free_memory", _MEMORY, [f"c{i}" for i in range(len(MEMORY))], _memory_theta)


def smoothing(length: float) -> Values:
    """What makes the coefficients of a smooth curve (n, n) out of independent ones of unit deviation.

    Args:
        length: Distance within which the curve keeps its course, over its reach.
    """
    middles = np.sinh(NONPARAMETRIC_LIMITS.warp * _middles(NONPARAMETRIC_LIMITS.spans)) / WARPED
    covariance = _covariance(middles, length)
    return np.asarray(
        np.linalg.cholesky(covariance + SETTINGS.jitter * np.eye(len(middles))), dtype=np.float64
    )


def smoothing_both(along: float, across: float) -> Values:
    """What makes the coefficients of a smooth surface (n, k) out of `modes` independent ones of unit deviation, or fewer.

    Args:
        along: Distance of displacements within which the surface keeps its course, over its reach.
        across: The same of velocities, on their scale that is finer about rest.
    """
    parts = [
        np.linalg.eigh(_covariance(_middles(n), length))
        for n, length in zip(PATCHES, (along, across), strict=True)
    ]
    powers = np.maximum(np.outer(parts[0][0], parts[1][0]), 0.0).ravel()
    shapes = np.kron(parts[0][1], parts[1][1])
    kept = np.argsort(-powers)[: SETTINGS.modes]
    kept = kept[powers[kept] > SETTINGS.jitter * powers.max()]
    return np.asarray(shapes[:, kept] * np.sqrt(powers[kept]), dtype=np.float64)


def _middles(pieces: int) -> Values:
    """Where the B-splines of so many pieces stand, on the scale on which these are equal."""
    return np.linspace(-1.0 - 2.0 / pieces, 1.0 + 2.0 / pieces, pieces + 3)


def _covariance(middles: Values, length: float) -> Values:
    return np.exp(-0.5 * ((middles[:, None] - middles) / length) ** 2)


def mixed(closure: Effect, mixing: Values) -> Effect:
    """A closure whose coefficients (n,) are mixed of independent ones (k,) by (n, k): a prior that knows of neighbours."""
    inner, count = closure.theta, mixing.shape[1]
    assert inner is not None
    return replace(
        closure,
        parameters=closure.parameters[:count],
        n_linear=count,
        theta=lambda values, scales: inner(mixing @ values, scales),
    )


CLOSURES = (
    _closure("polynomial_surface", _SURFACE, [f"c{i}{j}" for i, j in POWERS], _surface_theta),
    FREE_DISPLACEMENT,
    FREE_VELOCITY,
    FREE_MEMORY,
)
