"""A case made and written: the robot drawn, run along its references, logged, and its answer told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fourth_robots_cases.answers import Sizes, answer_document
from fourth_robots_cases.faults import with_faults
from robot_case_sets import UnstableRobotError

from bench.arrays import Array
from bench.files import write_text
from fifth_robots_cases.answers import Measured, sizes
from fifth_robots_cases.cases import RobotCase
from fifth_robots_cases.mjcf import mjcf
from fifth_robots_cases.plant import drawn_parameters, machine_of, nominal_parameters
from fifth_robots_cases.recording import logged, write_record
from fifth_robots_cases.running import command_of, run
from fifth_robots_cases.stating import nominal_document

SEED = 20250505
"""Of the set; each case adds its own."""


class MadeRobotCase(NamedTuple):
    """What was made of a case."""

    case: RobotCase
    answer: dict[str, Any]
    sizes: dict[str, Sizes]
    """What the effects make of each record."""
    tables: dict[str, Array]
    """Records, (n_samples, n_columns)."""


def make(case: RobotCase, shift: int = 0) -> MadeRobotCase:
    """Simulate a case, with a shift added to its seed.

    Raises:
        UnstableRobotError: A simulation left the finite numbers.
    """
    robot, friction = case.robot, np.array(case.background)
    rng = np.random.default_rng([SEED, case.seed + shift])
    parameters, nominal = drawn_parameters(rng, robot), nominal_parameters(robot)
    machine = with_faults(machine_of(robot, parameters, friction), robot, case.faults)
    tables, found = {}, {}
    for name, plan in case.records.items():
        ran = run(case, machine, command_of(rng, case, plan))
        if not np.isfinite(ran.steps.q).all():
            raise UnstableRobotError(f"{case.name}: a simulation diverged; choose a shorter step")
        tables[name] = logged(rng, case, machine, ran)
        found[name] = sizes(case, Measured(parameters, nominal, machine, ran))
    noise = np.array(case.load_noise or np.zeros(len(robot.links))) * parameters["gear"]
    answer = answer_document(case, parameters, friction, noise, "jitters", found)
    return MadeRobotCase(case, answer, found, tables)


def write(made: MadeRobotCase, cases: Path, answers: Path) -> None:
    """Write the folder of a case and its answer."""
    case, folder = made.case, cases / made.case.name
    for record, table in made.tables.items():
        write_record(folder / f"{record}.csv", case, table)
    write_text(folder / f"{case.robot.name}.xml", mjcf(case.robot))
    write_text(folder / "nominal.json", json.dumps(nominal_document(case), indent=1) + "\n")
    write_text(answers / f"{case.name}.json", json.dumps(made.answer, indent=1) + "\n")
