"""Mass, moment of inertia and centre of mass of a body as uncertain numbers of a robot."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest
from test_articulated import mjcf, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import Findings, apply
from bench.discrepancy.case.case import Case, NominalParameter
from bench.discrepancy.multibody.body_terms import body_terms, gravity_terms
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.replay.verification import verify
from bench.errors import BenchError, ModelError
from bench.native.inverse import along
from bench.rig.bodies import BODIES, body_value, moved_by, set_body
from bench.rig.gravity import level_axes, tilted

HEAVIER, FARTHER = 1.5, 0.02


def turned(text):
    """The arm with inertias that are all different, about axes that are not those of the body."""
    return text.replace("diaginertia", 'euler="0 40 0" diaginertia')


def wrong(text):
    """The forearm with half as much inertia again and its centre of mass two centimetres farther out."""
    model = mujoco.MjSpec.from_string(text)
    fore = model.body("fore")
    fore.inertia, fore.ipos = HEAVIER * fore.inertia, fore.ipos - [0.0, 0.0, FARTHER]
    return model.to_xml()


def uncertain(folder, *, inertia=0.3, centre=0.02):
    """State how well inertia and centre of mass of the forearm are known."""
    document = json.loads((folder / "nominal.json").read_text())
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    i = model.body("fore").id
    for kind, std, unit in (
        ("inertia", inertia * body_value(model, i, "inertia"), "kg m^2"),
        ("com_z", centre, "m"),
    ):
        document["parameters"][f"{kind}:fore"] = {
            "value": body_value(model, i, kind),
            "std": std,
            "unit": unit,
        }
    (folder / "nominal.json").write_text(json.dumps(document))
    return folder


def test_the_moment_of_inertia_is_that_about_the_hinge():
    model = mujoco.MjModel.from_xml_string(turned(mjcf(servo=False)))
    i, data = model.body("fore").id, mujoco.MjData(model)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[i])
    turn = turn.reshape(3, 3)
    tensor = turn @ np.diag(model.body_inertia[i]) @ turn.T
    assert body_value(model, i, "inertia") == pytest.approx(tensor[1, 1])
    mujoco.mj_forward(model, data)
    before = data.M[model.M_rowadr[1] + model.M_rownnz[1] - 1]
    set_body(model, i, "inertia", body_value(model, i, "inertia") + 0.01)
    mujoco.mj_forward(model, data)
    assert data.M[model.M_rowadr[1] + model.M_rownnz[1] - 1] == pytest.approx(before + 0.01)


@pytest.mark.parametrize("kind", BODIES)
def test_a_number_that_is_set_gives_the_torques_of_a_model_compiled_with_it(kind):
    spec = mujoco.MjSpec.from_string(mjcf(servo=False))
    model = ArticulatedModel.of(spec.compile())
    value = model.body_value(kind, "fore") + 0.01
    fore = spec.body("fore")
    if kind == "mass":
        fore.mass = value
    elif kind == "inertia":
        fore.inertia = fore.inertia * value / model.body_value(kind, "fore")
    else:
        fore.ipos = np.where(np.arange(3) == BODIES.index(kind) - 2, value, fore.ipos)
    moved = np.random.default_rng(0).standard_normal((3, 20, 2))
    found, asked = (
        m.dynamics(*moved)
        for m in (model.with_body(kind, "fore", value), ArticulatedModel.of(spec.compile()))
    )
    np.testing.assert_allclose(found.torque, asked.torque, atol=1e-12)
    np.testing.assert_allclose(found.inertia, asked.inertia, atol=1e-12)


def test_inertia_and_centre_of_mass_are_found_and_written_back(tmp_path):
    folder = uncertain(write_case(tmp_path, wrong(mjcf(servo=True)), servo=True, nominal=mjcf(servo=True)))
    case = read_case(folder)
    found = diagnose(case)
    assert found.verdict.verdict == "none"  # nothing but numbers that were stated as uncertain
    estimates = {estimate.name: estimate for estimate in found.verdict.nominal}
    truth = mujoco.MjModel.from_xml_string(wrong(mjcf(servo=True)))
    i = truth.body("fore").id
    for kind in ("inertia", "com_z"):
        estimate = estimates[f"{kind}:fore"]
        assert abs(estimate.value - body_value(truth, i, kind)) < 3.0 * estimate.std
        assert abs(estimate.value - body_value(truth, i, kind)) < 0.3 * abs(
            estimate.stated - body_value(truth, i, kind)
        )
    findings = Findings((), found.verdict.nominal)
    written = apply(folder / "model.xml", findings, case=case).compiled()
    assert body_value(written, i, "com_z") == pytest.approx(estimates["com_z:fore"].value)
    assert body_value(written, i, "inertia") == pytest.approx(estimates["inertia:fore"].value)
    for figure in verify(folder / "model.xml", findings, found.verdict.gaps, case).figures:
        assert figure.after < min(1.6 * figure.floor, 0.5 * figure.before)


def test_equations_of_the_joints_change_exactly_with_all_numbers_at_once():
    spec = mujoco.MjSpec.from_string(turned(mjcf(servo=False)))
    model = ArticulatedModel.of(spec.compile())
    value = {kind: model.body_value(kind, "fore") for kind in BODIES}
    by = {"mass": 0.2, "inertia": 0.001, "com_x": 0.03, "com_y": -0.02, "com_z": 0.05}
    parameters = tuple(NominalParameter(f"{kind}:fore", value[kind], 0.01) for kind in BODIES)
    case = Case("case", "model.xml", parameters, (), (), (), None)
    moved = tuple(np.random.default_rng(1).standard_normal((3, 20, 2)))

    def beside(changed):
        return np.stack([
            [changed.torque[:, j] - now.torque[:, j], changed.inertia[:, j] - now.inertia[:, j]] for j in range(2)
        ])  # fmt: skip

    now = model.dynamics(*moved)
    terms = body_terms(case, model, moved, beside)["fore"]
    other = model
    for kind, change in by.items():
        other = other.with_body(kind, "fore", value[kind] + change)
    asked = beside(other.dynamics(*moved))
    for j in range(2):
        made = np.zeros_like(asked[j])
        terms.of_joint(j).change(made, by)
        np.testing.assert_allclose(made, asked[j], atol=1e-9)


def test_a_body_that_is_a_point_cannot_be_scaled_and_wrong_names_are_refused(tmp_path):
    folder = uncertain(write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0))
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    model.body_inertia[:] = 0.0
    with pytest.raises(ModelError, match="diaginertia"):
        set_body(model, 1, "inertia", 0.1)
    text = (folder / "nominal.json").read_text()
    (folder / "nominal.json").write_text(text.replace("inertia:fore", "inertia:hand"))
    with pytest.raises(BenchError, match="fore"):
        diagnose(read_case(folder))


SWINGING = """<mujoco><option {option}/><worldbody><body name="upper"><joint name="lift" axis="0 1 0" {joint}/>
<geom type="capsule" fromto="0 0 0 .1 0 -.4" size=".04" mass="2"/><body name="fore" pos=".1 0 -.4" {body}><joint name="slide" type="slide"
axis="1 0 0"/><geom type="box" size=".1 .05 .03" pos=".05 .02 0" mass="1"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("option", "joint", "body"),
    [
        ("", "", ""),
        ('density="900" viscosity="2"', "", ""),
        ("", 'armature=".3"', ""),
        ("", 'stiffness="3 0 20"', ""),
        ("", 'damping="1"', ""),
        ("", 'range="-.1 .1" limited="true"', ""),
        ("", "", 'gravcomp=".7"'),
    ],
)
def test_torques_along_a_motion_are_those_of_inverse_dynamics(option, joint, body):
    model = mujoco.MjModel.from_xml_string(SWINGING.format(option=option, joint=joint, body=body))
    if not joint.startswith("range"):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    q, v, a = np.random.default_rng(3).normal(size=(3, 20, 2))
    torque, inertia = along(model, q, v, a)
    data = mujoco.MjData(model)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(torque[k], data.qfrc_inverse, rtol=1e-11, atol=1e-11)
        whole = np.zeros((2, 2))
        mujoco.mj_fullM(model, data, whole)
        np.testing.assert_allclose(inertia[k], np.diag(whole), rtol=1e-11)


def test_a_base_that_leans_turns_gravity_the_other_way_about_horizontal_axes():
    down = np.array([0.0, 0.0, -9.81])
    assert tilted(down, 0.0, 0.3) == pytest.approx([9.81 * np.sin(0.3), 0.0, -9.81 * np.cos(0.3)])
    assert tilted(down, 0.2, 0.0) == pytest.approx([0.0, -9.81 * np.sin(0.2), -9.81 * np.cos(0.2)])
    for gravity in (down, np.array([0.0, -9.81, 0.0]), np.array([-3.0, 1.0, 2.0])):
        first, second = level_axes(gravity)
        up = -gravity / np.linalg.norm(gravity)
        assert np.stack([first, second, up]) @ np.stack([first, second, up]).T == pytest.approx(np.eye(3))
        assert np.cross(first, second) == pytest.approx(up)
        assert np.linalg.norm(tilted(gravity, 0.4, -0.1)) == pytest.approx(np.linalg.norm(gravity))


def test_what_a_lean_of_the_base_changes_is_exact_however_large_it_is():
    model = ArticulatedModel.of(mujoco.MjModel.from_xml_string(SWINGING.format(option="", joint="", body="")))
    rng = np.random.default_rng(4)
    motion = tuple(rng.normal(size=(3, 20, 2)))
    base = model.dynamics(*motion)

    def beside(changed):
        difference = (changed.torque - base.torque).T
        return np.stack([difference, np.zeros_like(difference)], axis=1)

    terms = gravity_terms(model, motion, beside)
    leaning = model.with_tilt(0.7, -0.4).dynamics(*motion).torque - base.torque
    for j in range(2):
        np.testing.assert_allclose(terms.of_joint(j).change(0.7, -0.4), leaning[:, j], atol=1e-9)


def test_what_a_joint_moves_of_its_own_body_is_its_entry_of_the_mass_matrix():
    """About a hinge beside the centre of mass, turned principal axes, and along a slide; without what the body carries."""
    inertial = '<inertial pos="0.2 0.1 -0.3" quat="0.9 0.3 0.1 0.2" mass="1.7" diaginertia="0.03 0.05 0.06"/>'
    for kind in ("hinge", "slide"):
        alone = (
            f'<body name="a"><joint name="j" type="{kind}" axis="1 2 2" pos="0 0.05 0"/>{inertial}{{}}</body>'
        )
        load = '<body pos="1 0 0"><geom size="0.1" mass="3"/></body>'
        models = [
            mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{alone.format(child)}</worldbody></mujoco>")
            for child in ("", load)
        ]
        data, matrix = mujoco.MjData(models[0]), np.zeros((1, 1))
        mujoco.mj_forward(models[0], data)
        mujoco.mj_fullM(models[0], data, matrix)
        assert [moved_by(model, "j") for model in models] == pytest.approx([matrix[0, 0]] * 2, rel=1e-12)
