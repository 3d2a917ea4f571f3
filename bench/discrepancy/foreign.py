"""Effects that stand in no catalogue: what the blind protocol withholds so that *unknown* can be put to the test."""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.effect import Effect, FreeParameter, Scales, Values
from bench.laws.base import ForceLaw, Parameter, kernel

CYCLES = tuple(math.log(c) for c in np.arange(1.0, 240.0, 0.8))
"""Logarithms of the cycles a record at which a modulation is looked for; a record resolves about one cycle."""


@kernel
def modulated_force(t, q, v, z, theta, f):
    """``f = k (1 + a cos(w t + phi)) q - k q``, in cosine and sine parts."""
    f[0] += (theta[0] * math.cos(theta[2] * t) + theta[1] * math.sin(theta[2] * t)) * q[0]


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


def _modulated_theta(values: Values, scales: Scales) -> Values:
    return np.array([values[0], values[1], 2.0 * np.pi * values[2]])


FOREIGN = (
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
