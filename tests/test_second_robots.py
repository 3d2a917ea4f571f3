"""Robot cases simulated apart from the bench: dynamics as MuJoCo's, friction that sticks, folders that are read as they are meant."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.discrepancy import read_case

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from second_robots_cases import making, plant, robots
from second_robots_cases.cases import robot_cases
from second_robots_cases.faults import friction, payload
from second_robots_cases.mjcf import against_mujoco
from second_robots_cases.running import run

pytestmark = pytest.mark.slow  # the loops are compiled
ROBOTS = (
    robots.pan_tilt_head, robots.two_link, robots.scara, robots.hopper_leg, robots.bench_arm, robots.gantry,
)  # fmt: skip


@pytest.mark.parametrize("robot", ROBOTS)
def test_mass_matrix_and_bias_are_those_of_mujoco(robot):
    assert against_mujoco(robot()) < 1e-13  # 2e-15 as measured: rounding of sums of order ten


def test_friction_holds_a_joint_at_rest():
    robot = robots.pan_tilt_head()
    nominal = plant.nominal_plant(robot)
    stuck = nominal.copied()
    friction((10.0, 10.0))(stuck)  # more than the servos (6 N m) and gravity give
    reference = np.full((20, 2), 0.4)
    reference[10:] = 0.6
    done = run(stuck, robot, nominal, reference, 1e-4, np.random.default_rng(0))
    assert np.ptp(done.position, axis=0).max() == 0.0
    free = run(nominal, robot, nominal, reference, 1e-4, np.random.default_rng(0))
    assert np.ptp(free.position, axis=0).min() > 0.01


def test_a_payload_at_the_centre_of_mass_adds_no_inertia():
    robot = robots.pan_tilt_head()
    carrying, nominal = plant.nominal_plant(robot), plant.nominal_plant(robot)
    payload(1, 0.5, robot.links[1].com)(carrying)
    assert carrying.chain.mass[1] == pytest.approx(1.9)
    np.testing.assert_allclose(carrying.chain.com, nominal.chain.com, atol=1e-15)
    np.testing.assert_allclose(carrying.chain.inertia, nominal.chain.inertia, atol=1e-15)


def test_a_case_is_read_as_it_is_meant(tmp_path, monkeypatch):
    monkeypatch.setattr(making, "SHORTEST", 3)
    monkeypatch.setattr(making, "LONGEST", 3)
    case = replace(robot_cases()["ptz-1"], step=5e-4)
    making.write(making.make(case, 1), tmp_path / "cases", tmp_path / "answers")
    read = read_case(tmp_path / "cases" / "ptz-1")
    answer = json.loads((tmp_path / "answers" / "ptz-1.json").read_text())
    assert [record.name for record in read.identification] == ["identification", "identification_2"]
    assert read.channel("pan_angle").noise_std is None
    assert answer["class"] == "single"
    assert answer["gaps_by_joint"]["validation"][0] > 0.05
    again = making.make(case, 1)
    assert answer == json.loads(json.dumps(again.answer))


def test_names_of_cases_are_those_of_the_readme():
    text = Path(making.__file__).with_name("README.md").read_text()
    rows = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    assert sorted(set(rows) - {"case"}) == sorted(robot_cases())
