"""Robot cases of a fourth author: dynamics as MuJoCo's, friction that holds, play, folders that are read as they are meant."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bench.discrepancy import read_case

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from fourth_robots_cases import making
from fourth_robots_cases.cases import robot_cases
from fourth_robots_cases.faults import with_faults
from fourth_robots_cases.mjcf import against_mujoco, mjcf
from fourth_robots_cases.plant import machine_of, nominal_parameters
from fourth_robots_cases.running import BEFORE, STEP, clock_of, command_of, run

pytestmark = pytest.mark.slow  # the loops are compiled


@pytest.mark.parametrize("name", ["finger-1", "crane-1", "wrist-1", "balanced-1", "stage-1", "ankle-1"])
def test_mass_matrix_and_bias_are_those_of_mujoco(name):
    assert against_mujoco(robot_cases()[name].robot) < 1e-12  # 4e-14 as measured


def test_a_run_of_the_nominal_robot_is_that_of_mujoco():
    case = replace(robot_cases()["finger-1"], seconds=2, clock="exact")
    nominal = machine_of(case.robot, nominal_parameters(case.robot), np.zeros(3))
    command = command_of(case, nominal, case.seed, 0)
    ours = run(nominal, command, clock_of(np.random.default_rng(0), case)).position
    model = mujoco.MjModel.from_xml_string(mjcf(case.robot))
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    data.qpos[:] = data.ctrl[:] = command.start
    mujoco.mj_step(model, data, round(BEFORE / STEP))
    theirs = []
    for goal in command.position:
        theirs.append(data.qpos.copy())
        data.ctrl[:] = goal
        mujoco.mj_step(model, data, round(1 / case.rate / STEP))
    # 5e-8 as measured; the motions are of 0.1 to 0.2 rad
    assert np.abs(np.array(theirs) - ours).max() < 2e-7


def test_friction_holds_every_joint_and_play_lets_the_link_lag():
    case = replace(robot_cases()["finger-2"], seconds=2)
    robot, nominal = case.robot, nominal_parameters(case.robot)
    free = machine_of(robot, nominal, np.zeros(3))
    command, clock = command_of(case, free, case.seed, 0), clock_of(np.random.default_rng(0), case)
    held = run(
        machine_of(robot, nominal, np.full(3, 10.0)), command, clock
    )  # more than servos and gravity give
    assert np.ptp(held.position, axis=0).max() < 1e-9  # the sweeps end at a billionth of the friction
    moved = run(free, command, clock)
    assert np.ptp(moved.position, axis=0).min() > 0.05
    loose = run(with_faults(free, robot, case.faults[:1]), command, clock)
    apart = np.abs(loose.motor - loose.position).max(axis=0)
    assert 0.016 < apart[0] < 0.03  # half of 0.034 rad, and what the faces give way
    assert apart[1:].max() == 0.0


def test_a_case_is_read_as_it_is_meant_and_its_seed_gives_its_bytes(tmp_path):
    case = replace(robot_cases()["wrist-1"], seconds=1)
    for folder in ("one", "other"):
        making.write(making.make(case), tmp_path / folder, tmp_path / folder / "answers")
    files = [path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.*")]
    assert len(files) == 6
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()
    read = read_case(tmp_path / "one" / "wrist-1")
    assert [record.name for record in read.identification] == ["identification", "identification_2"]
    assert read.channel("spin").noise_std is None
    answer = json.loads((tmp_path / "one" / "answers" / "wrist-1.json").read_text())
    assert [effect["name"] for effect in answer["effects"]] == ["cogging"]


def test_names_of_cases_are_those_of_the_readme_and_of_the_rules():
    folder = Path(making.__file__).parent
    rows = [line.split("|") for line in (folder / "README.md").read_text().splitlines()]
    named = {row[1].strip() for row in rows if len(row) == 8} - {"case", "---"}
    assert named == set(robot_cases()) == set(json.loads((folder / "acceptance.json").read_text())["cases"])
