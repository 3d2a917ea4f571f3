"""Time stepping of a frame of two storeys, the upper one with a weak hidden mode: the classical Runge-Kutta method of fourth order."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from third_laboratory_cases.oscillator import compiled, inlined

from bench.arrays import Array


class Frame(NamedTuple):
    """The frame as a nominal model has it; the lower storey stands on the ground, the upper one on the lower."""

    mass_1: float
    """Mass of the lower storey [kg]."""
    mass_2: float
    """Mass of the upper storey [kg], that of the hidden mode included."""
    stiffness_1: float
    """Stiffness below the lower storey [N/m]."""
    stiffness_2: float
    """Stiffness below the upper storey [N/m]."""
    damping_1: float
    """Viscous damping below the lower storey [N s/m]."""
    damping_2: float
    """Viscous damping below the upper storey [N s/m]."""


class Background(NamedTuple):
    """Small physics that no nominal model has."""

    hidden: float = 0.0
    """Part of the upper mass [kg] that is mounted on the rest by a spring and a dashpot."""
    hidden_frequency: float = 1.0
    """Natural frequency of that part on the blocked rest [Hz]."""
    hidden_ratio: float = 0.0
    """Its damping ratio."""
    friction_1: float = 0.0
    """Mean of a dry friction [N] below the lower storey that varies along the stroke by 40 %."""
    friction_2: float = 0.0
    """Dry friction [N] below the upper storey."""
    creep: float = 1.0
    """Velocity [m/s] over which both change their sign."""
    drift: float = 0.0
    """Relative change a second [1/s] of the stiffness below the lower storey."""


class State(NamedTuple):
    """Displacements of both storeys and of the hidden mode, with their velocities, or a derivative of them."""

    x_1: float
    x_2: float
    y: float
    v_1: float
    v_2: float
    w: float


class Motion(NamedTuple):
    """Motion of the frame at each step, each (n,)."""

    displacement_1: Array
    displacement_2: Array
    acceleration_1: Array
    acceleration_2: Array


STROKE = 4e-4
"""Displacement [m] over which the friction of the lower storey varies by one radian."""


@inlined
def derivative(p: Frame, b: Background, s: State, load: float, t: float) -> State:
    """Time derivative of the state under a load [N] on the lower storey."""
    below = load - p.stiffness_1 * (1 + b.drift * t) * s.x_1 - p.damping_1 * s.v_1
    between = p.stiffness_2 * (s.x_2 - s.x_1) + p.damping_2 * (s.v_2 - s.v_1)
    friction_1 = b.friction_1 * (1 + 0.4 * math.sin(s.x_1 / STROKE)) * math.tanh(s.v_1 / b.creep)
    friction_2 = b.friction_2 * math.tanh((s.v_2 - s.v_1) / b.creep)
    omega = 2 * np.pi * b.hidden_frequency
    pull = b.hidden * (omega * omega * (s.y - s.x_2) + 2 * b.hidden_ratio * omega * (s.w - s.v_2))
    a_1 = (below + between - friction_1 + friction_2) / p.mass_1
    a_2 = (-between - friction_2 + pull) / (p.mass_2 - b.hidden)
    return State(s.v_1, s.v_2, s.w, a_1, a_2, -pull / b.hidden if b.hidden > 0 else 0.0)


@inlined
def moved(s: State, h: float, d: State) -> State:
    """A state after some time [s] with a derivative."""
    return State(
        s.x_1 + h * d.x_1,
        s.x_2 + h * d.x_2,
        s.y + h * d.y,
        s.v_1 + h * d.v_1,
        s.v_2 + h * d.v_2,
        s.w + h * d.w,
    )


@inlined
def weighted(d_1: State, d_2: State, d_3: State, d_4: State) -> State:
    """Six times the mean derivative of a step, from those of its four stages."""
    return State(
        d_1.x_1 + 2 * d_2.x_1 + 2 * d_3.x_1 + d_4.x_1,
        d_1.x_2 + 2 * d_2.x_2 + 2 * d_3.x_2 + d_4.x_2,
        d_1.y + 2 * d_2.y + 2 * d_3.y + d_4.y,
        d_1.v_1 + 2 * d_2.v_1 + 2 * d_3.v_1 + d_4.v_1,
        d_1.v_2 + 2 * d_2.v_2 + 2 * d_3.v_2 + d_4.v_2,
        d_1.w + 2 * d_2.w + 2 * d_3.w + d_4.w,
    )


@compiled
def march(p: Frame, b: Background, load: Array, h: float) -> Motion:
    """Motion of a frame from rest.

    Args:
        p: The frame.
        b: Its background.
        load: Force on the lower storey [N] at each half step (2 n - 1,).
        h: Step [s].
    """
    n = len(load) // 2 + 1
    x_1, x_2, a_1, a_2 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    s = State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        t, j = i * h, 2 * i
        d_1 = derivative(p, b, s, load[j], t)
        x_1[i], x_2[i], a_1[i], a_2[i] = s.x_1, s.x_2, d_1.v_1, d_1.v_2
        if i == n - 1:
            break
        d_2 = derivative(p, b, moved(s, h / 2, d_1), load[j + 1], t + h / 2)
        d_3 = derivative(p, b, moved(s, h / 2, d_2), load[j + 1], t + h / 2)
        d_4 = derivative(p, b, moved(s, h, d_3), load[j + 2], t + h)
        s = moved(s, h / 6, weighted(d_1, d_2, d_3, d_4))
    return Motion(x_1, x_2, a_1, a_2)
