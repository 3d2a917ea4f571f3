"""Cases of what turns: a shaft with a bladed disc, and a pendulum whose vane passes a magnet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import DEGREE, load_on, of_joint

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.models import PENDULUM as PENDULUM_MODEL
from sixth_laboratory_cases.models import ROTOR as ROTOR_MODEL
from sixth_laboratory_cases.signals import band_noise, levels, multisine
from sixth_laboratory_cases.stepping import straight


class Rotor(NamedTuple):
    """A shaft with a disc; what follows its damping, a nominal model has not."""

    inertia: float
    """Moment of inertia [kg m^2]."""
    damping: float
    """Viscous damping [N m s/rad]."""
    drag: float = 0.0
    """Coefficient of v |v| [N m s^2/rad^2]."""
    friction: float = 0.0
    """Dry friction [N m]."""
    creep: float = 0.05
    """Angular velocity [rad/s] over which that changes its sign."""
    ripple: float = 0.0
    """Amplitude [N m] of a torque with a period of one turn."""


@inlined
def rotor_derivative(p: Rotor, s: Array, load: Array, t: float) -> tuple[float, float]:
    """Time derivative of angle and angular velocity under a torque [N m]."""
    speed = s[1]
    drag = p.damping * speed + p.drag * speed * abs(speed) + p.friction * np.tanh(speed / p.creep)
    return speed, (load[0] - drag + p.ripple * np.sin(s[0])) / p.inertia


rotor_march = stepper(rotor_derivative)


def rotor(run: Run) -> Signals:
    """A shaft that a torque drives."""
    motion = rotor_march(Rotor(**run.values), np.zeros(2), straight(run.loads), run.step)
    return {"load": run.loads[:, 0], "speed": motion.state[:, 1], "acceleration": motion.rate[:, 1]}


def torques(session: Session) -> Sequence[Array]:
    """Torques [N m] that step and swing."""
    clock, rng = session.clock, session.rng
    return (
        levels(clock, (0.9, 0.3, 1.3, -0.4, 0.6), 0.5) + multisine(clock, rng, (0.1, 2.0), 0.25, period=20.0),
        levels(clock, (1.4, 0.0, -0.9, 0.0), 1.0),
        levels(clock, (0.5, 1.1, -0.7, 1.2, 0.1), 0.8) + band_noise(clock, rng, (0.1, 1.5), 0.3),
    )


ROTOR = Case(
    name="sixth_rotor_1",
    number=7,
    rig="rotor.xml",
    model=ROTOR_MODEL,
    rate=200,
    seconds=40.0,
    substeps=20,
    simulate=rotor,
    excitation=torques,
    parameters={
        "inertia": Parameter("inertia:disc", 0.05, 0.0005, "kg m^2"),
        "damping": Parameter("damping:shaft", 0.0042, 0.0006, "N m s/rad"),
    },
    missing={"drag": 6.5e-5},
    besides={"friction": 0.012, "creep": 0.2, "ripple": 0.01},
    channels={
        "torque": Channel("load", "N m", 0.01, told=load_on("drive")),
        "speed": Channel("speed", "rpm", 0.8, 30.0 / np.pi, stated=None, told=of_joint("shaft", "velocity")),
    },
    responses=("speed",),
    right=[["quadratic_damping"], ["power_law_damping"]],
    also=["coulomb_friction"],
    why="windage, quadratic in the speed; a power law with a power near two is the same",
    tested="a vertical shaft with a bladed disc; torque and speed",
    size="6.5e-5 N m s^2/rad^2: 33 to 44 % of the torque",
    background="friction 1.4 %, ripple of 0.01 N m once a turn",
    noise_stated="as it is of the torque, not stated of the speed",
    left={"speed": Left(56.11, 5.26, 8.46, 0.46, 0.26)},
    farthest="damping +8.3",
    found="1.4; 6.229e-5 N m s^2/rad^2",
)


class Pendulum(NamedTuple):
    """A pendulum with a vane that passes a magnet; what follows its damping, a nominal model has not."""

    inertia: float
    """Moment of inertia about the pivot [kg m^2]."""
    weight: float
    """Weight times the distance of the centre of mass from the pivot [N m]."""
    damping: float
    """Viscous damping of the pivot [N m s/rad]."""
    brake: float
    """Damping of the vane before the middle of the magnet [N m s/rad]."""
    width: float
    """Angle [rad] on either side within which that falls to 1/e."""
    centre: float
    """Angle [rad] of the magnet."""
    friction: float
    """Dry friction of the pivot [N m]."""
    drag: float
    """Coefficient of v |v| [N m s^2/rad^2]."""


ARM, GRAVITY = 0.38, 9.81
"""Distance of the centre of mass from the pivot [m], and gravitational acceleration [m/s^2]."""
PIVOT_CREEP = 0.01
"""Angular velocity [rad/s] over which the friction of the pivot changes its sign."""


@inlined
def pendulum_derivative(p: Pendulum, s: Array, load: Array, t: float) -> tuple[float, float]:
    """Time derivative of angle and angular velocity under a torque [N m]."""
    angle, speed = s[0], s[1]
    brake = p.brake * np.exp(-(((angle - p.centre) / p.width) ** 2)) * speed
    friction = p.friction * np.tanh(speed / PIVOT_CREEP) + p.drag * speed * abs(speed)
    return speed, (load[0] - p.weight * np.sin(angle) - p.damping * speed - brake - friction) / p.inertia


pendulum_march = stepper(pendulum_derivative)


def pendulum(run: Run) -> Signals:
    """A pendulum that is let go."""
    values = run.values
    p = Pendulum(
        inertia=values["inertia"] + values["mass"] * ARM**2,
        weight=values["mass"] * GRAVITY * ARM,
        damping=values["damping"],
        brake=values.get("brake", 0.0),
        width=values.get("width", 0.1),
        centre=values.get("centre", 0.0),
        friction=values.get("friction", 0.0),
        drag=values.get("drag", 0.0),
    )
    start = np.array([np.radians(run.start), 0.0])
    motion = pendulum_march(p, start, straight(run.loads), run.step)
    return {"load": run.loads[:, 0], "angle": motion.state[:, 0], "speed": motion.state[:, 1]}


def nothing(session: Session) -> Sequence[Array]:
    """No torque in any of three records."""
    return [np.zeros(session.clock.n)] * 3


PENDULUM = Case(
    name="sixth_pendulum_1",
    number=8,
    rig="pendulum.xml",
    model=PENDULUM_MODEL,
    rate=200,
    seconds=30.0,
    substeps=10,
    simulate=pendulum,
    excitation=nothing,
    starts=(36.0, -21.0, 29.0),
    parameters={
        "inertia": Parameter("inertia:bob", 0.0121, 0.0003, "kg m^2"),
        "mass": Parameter("mass:bob", 0.62, 0.003, "kg"),
        "damping": Parameter("damping:pivot", 0.0006, 0.0003, "N m s/rad"),
    },
    missing={"brake": 0.06, "width": float(np.radians(4.0)), "centre": float(np.radians(10.0))},
    besides={"friction": 1.0e-4, "drag": 2.0e-5},
    channels={
        "torque": Channel("load", "N m", told=load_on("hand")),
        "angle": Channel("angle", "deg", 0.03, DEGREE, resolution=0.044, told=of_joint("pivot", "position")),
    },
    responses=("angle",),
    told={"starts_in_motion": True},
    right=[],
    also=["damping_error"],
    why="foreign: an eddy-current brake about +10 deg only; that damping is too low on the whole is true as well",
    tested="free decays of a pendulum from 36, -21 and 29 degrees; its angle",
    size="a Gaussian 4 degrees wide: 100 times the damping of the pivot inside, nothing outside",
    background="friction 1e-4 N m, drag",
    noise_stated="as it is, steps of 0.044 degrees",
    left={"angle": Left(119.69, 13.94, 6.02, 0.30, 0.29)},
    farthest="damping +32.4",
    found="1.2; 0.0588 N m s/rad, 4.15 degrees wide, at 10.01 degrees",
)
