"""The answer to a case: what is there, how much of the records it makes, and the true parameters.

How much something makes of a robot with servos is the difference of the positions of two simulations with the same goals, with it and
without. Where currents or torques are measured, it is the torque that it adds along the motion that is logged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from robot_case_sets import shown

from bench.arrays import Array
from fourth_robots_cases.cases import BasicCase, RobotCase
from fourth_robots_cases.faults import with_faults
from fourth_robots_cases.machine import Machine
from fourth_robots_cases.plant import Parameters, machine_of
from fourth_robots_cases.running import rigid_torques
from fourth_robots_cases.stepping import Trace

RESTING = 1e-4
"""Speed below which a joint rests [rad/s or m/s]."""
STATED = {1.0: "true", 0.5: "understated by 2", None: "not stated"}
"""What is told of the noise that is stated, by its share of the true one."""


class Sizes(NamedTuple):
    """Sizes of the effects in one record, by joint; None where they are not measured."""

    unit: str
    """Unit of the first sizes."""
    motion_std: list[float] | None
    """Standard deviation of the positions [rad or m]."""
    main: list[float]
    """What the faults make."""
    main_over_noise: list[float]
    """The same over the noise of its channel."""
    background_friction: list[float]
    """What the background makes."""
    parameters_off: list[float]
    """What the deviations of the parameters make."""
    torque_rms: list[float]
    """Root mean square of the torques or forces [N m or N]."""
    each: list[list[float]] | None
    """What each of several faults makes alone."""
    in_stop: float | None
    """Share of the time in a stop."""
    in_gap: float | None
    """Share of the time within the play."""
    resting: list[float]
    """Share of the time for which a joint rests."""
    speed_rms: list[float]
    """Root mean square of the speed [rad/s or m/s]."""
    range: list[list[float]]
    """Smallest and largest positions [rad or m]."""


class Measured(NamedTuple):
    """What made a record."""

    parameters: Parameters
    """Of the robot."""
    nominal: Parameters
    """As they are stated."""
    friction: Array
    """Dry friction of the background [N m or N] (n)."""
    torque: Array
    """Root mean square of the torques without faults and background, over all records [N m or N] (n)."""
    trace: Trace
    """The run that is logged."""
    again: Callable[[Machine], Trace]
    """Runs another machine with the same goals."""


def root_mean_square(values: Array) -> Array:
    """Root mean square of each column (n)."""
    return np.sqrt(np.mean(np.square(values), 0))


class Parts(NamedTuple):
    """What makes the positions [rad or m] or the torques [N m or N] of a record, by joint; each (n)."""

    main: Array
    """All faults."""
    noise: Array
    """Noise of the channel."""
    background: Array
    """Background friction."""
    parameters: Array
    """Deviations of the parameters."""
    each: list[Array]
    """Each fault alone, where there are several and they are measured so."""


def sizes(case: RobotCase, measured: Measured) -> Sizes:
    """Sizes of the effects in a record."""
    parts = _of_positions(case, measured) if case.robot.has_servos else _of_torques(case, measured)
    return sizes_of(case, parts, measured.torque, measured.trace)


def sizes_of(case: BasicCase, parts: Parts, torque: Array, trace: Trace) -> Sizes:
    """Sizes in a record.

    Args:
        case: The case.
        parts: What makes positions, where servos follow goals, or torques.
        torque: Torques of which the latter are told as parts [N m or N] (n).
        trace: What the robot did.
    """
    servos = case.robot.has_servos
    whole = np.ones_like(torque) if servos else torque
    stopped = _share(case, "one_sided_stop", lambda j, told: trace.position[:, j] > told["place"])
    between = np.abs(trace.motor - trace.position)
    loose = _share(case, "backlash", lambda j, told: between[:, j] < told["gap"] / 2)
    return Sizes(
        unit="rad or m" if servos else "of the rms torque",
        motion_std=rounded(trace.position.std(0)) if servos else None,
        main=rounded(parts.main / whole),
        main_over_noise=rounded(parts.main / parts.noise),
        background_friction=rounded(parts.background / whole),
        parameters_off=rounded(parts.parameters / whole),
        torque_rms=rounded(root_mean_square(trace.torque)),
        each=[rounded(one) for one in parts.each] or None,
        in_stop=stopped,
        in_gap=loose,
        resting=rounded(np.mean(np.abs(trace.velocity) < RESTING, 0)),
        speed_rms=rounded(root_mean_square(trace.velocity)),
        range=[rounded(trace.position.min(0)), rounded(trace.position.max(0))],
    )


def _of_positions(case: RobotCase, measured: Measured) -> Parts:
    """By runs with the same goals, with and without."""
    robot, none = case.robot, np.zeros(len(case.robot.links))
    sound = machine_of(robot, measured.parameters, none)
    bare = measured.again(sound).position

    def change(machine: Machine) -> Array:
        return root_mean_square(measured.again(machine).position - bare)

    several = case.faults if len(case.faults) > 1 else ()
    return Parts(
        main=change(with_faults(sound, robot, case.faults)),
        noise=np.array(case.position_noise),
        background=change(machine_of(robot, measured.parameters, measured.friction)),
        parameters=change(machine_of(robot, measured.nominal, none)),
        each=[change(with_faults(sound, robot, (fault,))) for fault in several],
    )


def _of_torques(case: RobotCase, measured: Measured) -> Parts:
    """Along the motion that is logged."""
    trace, robot, none = measured.trace, case.robot, np.zeros(len(case.robot.links))
    main = root_mean_square(trace.fault)
    for fault in case.faults:
        if fault.name == "stribeck_friction":
            j = fault.joint(robot)
            main[j] = root_mean_square(trace.friction)[j]
    acceleration = np.gradient(trace.velocity, 1 / case.rate, axis=0)

    def rigid(parameters: Parameters) -> Array:
        machine = machine_of(robot, parameters, none)
        return rigid_torques(trace.position, trace.velocity, acceleration, machine.chain, machine.passive)[0]

    read = trace.torque * (measured.nominal.gear / measured.parameters.gear - 1)
    return Parts(
        main=main,
        noise=case.torque_noise * measured.torque,
        background=measured.friction,
        parameters=root_mean_square(rigid(measured.parameters) - rigid(measured.nominal) + read),
        each=[],
    )


def _share(case: BasicCase, name: str, within: Callable[[int, Mapping[str, Any]], Array]) -> float | None:
    """Share of the samples that are within something at the joint of a fault of a name; None where there is no such fault."""
    for fault in case.faults:
        if fault.name == name:
            return float(np.mean(within(fault.joint(case.robot), fault.parameters)))
    return None


def rounded(values: Array) -> list[float]:
    """Values (n) to four digits."""
    return [float(f"{x:.4g}") for x in values]


def in_lines(records: Mapping[str, Sizes]) -> str:
    """Sizes of the effects by joint, a line for each record."""
    lines = []
    for record, size in records.items():
        rows = (
            ("main", size.main),
            ("main/noise", size.main_over_noise),
            ("background", size.background_friction),
        )
        sized = ", ".join(f"{name} {shown(row)}" for name, row in rows)
        lines.append(f"    {record} ({size.unit}): {sized}\n")
    return "".join(lines)


def answer_document(
    case: BasicCase, parameters: Mapping[str, Array], friction: Array, torque_noise: Array, clock: str,
    records: Mapping[str, Sizes],
) -> dict[str, Any]:  # fmt: skip
    """The answer.

    Args:
        case: The case.
        parameters: Of the robot, without faults.
        friction: Dry friction of the background [N m or N] (n).
        torque_noise: Standard deviation of the noise of measured torques [N m or N] (n).
        clock: Of the log.
        records: Sizes of the effects by record.
    """
    robot = case.robot
    return {
        "case": case.name,
        "class": case.kind,
        "robot": robot.name,
        "drive": robot.drive,
        "side": case.side,
        "joints": robot.joints,
        "effects": [
            {"name": fault.name, "where": fault.where, "parameters": dict(fault.parameters)}
            for fault in case.faults
        ],
        "background_coulomb": rounded(friction),
        "noise": {
            "stated": STATED[case.stated],
            "position": list(case.position_noise),
            "torque": None if robot.has_servos else rounded(torque_noise),
        },
        "clock": clock,
        "true": {
            name: values.tolist() if values.ndim > 1 else rounded(values)
            for name, values in parameters.items()
        },
        "sizes": {
            record: {name: size for name, size in found._asdict().items() if size is not None}
            for record, found in records.items()
        },
    }
