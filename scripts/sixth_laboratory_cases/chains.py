"""Cases of two masses, one upon the other: a frame of two storeys on a shaking table, and a floor with a machine on mounts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import MILLIMETRE, PRESCRIBED, load_on, of_joint

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.models import FLOOR as FLOOR_MODEL
from sixth_laboratory_cases.models import FRAME as FRAME_MODEL
from sixth_laboratory_cases.signals import band_noise, multisine, quake, sweep
from sixth_laboratory_cases.stepping import straight


class Chain(NamedTuple):
    """Two masses on two springs, the second one upon the first; what follows the dampings, a nominal model has not."""

    mass_1: float
    """Mass of the lower one [kg]."""
    mass_2: float
    """Mass of the upper one [kg]."""
    stiffness_1: float
    """Stiffness of the lower spring [N/m]."""
    stiffness_2: float
    """Stiffness of the upper spring [N/m]."""
    damping_1: float
    """Viscous damping of the lower spring [N s/m]."""
    damping_2: float
    """Viscous damping of the upper spring [N s/m]."""
    cubic_stiffness_1: float = 0.0
    """Coefficient of the cube of the deformation of the lower spring [N/m^3]."""
    cubic_stiffness_2: float = 0.0
    """The same of the upper one."""
    friction: float = 0.0
    """Dry friction in the lower spring [N]."""
    creep: float = 1e-3
    """Velocity [m/s] over which that changes its sign."""


@inlined
def chain_derivative(p: Chain, s: Array, load: Array, t: float) -> tuple[float, float, float, float]:
    """Time derivative of the deformations of the springs and their rates.

    The loads are the acceleration of the base [m/s^2] and a force on the lower mass [N].
    """
    lower = p.stiffness_1 * s[0] + p.damping_1 * s[2] + p.cubic_stiffness_1 * s[0] ** 3
    lower = lower + p.friction * np.tanh(s[2] / p.creep)
    upper = p.stiffness_2 * s[1] + p.damping_2 * s[3] + p.cubic_stiffness_2 * s[1] ** 3
    first = (load[1] - lower + upper) / p.mass_1
    second = -upper / p.mass_2
    return s[2], s[3], first - load[0], second - first


chain_march = stepper(chain_derivative)


def chain(run: Run) -> Signals:
    """Two masses on a base that moves, or under a force."""
    motion = chain_march(Chain(**run.values), np.zeros(4), straight(run.loads), run.step)
    first = motion.rate[:, 2] + run.loads[:, 0]
    return {
        "base": run.loads[:, 0],
        "load": run.loads[:, 1],
        "deformation_1": motion.state[:, 0],
        "acceleration_1": first,
        "acceleration_2": first + motion.rate[:, 3],
    }


def shaken_base(session: Session) -> Sequence[Array]:
    """Accelerations [m/s^2] of the table, and no force."""
    clock, rng = session.clock, session.rng
    base = (
        band_noise(clock, rng, (0.8, 14.0), 0.9),
        sweep(clock, (1.2, 14.0), 1.0),
        quake(clock, rng, 1.0),
    )
    return [np.column_stack([one, np.zeros(clock.n)]) for one in base]


FRAME = Case(
    name="sixth_frame_1",
    number=3,
    rig="frame.xml",
    model=FRAME_MODEL,
    rate=400,
    seconds=24.0,
    substeps=20,
    simulate=chain,
    excitation=shaken_base,
    parameters={
        "mass_1": Parameter("mass:floor_1", 4.5, 0.04, "kg"),
        "mass_2": Parameter("mass:floor_2", 3.8, 0.035, "kg"),
        "stiffness_1": Parameter("stiffness:storey_1", 5200.0, 130.0, "N/m"),
        "stiffness_2": Parameter("stiffness:storey_2", 4300.0, 120.0, "N/m"),
        "damping_1": Parameter("damping:storey_1", 11.0, 2.0, "N s/m"),
        "damping_2": Parameter("damping:storey_2", 8.0, 1.5, "N s/m"),
    },
    missing={"friction": 3.0, "creep": 4e-4, "stiffness_2": 4300.0 * 0.74},
    besides={"cubic_stiffness_1": 1.5e5, "cubic_stiffness_2": 3.0e5},
    channels={
        "table_acc": Channel("base", "m/s^2", 0.004, told=PRESCRIBED),
        "floor_1_acc": Channel("acceleration_1", "m/s^2", 0.02, slow=0.3),
        "floor_2_acc": Channel("acceleration_2", "m/s^2", 0.02, slow=0.3),
        "drift_1": Channel("deformation_1", "mm", 0.03, MILLIMETRE, told=of_joint("storey_1", "position")),
    },
    responses=("floor_1_acc", "floor_2_acc", "drift_1"),
    right=[
        ["coulomb_friction@storey_1", "stiffness_error@storey_2"],
        ["coulomb_friction@storey_1", "stiffness_error@stiffness:storey_2"],
    ],
    also=["cubic_stiffness"],
    why="Coulomb friction of 3 N in storey_1, and storey_2 softer by 26 % than stated",
    tested="two storeys on a shaking table, of which the validation record is like an earthquake; accelerations and the lower drift",
    size="friction 17 to 40 % of the force of storey_1; stiffness off by 9.3 sigmas",
    background="cubic springs below 1 %",
    noise_stated="as it is, slow by 30 %",
    left={
        "floor_1_acc": Left(129.30, 26.42, 39.19, 3.39, 1.18),
        "floor_2_acc": Left(123.17, 27.93, 25.02, 1.31, 0.68),
        "drift_1": Left(134.43, 27.87, 22.82, 1.30, 0.86),
    },
    farthest="mass of floor_1 -14.8",
    found="1.2; friction of 2.961 N, 3141 N/m in storey_2",
)


def shaken_floor(session: Session) -> Sequence[Array]:
    """Forces [N] of an inertial shaker on a floor whose base rests."""
    clock, rng = session.clock, session.rng
    forces = (
        multisine(clock, rng, (3.0, 40.0), 60.0, period=8.0),
        sweep(clock, (4.0, 35.0), 40.0),
        band_noise(clock, rng, (4.0, 35.0), 60.0),
    )
    return [np.column_stack([np.zeros(clock.n), one]) for one in forces]


FLOOR = Case(
    name="sixth_floor_1",
    number=4,
    rig="floor.xml",
    model=FLOOR_MODEL,
    rate=500,
    seconds=16.0,
    substeps=10,
    simulate=chain,
    excitation=shaken_floor,
    parameters={
        "mass_1": Parameter("mass:strip", 120.0, 1.5, "kg"),
        "mass_2": Parameter("mass:machine", 21.0, 0.2, "kg"),
        "stiffness_1": Parameter("stiffness:floor", 312000.0, 6000.0, "N/m"),
        "stiffness_2": Parameter("stiffness:mount", 148000.0, 3000.0, "N/m"),
        "damping_1": Parameter("damping:floor", 480.0, 60.0, "N s/m"),
        "damping_2": Parameter("damping:mount", 95.0, 20.0, "N s/m"),
    },
    missing={},
    besides={"cubic_stiffness_1": 5.0e8, "friction": 0.8, "creep": 2e-3},
    channels={
        "shaker_force": Channel("load", "N", 0.8, stated=0.5, told=load_on("shaker")),
        "strip_acc": Channel("acceleration_1", "m/s^2", 0.012, stated=0.5, slow=0.3),
        "machine_acc": Channel("acceleration_2", "m/s^2", 0.02, stated=0.5, slow=0.3),
    },
    responses=("strip_acc", "machine_acc"),
    right=[[]],
    also=["coulomb_friction@floor", "cubic_stiffness@floor"],
    why="nothing of size; the noise is twice what is stated",
    tested="a strip of a floor with a machine on mounts, and an inertial shaker; accelerations of both",
    size="–",
    background="friction 0.7 to 0.9 % of the force of the spring, cubic spring about 1 %, noise of the accelerations slow by 30 %",
    noise_stated="half of it",
    left={
        "strip_acc": Left(17.02, 17.02, 2.16, 2.16, 1.46),
        "machine_acc": Left(29.50, 29.50, 1.56, 1.56, 1.06),
    },
    farthest="damping of the mount -1.5",
    found="1.5",
)
