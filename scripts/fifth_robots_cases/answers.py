"""How much the effects make of the records of a case.

Where servos follow goals it is the difference of the positions of two simulations with the same goals, with it and without. Where currents
or torques are measured, it is what the torques of the drives differ from those of the sound model along the motion as it is logged, without
noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from fourth_robots_cases.answers import Parts, Sizes, root_mean_square, sizes_of
from fourth_robots_cases.faults import with_faults

from bench.arrays import Array
from fifth_robots_cases.cases import RobotCase
from fifth_robots_cases.dynamics import mass_matrix_and_bias
from fifth_robots_cases.machine import Machine
from fifth_robots_cases.plant import Parameters, machine_of
from fifth_robots_cases.recording import read_at, side_of
from fifth_robots_cases.running import Run, period, run


class Measured(NamedTuple):
    """What made a record."""

    parameters: Parameters
    """Of the robot."""
    nominal: Parameters
    """As they are stated."""
    machine: Machine
    """What was run, faults and background included."""
    ran: Run
    """What it did."""


def sizes(case: RobotCase, measured: Measured) -> Sizes:
    """Sizes of the effects in a record."""
    parts = _of_positions(case, measured) if case.robot.has_servos else _of_torques(case, measured)
    trace = measured.ran.trace
    return sizes_of(case, parts, root_mean_square(trace.torque), trace)


def _of_positions(case: RobotCase, measured: Measured) -> Parts:
    """By runs with the same goals, with and without."""
    robot, none = case.robot, np.zeros(len(case.robot.links))
    side = side_of(case, measured.machine)

    def positions(machine: Machine) -> Array:
        trace = run(case, machine, measured.ran.replay).trace
        return trace.motor if case.side == "motor" else trace.position

    sound = machine_of(robot, measured.parameters, none)
    bare = positions(sound)

    def change(machine: Machine) -> Array:
        return root_mean_square(positions(machine) - bare)

    return Parts(
        main=change(with_faults(sound, robot, case.faults)) if case.faults else np.zeros(len(side)),
        noise=np.array(case.position_noise),
        background=change(machine_of(robot, measured.parameters, np.array(case.background))),
        parameters=change(machine_of(robot, measured.nominal, none)),
        each=[],
    )


def _of_torques(case: RobotCase, measured: Measured) -> Parts:
    """Along the motion that is logged."""
    robot, ran, none = case.robot, measured.ran, np.zeros(len(case.robot.links))
    trace, friction = ran.trace, np.array(case.background)
    motion = _logged_motion(case, measured)
    sound = rigid_torques(*motion, machine_of(robot, measured.parameters, none))
    nominal = rigid_torques(*motion, machine_of(robot, measured.nominal, none))
    main = root_mean_square(trace.torque + trace.friction - sound)
    for fault in case.faults:
        if fault.name == "stribeck_friction":
            j = fault.joint(robot)
            main[j] = root_mean_square(trace.friction)[j]
    gear, read = measured.parameters["gear"], measured.nominal["gear"]
    return Parts(
        main=main,
        noise=np.array(case.load_noise) * gear,
        background=friction,
        parameters=root_mean_square(sound - nominal + trace.torque * (read / gear - 1)),
        each=[],
    )


def _logged_motion(case: RobotCase, measured: Measured) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations at the ticks as encoders read them, without noise; each (n_ticks, n)."""
    ran, side = measured.ran, side_of(case, measured.machine)
    t = np.arange(len(ran.trace.goal)) * period(case)
    rates = np.gradient(ran.steps.v, ran.step, axis=0)
    q, v, a = (np.zeros((len(t), len(side))) for _ in range(3))
    for j, m in enumerate(side):
        at = np.clip(t - measured.machine.late[j], 0, None)
        positions, velocities = read_at(ran.steps, ran.step, at)
        q[:, j], v[:, j] = positions[:, m], velocities[:, m]
        a[:, j] = rates[np.clip(np.round(at / ran.step).astype(int), 0, len(rates) - 1), m]
    return q, v, a


def rigid_torques(q: Array, v: Array, a: Array, machine: Machine) -> Array:
    """Torques of a motion with rotors, viscous friction and springs.

    Args:
        q, v, a: Positions, velocities and accelerations (n_samples, n).
        machine: What moves, rigidly.
    """
    passive, torque = machine.passive, np.zeros_like(q)
    for row, (at, fast, faster) in enumerate(zip(q, v, a, strict=True)):
        matrix, bias = mass_matrix_and_bias(at, fast, machine.chain)
        torque[row] = matrix @ faster + bias
    return torque + passive.armature * a + passive.damping * v + passive.stiffness * (q - passive.rest)
