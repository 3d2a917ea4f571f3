"""Robot cases of a third author: dynamics as MuJoCo's, friction and gears that hold, folders that are read as they are meant."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.discrepancy import read_case

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from third_robots_cases import making
from third_robots_cases.cases import robot_cases
from third_robots_cases.mjcf import against_mujoco
from third_robots_cases.plant import nominal_plant
from third_robots_cases.running import run

pytestmark = pytest.mark.slow  # the loops are compiled


@pytest.mark.parametrize("name", ["boom-1", "hung-1", "gantry-1", "slide-1", "pal-1"])
def test_mass_matrix_and_bias_are_those_of_mujoco(name):
    case = robot_cases()[name]
    # 6e-14 as measured; the MJCF of the gantry tells the axis of its wrist to eight digits
    assert against_mujoco(case.robot, case.drive) < (1e-7 if name == "gantry-1" else 1e-12)


def test_friction_holds_every_joint_and_a_gap_lets_the_link_lag():
    case = replace(robot_cases()["hung-1"], seconds=2.0)
    nominal = nominal_plant(case.robot, case.drive)
    stuck = nominal.copied()
    stuck.machine.drives.coulomb[:] = 1e4  # more than servos and gravity give
    held = run(case, stuck, nominal, case.seed, 0, jitter=False)
    assert np.ptp(held.position, axis=0).max() < 1e-9  # the sweeps end at a billionth of the friction
    free = run(case, nominal, nominal, case.seed, 0, jitter=False)
    assert np.ptp(free.position, axis=0).min() > 0.05
    loose = run(case, making.with_faults(nominal, case.faults), nominal, case.seed, 0, jitter=False)
    apart = np.abs(loose.position - free.position).max(axis=0)
    assert 0.005 < apart[1] < 0.1  # a gap of 0.032 rad at the knee


def test_a_case_is_read_as_it_is_meant(tmp_path):
    case = replace(robot_cases()["slide-1"], seconds=3.0)
    made = making.make(case)
    making.write(made, tmp_path / "cases", tmp_path / "answers")
    read = read_case(tmp_path / "cases" / "slide-1")
    answer = json.loads((tmp_path / "answers" / "slide-1.json").read_text())
    assert [record.name for record in read.identification] == ["identification", "identification_2"]
    assert read.channel("j2_position").noise_std is None
    assert [effect["name"] for effect in answer["effects"]] == ["coulomb_friction"]
    assert answer == json.loads(json.dumps(making.make(case).answer))


def test_names_of_cases_are_those_of_the_readme_and_of_the_rules():
    folder = Path(making.__file__).parent
    rows = [line.split("|") for line in (folder / "README.md").read_text().splitlines()]
    named = {row[1].strip() for row in rows if len(row) == 8} - {"case", "---"}
    assert named == set(robot_cases()) == set(json.loads((folder / "acceptance.json").read_text())["cases"])
