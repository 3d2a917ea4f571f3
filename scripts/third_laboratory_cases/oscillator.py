"""Time stepping of an oscillator with one degree of freedom: drift, kick, drift, with dry friction as a proximal step.

A step drifts for half of it, changes the velocity at once (damping by the trapezoidal rule, dry friction implicitly, so that a contact
sticks with a velocity of exactly zero), and drifts for the other half. Other forces that depend on the velocity take that at the start
of the step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from bench.arrays import Array

inlined: Any = numba.njit(error_model="numpy", nogil=True, forceinline=True)
compiled: Any = numba.njit(cache=True, error_model="numpy", nogil=True)


class Oscillator(NamedTuple):
    """Properties of an oscillator, in units of a translation; where it turns, read rad for m, N m for N and kg m^2 for kg.

    Those from `friction` on are what a nominal model may miss.
    """

    mass: float
    """Mass [kg], that of the small resonator included."""
    damping: float
    """Viscous damping [N s/m]."""
    stiffness: float
    """Stiffness [N/m]."""
    friction: float = 0.0
    """Coulomb friction [N]."""
    scheduled_friction: float = 0.0
    """Coulomb friction [N] for one unit of the scheduling signal."""
    stop_above: float = 0.0
    """Stiffness [N/m] of a stop on the positive side."""
    scheduled_stop: float = 0.0
    """Stiffness [N/m] of that stop for one unit of the scheduling signal."""
    gap_above: float = 0.0
    """Displacement [m] from which it is touched."""
    stop_below: float = 0.0
    """Stiffness [N/m] of a stop on the negative side."""
    gap_below: float = 0.0
    """Displacement [m], without its sign, from which it is touched."""
    quadratic_damping: float = 0.0
    """Coefficient of v |v| [N s^2/m^2]."""
    eddy_drag: float = 0.0
    """Largest drag of an eddy-current brake [N]."""
    eddy_velocity: float = 1.0
    """Velocity [m/s] at which the drag is largest."""


class Background(NamedTuple):
    """Small physics that no nominal model has."""

    resonator: float = 0.0
    """Part of the mass that is mounted on the rest by a spring and a dashpot, as a fraction of it."""
    resonator_frequency: float = 1.0
    """Natural frequency of that part on the blocked rest [Hz]."""
    resonator_ratio: float = 0.0
    """Its damping ratio."""
    swing: float = 0.0
    """Amplitude of a slow swing of the stiffness, as a fraction of it."""
    swing_frequency: float = 0.0
    """Frequency of that swing [Hz]."""
    stroke_friction: float = 0.0
    """Mean of a dry friction [N] that varies along the stroke between zero and twice as much."""
    stroke_period: float = 1.0
    """Period of that variation [m]."""


class Motion(NamedTuple):
    """Motion of an oscillator at each step, each (n,)."""

    displacement: Array
    velocity: Array


def scaled(background: Background, factor: float) -> Background:
    """A background of another size."""
    return background._replace(
        resonator=background.resonator * factor,
        swing=background.swing * factor,
        stroke_friction=background.stroke_friction * factor,
    )


@inlined
def missing_force(p: Oscillator, schedule: float, x: float, v: float) -> float:
    """Force [N] against the motion, beside spring, dashpot and dry friction."""
    f = 0.0
    if x > p.gap_above:
        f = (p.stop_above + p.scheduled_stop * schedule) * (x - p.gap_above)
    elif x < -p.gap_below:
        f = p.stop_below * (x + p.gap_below)
    ratio = v / p.eddy_velocity
    return f + p.quadratic_damping * v * abs(v) + 2.0 * p.eddy_drag * ratio / (1.0 + ratio * ratio)


@inlined
def friction_limit(p: Oscillator, b: Background, schedule: float, x: float) -> float:
    """Largest dry friction [N]."""
    along = b.stroke_friction * (1.0 + np.cos(2.0 * np.pi * x / b.stroke_period))
    return along + p.friction + p.scheduled_friction * schedule


@inlined
def proximal(v: float, most: float) -> float:
    """A velocity less what friction takes of it, at most `most`; zero where that holds."""
    if v > most:
        return v - most
    if v < -most:
        return v + most
    return 0.0


@compiled
def march(p: Oscillator, b: Background, load: Array, schedule: Array, h: float, start: float) -> Motion:
    """Motion of an oscillator that is released at rest.

    Args:
        p: Its properties.
        b: Its background.
        load: Force on it [N] at each step, linear between them (n,).
        schedule: Scheduling signal at each step (n,).
        h: Step [s].
        start: Displacement [m] from which it is released.
    """
    n = len(load)
    xs, vs = np.zeros(n), np.zeros(n)
    x: float = start
    v: float = 0.0
    y: float = start  # y and u: of the resonator
    u: float = 0.0
    xs[0] = start
    omega = 2.0 * np.pi * b.resonator_frequency
    small = b.resonator * p.mass
    mass = p.mass - small
    divisor = mass + 0.5 * h * p.damping
    for i in range(n - 1):
        x += 0.5 * h * v
        swing = b.swing * np.sin(2.0 * np.pi * b.swing_frequency * (i + 0.5) * h + 0.7)
        force = 0.5 * (load[i] + load[i + 1]) - p.stiffness * (1.0 + swing) * x
        force -= missing_force(p, schedule[i], x, v)
        if small > 0.0:
            y += 0.5 * h * u
            pull = small * omega**2 * (y - x) + 2.0 * b.resonator_ratio * small * omega * (u - v)
            force += pull
            u -= h * pull / small
            y += 0.5 * h * u
        free = ((mass - 0.5 * h * p.damping) * v + h * force) / divisor
        v = proximal(free, h * friction_limit(p, b, schedule[i], x) / divisor)
        x += 0.5 * h * v
        xs[i + 1], vs[i + 1] = x, v
    return Motion(xs, vs)
