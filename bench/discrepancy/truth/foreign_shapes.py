"""Shapes of the effects that stand in no catalogue, drawn over the ranges that test laboratories see."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bench.discrepancy.truth.recipe import Drawn, DrawShape, Reach, Shape, between, sign


def modulated(frequency_of: Callable[[np.random.Generator, Reach], float]) -> DrawShape:
    """A stiffness that follows the clock with a frequency [Hz] so drawn."""

    def draw(rng: np.random.Generator, r: Reach) -> Shape:
        frequency, phase = frequency_of(rng, r), rng.uniform(0.0, 2.0 * np.pi)

        def shape(a: float) -> Drawn:
            values = {"stiffness": a * r.stiffness, "frequency": frequency, "phase": phase}
            return Drawn(values, tuple(values.values()))

        return shape

    return draw


def fractional(rng: np.random.Generator, r: Reach) -> Shape:
    """A fractional derivative, as a sum of relaxations."""
    alpha = rng.uniform(0.35, 0.65)
    shortest, ratio = 0.03 / r.omega, math.sqrt(10.0)

    def shape(a: float) -> Drawn:
        values = {"C": a * r.stiffness * r.omega**-alpha, "alpha": alpha}
        return Drawn(values, (*values.values(), shortest, ratio))

    return shape


def snap(rng: np.random.Generator, r: Reach) -> Shape:
    """A window of negative stiffness."""
    window = rng.uniform(0.3, 0.6) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "window": window}
        return Drawn(values, tuple(values.values()), ((-window, window),))

    return shape


def switching(rng: np.random.Generator, r: Reach) -> Shape:
    """A spring that latches in and lets go."""
    upper, lower = rng.uniform(0.45, 0.7) * r.position, rng.uniform(0.1, 0.35) * r.position
    side = sign(rng)

    def shape(a: float) -> Drawn:
        # a spring taken away may take at most half of the rig's own, or the rig would fall over
        stiffness = a * r.stiffness if side > 0 else -0.5 * r.stiffness * a / (1.0 + a)
        values = {"stiffness": stiffness, "upper": upper, "lower": lower}
        return Drawn(values, (*values.values(), 0.3 / r.omega, r.omega))

    return shape


def cone(rng: np.random.Generator, r: Reach) -> Shape:
    """Friction in two directions with one limit."""
    slip = between(rng, 0.03, 0.15) * r.position
    radius = between(rng, 0.6, 1.6) * r.velocity / r.velocity2

    def shape(a: float) -> Drawn:
        values = {"limit": a * r.force, "bristle_stiffness": a * r.force / slip, "radius": radius}
        return Drawn(values, tuple(values.values()))

    return shape


def saturating(rng: np.random.Generator, r: Reach) -> Shape:
    """A spring that fades with the displacement."""
    width = rng.uniform(0.1, 0.5) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "width": width}
        return Drawn(values, tuple(values.values()))

    return shape


def hertz(rng: np.random.Generator, r: Reach) -> Shape:
    """A Hertzian contact on one side."""
    side, position = sign(rng), rng.uniform(-0.3, 0.7) * r.position

    def shape(a: float) -> Drawn:
        values = {
            "stiffness": a * r.stiffness / math.sqrt(r.position),
            "position": side * position,
            "side": side,
        }
        region = (side * position, math.inf) if side > 0 else (-math.inf, side * position)
        return Drawn(values, tuple(values.values()), (region,))

    return shape


def resonator(frequency: tuple[float, float], damping: tuple[float, float]) -> DrawShape:
    """A hidden mass on a spring, its frequency as a multiple of that of the motion and its damping ratio drawn between limits."""

    def draw(rng: np.random.Generator, r: Reach) -> Shape:
        omega, damping_ratio = between(rng, *frequency) * r.omega, between(rng, *damping)

        def shape(a: float) -> Drawn:
            stiffness = a * r.stiffness
            mass = stiffness / omega**2
            values = {"stiffness": stiffness, "mass": mass, "damping": 2.0 * damping_ratio * mass * omega}
            return Drawn(values, tuple(values.values()))

        return shape

    return draw


def stress_softening(rng: np.random.Generator, r: Reach) -> Shape:
    """A spring that gives way with the largest displacement."""
    width = rng.uniform(0.3, 0.8) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "width": width}
        return Drawn(values, (*values.values(), 0.05 / r.omega))

    return shape


def wavy(shallowest: float) -> DrawShape:
    """Friction that comes and goes along the stroke, by a part of it between `shallowest` and all."""

    def draw(rng: np.random.Generator, r: Reach) -> Shape:
        depth, width = rng.uniform(shallowest, 1.0), rng.uniform(0.1, 0.4) * r.position
        phase = rng.uniform(0.0, 2.0 * np.pi)

        def shape(a: float) -> Drawn:
            values = {"friction_force": a * r.force, "depth": depth, "width": width, "phase": phase}
            return Drawn(values, (*values.values(), 0.02 * r.velocity))

        return shape

    return draw


def blow(rng: np.random.Generator, r: Reach) -> Shape:
    """A load that nobody measured."""
    moment, width = rng.uniform(0.2, 0.8) * r.duration, between(rng, 0.1, 1.0) / r.omega

    def shape(a: float) -> Drawn:
        values = {"force": a * r.force, "moment": moment, "width": width}
        return Drawn(values, tuple(values.values()))

    return shape


def restitution(rng: np.random.Generator, r: Reach) -> Shape:
    """A rigid stop that throws back."""
    side, restitution = sign(rng), rng.uniform(0.3, 0.8)

    def shape(a: float) -> Drawn:
        position = side * r.position / (1.0 + a)
        region = (position, math.inf) if side > 0 else (-math.inf, position)
        return Drawn({"position": position, "side": side, "restitution": restitution}, (), (region,))

    return shape
