"""Compiled hysteresis: the Bouc-Wen element and the flag-shaped loop of superelastic wire."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.oscillator import compiled, inlined


class Loop(NamedTuple):
    """Shape of the loop of a Bouc-Wen element."""

    yielding: float
    """Displacement [m] after which it yields."""
    beta: float
    """Weight of the term whose sign follows that of the motion; gamma is one less it."""
    exponent: float
    """The exponent n."""


class Flag(NamedTuple):
    """Shape of a re-centring loop."""

    stiffness: float
    """Stiffness before the plateau [N/m]."""
    upper: float
    """Force at which the upper plateau begins [N]."""
    lower: float
    """Force at which the lower plateau ends [N]."""
    hardening: float
    """Stiffness on the plateaus, as a fraction of that before."""


@inlined
def deflected(loop: Loop, z: float, dx: float) -> float:
    """Hysteretic deflection [m] after a motion [m], by an explicit step: dz = dx (1 - (beta sgn(z dx) + gamma) |z / x_y|^n)."""
    sign = 1.0 if dx * z > 0.0 else -1.0
    return z + dx * (1.0 - (loop.beta * sign + 1.0 - loop.beta) * (abs(z) / loop.yielding) ** loop.exponent)


@compiled
def bouc_wen(loop: Loop, x: Array) -> Array:
    """Force of a Bouc-Wen element of unit yield force (n,) along a motion [m] (n,)."""
    out = np.zeros(len(x))
    z = 0.0
    for i in range(1, len(x)):
        z = deflected(loop, z, x[i] - x[i - 1])
        out[i] = z / loop.yielding
    return out


@compiled
def flag_shaped(flag: Flag, x: Array) -> Array:
    """Force of superelastic wire [N] along a motion [m] from rest, (n,): elastic within two plateaus, the same on both sides."""
    out = np.zeros(len(x))
    f = before = 0.0
    for i in range(len(x)):
        far, sign = abs(x[i]), 1.0 if x[i] >= 0.0 else -1.0
        most = flag.upper + flag.hardening * (flag.stiffness * far - flag.upper)
        least = flag.lower + flag.hardening * (flag.stiffness * far - flag.lower)
        elastic = sign * (f + flag.stiffness * (x[i] - before))
        most, least = min(flag.stiffness * far, most), min(flag.stiffness * far, least)
        f = sign * min(max(elastic, least), most)
        out[i], before = f, x[i]
    return out
