"""Cases of single masses: a table on mounts with a snubber, and the first mode of a beam whose accelerometer is coupled by AC."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from scipy.signal import lfilter
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import MEASURED, MILLIMETRE

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.signals import band_noise, multisine, sweep
from sixth_laboratory_cases.stepping import straight


class Oscillator(NamedTuple):
    """A mass on a spring; what follows its damping, a nominal model has not."""

    mass: float
    """Mass [kg]."""
    stiffness: float
    """Stiffness [N/m]."""
    damping: float
    """Viscous damping [N s/m]."""
    cubic_stiffness: float = 0.0
    """Coefficient of the cube of the displacement [N/m^3]."""
    friction: float = 0.0
    """Dry friction [N]."""
    creep: float = 1e-3
    """Velocity [m/s] over which that changes its sign."""
    stop: float = 0.0
    """Stiffness [N/m] of a stop on the positive side."""
    stop_at: float = 1.0
    """Displacement [m] from which that is touched."""
    stop_damping: float = 0.0
    """Damping [N s/m] of the contact, which never pulls."""
    corner: float = 0.0
    """Corner [Hz] of a high-pass of first order behind the accelerometer; none where zero."""


@inlined
def oscillator_derivative(p: Oscillator, s: Array, load: Array, t: float) -> tuple[float, float]:
    """Time derivative of displacement and velocity under a force [N]."""
    x, v = s[0], s[1]
    force = p.damping * v + p.stiffness * x + p.cubic_stiffness * x**3 + p.friction * np.tanh(v / p.creep)
    if x > p.stop_at:
        force += max(0.0, p.stop * (x - p.stop_at) + p.stop_damping * v)
    return v, (load[0] - force) / p.mass


oscillator_march = stepper(oscillator_derivative)


def high_pass(values: Array, step: float, corner: float) -> Array:
    """Values (n,) at each step [s] behind a high-pass of first order; as they are where its corner [Hz] is zero."""
    if corner <= 0.0:
        return values
    half = np.pi * corner * step
    return np.asarray(lfilter([1.0, -1.0], [1.0 + half, half - 1.0], values))


def oscillator(run: Run) -> Signals:
    """A mass that a force drives."""
    p = Oscillator(**run.values)
    motion = oscillator_march(p, np.zeros(2), straight(run.loads), run.step)
    return {
        "load": run.loads[:, 0],
        "displacement": motion.state[:, 0],
        "acceleration": high_pass(motion.rate[:, 1], run.step, p.corner),
    }


def shaken_table(session: Session) -> Sequence[Array]:
    """Forces [N] of the isolator's shaker."""
    clock, rng = session.clock, session.rng
    return (
        multisine(clock, rng, (1.0, 20.0), 20.0),
        sweep(clock, (2.0, 14.0), 17.0),
        band_noise(clock, rng, (1.5, 16.0), 22.0),
    )


ISOLATOR = Case(
    name="sixth_isolator_1",
    number=1,
    rig="sdof",
    rate=500,
    seconds=20.0,
    substeps=20,
    simulate=oscillator,
    excitation=shaken_table,
    parameters={
        "mass": Parameter("mass", 12.0, 0.12, "kg"),
        "stiffness": Parameter("stiffness", 17000.0, 400.0, "N/m"),
        "damping": Parameter("damping", 45.0, 6.0, "N s/m"),
    },
    missing={"stop": 26000.0, "stop_at": 3.6e-3},
    besides={"cubic_stiffness": 1.1e7, "friction": 0.25, "creep": 2e-3, "stop_damping": 10.0},
    channels={
        "force": Channel("load", "N", 0.15, told=MEASURED),
        "displacement": Channel("displacement", "mm", 0.02, MILLIMETRE),
        "acceleration": Channel("acceleration", "m/s^2", 0.04, slow=0.3),
    },
    responses=("displacement", "acceleration"),
    right=[["one_sided_stop"]],
    also=["coulomb_friction", "cubic_stiffness"],
    why="a snubber touches on one side, beyond 3.6 mm, 1.5 times as stiff as the mounts",
    tested="a table on mounts above a shaker; displacement and acceleration",
    size="26 kN/m: 19 to 25 % of the force of the spring, touched for 4 to 8 % of the time",
    background="cubic spring 1.5 to 2 %, friction 0.25 N, damping of 10 N s/m in the contact, noise of the acceleration slow by 30 %",
    noise_stated="as it is",
    left={
        "displacement": Left(55.11, 11.61, 34.09, 2.08, 0.81),
        "acceleration": Left(50.77, 10.75, 34.53, 2.45, 0.99),
    },
    farthest="mass -9.8",
    found="1.3; a stop of 29.6 kN/m at 3.616 mm",
)


def coil_on_beam(session: Session) -> Sequence[Array]:
    """Forces [N] of the cantilever's voice coil."""
    clock, rng = session.clock, session.rng
    return (
        multisine(clock, rng, (0.5, 14.0), 0.42),
        band_noise(clock, rng, (0.6, 12.0), 0.42),
        sweep(clock, (0.8, 11.0), 0.24),
    )


CANTILEVER = Case(
    name="sixth_cantilever_1",
    number=2,
    rig="sdof",
    rate=400,
    seconds=25.0,
    substeps=10,
    simulate=oscillator,
    excitation=coil_on_beam,
    parameters={
        "mass": Parameter("mass", 0.45, 0.006, "kg"),
        "stiffness": Parameter("stiffness", 284.0, 3.5, "N/m"),
        "damping": Parameter("damping", 0.42, 0.06, "N s/m"),
    },
    missing={"corner": 1.3},
    besides={"cubic_stiffness": 2.0e4, "friction": 0.004, "creep": 2e-3},
    channels={
        "force": Channel("load", "N", 0.006, stated=0.5, told=MEASURED),
        "displacement": Channel("displacement", "mm", 0.05, MILLIMETRE, stated=0.5),
        "acceleration": Channel(
            "acceleration", "g", 0.003, 1.0 / 9.80665, stated=0.5, slow=0.25, resolution=0.0005
        ),
    },
    responses=("acceleration",),
    right=[["acceleration_high_pass"]],
    also=["coulomb_friction", "cubic_stiffness"],
    why="the accelerometer's conditioner is coupled by AC: first order, 1.3 Hz",
    tested="the first mode of a beam at 4 Hz, with a voice coil at its tip; laser in mm, accelerometer in g",
    size="31 % of the acceleration at 4 Hz",
    background="cubic spring 1 % at peaks, friction 0.004 N, accelerometer in steps of 0.5 mg",
    noise_stated="half of it, in all channels",
    left={"acceleration": Left(32.21, 19.00, 21.72, 4.77, 2.52)},
    farthest="stiffness +5.8",
    found="1.5; a corner of 1.305 Hz",
)
