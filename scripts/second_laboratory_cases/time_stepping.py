"""Time stepping of the second laboratory, apart from the bench's: midpoint rule with set-valued dry friction.

A step drifts for half of it, changes the velocity at once (damping by the trapezoidal rule, dry friction implicitly, so that it holds
exactly), and drifts for the other half. It is of second order, but of first order in the dashpots of carried masses, which take the
velocities at the start of the step. A component on a testing machine has no equation of motion: its force follows from the motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from second_laboratory_cases.forces import (
    Memory,
    compiled,
    friction_limit,
    harmonic,
    inlined,
    memory_at_end,
    memory_at_middle,
    restoring,
    secant_damping,
)
from second_laboratory_cases.properties import Properties


class Drive(NamedTuple):
    """How the load follows from its samples."""

    held: bool = False
    """Whether it is held from sample to sample; else it is linear between them."""
    velocity_gain: float = 0.0
    """Gain of the velocity loop of a cascade controller [N s/m], whose targets the samples are; they are forces where it is zero."""
    position_gain: float = 0.0
    """Gain of its position loop [1/s]."""


class Motion(NamedTuple):
    """What an oscillator does, at the samples, each (n_samples,)."""

    displacement: Array
    acceleration: Array
    load: Array
    """Force that drives it, which a controller may have made [N]."""


class State(NamedTuple):
    """State of an oscillator and of what it carries."""

    x: float
    v: float
    memory: Memory
    carried_x: float
    carried_v: float
    hidden_x: float
    hidden_v: float
    ball_x: float
    ball_v: float


@inlined
def mounting_force(
    mass: float, omega: float, ratio: float, x: float, v: float, base_x: float, base_v: float, h: float
) -> float:
    """Force [N] of a carried mass on its base in the middle of a step, from its own state at the start of it."""
    spring = mass * omega**2 * (x + 0.5 * h * v - base_x)
    return spring + 2.0 * ratio * omega * mass * (v - base_v)


@inlined
def sliding_velocity(p: Properties, x: float, v: float, force: float, mass: float, h: float) -> float:
    """Velocity at the end of a step under a force [N], with dry friction; zero where that holds."""
    between = free = v
    divisor = mass
    for _ in range(2):  # the damping is that of the mean velocity, which depends on it
        c = secant_damping(p, x, between)
        divisor = mass + 0.5 * h * c
        free = ((mass - 0.5 * h * c) * v + h * force) / divisor
        between = 0.5 * (v + free)
        if between * free < 0.0:
            between = 0.5 * free
    most = h * friction_limit(p, x, v) / divisor
    if free > most:
        return free - most
    if free < -most:
        return free + most
    return 0.0


@inlined
def advance(p: Properties, s: State, load: float, t: float, h: float) -> State:
    """The state a step [s] later under a load [N] in its middle, whose time is t."""
    mass = p.mass - p.carried_mass
    x = s.x + 0.5 * h * s.v
    middle = memory_at_middle(p, s.memory, s.v, h)
    force = load + harmonic(p, t) - restoring(p, x, t) - middle.bouc_wen
    force -= p.dahl_stiffness * middle.dahl
    force -= p.relaxing_stiffness * middle.maxwell
    carried_v, hidden_v = s.carried_v, s.hidden_v
    if p.carried_mass > 0.0:
        pull = mounting_force(
            p.carried_mass, p.carried_omega, p.carried_ratio, s.carried_x, carried_v, x, s.v, h
        )
        force += pull
        carried_v -= h * pull / p.carried_mass
    if p.hidden_mass > 0.0:
        pull = mounting_force(p.hidden_mass, p.hidden_omega, p.hidden_ratio, s.hidden_x, hidden_v, x, s.v, h)
        force += pull
        hidden_v -= h * pull / p.hidden_mass
    v = sliding_velocity(p, x, s.v, force, mass, h)
    memory = memory_at_end(p, s.memory, middle, 0.5 * (s.v + v), h)
    carried_x = s.carried_x + 0.5 * h * (s.carried_v + carried_v)
    hidden_x = s.hidden_x + 0.5 * h * (s.hidden_v + hidden_v)
    x += 0.5 * h * v
    ball_x, ball_v = s.ball_x, s.ball_v
    if p.ball_mass > 0.0:
        ball_x += h * ball_v
        apart = ball_x - x
        if (apart > p.ball_gap and ball_v > v) or (apart < -p.ball_gap and ball_v < v):
            impulse = (1.0 + p.ball_restitution) * (ball_v - v) * mass * p.ball_mass / (mass + p.ball_mass)
            v += impulse / mass
            ball_v -= impulse / p.ball_mass
    return State(x, v, memory, carried_x, carried_v, hidden_x, hidden_v, ball_x, ball_v)


@compiled
def march(p: Properties, samples: Array, rate: float, substeps: int, start: float, drive: Drive) -> Motion:
    """Motion of an oscillator.

    Args:
        p: Its properties.
        samples: Loads [N] or, for a controller, targets [m] (n_samples,).
        rate: Sample rate [Hz].
        substeps: Steps of the integration a sample.
        start: Displacement [m] from which it is released at rest.
        drive: How the load follows from the samples.

    Returns:
        The motion. Its acceleration is the central difference of the velocity over a step to either side of the sample.
    """
    n = len(samples)
    h = 1.0 / (rate * substeps)
    x, a, load = np.zeros(n), np.zeros(n), np.zeros(n)
    s = State(start, 0.0, Memory(0.0, 0.0, 0.0), start, 0.0, start, 0.0, start, 0.0)
    before = 0.0  # velocity a step ago
    for i in range(n):
        x[i] = s.x
        first = samples[i]
        last = samples[min(i + 1, n - 1)]
        if drive.velocity_gain > 0.0:
            first = drive.velocity_gain * (drive.position_gain * (samples[i] - s.x) - s.v)
        if drive.held:
            last = first
        load[i] = first
        for j in range(substeps):
            t = (i * substeps + j + 0.5) * h
            following = advance(p, s, first + (last - first) * (j + 0.5) / substeps, t, h)
            if j == 0:
                a[i] = (following.v - before) / (2.0 * h if i > 0 else h)
            before = s.v
            s = following
    return Motion(x, a, load)


@compiled
def component_force(p: Properties, x: Array, v: Array, rate: float, substeps: int) -> Array:
    """Force of a component along a motion.

    Args:
        p: Its properties.
        x: Displacement [m] at each step (n_steps,).
        v: Velocity [m/s], shaped alike.
        rate: Sample rate of the force [Hz].
        substeps: Steps a sample.

    Returns:
        Force [N] at the samples ((n_steps - 1) // substeps + 1,). At rest, dry friction keeps its last value.
    """
    n = (len(x) - 1) // substeps + 1
    h = 1.0 / (rate * substeps)
    out = np.zeros(n)
    memory = Memory(0.0, 0.0, 0.0)
    friction = 0.0
    for i in range(n * substeps - substeps + 1):
        if i > 0:
            mean = 0.5 * (v[i] + v[i - 1])
            memory = memory_at_end(p, memory, memory_at_middle(p, memory, mean, h), mean, h)
        if v[i] > 0.0:
            friction = friction_limit(p, x[i], v[i])
        elif v[i] < 0.0:
            friction = -friction_limit(p, x[i], v[i])
        if i % substeps == 0:
            force = restoring(p, x[i], i * h) + secant_damping(p, x[i], v[i]) * v[i] + friction
            force += memory.bouc_wen
            force += p.dahl_stiffness * memory.dahl
            out[i // substeps] = force + p.relaxing_stiffness * memory.maxwell
    return out
