"""An arm that presses on its table: what touches, how that is found, and that it closes in plain MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from bench.discrepancy import Case, CaseChannel, diagnose, record_from_arrays
from bench.discrepancy.application.applying import apply
from bench.discrepancy.application.reading import findings_of, gaps_left
from bench.discrepancy.articulated.diagnosis import diagnose_articulated
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_search.ends import ends_within
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import NominalParameter
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.touch import ends_of, touch_of
from bench.discrepancy.replay.verification import verify

RATE, HEIGHT = 200.0, -0.12
NAMES = ("identification", "identification_2", "validation")
SHAPES = {
    "sphere": 'type="sphere" size="0.03" pos="0.2 0.01 0.02"',
    "capsule": 'type="capsule" size="0.02 0.08" pos="0.1 0 0" euler="20 70 10"',
    "box": 'type="box" size="0.05 0.03 0.02" pos="0.15 0 0.01" euler="10 20 30"',
    "cylinder": 'type="cylinder" size="0.03 0.06" pos="0.15 0 0" euler="40 20 0"',
    "ellipsoid": 'type="ellipsoid" size="0.06 0.03 0.02" pos="0.15 0 0" euler="10 50 0"',
    "mesh": 'type="mesh" mesh="wedge" pos="0.1 0 0" euler="0 30 60"',
}
ROBOT = """
<mujoco model="robot">
  <compiler angle="degree"/>
  <option timestep="0.001" integrator="implicitfast" gravity="{gravity}"/>
  <default><joint damping="0.3" armature="0.02"/><position kp="40" kv="1.5"/></default>
  <asset><mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.05 0  0 0 0.04"/></asset>
  <worldbody>
    <body name="column">
      <joint name="pan" axis="0 0 1"/><geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.03" mass="1"/>
      <body name="upper" pos="0 0 0.1">
        <joint name="shoulder" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1.2" contype="0" conaffinity="0"/>
        <body name="fore" pos="0.3 0 0">
          <joint name="elbow" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.6" contype="0" conaffinity="0"/>
          <body name="finger" pos="0.2 0 0"><geom {shape} mass="0.05" contype="0" conaffinity="0"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="m0" joint="pan"/><position name="m1" joint="shoulder"/><position name="m2" joint="elbow"/>
  </actuator>
</mujoco>
"""


def robot(shape: str, gravity: str = "0 0 -9.81") -> str:
    return ROBOT.format(shape=SHAPES[shape], gravity=gravity)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("gravity", ["0 0 -9.81", "3 -4 -8"])
def test_the_lowest_point_is_that_of_mujocos_distance_to_a_plane(shape, gravity):
    spec = mujoco.MjSpec.from_string(robot(shape, gravity))
    model = ArticulatedModel.of(spec.compile(), "robot")
    assert ends_of(model) == ("fore",)
    up, turn = -np.array([float(x) for x in gravity.split()]), np.zeros(4)
    mujoco.mju_quatZ2Vec(turn, up / np.linalg.norm(up))
    far = 1.0
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(5, 5, 0.1),
        quat=turn,
        pos=-(far + 0.1) * up / np.linalg.norm(up),
    )
    plain = spec.compile()
    data, floor = mujoco.MjData(plain), plain.geom("floor").id
    q = np.random.default_rng(4).uniform(-0.8, 0.8, (12, 3))
    touch = touch_of(model, "fore", q)
    own = [g for g in range(plain.ngeom) if plain.geom_bodyid[g] >= plain.body("fore").id]
    for row, height in zip(q, touch.height, strict=True):
        data.qpos[:] = row
        mujoco.mj_forward(plain, data)
        true = min(mujoco.mj_geomDistance(plain, data, g, floor, 10.0, None) for g in own) - far
        assert height == pytest.approx(true, abs=2e-5)
    for j in range(3):
        ahead, behind = (touch_of(model, "fore", q + s * 1e-6 * np.eye(3)[j]).height for s in (1.0, -1.0))
        # the point of a polyhedron jumps from corner to corner, its height does not
        assert touch.raised[:, j] == pytest.approx((ahead - behind) / 2e-6, abs=1e-4)


def test_nothing_is_level_without_gravity_and_a_tree_ends_where_nothing_moves_on():
    assert ends_of(ArticulatedModel.of(mujoco.MjModel.from_xml_string(robot("box", "0 0 0")))) == ()


def smooth(rng, n, low, high, rms):
    f = np.fft.rfftfreq(n, 1.0 / RATE)
    inside = (f >= low) & (f <= high)
    x = np.fft.irfft(inside * np.exp(2j * np.pi * rng.uniform(size=len(f))), n)
    return rms * x / np.std(x)


def with_table(spec: mujoco.MjSpec) -> None:
    """A table in MuJoCo's own terms, as hard as MuJoCo makes it by itself, frictionless."""
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(1, 1, 0.1),
        pos=(0, 0, HEIGHT),
        contype=0,
        conaffinity=0,
    )
    for i, shape in enumerate([*spec.body("fore").geoms, *spec.body("finger").geoms]):
        shape.name = f"shape_{i}"
        spec.add_pair(geomname1="table", geomname2=shape.name, condim=1)


def measured(wrong, folder, n=1600) -> Case:
    """Commands and encoders of the robot in plain MuJoCo, four steps finer than those of its model."""
    folder.mkdir(parents=True, exist_ok=True)
    text = robot("sphere")
    (folder / "robot.xml").write_text(text)
    spec = mujoco.MjSpec.from_string(text)
    wrong(spec)
    spec.option.timestep, spec.option.integrator = 2.5e-4, mujoco.mjtIntegrator.mjINT_RK4
    model = spec.compile()
    per, records = round(1.0 / RATE / model.opt.timestep), []
    for seed, name in enumerate(NAMES):
        rng, data = np.random.default_rng(70 + seed), mujoco.MjData(model)
        target = np.column_stack([smooth(rng, n, 0.2, 1.5, size) for size in (0.4, 0.3, 0.4)])
        target *= np.minimum(np.arange(n) / RATE, 1.0)[:, None] ** 2  # from rest, without a corner
        data.qpos[:] = data.ctrl[:] = target[0]
        mujoco.mj_step(model, data, 4000)
        middles = (np.arange(n * per) + 0.5) / per
        fine, q = np.column_stack([np.interp(middles, np.arange(n), t) for t in target.T]), np.empty((n, 3))
        for k, row in enumerate(fine):
            if k % per == 0:
                q[k // per] = data.qpos
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
        q += 3e-4 * rng.standard_normal(q.shape)
        columns = {f"t{i}": target[:, i] for i in range(3)} | {f"q{i}": q[:, i] for i in range(3)}
        records.append(record_from_arrays(name, np.arange(n) / RATE, columns, at_rest=False))
    joints = ("pan", "shoulder", "elbow")
    channels = (
        *(CaseChannel(f"t{i}", "rad", "command", None, None, f"actuator:m{i}") for i in range(3)),
        *(
            CaseChannel(f"q{i}", "rad", "response", 3e-4, None, f"joint:{j}", "position")
            for i, j in enumerate(joints)
        ),
    )
    parameters = tuple(NominalParameter(f"damping:{j}", 0.3, 0.03) for j in joints)
    return Case("robot", "robot.xml", parameters, channels, tuple(records[:2]), (records[2],), folder)


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    case = measured(with_table, tmp_path_factory.mktemp("pressed"))
    return case, diagnose_articulated(case)


def test_a_table_is_named_where_it_stands(pressed):
    verdict = pressed[1].verdict
    assert [(e.name, e.where) for e in verdict.named] == [("surface_contact", "fore")]
    (named,) = verdict.named
    assert named.parameters["height"].unit == "m"
    # it is soft: what presses with some newtons sinks in by millimetres
    assert named.parameters["height"].value == pytest.approx(HEIGHT, abs=0.004)
    assert named.closed > 0.8


def test_the_table_closes_in_plain_mujoco(pressed):
    case, found = pressed
    path = case.folder / case.rig
    applied = apply(path, findings_of(found.verdict), case=case)
    assert [change.form for change in applied.changes if change.what == "surface_contact"] == ["native"]
    assert (
        applied.compiled().geom("added_fore_surface").pos[2]
        == found.verdict.named[0].parameters["height"].value
    )
    worth = verify(path, findings_of(found.verdict), gaps_left(found.verdict), case)
    left = {figure.dof: figure for figure in worth.figures}
    for joint in ("shoulder", "elbow"):
        assert left[joint].after < 0.35 * left[joint].before


def test_no_table_is_named_where_none_is(tmp_path):
    verdict = diagnose(measured(lambda spec: None, tmp_path)).verdict
    assert (verdict.verdict, verdict.named) == ("none", ())


def test_a_stop_of_a_single_joint_is_no_surface(pressed):
    case, found = pressed
    problem = ArticulatedProblem.of(case, found.model, case.identification)
    (end,) = ends_within(problem)
    assert (end.body, end.joint, end.others) == ("fore", 2, (1,))
    (placed,) = [p for p in placements(problem, CATALOGUE) if p.effect.name == "surface_contact"]
    assert placed.joints == (2, 1)
    # with the shoulder's axis upright the elbow alone raises the finger
    upright = robot("sphere").replace('name="shoulder" axis="0 1 0"', 'name="shoulder" axis="0 0 1"')
    model = ArticulatedModel.of(mujoco.MjModel.from_xml_string(upright))
    assert ends_within(ArticulatedProblem.of(case, model, case.identification)) == []
