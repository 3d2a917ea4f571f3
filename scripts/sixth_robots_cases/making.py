"""A case made and written: the robot drawn, run along its references, logged, and its answer told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from bench.files import write_text
from sixth_robots_cases.answers import Sizes, answer_document, sizes
from sixth_robots_cases.cases import RobotCase
from sixth_robots_cases.effects import with_effects
from sixth_robots_cases.mjcf import mjcf
from sixth_robots_cases.recording import read, write_record
from sixth_robots_cases.running import Run, background, played
from sixth_robots_cases.stating import nominal_document


class MadeRobotCase(NamedTuple):
    """What was made of a case."""

    case: RobotCase
    """With the seed from which it was drawn."""
    answer: dict[str, Any]
    sizes: dict[str, Sizes]
    """How large the effects stand out, by joint."""
    runs: dict[str, Run]
    """What the robot did, by record."""


def make(case: RobotCase, shift: int = 0) -> MadeRobotCase:
    """Simulate a case, with a shift added to its seed.

    Raises:
        UnstableRobotError: A simulation left the finite numbers.
    """
    shifted = replace(case, shift=case.shift + shift)
    machine = with_effects(background(shifted), case.robot, case.effects)
    runs = {record: played(shifted, record, machine) for record in case.records}
    found = sizes(shifted, runs)
    return MadeRobotCase(shifted, answer_document(shifted, found), found, runs)


def write(made: MadeRobotCase, cases: Path, answers: Path) -> None:
    """Write the folder of a case and its answer."""
    case, folder = made.case, cases / made.case.name
    for record, ran in made.runs.items():
        positions, loads = read(case, record, ran)
        write_record(folder / f"{record}.csv", case, ran.time, positions, loads)
    write_text(folder / f"{case.robot.name}.xml", mjcf(case.robot))
    write_text(folder / "nominal.json", json.dumps(nominal_document(case), indent=2) + "\n")
    write_text(answers / f"{case.name}.json", json.dumps(made.answer, indent=1) + "\n")
