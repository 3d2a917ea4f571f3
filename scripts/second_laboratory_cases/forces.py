"""Compiled laws of force of the second laboratory: restoring forces, damping, dry friction, and elements with a memory.

They are compiled into the loops of `time_stepping`, whose machine code Numba keeps until that file changes: after a change of this one,
delete ``__pycache__`` beside it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from second_laboratory_cases.properties import Properties

TURN = 6.283185307
"""2 pi to ten digits, as the cases were first written with it: with all its digits, the last printed digits would differ."""
inlined: Any = numba.njit(error_model="numpy", nogil=True, forceinline=True)
compiled: Any = numba.njit(cache=True, error_model="numpy", nogil=True)


class Memory(NamedTuple):
    """States of the elements with a memory."""

    bouc_wen: float
    """Force of the Bouc-Wen element [N]."""
    dahl: float
    """Deflection of the bristle of Dahl friction [m]."""
    maxwell: float
    """Deflection of the spring of the Maxwell element [m]."""


@inlined
def restoring(p: Properties, x: float, t: float) -> float:
    """Force [N] that resists a displacement [m] at a time [s], without elements with a memory."""
    k = p.stiffness
    if p.parametric_stiffness != 0.0:
        k += p.parametric_stiffness * np.sin(TURN * p.parametric_frequency * t + p.parametric_phase)
    if p.swing_stiffness != 0.0:
        k += p.swing_stiffness * np.sin(TURN * p.swing_frequency * t)
    f = k * x + p.cubic_stiffness * x * x * x
    if p.stop_stiffness > 0.0:
        if x > p.gap_above:
            f += p.stop_stiffness * (x - p.gap_above)
        elif x < -p.gap_below:
            f += p.stop_stiffness * (x + p.gap_below)
    if p.cogging != 0.0:
        f += p.cogging * np.sin(TURN * x / p.cogging_pitch + p.cogging_phase)
    if p.gravity_torque != 0.0:
        f += p.gravity_torque * np.sin(x)
    return f


@inlined
def secant_damping(p: Properties, x: float, v: float) -> float:
    """The damping force over the velocity [N s/m], without dry friction."""
    c = p.damping + p.quadratic_damping * abs(v) + p.metered_damping * x * x
    if (
        p.power_damping > 0.0
    ):  # rounded off below 1e-5 m/s, where the secant of an exponent below one has no bound
        c += p.power_damping * (v * v + 1e-10) ** (0.5 * (p.power_exponent - 1.0))
    if v > 0.0:
        c += p.damping_asymmetry
    elif v < 0.0:
        c -= p.damping_asymmetry
    if p.stop_damping > 0.0 and x > p.gap_above:
        c += p.stop_damping
    return c


@inlined
def friction_limit(p: Properties, x: float, v: float) -> float:
    """Largest dry friction [N] at a displacement and a velocity."""
    limit = p.coulomb
    if p.stribeck_excess != 0.0:
        limit *= 1.0 + p.stribeck_excess * np.exp(-((v / p.stribeck_velocity) ** 2))
    if p.stroke_friction != 0.0:
        limit += p.stroke_friction * 0.5 * (1.0 + np.sin(TURN * x / p.stroke_period))
    return limit + p.friction_per_deflection * abs(x)


@inlined
def harmonic(p: Properties, t: float) -> float:
    """The harmonic force [N] that nobody measures."""
    if p.harmonic_force == 0.0:
        return 0.0
    return p.harmonic_force * np.sin(TURN * p.harmonic_frequency * t + p.harmonic_phase)


@inlined
def bouc_wen_rate(p: Properties, z: float, v: float) -> float:
    """Rate of the force of the Bouc-Wen element (Wen 1976): A v - beta |v| |z|^(n-1) z - gamma v |z|^n."""
    a, n = abs(z), p.bouc_wen_exponent
    return (
        p.bouc_wen_stiffness * v - p.bouc_wen_beta * abs(v) * a ** (n - 1.0) * z - p.bouc_wen_gamma * v * a**n
    )


@inlined
def dahl_rate(p: Properties, y: float, v: float) -> float:
    """Rate of the deflection of the bristle (Dahl 1968): v - (k / F) |v| y."""
    return v - p.dahl_stiffness * abs(v) * y / p.dahl_force


@inlined
def memory_at_middle(p: Properties, memory: Memory, v: float, h: float) -> Memory:
    """States half a step [s] later, by an explicit Euler step at a velocity."""
    z, y, w = memory
    if p.bouc_wen_stiffness > 0.0:
        z += 0.5 * h * bouc_wen_rate(p, z, v)
    if p.dahl_stiffness > 0.0:
        y += 0.5 * h * dahl_rate(p, y, v)
    if p.relaxing_stiffness > 0.0:
        w += 0.5 * h * (v - w / p.relaxation_time)
    return Memory(z, y, w)


@inlined
def memory_at_end(p: Properties, memory: Memory, middle: Memory, v: float, h: float) -> Memory:
    """States a whole step later: by the midpoint rule, and of the Maxwell element exactly for a constant velocity."""
    z, y, w = memory
    if p.bouc_wen_stiffness > 0.0:
        z += h * bouc_wen_rate(p, middle.bouc_wen, v)
    if p.dahl_stiffness > 0.0:
        y += h * dahl_rate(p, middle.dahl, v)
    if p.relaxing_stiffness > 0.0:
        kept = np.exp(-h / p.relaxation_time)
        w = w * kept + p.relaxation_time * (1.0 - kept) * v
    return Memory(z, y, w)
