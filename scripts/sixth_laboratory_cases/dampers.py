"""Cases of dampers in testing machines: one that is valved differently each way, and one whose silicone warms and thins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import DEGREE, MILLIMETRE, PRESCRIBED

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.signals import band_noise, levels, multisine, rate_of, sweep
from sixth_laboratory_cases.stepping import straight


class Damper(NamedTuple):
    """A shock absorber whose motion a testing machine prescribes; what follows its friction, a nominal model has not."""

    stiffness: float
    """Stiffness of its gas [N/m]."""
    damping: float
    """Mean viscous damping [N s/m]."""
    coulomb: float
    """Dry friction [N]."""
    asymmetry: float = 0.0
    """Part by which the damping is harder at positive velocities and softer at negative ones."""
    fall: float = 0.0
    """Part by which it falls a unit of velocity [s/m]."""
    creep: float = 2e-3
    """Velocity [m/s] over which the friction changes its sign."""


def damper_force(p: Damper, x: Array, v: Array) -> Array:
    """Force [N] of a shock absorber (n,), from displacement and velocity in SI units, each (n,)."""
    damping = p.damping * (1.0 + p.asymmetry * np.sign(v)) * (1.0 - p.fall * np.abs(v))
    return p.stiffness * x + damping * v + p.coulomb * np.tanh(v / p.creep)


def damper(run: Run) -> Signals:
    """A shock absorber in a testing machine."""
    x = run.loads[:, 0]
    return {"motion": x, "force": damper_force(Damper(**run.values), x, rate_of(x, 1.0 / run.step))}


def strokes(session: Session) -> Sequence[Array]:
    """Strokes [m] of the testing machine."""
    clock, rng = session.clock, session.rng
    return (
        multisine(clock, rng, (0.4, 5.0), 0.010),
        sweep(clock, (0.5, 5.0), 0.016),
        band_noise(clock, rng, (0.5, 4.5), 0.011),
    )


DAMPER = Case(
    name="sixth_damper_1",
    number=9,
    rig="damper",
    rate=500,
    seconds=16.0,
    substeps=10,
    simulate=damper,
    excitation=strokes,
    parameters={
        "stiffness": Parameter("stiffness", 2600.0, 200.0, "N/m"),
        "damping": Parameter("damping", 1150.0, 110.0, "N s/m"),
        "coulomb": Parameter("coulomb", 22.0, 5.0, "N"),
    },
    missing={"asymmetry": 0.24},
    besides={"fall": 0.06, "creep": 3e-3},
    channels={
        "displacement": Channel("motion", "mm", 0.004, MILLIMETRE, told=PRESCRIBED),
        "force": Channel("force", "N", 5.0, stated=0.5, slow=0.3),
    },
    responses=("force",),
    right=[["asymmetric_damping"]],
    also=["power_law_damping"],
    why="rebound is damped by 24 % more than the mean, bump by 24 % less",
    tested="a shock absorber in a testing machine; stroke and force",
    size="24 % of the force of the damping",
    background="damping that falls by 1 to 3 %, friction rounded within 3 mm/s",
    noise_stated="as it is of the displacement, half of it of the force, which is slow by 30 %",
    left={"force": Left(13.64, 2.24, 13.61, 2.14, 2.03)},
    farthest="stiffness +1.2",
    found="0.4; an asymmetry of 0.2415",
)


class Rotary(NamedTuple):
    """A rotary damper with a film of silicone; what follows its damping, a nominal model has not."""

    stiffness: float
    """Stiffness [N m/rad]."""
    damping: float
    """Viscous damping of the cold film [N m s/rad]."""
    thinning: float = 0.0
    """Part by which the damping falls a kelvin [1/K]."""
    capacity: float = 12.0
    """Heat capacity of the film [J/K]."""
    cooling: float = 8.0
    """Time [s] within which it cools."""
    friction: float = 0.0
    """Dry friction [N m]."""
    creep: float = 0.05
    """Angular velocity [rad/s] over which that changes its sign."""


@inlined
def film_derivative(p: Rotary, s: Array, load: Array, t: float) -> tuple[float]:
    """Time derivative of how much warmer than its housing the film is [K], under an angular velocity [rad/s]."""
    heat = p.damping * np.exp(-p.thinning * s[0]) * load[0] ** 2
    return (heat / p.capacity - s[0] / p.cooling,)


film_march = stepper(film_derivative)


def rotary(run: Run) -> Signals:
    """A rotary damper in a testing machine."""
    p, angle = Rotary(**run.values), run.loads[:, 0]
    speed = rate_of(angle, 1.0 / run.step)
    warmth = film_march(p, np.zeros(1), straight(speed[:, None]), run.step).state[:, 0]
    damping = p.damping * np.exp(-p.thinning * warmth)
    torque = p.stiffness * angle + damping * speed + p.friction * np.tanh(speed / p.creep)
    return {"motion": angle, "torque": torque, "warmth": warmth}


def bursts(session: Session) -> Sequence[Array]:
    """Angles [rad] that swing more and less by turns."""
    clock, rng = session.clock, session.rng
    return (
        levels(clock, (0.4, 1.3, 0.3, 1.0, 0.5), 0.8) * multisine(clock, rng, (0.4, 2.5), 0.42),
        levels(clock, (1.3, 0.5, 0.9, 0.2, 1.1), 0.8) * band_noise(clock, rng, (0.5, 2.5), 0.42),
        levels(clock, (0.6, 1.2, 0.4, 0.4, 1.3), 0.8) * band_noise(clock, rng, (0.4, 2.2), 0.45),
    )


ROTARY = Case(
    name="sixth_rotary_1",
    number=10,
    rig="damper",
    rate=400,
    seconds=25.0,
    substeps=10,
    simulate=rotary,
    excitation=bursts,
    parameters={
        "stiffness": Parameter("stiffness", 1.5, 0.3, "N m/rad"),
        "damping": Parameter("damping", 0.92, 0.07, "N m s/rad"),
    },
    missing={"thinning": 0.035},
    besides={"friction": 0.05, "creep": 0.05},
    channels={
        "angle": Channel("motion", "deg", 0.01, DEGREE, told=PRESCRIBED),
        "torque": Channel("torque", "N m", 0.04, slow=0.3),
    },
    responses=("torque",),
    right=[],
    also=["coulomb_friction"],
    why="foreign: the silicone warms while it is sheared and thins by 23 to 27 %, within 8 s",
    tested="a silicone damper in bursts; angle and torque",
    size="up to 23 to 27 % of the torque of the damping",
    background="friction 0.05 N m, 2 % of the torque",
    noise_stated="as it is, slow by 30 %",
    left={"torque": Left(21.49, 4.56, 6.94, 1.95, 1.51)},
    farthest="damping -2.5",
    found="0.5; thinning of 0.0345 a kelvin",
)
