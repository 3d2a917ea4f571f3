"""Robot cases of a sixth author: dynamics as MuJoCo's, effects that act as told, folders that are read as they are meant."""

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

from robot_case_sets import differences_from_mujoco
from sixth_robots_cases import making, running
from sixth_robots_cases.cases import RobotCase, robot_cases
from sixth_robots_cases.dynamics import mass_matrix_and_bias
from sixth_robots_cases.effects import Effects, listed, with_effects
from sixth_robots_cases.machine import Machine
from sixth_robots_cases.mjcf import against_mujoco, mjcf
from sixth_robots_cases.plant import machine_of
from sixth_robots_cases.running import Run, background, played

pytestmark = pytest.mark.slow  # the loops are compiled

CASES = robot_cases()


def shortened(case: RobotCase, seconds: float, longest_step: float = 5e-4) -> RobotCase:
    records = {name: replace(signal, seconds=seconds) for name, signal in case.records.items()}
    return replace(case, records=records, longest_step=longest_step)


def effective(case: RobotCase) -> Machine:
    """The nominal robot with what is missing."""
    return with_effects(machine_of(case.robot, {}), case.robot, case.effects)


@pytest.fixture(autouse=True)
def _begins_soon(monkeypatch):
    monkeypatch.setattr(running, "SETTLE", 0.2)


@pytest.mark.parametrize("name", [name for name in CASES if name.endswith("_1")])
def test_mass_matrix_and_bias_are_those_of_mujoco(name):
    assert against_mujoco(CASES[name].robot) < 1e-9


def test_soil_in_a_bucket_and_a_base_that_leans_are_those_of_mujoco():
    digger, crane = CASES["sixth_digger_1"], CASES["sixth_crane_1"]
    x, y = np.radians([4.0, -2.5])
    # the room's plumb line in the frame of a base that is turned about x, then about its own y
    plumb = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]).T @ [
        0.0, -9.81 * np.sin(x), -9.81 * np.cos(x),
    ]  # fmt: skip
    leaning = " ".join(f"{g:.12g}" for g in plumb)
    models = (
        (digger, mjcf(digger.robot).replace('mass="3"', 'mass="4.5"')),
        (crane, mjcf(crane.robot).replace('gravity="0 0 -9.81"', f'gravity="{leaning}"')),
    )
    for case, model in models:
        assert model != mjcf(case.robot)
        machine = effective(case)

        def dynamics(q, v, machine=machine):
            matrix, bias = mass_matrix_and_bias(machine, q, v)
            return matrix + np.diag(machine.armature), bias

        assert differences_from_mujoco(model, dynamics) < 1e-9


def test_a_wheel_in_the_head_turns_with_it_and_does_no_work():
    case, rng = CASES["sixth_crane_2"], np.random.default_rng(0)
    still, turning = machine_of(case.robot, {}), effective(case)
    q, v = rng.normal(size=3), rng.normal(size=3)
    torque = mass_matrix_and_bias(turning, q, v)[1] - mass_matrix_and_bias(still, q, v)[1]
    lean = q[1] + q[2]  # of the head, about the axis of tilt
    across = -1.2 * np.sin(lean) + 0.3 * np.cos(lean)  # momentum along the post
    along = 1.2 * np.cos(lean) + 0.3 * np.sin(lean)  # and along the jib
    turned = along * v[0]
    assert torque == pytest.approx([-along * (v[1] + v[2]), turned, turned], abs=1e-12)
    assert torque @ v == pytest.approx(0.0, abs=1e-12)
    assert across != pytest.approx(along)


def off_mujoco(longest_step: float) -> float:
    """Largest difference of a joint's angle from MuJoCo's fourth-order run, rad, over a second."""
    case = shortened(CASES["sixth_desk_1"], 1.0, longest_step)
    ran = played(case, "identification", machine_of(case.robot, {}))
    model = mujoco.MjModel.from_xml_string(mjcf(case.robot))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data, moved = mujoco.MjData(model), []
    data.qpos[:], data.qvel[:] = np.split(ran.states[0], 4)[:2]
    clock = case.rng("clock/identification").normal(0.0, running.JITTER / case.laboratory.rate, 121)
    spans = np.diff(clock[20:]) + 1 / case.laboratory.rate
    for goal, span in zip(ran.commands, spans, strict=True):
        moved.append(data.qpos.copy())
        data.ctrl[:] = goal
        model.opt.timestep = span / 100
        mujoco.mj_step(model, data, 100)
    assert np.ptp(moved, axis=0).min() > 0.5
    return float(np.abs(np.array(moved) - ran.states[:, :4]).max())


def test_a_run_of_the_nominal_robot_comes_to_that_of_mujoco_as_steps_get_shorter():
    off = np.array([off_mujoco(step) for step in (2e-4, 1e-4, 5e-5)])
    assert off[-1] < 5e-4
    assert off[:-1] / off[1:] == pytest.approx(2.0, rel=0.03)  # steps of the first order


def test_friction_holds_every_joint_and_play_lets_the_link_lag():
    case = shortened(CASES["sixth_desk_1"], 1.5)
    free = machine_of(case.robot, {})
    held = played(case, "identification_2", free._replace(friction=np.full(4, 50.0)))
    assert np.ptp(held.states[:, :4], axis=0).max() < 1e-9
    loose = played(case, "identification_2", effective(case)).states
    apart = np.abs(loose[:, 8:12] - loose[:, :4]).max(axis=0)
    assert 0.028 < apart[0] < 0.04  # half of 0.06 rad, and what the teeth give way
    assert apart[1:].max() == 0.0


def test_a_late_drive_is_an_early_one_of_before_and_a_weak_servo_gives_no_more():
    leg = shortened(CASES["sixth_leg_1"], 1.0)
    sound = machine_of(leg.robot, {})
    late = with_effects(sound, leg.robot, replace(leg.effects, friction={}))
    assert late.delay.tolist() == [0.0, 0.014, 0.0]
    runs = [played(leg, "identification", machine) for machine in (sound, late)]
    assert np.abs(runs[0].torques - runs[0].commands).max() < 1e-12  # held over the sample
    assert np.abs(runs[1].torques - runs[1].commands)[:, [0, 2]].max() < 1e-12
    assert runs[1].torques[50:, 1] == pytest.approx(runs[1].commands[43:-7, 1], abs=0.05 * torque_of(runs[1]))
    wheel = shortened(CASES["sixth_wheelleg_1"], 2.0)
    weak = [
        played(wheel, "validation", machine) for machine in (machine_of(wheel.robot, {}), effective(wheel))
    ]
    assert np.abs(weak[0].torques[:, 1]).max() > 4.5
    assert np.abs(weak[1].torques[:, 1]).max() == pytest.approx(4.5)


def torque_of(ran: Run) -> float:
    """Largest torque of the hip."""
    return float(np.abs(ran.torques[:, 1]).max())


def test_effects_are_told_by_name_and_place():
    told = {
        name: [f"{one['name']}@{one['where']}" for one in listed(case.effects, case.robot)]
        for name, case in CASES.items()
    }
    rules = json.loads((Path(making.__file__).parent / "acceptance.json").read_text())["cases"]
    for name, case in CASES.items():
        if case.kind != "foreign":
            assert set(told[name]) in [set(group) for group in rules[name]["right"]]
    assert told["sixth_crane_2"] == ["rotor@head"]
    assert [case.kind for case in CASES.values()].count("double") == 2
    assert listed(Effects(), CASES["sixth_scara_2"].robot) == []


def test_stated_numbers_are_off_by_no_more_than_is_told():
    case = CASES["sixth_desk_1"]
    true, nominal = background(case), machine_of(case.robot, {})
    assert np.abs(true.mass / nominal.mass - 1).max() <= 1.5 * 0.03
    assert np.abs(true.kp - nominal.kp).max() <= 1.5 * (4.0 + 1.2)
    assert np.ptp(true.kp) <= 2 * 1.5 * 1.2  # servos of one type
    rated = np.array([part.rated for part in case.robot.parts])
    assert ((true.friction >= 0.01 * rated) & (true.friction <= 0.02 * rated)).all()


def test_each_case_is_read_as_it_is_meant(tmp_path):
    for name, case in CASES.items():
        making.write(making.make(shortened(case, 0.8, 2e-3)), tmp_path, tmp_path / "answers")
        read = read_case(tmp_path / name)
        assert [record.name for record in (*read.identification, *read.validation)] == list(case.records)
        effects = json.loads((tmp_path / "answers" / f"{name}.json").read_text())["effects"]
        assert effects == listed(case.effects, case.robot)
    nominal = json.loads((tmp_path / "sixth_scara_2" / "nominal.json").read_text())
    assert nominal["channels"]["elbow_torque"]["noise_std"] == pytest.approx(
        0.5 * 0.006 * 6.0
    )  # half the true
    desk = json.loads((tmp_path / "sixth_desk_1" / "nominal.json").read_text())
    assert desk["parameters"]["kp:pan_servo"]["alike"] == "HS30"
    assert "noise_std" not in desk["channels"]["pan_position"]


def test_a_seed_gives_the_bytes_of_a_case(tmp_path):
    case = shortened(CASES["sixth_pick_1"], 0.8, 2e-3)
    for folder, shift in (("one", 0), ("other", 0), ("next", 1)):
        making.write(making.make(case, shift), tmp_path / folder, tmp_path / folder / "answers")
    files = [path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.*")]
    assert len(files) == 7
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()
    records = [(tmp_path / folder / case.name / "validation.csv").read_bytes() for folder in ("one", "next")]
    assert records[0] != records[1]


def test_names_of_cases_are_those_of_the_readme_and_of_the_rules():
    folder = Path(making.__file__).parent
    rows = [line.split("|") for line in (folder / "README.md").read_text().splitlines()]
    named = {row[1].strip() for row in rows if len(row) == 8} - {"case", "---"}
    assert named == set(CASES) == set(json.loads((folder / "acceptance.json").read_text())["cases"])
