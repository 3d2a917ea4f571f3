"""Force of a specimen in a testing machine that prescribes the motion: spring, dashpot, friction and a Bouc-Wen element in parallel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from third_laboratory_cases.oscillator import compiled, inlined

from bench.arrays import Array


class Isolator(NamedTuple):
    """A specimen; the last four, of its Bouc-Wen element, are what a nominal model may miss."""

    stiffness: float
    """Stiffness [N/m]."""
    damping: float
    """Viscous damping [N s/m]."""
    friction: float
    """Coulomb friction [N]."""
    slip_stiffness: float = 0.0
    """Stiffness A of the element where it is at rest [N/m]; zero for no element."""
    slip_limit: float = 1.0
    """Force [N] that it nears."""
    slip_exponent: float = 1.0
    """Its exponent n."""
    slip_skew: float = 0.0
    """Its gamma over its beta."""


class Background(NamedTuple):
    """Small physics of specimen and machine that no nominal model has."""

    compliance: float = 0.0
    """Compliance of the frame [m/N]."""
    drift: float = 0.0
    """Relative change a second [1/s] of the stiffness."""
    variation: float = 0.0
    """Relative variation of the friction along the stroke."""
    wavelength: float = 1.0
    """Displacement [m] over which that repeats itself."""
    fixture: float = 0.0
    """Mass [kg] between specimen and load cell."""
    cell_frequency: float = 0.0
    """Natural frequency of the load cell [Hz]; zero for a rigid one."""
    cell_ratio: float = 0.0
    """Its damping ratio."""
    friction_share: float = 1.0
    """True friction over the stated one."""


CREEP = 2e-4
"""Velocity [m/s] over which the friction changes its sign."""


@inlined
def slip_rate(p: Isolator, z: float, v: float) -> float:
    """Rate [N/s] of the force z of the Bouc-Wen element at a velocity.

    References:
        Wen, Y.-K. (1976), Method for random vibration of hysteretic systems, J. Eng. Mech. Div. 102, eq. 2; beta + gamma follows from
        the limit.
    """
    both = p.slip_stiffness / p.slip_limit**p.slip_exponent
    beta = both / (1 + p.slip_skew)
    gamma = both - beta
    against = beta * abs(v) * abs(z) ** (p.slip_exponent - 1) * z
    return p.slip_stiffness * v - against - gamma * v * abs(z) ** p.slip_exponent


@compiled
def force(
    p: Isolator, b: Background, displacement: Array, velocity: Array, acceleration: Array, h: float
) -> Array:
    """Force that the load cell reads [N] at each step (n,).

    The compliance of the frame takes the force of the step before; the Bouc-Wen element is integrated by the method of Heun.

    Args:
        p: The specimen.
        b: The background.
        displacement: That the machine prescribes [m] (n,).
        velocity: Its velocity [m/s], shaped alike.
        acceleration: Its acceleration [m/s^2], shaped alike.
        h: Step [s].
    """
    n = len(displacement)
    read = np.empty(n)
    slip = acting = cell = cell_rate = 0.0
    omega = 2 * np.pi * b.cell_frequency
    for i in range(n):
        x, v = displacement[i] - b.compliance * acting, velocity[i]
        along = 1 + b.variation * math.sin(2 * math.pi * x / b.wavelength)
        friction = b.friction_share * p.friction * along * math.tanh(v / CREEP)
        acting = p.stiffness * (1 + b.drift * (i * h)) * x + p.damping * v + friction + slip
        if p.slip_stiffness > 0:
            rate = slip_rate(p, slip, v)
            slip += h / 2 * (rate + slip_rate(p, slip + h * rate, v))
        read[i] = acting + b.fixture * acceleration[i]
        if omega > 0:
            cell_rate += h * (omega**2 * (read[i] - cell) - 2 * b.cell_ratio * omega * cell_rate)
            cell += h * cell_rate
            read[i] = cell
    return read
