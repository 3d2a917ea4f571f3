"""Robot cases of a fifth author: dynamics as MuJoCo's, faults that act as told, folders that are read as they are meant."""

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

from fifth_robots_cases import making, running
from fifth_robots_cases.cases import RobotCase, robot_cases
from fifth_robots_cases.dynamics import mass_matrix_and_bias
from fifth_robots_cases.mjcf import against_mujoco, mjcf
from fifth_robots_cases.plant import chain_of, machine_of, nominal_parameters
from fifth_robots_cases.recording import read_at
from fifth_robots_cases.running import command_of, run
from fourth_robots_cases.faults import with_faults
from robot_case_sets import differences_from_mujoco

pytestmark = pytest.mark.slow  # the loops are compiled

CASES = robot_cases()
BEFORE = 0.2
"""Time before a record [s], less than that of the set."""


def shortened(case: RobotCase, seconds: float, longest_step: float = 2.5e-4) -> RobotCase:
    plans = tuple(plan._replace(seconds=seconds) for plan in case.plans)
    return replace(case, plans=plans, longest_step=longest_step)


@pytest.fixture(autouse=True)
def _begins_soon(monkeypatch):
    monkeypatch.setattr(running, "BEFORE", BEFORE)


@pytest.mark.parametrize("name", [name for name in CASES if name.endswith("_1")])
def test_mass_matrix_and_bias_are_those_of_mujoco(name):
    assert against_mujoco(CASES[name].robot) < 1e-9  # the MJCF has ten digits


def test_a_payload_and_a_base_that_leans_are_those_of_mujoco():
    arm, head = CASES["fifth_springarm_1"], CASES["fifth_pantilt_1"]
    site = '<site name="forearm_tip" pos="0.31 0 0"/>'
    point = '<body pos="0.31 0 0"><inertial pos="0 0 0" mass="0.16" diaginertia="1e-15 1e-15 1e-15"/></body>'
    lean, side = np.radians([4.5, 115.0])
    leaning = (
        f"{9.81 * np.sin(lean) * np.cos(side)} {9.81 * np.sin(lean) * np.sin(side)} {-9.81 * np.cos(lean)}"
    )
    models = (
        (arm, mjcf(arm.robot).replace(site, site + point)),
        (head, mjcf(head.robot).replace('gravity="0 0 -9.81"', f'gravity="{leaning}"')),
    )
    for case, model in models:
        assert model != mjcf(case.robot)
        parameters = nominal_parameters(case.robot)
        sound = machine_of(case.robot, parameters, np.zeros(len(case.robot.links)))
        chain, armature = with_faults(sound, case.robot, case.faults).chain, np.diag(parameters["armature"])

        def dynamics(q, v, chain=chain, armature=armature):
            matrix, bias = mass_matrix_and_bias(q, v, chain)
            return matrix + armature, bias

        assert differences_from_mujoco(model, dynamics) < 1e-9


def test_a_rotor_turns_yaw_and_pitch_against_one_another_and_does_no_work():
    case, rng = CASES["fifth_gantry_1"], np.random.default_rng(0)
    parameters = nominal_parameters(case.robot)
    still = chain_of(case.robot, parameters["mass"])
    turning = with_faults(machine_of(case.robot, parameters, np.zeros(4)), case.robot, case.faults).chain
    q, v = rng.normal(size=4), rng.normal(size=4)
    torque = mass_matrix_and_bias(q, v, turning)[1] - mass_matrix_and_bias(q, v, still)[1]
    across = 0.12 * np.cos(q[3])  # of the spindle's momentum, to the axis of yaw
    assert torque == pytest.approx([0.0, 0.0, -across * v[3], across * v[2]], abs=1e-12)
    assert torque @ v == pytest.approx(0.0, abs=1e-12)


def test_a_run_of_the_nominal_robot_is_that_of_mujoco():
    case = shortened(CASES["fifth_surgwrist_1"], 1.0)
    command = command_of(np.random.default_rng(0), case, case.plans[0])
    ran = run(case, machine_of(case.robot, nominal_parameters(case.robot), np.zeros(4)), command)
    model = mujoco.MjModel.from_xml_string(mjcf(case.robot))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, ran.step
    data = mujoco.MjData(model)
    data.qpos[:] = command.start
    theirs, substeps = [], round(1 / case.rate / ran.step)
    for goal in command.position:
        theirs.append(data.qpos.copy())
        data.ctrl[:] = goal
        mujoco.mj_step(model, data, substeps)
    moved = np.array(theirs[round(BEFORE * case.rate) :])
    assert np.ptp(moved, axis=0).min() > 0.1
    assert np.abs(moved - ran.trace.position).max() < 2e-6  # 3e-7 as measured


def test_friction_holds_every_joint_and_play_lets_the_link_lag():
    case = shortened(CASES["fifth_hexleg_1"], 2.0)
    robot, nominal = case.robot, nominal_parameters(case.robot) | {"frictionloss": np.zeros(3)}
    command = command_of(np.random.default_rng(0), case, case.plans[0])
    held = run(
        case, machine_of(robot, nominal, np.full(3, 10.0)), command
    )  # more than servos and gravity give
    assert np.ptp(held.trace.position, axis=0).max() < 1e-9
    free = machine_of(robot, nominal, np.zeros(3))
    assert np.ptp(run(case, free, command).trace.position, axis=0).min() > 0.05
    loose = run(case, with_faults(free, robot, case.faults), command).trace
    apart = np.abs(loose.motor - loose.position).max(axis=0)
    assert 0.02 < apart[2] < 0.03  # half of 0.04 rad, and what the teeth give way
    assert apart[:2].max() == 0.0


def test_a_dead_band_leaves_a_servo_without_torque_and_a_stop_only_pushes():
    wrist = shortened(CASES["fifth_surgwrist_1"], 2.0)
    sound = machine_of(wrist.robot, nominal_parameters(wrist.robot), np.zeros(4))
    trace = run(
        wrist,
        with_faults(sound, wrist.robot, wrist.faults),
        command_of(np.random.default_rng(0), wrist, wrist.plans[0]),
    ).trace
    within = np.abs(trace.goal - trace.position)[:, 2] < 0.0175  # a step moves by less than what is left
    assert 0.1 < within.mean() < 0.9
    assert np.abs(trace.torque[within, 2]).max() == 0.0 < np.abs(trace.torque[~within, 2]).max()
    leg = shortened(CASES["fifth_exoleg_1"], 2.0)
    limp = machine_of(leg.robot, nominal_parameters(leg.robot), np.zeros(3))
    stopped = run(
        leg, with_faults(limp, leg.robot, leg.faults), command_of(np.random.default_rng(0), leg, leg.plans[0])
    )
    push, place = stopped.trace.fault[:, 1], stopped.trace.position[:, 1]
    assert push.max() == 0.0 > push.min()
    assert place[push < 0].min() > -0.16


def test_a_late_position_is_that_of_before():
    case = CASES["fifth_springarm_1"]
    machine = machine_of(case.robot, nominal_parameters(case.robot), np.zeros(3))
    assert with_faults(machine, case.robot, case.faults).late.tolist() == [0.011, 0.0, 0.0]
    short = shortened(case, 1.0)
    ran = run(short, machine, command_of(np.random.default_rng(0), short, short.plans[0]))
    t = np.array([0.2, 0.7])
    q, v = read_at(ran.steps, ran.step, t)
    assert q == pytest.approx(ran.trace.position[np.round(t * case.rate).astype(int)], abs=1e-12)
    assert read_at(ran.steps, ran.step, t - 1e-4)[0] == pytest.approx(q - 1e-4 * v, abs=1e-6)


def test_each_case_is_read_as_it_is_meant(tmp_path):
    for name, case in CASES.items():
        making.write(making.make(shortened(case, 0.8, 2e-3)), tmp_path, tmp_path / "answers")
        read = read_case(tmp_path / name)
        assert [record.name for record in (*read.identification, *read.validation)] == list(case.records)
        effects = json.loads((tmp_path / "answers" / f"{name}.json").read_text())["effects"]
        assert [effect["name"] for effect in effects] == [fault.name for fault in case.faults]
    nominal = json.loads((tmp_path / "fifth_hexleg_2" / "nominal.json").read_text())
    assert nominal["channels"]["tibia_angle"]["noise_std"] == 9e-4  # half the true
    assert nominal["parameters"]["kp:coxa_servo"]["alike"] == "HS7"


def test_a_seed_gives_the_bytes_of_a_case(tmp_path):
    case = shortened(CASES["fifth_pantilt_1"], 0.5, 2e-3)
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
