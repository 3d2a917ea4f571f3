"""Sealed cases of robots: their integrator is MuJoCo's mechanics with friction that sticks, and a case is a function of its seed."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest

from bench import model_path
from bench.discrepancy import BlindOptions, make_blind, read_case
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.articulated_truth.faults import FAULTS
from bench.discrepancy.articulated_truth.robots import MODELS, draw_robot, reference_of
from bench.discrepancy.articulated_truth.time_stepping import CELLS, Cell, march_bodies
from bench.discrepancy.multibody.model import ArticulatedModel, compiled_model
from bench.errors import ParameterError

RATE, FINE = 250.0, 64
"""Samples a second, and Runge-Kutta steps of MuJoCo a sample."""


def swung(table, model, n=250):
    """The two-link arm along a slow swing of both joints."""
    t = np.arange(n) / RATE
    reference = 0.4 * np.sin(4.0 * np.outer(t, [1.0, 1.5])) * np.minimum(t, 1.0)[:, None] ** 2
    speed = np.gradient(reference, 1.0 / RATE, axis=0)
    return march_bodies(
        model.model,
        table,
        servo=False,
        reference=reference,
        speed=speed,
        forward=0.0 * reference,
        sample=1.0 / RATE,
    )


@pytest.fixture(scope="module")
def arm():
    model = ArticulatedModel.of(compiled_model(model_path("arms/two_link")))
    table = np.zeros((2, CELLS))
    for j, joint in enumerate(model.joints):
        table[j, [Cell.DAMPING, Cell.ARMATURE, Cell.GEAR, Cell.KP, Cell.KV]] = (
            joint.damping,
            joint.armature,
            1.0,
            60.0,
            6.0,
        )
    return model, table


def test_without_friction_it_moves_as_mujoco_has_it(arm):
    model, table = arm
    motion = swung(table, model)
    mj = mujoco.MjModel.from_xml_path(str(model_path("arms/two_link")))
    mj.opt.integrator, mj.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1.0 / RATE / FINE
    data = mujoco.MjData(mj)
    theirs = []
    for command in motion.command:
        theirs.append(data.qpos.copy())
        data.ctrl[:] = command
        mujoco.mj_step(mj, data, FINE)
    # a quarter of a millisecond a step, of second order but for the damping: some 1e-4 of the motion
    assert np.abs(np.array(theirs) - motion.position).max() < 3e-4 * np.abs(motion.position).max() + 1e-4


def test_friction_holds_a_joint_still_and_a_motor_behind_play_leads_its_link(arm):
    model, table = arm
    table = table.copy()
    table[1, Cell.FRICTION] = 1.0
    table[0, [Cell.TRAIN, Cell.TRAIN_DAMPING, Cell.PLAY, Cell.SHARE]] = 400.0, 0.3, 0.01, 0.9
    motion = swung(table, model)
    still = np.abs(motion.velocity[:, 1]) < 1e-10
    assert 0.05 < still.mean() < 0.95
    apart = np.abs(motion.motor_position - motion.position)
    assert apart[:, 1].max() == 0.0
    most = np.abs(motion.command[:, 0]).max() / 400.0
    assert 0.01 < apart[:, 0].max() < 0.01 + 2.0 * most


def test_a_robot_case_is_a_function_of_its_seed_and_is_admitted(tmp_path):
    options = BlindOptions(
        robots=("arm",), effects=("coulomb_friction",), shares=(0.0, 1.0, 0.0, 0.0), duration=4.0
    )
    made = []
    for name in ("first", "second"):
        make_blind(
            tmp_path / name, tmp_path / f"{name}_answers", n=1, rng=np.random.default_rng(3), options=options
        )
        made.append(sorted(path.read_bytes() for path in (tmp_path / name / "case-000").iterdir()))
    assert made[0] == made[1]
    case = read_case(tmp_path / "first" / "case-000")
    assert applies(case)
    assert admitted_robot(case).notes == ()
    answer = json.loads((tmp_path / "first_answers" / "case-000.json").read_text())
    assert [effect["name"] for effect in answer["effects"]] == ["coulomb_friction"]


def test_what_cannot_be_withheld_from_a_robot_is_said(tmp_path):
    options = BlindOptions(
        robots=("leg",), effects=("bouc_wen_hysteresis",), shares=(0.0, 1.0, 0.0, 0.0), duration=2.0
    )
    with pytest.raises(ParameterError, match="bouc_wen_hysteresis"):
        make_blind(tmp_path / "a", tmp_path / "b", n=1, rng=np.random.default_rng(0), options=options)


@pytest.mark.parametrize("kind", MODELS)
def test_references_begin_at_rest_within_the_range_of_the_joints(kind):
    robot = draw_robot((kind,), np.random.default_rng(1))
    for reference in (
        reference_of(robot, one, 5.0, np.random.default_rng(2))
        for one in ("multisine", "chirp", "point_to_point")
    ):
        ranges = np.array([joint.range for joint in robot.nominal.joints])
        assert (reference >= ranges[:, 0]).all()
        assert (reference <= ranges[:, 1]).all()
        np.testing.assert_allclose(reference[1], reference[0], atol=1e-2)


def test_faults_write_into_cells_that_they_draw():
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)
    for fault in FAULTS:
        assert fault.cells or fault.site in ("sensor", "body", "base"), fault.name
