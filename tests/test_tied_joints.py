"""Joints that others move by linear equalities: grippers with two fingers, parallelograms, wrists behind one motor."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest
from test_articulated import FINE, KP, LIMIT, NOISE, RATE, mjcf, targets, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import Findings
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joints import ties_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.replay.verification import verify
from bench.errors import BenchError, ModelError

RATIO = -1.5
HAND = """<body name="hand" pos="0 0 -0.25"><joint name="wrist" type="hinge" axis="0 1 0" damping="0.05" armature="0.01"/>
<inertial pos="0 0 -0.08" mass="0.4" diaginertia="0.001 0.001 0.0003"/></body>"""


def tied(text, curve=f"0.2 {RATIO} 0 0 0", more=""):
    """The arm with a hand that turns with its elbow."""
    text = text.replace('<site name="fore_tip"', f'{HAND}<site name="fore_tip"')
    equality = f'<equality><joint joint1="wrist" joint2="elbow" polycoef="{curve}" solref="0.001 1"/>{more}</equality>'
    return text.replace("<actuator>", f"{equality}<actuator>")


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A folder: friction at the elbow, which moves the hand, too."""
    folder = write_case(
        tmp_path_factory.mktemp("tied"), mjcf(servo=True), servo=True, nominal=tied(mjcf(servo=True))
    )
    model = mujoco.MjModel.from_xml_string(tied(mjcf(servo=True, friction=LIMIT)))
    for seed, name in enumerate(("identification", "validation")):
        data, rng, rows = mujoco.MjData(model), np.random.default_rng(seed), []
        data.qpos[2] = 0.2
        for goal in targets(seed):
            rows.append([*goal, *data.qpos[:2]])
            data.ctrl[:] = goal
            mujoco.mj_step(model, data, FINE)
        table = np.array(rows)
        table[:, 2:] += NOISE * rng.standard_normal((len(table), 2))
        header = ",".join(["time", *(f"{j}_in" for j in KP), *(f"{j}_q" for j in KP)])
        clock = np.arange(len(table)) / RATE
        np.savetxt(
            folder / f"{name}.csv",
            np.column_stack([clock, table]),
            delimiter=",",
            header=header,
            comments="",
            fmt="%.9g",
        )
    return folder


def test_the_equation_of_a_joint_holds_what_it_moves():
    text = tied(mjcf(servo=False)).replace(
        '<motor name="elbow_drive" joint="elbow"/>', '<motor name="elbow_drive" joint="wrist" gear="3"/>'
    )
    compiled, rng = mujoco.MjModel.from_xml_string(text), np.random.default_rng(0)
    model, data = ArticulatedModel.of(compiled), mujoco.MjData(compiled)
    shoulder, elbow = model.joints
    q, v, a = (rng.standard_normal((20, 2)) for _ in range(3))
    found = model.dynamics(q, v, a)
    passive = (
        elbow.armature * a[:, 1] + elbow.damping * v[:, 1],
        shoulder.armature * a[:, 0] + shoulder.damping * v[:, 0],
    )
    whole = [model.whole(part, order) for order, part in enumerate((q, v, a))]
    np.testing.assert_allclose(whole[0][:, 2], 0.2 + RATIO * q[:, 1])
    asked = []
    for row in zip(*whole, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(compiled, data)
        asked.append(model.on_joints(data.qfrc_inverse))
    np.testing.assert_allclose(
        np.column_stack([found.torque[:, 0] + passive[1], found.torque[:, 1] + passive[0]]), asked, atol=1e-9
    )
    # the inertia is what a unit acceleration asks for more
    more = model.dynamics(q, v, a + np.array([0.0, 1.0])).torque - found.torque
    np.testing.assert_allclose(more[:, 1], found.inertia[:, 1])
    assert elbow.drive.gear == 3.0 * RATIO
    assert elbow.damping == pytest.approx(0.1 + RATIO**2 * 0.05)


def test_a_joint_may_move_several():
    # one behind the other, so that the two feel each other
    thumb, inner = HAND.replace("hand", "thumb").replace("wrist", "knuckle"), '0.0003"/>'
    text = tied(mjcf(servo=True), more='<joint joint1="knuckle" joint2="elbow" polycoef="0 2 0 0 0"/>')
    text = text.replace(f"{inner}</body>", f"{inner}{thumb}</body>", 1)
    model, rng = ArticulatedModel.of(mujoco.MjModel.from_xml_string(text)), np.random.default_rng(1)
    q, v, a = (rng.standard_normal((5, 2)) for _ in range(3))
    found = model.dynamics(q, v, a)
    more = model.dynamics(q, v, a + np.array([0.0, 1.0])).torque - found.torque
    assert len(model.ties) == 2
    np.testing.assert_allclose(more[:, 1], found.inertia[:, 1])


def test_friction_of_a_joint_that_moves_another_is_found_and_closes_in_mujoco(arm):
    case = read_case(arm)
    found = diagnose(case)
    (named,) = found.verdict.named
    assert (named.name, named.where) == ("coulomb_friction", "elbow")
    assert named.parameters["limit"].value == pytest.approx(LIMIT, rel=0.1)
    assert all(gap.after < 1.6 * gap.noise_floor for gap in found.verdict.gaps)
    told = verify(
        arm / "model.xml",
        Findings(tuple(found.verdict.named), found.verdict.nominal),
        found.verdict.gaps,
        case,
    )
    for figure in told.better or told.figures:
        assert figure.after < 2.0 * figure.floor


def test_parameters_of_a_joint_that_is_moved_count_by_the_ratio(arm):
    text = (arm / "nominal.json").read_text()
    document = json.loads(text)
    document["parameters"] |= {
        "damping:wrist": {"value": 0.05, "std": 0.02, "unit": "N m s/rad"},
        "armature:wrist": {"value": 0.01, "std": 0.002, "unit": "kg m^2"},
    }
    try:
        (arm / "nominal.json").write_text(json.dumps(document))
        case, compiled, _ = admitted_robot(read_case(arm))
    finally:
        (arm / "nominal.json").write_text(text)
    problem = ArticulatedProblem.of(case, ArticulatedModel.of(compiled), case.identification)
    names = [parameter.name for parameter in problem.nominal]
    elbow = [joint.name for joint in problem.joints].index("elbow")
    vector = np.zeros(len(names))
    before = problem.slots(elbow, (), vector, on_link=True)
    vector[names.index("damping:wrist")] = vector[names.index("armature:wrist")] = 1.0
    after = problem.slots(elbow, (), vector, on_link=True)
    assert after[Slot.DAMPING] - before[Slot.DAMPING] == pytest.approx(0.02 * RATIO**2)
    assert after[Slot.INERTIA] - before[Slot.INERTIA] == pytest.approx(0.002 * RATIO**2)


def test_what_cannot_be_tied_is_said(arm):
    def model_with(curve, more=""):
        return mujoco.MjModel.from_xml_string(tied(mjcf(servo=True), curve, more))

    with pytest.raises(ModelError, match="not linear"):
        ArticulatedModel.of(model_with("0 1 0.5 0 0"))
    with pytest.raises(ModelError, match="two equalities move joint 'wrist'"):
        ArticulatedModel.of(
            model_with("0 1 0 0 0", '<joint joint1="wrist" joint2="shoulder" polycoef="0 1 0 0 0"/>')
        )
    with pytest.raises(ModelError, match="in a circle"):
        ArticulatedModel.of(
            model_with("0 1 0 0 0", '<joint joint1="elbow" joint2="wrist" polycoef="0 1 0 0 0"/>')
        )
    alone = tied(mjcf(servo=True)).replace('joint2="elbow" ', "")
    with pytest.raises(ModelError, match="hold"):
        ArticulatedModel.of(mujoco.MjModel.from_xml_string(alone))
    driven = tied(mjcf(servo=True)).replace("<actuator>", '<actuator><motor name="own" joint="wrist"/>')
    with pytest.raises(ModelError, match="together, and they have an actuator each"):
        ArticulatedModel.of(mujoco.MjModel.from_xml_string(driven))
    text = (arm / "nominal.json").read_text()
    (arm / "nominal.json").write_text(text.replace('"joint": "elbow"', '"joint": "wrist"'))
    try:
        with pytest.raises(BenchError, match="exchange joint1 and joint2"):
            diagnose(read_case(arm))
    finally:
        (arm / "nominal.json").write_text(text)


def test_a_chain_of_equalities_ends_at_the_joint_that_is_free():
    text = tied(
        mjcf(servo=True), "0.1 2 0 0 0", '<joint joint1="elbow" joint2="shoulder" polycoef="0.3 -1 0 0 0"/>'
    )
    ties = {tie.name: tie for tie in ties_of(mujoco.MjModel.from_xml_string(text))}
    assert (ties["wrist"].to, ties["wrist"].ratio) == ("shoulder", -2.0)
    assert ties["wrist"].offset == pytest.approx(0.1 + 2 * 0.3)
