"""Judging records run in windows: they begin as late as their log, and with what no encoder shows as the window before left it."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest
from test_articulated import FINE, LIMIT, RATE, mjcf, write_case

from bench.discrepancy import read_case
from bench.discrepancy.application.applying import Findings, apply
from bench.discrepancy.replay.running import Stretch, Train, run
from bench.discrepancy.replay.verification import replay_of, root_mean_square, together
from bench.discrepancy.verdict import Estimate, NamedEffect
from bench.rig.held_joints import weld

TRAIN = """<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody>
  <body><joint name="motor" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/>
    <body><joint name="train" axis="0 0 1" stiffness="40" damping="0.02"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.03 0.03 0.03"/></body></body></worldbody>
  <actuator><motor joint="motor"/><general joint="motor" dyntype="integrator" gainprm="0.5"/></actuator></mujoco>"""


@pytest.mark.parametrize("on_link", [False, True])
def test_windows_in_a_row_are_one_run_where_encoders_show_what_it_shows(on_link):
    model = mujoco.MjModel.from_xml_string(TRAIN)
    steps, each = 900, 300
    control = np.column_stack([np.sin(0.02 * np.arange(steps)), np.cos(0.005 * np.arange(steps))])
    rest = Stretch(0, np.zeros(2), np.zeros(2))
    whole = [found[0] for found in run(model, None, [rest], control, steps, rested=True)]
    shown = [found.sum(axis=1) if on_link else found[:, 0] for found in whole]
    # what an encoder shows at the start of a window, and a train at rest
    windows = [Stretch(k, *(np.array([found[k], 0.0]) for found in shown)) for k in range(0, steps, each)]
    trains = [Train(1, 1, (0, 0) if on_link else None)]
    found = run(model, None, windows, control, each, rested=True, trains=trains)
    for one, all_at_once in zip(found, whole, strict=True):
        np.testing.assert_allclose(np.concatenate(one[:, :each]), all_at_once[:steps], atol=1e-12)
    # with the train taken for unwound the runs part
    other, _ = run(model, None, windows, control, each, rested=True)
    assert np.abs(np.concatenate(other[:, :each]) - whole[0][:steps]).max() > 0.01


@pytest.mark.parametrize("on_link", [False, True])
def test_a_train_is_wound_up_and_what_its_encoder_shows_stays(on_link):
    position, velocity = np.array([0.5, 0.0]), np.array([2.0, 0.0])
    Train(1, 1, (0, 0) if on_link else None).wind(position, velocity, 0.1, -0.3)
    assert (position[1], velocity[1]) == (0.1, -0.3)
    shown = (position.sum(), velocity.sum()) if on_link else (position[0], velocity[0])
    assert shown == pytest.approx((0.5, 2.0))


def test_windows_of_a_late_log_begin_as_late(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=False), servo=False)
    late = round(0.04 * RATE)
    for path in folder.glob("*.csv"):
        table = np.genfromtxt(path, delimiter=",", names=True)
        table["elbow_q"] = np.append(np.full(late, table["elbow_q"][0]), table["elbow_q"][:-late])
        header = ",".join(table.dtype.names)
        np.savetxt(path, table.tolist(), delimiter=",", header=header, comments="", fmt="%.9g")
    case, path = read_case(folder), folder / "model.xml"
    replay = replay_of(path, case, articulated=True)

    def left(*effects, **how):
        applied = apply(path, Findings(effects), case=case, linear=False)
        return root_mean_square(replay.errors(applied, effects, **how)["elbow"])

    delay = NamedEffect("position_delay", "elbow", 1.0, {"delay_s": Estimate(late / RATE, 1e-4, "s")})
    assert left(delay) < 0.1 * left()
    assert left(delay, together=True) < 0.1 * left(together=True)


def test_joints_that_are_free_at_once_pass_on_what_one_of_them_lacks(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=False, friction=LIMIT), servo=False)
    case, path = read_case(folder), folder / "model.xml"
    replay = replay_of(path, case, articulated=True)
    nothing, friction = (
        Findings(()),
        Findings((NamedEffect("coulomb_friction", "elbow", 1.0, {"limit": Estimate(LIMIT, 0.01, "N m")}),)),
    )
    runs = {run.dof: run for run in together(path, friction, case, replay)}
    alone = replay.errors(apply(path, nothing, case=case, linear=False), ())
    assert set(runs) == set(alone) == {"shoulder", "elbow"}
    # beside the elbow's measured motion the shoulder feels nothing of what the elbow lacks
    assert runs["shoulder"].before > 5.0 * root_mean_square(alone["shoulder"])
    assert all(run.after < 0.1 * run.before for run in runs.values())


JAW = """<body name="jaw" pos="0 0 -0.25"><joint name="jaw" type="hinge" axis="0 1 0"/>
  <inertial pos="0.02 0 -0.08" mass="0.3" diaginertia="0.001 0.001 0.0002"/></body>"""


def test_what_a_case_has_held_does_not_move_in_the_users_model_and_stays_a_joint_of_it(tmp_path):
    """A jaw that was held at an angle while the arm moved: it would swing in the model as it is."""
    wrong, nominal = (
        mjcf(servo=False, friction=level).replace('<site name="fore_tip"', f'{JAW}<site name="fore_tip"')
        for level in (LIMIT, 0.0)
    )
    truth = mujoco.MjSpec.from_string(wrong)
    weld(truth, {"jaw": 0.9})
    folder = write_case(tmp_path, truth.to_xml(), servo=False, nominal=nominal)
    document = json.loads((folder / "nominal.json").read_text())
    (folder / "nominal.json").write_text(json.dumps(document | {"joints": {"jaw": 0.9}}))
    case, path = read_case(folder), folder / "model.xml"
    found = Findings(
        (NamedEffect("coulomb_friction", "elbow", 1.0, {"limit": Estimate(LIMIT, 0.01, "N m")}),)
    )
    corrected = apply(path, found, case=case, linear=False)
    assert [joint.name for joint in corrected.spec.joints] == ["shoulder", "elbow", "jaw"]
    runs = {
        run.dof: run
        for run in together(path, found, case, replay_of(path, case, articulated=True, findings=found))
    }
    assert set(runs) == {"shoulder", "elbow"}
    assert all(run.after < 0.1 * run.before for run in runs.values())


def test_a_train_that_carries_others_begins_wound_up_by_what_it_carries(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=False), servo=False)
    path = folder / "model.xml"
    stiffness, rest = 60.0, np.array([0.8, -0.5])
    found = {"stiffness": stiffness, "damping": 0.1, "motor_share": 0.9}
    effect = NamedEffect(
        "joint_compliance", "shoulder", 1.0, {n: Estimate(v, 0.01 * v, "1") for n, v in found.items()}
    )
    truth = apply(path, Findings((effect,)), linear=False).compiled()
    data, rows, deflected = mujoco.MjData(truth), [], []
    motors = [int(truth.joint(name).qposadr[0]) for name in ("shoulder", "elbow")]
    for k in range(round(8.0 * RATE)):  # three seconds to come to rest, then the log
        t = max(k / RATE - 3.5, 0.0)
        goal = rest + 0.3 * min(t, 1.0) ** 2 * np.array([np.sin(4.0 * t), np.sin(5.5 * t)])
        command = 20.0 * (goal - data.qpos[motors]) - 1.0 * data.qvel[[0, 2]]
        rows.append([k / RATE - 3.0, *command, *data.qpos[motors]])
        deflected.append(data.qpos[1])
        data.ctrl[:] = command
        mujoco.mj_step(truth, data, FINE)
    table, trains = np.array(rows)[round(3.0 * RATE) :], np.array(deflected)[round(3.0 * RATE) :]
    header = "time,shoulder_in,elbow_in,shoulder_q,elbow_q"
    np.savetxt(folder / "validation.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
    case = read_case(folder)
    replay, found = replay_of(path, case, articulated=True), Findings((effect,))
    errors = replay.errors(apply(path, found, case=case, linear=False), (effect,))
    # the model is the truth: what is left comes of smoothed velocities at the starts of windows; a train that begins unwound swings for
    # seconds and takes the elbow along, by a twentieth of its travel
    assert max(root_mean_square(error) for error in errors.values()) < 0.004
    # as the run has it that the encoder corrects: what the truth's train did, to some hundredths of it
    known = replay_of(path, case, articulated=True, findings=found)
    (deflection,) = known.wound["shoulder"]
    assert np.std(deflection[50:, 0] - trains[50:]) < 0.05 * np.std(trains[50:])
    errors = known.errors(apply(path, found, case=case, linear=False), (effect,))
    assert max(root_mean_square(error) for error in errors.values()) < 0.004
