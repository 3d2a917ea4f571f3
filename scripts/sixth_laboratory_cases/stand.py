"""Case of a stand for joints: two bodies on mounts with a rubber element between, which relaxes along its axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import MILLIMETRE

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.signals import band_noise, levels, multisine
from sixth_laboratory_cases.stepping import straight

NEWTON_A_MILLIMETRE = "N/mm", 1e3
"""A unit, with the value in SI units over that in it."""


class Pair(NamedTuple):
    """Two bodies on mounts with a joint between, along one direction; about one, read N m for N, rad for m and kg m^2 for kg."""

    mass_1: float
    """Mass of the first body [kg]."""
    mass_2: float
    """Mass of the second body [kg]."""
    mount_stiffness_1: float
    """Stiffness of the first mount [N/m]."""
    mount_stiffness_2: float
    """Stiffness of the second mount [N/m]."""
    mount_damping_1: float
    """Viscous damping of the first mount [N s/m]."""
    mount_damping_2: float
    """Viscous damping of the second mount [N s/m]."""
    stiffness: float
    """Stiffness of the joint [N/m]."""
    damping: float
    """Viscous damping of the joint [N s/m]."""


class Stand(NamedTuple):
    """A stand for joints; what follows the two directions, a nominal model has not."""

    axial: Pair
    """What it is along its axis."""
    torsional: Pair
    """What it is about its axis."""
    relaxing: float = 0.0
    """Stiffness [N/m] of a spring behind a dashpot, beside that of the joint along the axis."""
    relaxation_time: float = 0.02
    """Time [s] within which its force relaxes."""
    friction: float = 0.0
    """Dry friction of the joint along the axis [N]."""
    creep: float = 2e-3
    """Velocity [m/s] over which that changes its sign."""
    cubic_stiffness: float = 0.0
    """Coefficient of the cube of the twist of the joint [N m/rad^3]."""


@inlined
def pair_accelerations(
    p: Pair, x1: float, x2: float, v1: float, v2: float, load: float, besides: float
) -> tuple[float, float]:
    """Accelerations of both bodies under a load on the first, and what else the joint pulls them together with."""
    force = p.stiffness * (x2 - x1) + p.damping * (v2 - v1) + besides
    first = (load - p.mount_stiffness_1 * x1 - p.mount_damping_1 * v1 + force) / p.mass_1
    return first, (-p.mount_stiffness_2 * x2 - p.mount_damping_2 * v2 - force) / p.mass_2


@inlined
def stand_derivative(
    p: Stand, s: Array, load: Array, t: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Time derivative of the state under a force [N] and a torque [N m] on the first body.

    The state is both displacements, both velocities and the deformation of the dashpot along the axis, then both angles and both angular
    velocities about it.
    """
    q, twist = s[1] - s[0], s[6] - s[5]
    relaxing = p.relaxing * (q - s[4]) + p.friction * np.tanh((s[3] - s[2]) / p.creep)
    a1, a2 = pair_accelerations(p.axial, s[0], s[1], s[2], s[3], load[0], relaxing)
    turning = p.cubic_stiffness * twist**3
    b1, b2 = pair_accelerations(p.torsional, s[5], s[6], s[7], s[8], load[1], turning)
    return s[2], s[3], a1, a2, (q - s[4]) / p.relaxation_time, s[7], s[8], b1, b2


stand_march = stepper(stand_derivative)


def stand(run: Run) -> Signals:
    """A stand under a force and a torque at once."""
    rest = dict(run.values)
    axial, torsional = (
        Pair(*(rest.pop(f"{name}_{way}") for name in Pair._fields)) for way in ("axial", "torsional")
    )
    motion = stand_march(Stand(axial, torsional, **rest), np.zeros(9), straight(run.loads), run.step)
    return {
        "force": run.loads[:, 0],
        "torque": run.loads[:, 1],
        "acceleration_1": motion.rate[:, 2],
        "acceleration_2": motion.rate[:, 3],
        "displacement_1": motion.state[:, 0],
        "displacement_2": motion.state[:, 1],
        "rotation_1": motion.state[:, 5],
        "rotation_2": motion.state[:, 6],
    }


def force_and_torque(session: Session) -> Sequence[Array]:
    """Forces [N] and torques [N m]; in the second record the force steps."""
    clock, rng = session.clock, session.rng
    return (
        np.column_stack(
            [multisine(clock, rng, (0.3, 25.0), 50.0), multisine(clock, rng, (0.5, 20.0), 1.5)],
        ),
        np.column_stack(
            [
                levels(clock, (70.0, -60.0, 110.0, -20.0, 40.0), 0.04),
                band_noise(clock, rng, (1.0, 18.0), 1.3),
            ]
        ),
        np.column_stack(
            [band_noise(clock, rng, (0.4, 16.0), 50.0), band_noise(clock, rng, (0.8, 18.0), 1.5)],
        ),
    )


TESTSTAND = Case(
    name="sixth_teststand_1",
    number=5,
    rig="joint",
    rate=1000,
    seconds=10.0,
    substeps=10,
    simulate=stand,
    excitation=force_and_torque,
    parameters={
        "mass_1_axial": Parameter("mass_1", 8.0, 0.08, "kg"),
        "mass_2_axial": Parameter("mass_2", 5.2, 0.05, "kg"),
        "mass_1_torsional": Parameter("inertia_1", 0.06, 0.0008, "kg m^2"),
        "mass_2_torsional": Parameter("inertia_2", 0.041, 0.0006, "kg m^2"),
        "mount_stiffness_1_axial": Parameter("mount_stiffness_axial_1", 21.0, 0.5, *NEWTON_A_MILLIMETRE),
        "mount_stiffness_2_axial": Parameter("mount_stiffness_axial_2", 13.0, 0.35, *NEWTON_A_MILLIMETRE),
        "mount_damping_1_axial": Parameter("mount_damping_axial_1", 32.0, 6.0, "N s/m"),
        "mount_damping_2_axial": Parameter("mount_damping_axial_2", 22.0, 4.0, "N s/m"),
        "stiffness_axial": Parameter("joint_stiffness_axial", 15.0, 0.45, *NEWTON_A_MILLIMETRE),
        "damping_axial": Parameter("joint_damping_axial", 14.0, 4.0, "N s/m"),
        "mount_stiffness_1_torsional": Parameter("mount_stiffness_torsional_1", 155.0, 4.0, "N m/rad"),
        "mount_stiffness_2_torsional": Parameter("mount_stiffness_torsional_2", 95.0, 2.5, "N m/rad"),
        "mount_damping_1_torsional": Parameter("mount_damping_torsional_1", 0.16, 0.04, "N m s/rad"),
        "mount_damping_2_torsional": Parameter("mount_damping_torsional_2", 0.11, 0.03, "N m s/rad"),
        "stiffness_torsional": Parameter("joint_stiffness_torsional", 110.0, 3.5, "N m/rad"),
        "damping_torsional": Parameter("joint_damping_torsional", 0.09, 0.03, "N m s/rad"),
    },
    missing={"relaxing": 9000.0, "relaxation_time": 0.05},
    besides={"friction": 0.5, "creep": 2e-3, "cubic_stiffness": 4.0e3},
    channels={
        "force": Channel("force", "N", 0.4, stated=None),
        "torque": Channel("torque", "N m", 0.012, stated=None),
        "acceleration_1": Channel("acceleration_1", "m/s^2", 0.04, stated=None, slow=0.3),
        "acceleration_2": Channel("acceleration_2", "m/s^2", 0.04, stated=None, slow=0.3),
        "displacement_1": Channel("displacement_1", "mm", 0.01, MILLIMETRE, stated=None),
        "displacement_2": Channel("displacement_2", "mm", 0.01, MILLIMETRE, stated=None),
        "rotation_1": Channel("rotation_1", "rad", 1e-4, stated=None),
        "rotation_2": Channel("rotation_2", "rad", 1e-4, stated=None),
    },
    responses=("acceleration_2", "displacement_1", "displacement_2"),
    right=[["viscoelastic_relaxation@axial"]],
    also=["coulomb_friction@axial", "cubic_stiffness@torsional"],
    why="the axial joint relaxes: 9000 N/m behind a dashpot, 0.05 s",
    tested="two bodies with a rubber element between, under force and torque at once; one record has steps of the force",
    size="13 to 57 % of the force of the joint's spring",
    background="friction 0.5 N along the axis, cubic spring 1 to 3 % about it",
    noise_stated="not stated",
    left={
        "acceleration_2": Left(99.04, 5.24, 2.37, 1.18, 0.35),
        "displacement_1": Left(31.94, 8.24, 2.05, 0.43, 0.33),
        "displacement_2": Left(45.84, 7.35, 1.97, 0.52, 0.33),
    },
    farthest="axial stiffness of the joint +20.8",
    found="1.4; 9022 N/m, 0.04895 s",
)
