"""A case made and written: the robot drawn, run along its references, logged, and its answer told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from robot_case_sets import RECORDS, UnstableRobotError

from bench.arrays import Array
from bench.files import write_text
from third_robots_cases.answers import Runs, Sizes, answer_document, root_mean_square, sizes
from third_robots_cases.cases import RobotCase
from third_robots_cases.faults import Fault
from third_robots_cases.mjcf import mjcf
from third_robots_cases.plant import Plant, drawn_plant, nominal_plant
from third_robots_cases.recording import VELOCITY_NOISE, Noise, logged, write_record
from third_robots_cases.running import Run, run
from third_robots_cases.stating import nominal_document


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
    seed = case.seed + shift
    nominal = nominal_plant(case.robot, case.drive)
    true = drawn_plant(np.random.default_rng([seed, 1]), case.robot, case.drive)
    numbers = range(len(RECORDS))

    def ran(plant: Plant, record: int, *, jitter: bool = False) -> Run:
        done = run(case, plant, nominal, seed, record, jitter=jitter)
        if not np.isfinite(done.position).all():
            raise UnstableRobotError(f"{case.name}, record {record}: it diverged; choose a shorter step")
        return done

    bare = [ran(true, record) for record in numbers]
    torque = over_records([one.torque for one in bare])
    noise = Noise(
        position=np.full(len(torque), case.position_noise),
        torque=case.torque_noise * torque,
        velocity=VELOCITY_NOISE * over_records([one.velocity for one in bare]),
    )
    friction = case.background * torque
    sound = true.copied()
    sound.drives.coulomb[:] = friction
    full, several = with_faults(sound, case.faults), case.faults if len(case.faults) > 1 else ()
    tables, found = {}, {}
    for record, name in enumerate(RECORDS):
        runs = Runs(
            bare=bare[record],
            background=ran(sound, record, jitter=True),
            faulty=ran(with_faults(true, case.faults), record) if case.faults else None,
            each=tuple(ran(with_faults(true, (fault,)), record) for fault in several),
            full=ran(full, record, jitter=True),
        )
        rng = np.random.default_rng([seed, 100 + record])
        tables[name] = logged(rng, case, full, noise, runs.full)
        found[name] = sizes(case, true, full.drives.limit, noise, runs)
    stated = nominal_document(case, full, noise)
    return MadeRobotCase(case, tables, stated, found, answer_document(case, true, friction, noise, found))


def with_faults(plant: Plant, faults: tuple[Fault, ...]) -> Plant:
    """A copy of a plant with faults."""
    copy = plant.copied()
    for fault in faults:
        fault.into(copy)
    return copy


def over_records(runs: list[Array]) -> Array:
    """Root mean square of each joint over records (n_samples, n), each of which weighs the same (n)."""
    return np.sqrt(np.mean([root_mean_square(one) ** 2 for one in runs], 0))


def write(made: MadeRobotCase, cases: Path, answers: Path) -> None:
    """Write the folder of a case and its answer."""
    case, folder = made.case, cases / made.case.name
    for record, table in made.tables.items():
        write_record(folder / f"{record}.csv.gz", case, table)
    write_text(folder / "model.xml", mjcf(case.robot, case.drive))
    write_text(folder / "nominal.json", json.dumps(made.nominal, indent=1) + "\n")
    write_text(answers / f"{case.name}.json", json.dumps(made.answer, indent=1) + "\n")
