"""A case made and written: the robot drawn, run along its references, logged, and its answer told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from robot_case_sets import RECORDS, UnstableRobotError

from bench.arrays import Array
from bench.files import write_text
from fourth_robots_cases.answers import Measured, Sizes, answer_document, root_mean_square, sizes
from fourth_robots_cases.cases import RobotCase
from fourth_robots_cases.faults import with_faults
from fourth_robots_cases.machine import Command, Machine
from fourth_robots_cases.mjcf import mjcf
from fourth_robots_cases.plant import drawn_parameters, machine_of, nominal_parameters
from fourth_robots_cases.recording import logged, write_record
from fourth_robots_cases.running import Clock, clock_of, command_of, replayed, run
from fourth_robots_cases.stating import nominal_document
from fourth_robots_cases.stepping import Trace


class MadeRobotCase(NamedTuple):
    """A case that was simulated."""

    case: RobotCase
    tables: dict[str, Array]
    """Records, (n_samples, n_columns)."""
    nominal: dict[str, Any]
    """What is stated of it."""
    sizes: dict[str, Sizes]
    """Sizes of the effects in each record."""
    answer: dict[str, Any]


def make(case: RobotCase, shift: int = 0) -> MadeRobotCase:
    """Simulate a case.

    Args:
        case: The case.
        shift: Added to its seed.

    Raises:
        UnstableRobotError: A simulation left the finite numbers.
    """
    robot, seed, none = case.robot, case.seed + shift, np.zeros(len(case.robot.links))
    nominal, parameters = nominal_parameters(robot), drawn_parameters(np.random.default_rng([seed, 7]), robot)
    # the controller knows the true centres of mass
    known = machine_of(robot, nominal._replace(com=parameters.com), none)
    bare = machine_of(robot, parameters, none)
    clocks = [clock_of(np.random.default_rng([seed, 40 + k]), case) for k in range(len(RECORDS))]
    commands = [command_of(case, known, seed, k) for k in range(len(RECORDS))]
    torques = [_ran(case, bare, *both).torque for both in zip(commands, clocks, strict=True)]
    # records weigh the same, however long they are
    torque = np.sqrt(np.mean([root_mean_square(one) ** 2 for one in torques], 0))
    friction, torque_std = case.background * torque, case.torque_noise * torque / parameters.gear
    full = with_faults(machine_of(robot, parameters, friction), robot, case.faults)
    tables, found = {}, {}
    for k, name in enumerate(RECORDS):
        clock, trace = clocks[k], _ran(case, full, commands[k], clocks[k])
        goals = replayed(commands[k], trace)

        def again(machine: Machine, goals: Command = goals, clock: Clock = clock) -> Trace:
            return _ran(case, machine, goals, clock)

        found[name] = sizes(case, Measured(parameters, nominal, friction, torque, trace, again))
        rng = np.random.default_rng([seed, 60 + k])
        tables[name] = logged(rng, case, seed, clock.ticks, parameters.gear, torque_std, trace)
    answer = answer_document(
        case, parameters._asdict(), friction, case.torque_noise * torque, case.clock, found
    )
    return MadeRobotCase(case, tables, nominal_document(case, torque_std), found, answer)


def _ran(case: RobotCase, machine: Machine, command: Command, clock: Clock) -> Trace:
    """What a machine did, which is finite."""
    trace = run(machine, command, clock)
    if not all(np.isfinite(values).all() for values in trace):
        raise UnstableRobotError(f"{case.name}: a simulation diverged; choose a shorter step")
    return trace


def write(made: MadeRobotCase, cases: Path, answers: Path) -> None:
    """Write the folder of a case and its answer."""
    case, folder = made.case, cases / made.case.name
    for record, table in made.tables.items():
        write_record(folder / f"{record}.csv.gz", case, table)
    write_text(folder / "model.xml", mjcf(case.robot))
    write_text(folder / "nominal.json", json.dumps(made.nominal, indent=1) + "\n")
    write_text(answers / f"{case.name}.json", json.dumps(made.answer, indent=1) + "\n")
