"""Time stepping of one axis with a weak hidden mode: the classical Runge-Kutta method of fourth order.

What the axis has besides its spring and dashpot is given by coefficients, all of which may act at once; one that is zero does nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from third_laboratory_cases.oscillator import compiled, inlined

from bench.arrays import Array


class Axis(NamedTuple):
    """An axis as a nominal model has it; where it turns, read rad for m, N m for N and kg m^2 for kg."""

    mass: float
    """Mass [kg], that of the hidden mode included."""
    stiffness: float
    """Stiffness [N/m]; of a pendulum weight times arm [N m]."""
    damping: float
    """Viscous damping [N s/m]."""
    hangs: bool = False
    """Whether the restoring force is that of a pendulum, as the sine of the displacement."""


class Missing(NamedTuple):
    """What an axis has and its nominal model has not."""

    jaw_stiffness: float = 0.0
    """Stiffness [N/m] of a stop on either side."""
    jaw_clearance: float = 0.0
    """Displacement [m] from the centre at which one is touched."""
    jaw_centre: float = 0.0
    """Centre of the clearance [m]."""
    jaw_ratio: float = 1.0
    """Stiffness of the lower stop over that of the upper one."""
    jaw_damping: float = 0.0
    """Viscous damping in contact [N s/m]."""
    drag: float = 0.0
    """Coefficient of v |v| [N s^2/m^2]."""
    block_stiffness: float = 0.0
    """Stiffness [N/m] of a rubber block on the negative side, where it is first touched."""
    block_clearance: float = 0.0
    """Displacement [m], without its sign, at which that is."""
    block_progression: float = 0.0
    """Relative growth of its stiffness a depth [1/m]."""
    block_damping: float = 0.0
    """Its viscous damping [N s/m]; it never pulls."""
    block_onset: float = 1.0
    """Depth [m] over which that damping sets in."""
    cubic_stiffness: float = 0.0
    """Coefficient of the cube of the displacement [N/m^3]."""
    brake_force: float = 0.0
    """Largest drag [N] of an eddy-current brake."""
    brake_velocity: float = 1.0
    """Velocity [m/s] at which that is."""
    crack_depth: float = 0.0
    """Loss of stiffness while a cracked tooth pair carries, as a fraction."""
    crack_rate: float = 0.0
    """Turns [1/s] of the wheel that carries it."""
    crack_share: float = 1.0
    """Part of a turn in which it carries."""
    crack_phase: float = 0.0
    """Turn at the start of the record, as a fraction."""
    crack_wander: float = 0.0
    """Amplitude of a slow wandering of the turn, as a fraction of one."""


class Background(NamedTuple):
    """Small physics that no nominal model has."""

    hidden: float = 0.0
    """Part of the mass that is mounted on the rest by a spring and a dashpot, as a fraction of it."""
    hidden_frequency: float = 1.0
    """Natural frequency of that part on the blocked rest [Hz]."""
    hidden_ratio: float = 0.0
    """Its damping ratio."""
    friction: float = 0.0
    """Mean of a dry friction [N] that varies along the stroke by 45 %."""
    creep: float = 1.0
    """Velocity [m/s] over which it changes its sign."""
    wavelength: float = 1.0
    """Displacement [m] over which it repeats itself."""
    drift: float = 0.0
    """Relative change of the stiffness in the end."""
    settling: float = 1.0
    """Time constant of that change [s]."""


class State(NamedTuple):
    """State of the axis (x, v) and of its hidden mode (y, w), or a derivative of it."""

    x: float
    v: float
    y: float
    w: float


@inlined
def jaw_force(m: Missing, x: float, v: float) -> float:
    """Force [N] of the stop that is touched."""
    u = x - m.jaw_centre
    if u > m.jaw_clearance:
        return m.jaw_stiffness * (u - m.jaw_clearance) + m.jaw_damping * v
    if u < -m.jaw_clearance:
        return m.jaw_stiffness * m.jaw_ratio * (u + m.jaw_clearance) + m.jaw_damping * v
    return 0.0


@inlined
def block_force(m: Missing, x: float, v: float) -> float:
    """Force [N] of the rubber block."""
    depth = -m.block_clearance - x
    if depth <= 0.0:
        return 0.0
    elastic = m.block_stiffness * depth * (1.0 + m.block_progression * depth)
    return -max(elastic - m.block_damping * v * min(1.0, depth / m.block_onset), 0.0)


@inlined
def crack_force(m: Missing, stiffness: float, x: float, t: float) -> float:
    """Force [N] that the cracked tooth pair takes from the spring."""
    turn = m.crack_rate * t + m.crack_phase + m.crack_wander * math.sin(0.9 * t)
    turn = turn - math.floor(turn)
    carried = min(1.0, 2.2 * math.sin(math.pi * turn / m.crack_share)) if turn < m.crack_share else 0.0
    return -m.crack_depth * carried * stiffness * x


@inlined
def missing_force(m: Missing, stiffness: float, x: float, v: float, t: float) -> float:
    """Force [N] of everything that is missing, against the motion."""
    f = m.drag * v * abs(v)
    if m.jaw_stiffness > 0.0:
        f += jaw_force(m, x, v)
    if m.block_stiffness > 0.0:
        f += block_force(m, x, v)
    if m.cubic_stiffness > 0.0:
        f += m.cubic_stiffness * x**3
    if m.brake_force > 0.0:
        u = v / m.brake_velocity
        f += 2.0 * m.brake_force * u / (1.0 + u * u)
    if m.crack_depth > 0.0:
        f += crack_force(m, stiffness, x, t)
    return f


@inlined
def derivative(p: Axis, m: Missing, b: Background, s: State, load: float, base: float, t: float) -> State:
    """Time derivative of the state under a load [N], relative to a base with an acceleration [m/s^2]."""
    x, v = s.x, s.v
    stiffness = p.stiffness
    if b.drift != 0.0:
        stiffness *= 1.0 + b.drift * (1.0 - math.exp(-t / b.settling))
    restoring = stiffness * math.sin(x) if p.hangs else stiffness * x
    force = load - restoring - p.damping * v - missing_force(m, p.stiffness, x, v, t)
    if b.friction > 0.0:
        along = 1.0 + 0.45 * math.sin(2.0 * math.pi * x / b.wavelength + 1.0)
        force -= b.friction * along * math.tanh(v / b.creep)
    small = b.hidden * p.mass
    if small == 0.0:
        return State(v, force / p.mass - base, s.w, 0.0)
    omega = 2.0 * np.pi * b.hidden_frequency
    pull = small * (omega * omega * (s.y - x) + 2.0 * b.hidden_ratio * omega * (s.w - v))
    return State(v, (force + pull) / (p.mass - small) - base, s.w, -pull / small - base)


@inlined
def moved(s: State, h: float, d: State) -> State:
    """A state after some time [s] with a derivative."""
    return State(s.x + h * d.x, s.v + h * d.v, s.y + h * d.y, s.w + h * d.w)


@inlined
def weighted(d_1: State, d_2: State, d_3: State, d_4: State) -> State:
    """Six times the mean derivative of a step, from those of its four stages."""
    return State(
        d_1.x + 2 * d_2.x + 2 * d_3.x + d_4.x,
        d_1.v + 2 * d_2.v + 2 * d_3.v + d_4.v,
        d_1.y + 2 * d_2.y + 2 * d_3.y + d_4.y,
        d_1.w + 2 * d_2.w + 2 * d_3.w + d_4.w,
    )


@compiled
def march(
    p: Axis, m: Missing, b: Background, load: Array, base: Array, h: float, x: float, v: float
) -> tuple[Array, Array, Array]:
    """Motion of an axis, relative to its base.

    Args:
        p: The axis.
        m: What it has besides.
        b: Its background.
        load: Force on it [N] at each half step (2 n - 1,).
        base: Acceleration of the base [m/s^2], shaped alike.
        h: Step [s].
        x: Displacement [m] at the start.
        v: Velocity [m/s] at the start, also of the hidden mode.

    Returns:
        Displacement [m], velocity [m/s] and acceleration [m/s^2] at each step, each (n,).
    """
    n = len(load) // 2 + 1
    displacement, velocity, acceleration = np.empty(n), np.empty(n), np.empty(n)
    s = State(x, v, x, v)
    for i in range(n):
        t, j = i * h, 2 * i
        d_1 = derivative(p, m, b, s, load[j], base[j], t)
        displacement[i], velocity[i], acceleration[i] = s.x, s.v, d_1.v
        if i == n - 1:
            break
        middle = t + 0.5 * h
        d_2 = derivative(p, m, b, moved(s, 0.5 * h, d_1), load[j + 1], base[j + 1], middle)
        d_3 = derivative(p, m, b, moved(s, 0.5 * h, d_2), load[j + 1], base[j + 1], middle)
        d_4 = derivative(p, m, b, moved(s, h, d_3), load[j + 2], base[j + 2], t + h)
        s = moved(s, h / 6.0, weighted(d_1, d_2, d_3, d_4))
    return displacement, velocity, acceleration
