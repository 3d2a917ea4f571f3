"""Time stepping of a carriage on a guide that nothing holds: semi-implicit Euler steps, with dry friction that sticks and slips by events.

A carriage at rest stays there until the other forces exceed its friction; one whose velocity would change its sign within a step stops.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from third_laboratory_cases.oscillator import compiled, inlined

from bench.arrays import Array


class Carriage(NamedTuple):
    """A carriage and its friction."""

    mass: float
    """Mass [kg], that of the hidden mode included."""
    damping: float
    """Viscous damping [N s/m]."""
    friction: float
    """Dry friction in motion [N], which a nominal model may miss; zero for none at all."""
    excess: float
    """By how much more it holds at rest, as a fraction."""
    fading: float
    """Velocity [m/s] over which that fades."""


class Background(NamedTuple):
    """Small physics that no nominal model has."""

    hidden: float = 0.0
    """Part of the mass [kg] that hangs on the rest by a spring and a dashpot, as a cable chain does."""
    hidden_frequency: float = 1.0
    """Natural frequency of that part on the blocked rest [Hz]."""
    hidden_ratio: float = 0.0
    """Its damping ratio."""
    variation: float = 0.0
    """Relative variation of the friction along the rail."""
    wavelength: float = 1.0
    """Displacement [m] over which that repeats itself."""
    drift: float = 0.0
    """Relative change a second [1/s] of the viscous damping."""
    cogging: float = 0.0
    """Amplitude of the cogging of the motor [N]."""
    pitch: float = 1.0
    """Displacement [m] over which that repeats itself."""


class PositionLoop(NamedTuple):
    """A position loop, whose command is held, with the current loop below it."""

    every: int
    """Steps between commands."""
    stiffness: float
    """Force [N] for one metre of error."""
    damping: float
    """Force [N] for one metre a second of error."""
    lag: float
    """Time constant of the current loop [s]."""


class State(NamedTuple):
    """State of the carriage (x, v) and of its hidden mode (y, w)."""

    x: float
    v: float
    y: float
    w: float


class Motion(NamedTuple):
    """Motion of the carriage at each step, with the force on it, each (n,)."""

    displacement: Array
    velocity: Array
    force: Array


@inlined
def slipped(p: Carriage, along: float, drive: float, mass: float, v: float, h: float) -> float:
    """Velocity [m/s] a step [s] later, under the friction times a factor and the other forces [N]."""
    if p.friction == 0.0:
        return v + h * drive / mass
    if v == 0.0:
        held = p.friction * along * (1 + p.excess)
        if abs(drive) <= held:
            return 0.0
        sign = 1.0 if drive > 0 else -1.0
        return h * (drive - sign * held) / mass
    sign = 1.0 if v > 0 else -1.0
    friction = p.friction * along * (1 + p.excess * math.exp(-((v / p.fading) ** 2)))
    later = v + h * (drive - sign * friction) / mass
    return 0.0 if later * v <= 0 else later


@inlined
def advance(p: Carriage, b: Background, s: State, force: float, t: float, h: float) -> State:
    """The state a step [s] later, under a force of the motor [N] at a time [s]."""
    pull = 0.0
    if b.hidden > 0:
        omega = 2 * np.pi * b.hidden_frequency
        pull = b.hidden * (omega * omega * (s.y - s.x) + 2 * b.hidden_ratio * omega * (s.w - s.v))
    drive = force + pull - p.damping * (1 + b.drift * t) * s.v
    if b.cogging > 0:
        drive += b.cogging * math.sin(2 * math.pi * s.x / b.pitch)
    along = 1.0 + b.variation * math.sin(2 * math.pi * s.x / b.wavelength)
    v = slipped(p, along, drive, p.mass - b.hidden, s.v, h)
    if b.hidden == 0:
        return State(s.x + h * v, v, s.y, s.w)
    w = s.w + h * (-pull / b.hidden)
    return State(s.x + h * v, v, s.y + h * w, w)


@compiled
def controlled(
    p: Carriage, b: Background, loop: PositionLoop, target: Array, target_velocity: Array, h: float
) -> Motion:
    """Motion of a carriage in its position loop, from rest.

    Args:
        p: The carriage.
        b: Its background.
        loop: The position loop.
        target: Displacement that is asked for [m] at each step (n,).
        target_velocity: Its velocity [m/s], shaped alike.
        h: Step [s].
    """
    n = len(target)
    displacement, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    s = State(0.0, 0.0, 0.0, 0.0)
    command = acting = 0.0
    for i in range(n):
        if i % loop.every == 0:
            command = loop.stiffness * (target[i] - s.x) + loop.damping * (target_velocity[i] - s.v)
        acting += h / loop.lag * (command - acting)
        displacement[i], velocity[i], force[i] = s.x, s.v, acting
        s = advance(p, b, s, acting, i * h, h)
    return Motion(displacement, velocity, force)


@compiled
def replayed(p: Carriage, b: Background, force: Array, h: float, start: float, x: float, v: float) -> Motion:
    """Motion of a carriage under a force that is given.

    Args:
        p: The carriage.
        b: Its background.
        force: Of the motor [N] at each step (n,).
        h: Step [s].
        start: Time [s] at which the force begins.
        x: Displacement [m] then.
        v: Velocity [m/s] then, also of the hidden mode.
    """
    n = len(force)
    displacement, velocity = np.empty(n), np.empty(n)
    s = State(x, v, x, v)
    for i in range(n):
        displacement[i], velocity[i] = s.x, s.v
        s = advance(p, b, s, force[i], start + i * h, h)
    return Motion(displacement, velocity, force)
