"""A case made and written: the robot drawn, run along its references, logged, and its answer told."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from robot_case_sets import RECORDS, UnstableRobotError

from bench.arrays import Array
from bench.files import write_text
from second_robots_cases.answers import Sizes, answer_document, sizes
from second_robots_cases.cases import RobotCase
from second_robots_cases.mjcf import mjcf
from second_robots_cases.plant import Plant, nominal_plant, perturbed_plant
from second_robots_cases.recording import logged, write_record
from second_robots_cases.references import Plan, reference
from second_robots_cases.running import Run, run
from second_robots_cases.stating import nominal_document

SHORTEST, LONGEST = 10, 16
"""Duration of a record [s], which is drawn from whole numbers."""


class Plants(NamedTuple):
    """A robot with its fault, and what tells how much of the records that makes."""

    nominal: Plant
    """As its model describes it, which is what its controller knows."""
    bare: Plant
    """With parameters as they were drawn."""
    sound: Plant
    """With background friction as well."""
    faulty: Plant
    """With the fault as well, as it is recorded."""


class MadeRobotCase(NamedTuple):
    """A case that was simulated."""

    case: RobotCase
    tables: dict[str, Array]
    """Records, (n_samples, 1 + 2 n_joints) in the units of the log."""
    sizes: dict[str, Sizes | None]
    """Sizes of the effects in each record; None where nothing is wrong."""
    answer: dict[str, Any]


def plants_of(rng: np.random.Generator, case: RobotCase) -> Plants:
    """The robot of a case with deviations drawn."""
    bare = perturbed_plant(rng, case.robot, alike=bool(case.alike))
    sound = bare.copied()
    sound.drives.coulomb[:] = case.coulomb
    faulty = sound.copied()
    case.fault(faulty)
    return Plants(nominal_plant(case.robot), bare, sound, faulty)


def make(case: RobotCase, seed: int) -> MadeRobotCase:
    """Simulate a case; its random numbers depend on the seed and on its name only.

    Raises:
        UnstableRobotError: A simulation left the finite numbers.
    """
    rng = np.random.default_rng([seed, zlib.crc32(case.name.encode())])
    plants = plants_of(rng, case)
    tables, found = {}, {}
    for record, plan in zip(RECORDS, case.plans, strict=True):
        done, found[record] = _recorded(rng, case, plants, record, plan)
        tables[record] = logged(rng, case.robot, done)
    return MadeRobotCase(case, tables, found, answer_document(case, plants.faulty, found))


def _recorded(
    rng: np.random.Generator, case: RobotCase, plants: Plants, record: str, plan: Plan
) -> tuple[Run, Sizes | None]:
    """A run of the faulty robot, and how much of it is the fault; the noise in the feedback is the same in all runs."""
    robot = case.robot
    seconds = float(rng.integers(SHORTEST, LONGEST + 1))
    highest = case.highest_frequency or robot.highest_frequency
    path = reference(rng, plan, robot, seconds, highest)
    seed = int(rng.integers(1 << 31))

    def ran(plant: Plant) -> Run:
        return run(plant, robot, plants.nominal, path, case.step, np.random.default_rng(seed))

    faulty = ran(plants.faulty)
    if not np.isfinite(faulty.position).all():
        raise UnstableRobotError(f"{case.name}, {record}: the simulation diverged; choose a shorter step")
    if not case.effects:
        return faulty, None
    bare = ran(plants.bare) if record == RECORDS[-1] else None
    return faulty, sizes(robot, faulty, ran(plants.sound), bare)


def write(made: MadeRobotCase, cases: Path, answers: Path) -> None:
    """Write the folder of a case and its answer."""
    case, folder = made.case, cases / made.case.name
    for record, table in made.tables.items():
        write_record(folder / f"{record}.csv.gz", case.robot, table)
    write_text(folder / "model.xml", mjcf(case.robot))
    write_text(folder / "nominal.json", json.dumps(nominal_document(case), indent=1) + "\n")
    write_text(answers / f"{case.name}.json", json.dumps(made.answer, indent=1) + "\n")
