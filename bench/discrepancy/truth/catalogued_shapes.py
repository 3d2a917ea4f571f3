"""Shapes of the effects of the catalogue, drawn over the ranges that test laboratories see."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bench.discrepancy.truth.recipe import SETTINGS, Drawn, Reach, Shape, between, sign


def one(name: str, scale: Callable[[Reach], float], *extra: Callable[[Reach], float], signed: bool = False):
    """An effect of one parameter; `extra` completes the theta of its law."""

    def draw(rng: np.random.Generator, r: Reach) -> Shape:
        side = sign(rng) if signed else 1.0

        def shape(a: float) -> Drawn:
            value = side * a * scale(r)
            return Drawn({name: value}, (value, *(e(r) for e in extra)))

        return shape

    return draw


relative = one("relative_error", lambda r: 1.0, signed=True)

delay = one("delay", lambda r: 1.0 / r.omega)


def stribeck(rng: np.random.Generator, r: Reach) -> Shape:
    """Friction with a static excess that falls with the velocity."""
    excess, velocity = between(rng, 0.3, 1.5), between(rng, 0.05, 0.4) * r.velocity

    def shape(a: float) -> Drawn:
        values = {"friction_force": a * r.force, "static_excess": excess, "stribeck_velocity": velocity}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def presliding(rng: np.random.Generator, r: Reach) -> Shape:
    """Friction behind bristles."""
    slip, damping = between(rng, 0.02, 0.25) * r.position, between(rng, 0.05, 0.5) / r.velocity

    def shape(a: float) -> Drawn:
        level = a * r.force
        values = {
            "friction_force": level, "presliding_displacement": slip, "bristle_damping_per_force": damping,
        }  # fmt: skip
        return Drawn(values, (level, level / slip, level * damping, 0.0, r.velocity, 0.0))

    return shape


def carried(rng: np.random.Generator, r: Reach) -> Shape:
    """A part of the mass on a spring, from liquids in a tank to the mode of a part well above the motion."""
    frequency = between(rng, 0.3, 3.0) * r.omega / (2.0 * math.pi)
    damping_ratio = between(rng, 0.005, 0.1)

    def shape(a: float) -> Drawn:
        values = {"share": a / (1.0 + a), "frequency": frequency, "damping_ratio": damping_ratio}
        mass = values["share"] * r.inertia
        return Drawn(values, (mass, frequency, damping_ratio), carried=mass)

    return shape


def bouc_wen(rng: np.random.Generator, r: Reach) -> Shape:
    """Bouc-Wen hysteresis."""
    yielding, skew, n = between(rng, 0.08, 0.6), rng.uniform(-0.3, 0.9), float(rng.choice([1.0, 1.5, 2.0]))

    def shape(a: float) -> Drawn:
        stiffness = a * r.stiffness
        strength = stiffness * yielding * r.position
        beta = stiffness / strength**n / (1.0 + skew)
        values = {"A": stiffness, "beta": beta, "gamma": skew * beta, "n": n}
        return Drawn(values, tuple(values.values()))

    return shape


def backlash(rng: np.random.Generator, r: Reach) -> Shape:
    """A slider behind a spring with a dead-space."""
    slip, clearance = between(rng, 0.05, 0.3) * r.position, between(rng, 0.05, 0.3) * r.position

    def shape(a: float) -> Drawn:
        level = a * r.force
        values = {"friction_force": level, "slip_displacement": slip, "clearance": clearance}
        stiffness = level / slip
        return Drawn(values, (stiffness, 0.1 * stiffness, clearance, level, level, 3.0, 0.0))

    return shape


def gap(rng: np.random.Generator, r: Reach) -> Shape:
    """A dead-space within the motion."""
    clearance = rng.uniform(0.25, 0.85) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "clearance": clearance}
        region = ((-math.inf, -clearance), (clearance, math.inf))
        return Drawn(values, (values["stiffness"], clearance, 0.0, 0.0), region)

    return shape


def one_sided(rng: np.random.Generator, r: Reach) -> Shape:
    """A stop on one side."""
    side, position = sign(rng), rng.uniform(-0.3, 0.8) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "position": side * position, "side": side}
        region = (side * position, math.inf) if side > 0 else (-math.inf, side * position)
        return Drawn(values, (values["stiffness"], side * position, 0.0, side), (region,))

    return shape


def power_law(rng: np.random.Generator, r: Reach) -> Shape:
    """Damping of an order between dry and viscous."""
    n = rng.uniform(0.3, 0.8)

    def shape(a: float) -> Drawn:
        values = {"C": a * r.force * r.velocity**-n, "n": n}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def relaxation(rng: np.random.Generator, r: Reach) -> Shape:
    """A relaxing branch."""
    time = between(rng, 0.2, 5.0) / r.omega

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "relaxation_time": time}
        return Drawn(values, tuple(values.values()))

    return shape


def time_varying(rng: np.random.Generator, r: Reach) -> Shape:
    """Friction whose level follows the clock."""
    depth, frequency = rng.uniform(0.3, 0.9), rng.uniform(1.5, 6.0) / r.duration
    phase = rng.uniform(0.0, 2.0 * np.pi)

    def shape(a: float) -> Drawn:
        values = {"friction_force": a * r.force, "depth": depth, "frequency": frequency, "phase": phase}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def gap_coupling(rng: np.random.Generator, r: Reach) -> Shape:
    """Damping that one axis adds to the other beyond a clearance."""
    across, along = rng.uniform(0.15, 0.6) * r.position2, rng.uniform(0.15, 0.6) * r.position
    balance = between(rng, 0.5, 2.0)

    def shape(a: float) -> Drawn:
        values = {
            "axial_damping": a * r.force / (r.velocity * r.position2),
            "torsional_damping": a * balance * r.force2 / (r.velocity2 * r.position),
            "torsional_clearance": across,
            "axial_clearance": along,
        }
        return Drawn(values, tuple(values.values()))

    return shape


def saturation(rng: np.random.Generator, r: Reach) -> Shape:
    """A largest force of the actuator."""
    return lambda a: Drawn({"level": 3.0 * r.force / (1.0 + a)})


def clipping(rng: np.random.Generator, r: Reach) -> Shape:
    """A largest displacement that the sensor tells."""
    return lambda a: Drawn({"level": r.position / (1.0 + a)})


def force(r: Reach) -> float:
    """The RMS load."""
    return r.force


def slow(r: Reach) -> float:
    """The velocity that rounds a law at rest."""
    return SETTINGS.slow * r.velocity
