"""The rerun recording: geometry and motion as MuJoCo has them, bands and loops as the laws have them, files whole."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench import Element, Recording, Rig, simulate
from bench.errors import BenchError, ParameterError, RecordingError, UnknownNameError
from bench.rerun_log import body_poses, joint_positions, log_comparison
from bench.rerun_log.bands import changes, element_bands
from bench.rerun_log.scene import eye_of, mesh_of, skin_slices
from bench.rerun_log.traces import extremes, frame_of
from bench.rig.library import chain_rig, joint_rig, sdof_rig

SHAPES = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .2 0 0  0 .1 0  0 0 .3"/></asset>
  <worldbody>
    <camera name="front" pos="0 -3 1" xyaxes="1 0 0 0 .3 .95" fovy="40"/>
    <geom name="floor" type="plane" size="3 3 .1"/>
    <body name="base"><geom name="plate" type="box" size=".4 .3 .02"/></body>
    <body name="carriage" pos="0 0 .2">
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom name="block" type="box" size=".1 .1 .1" rgba="1 0 0 1" mass="1"/>
      <geom name="rod" type="capsule" fromto="0 0 .1 .3 .2 .4" size=".02" mass="0"/>
      <geom name="hidden" type="box" size=".1 .1 .1" group="3" mass="0"/>
      <body name="arm" pos="0 0 .3">
        <joint name="hinge" type="hinge" axis="0 0 1"/>
        <geom name="drum" type="cylinder" size=".05 .1" mass="1"/>
        <geom name="ball" type="sphere" size=".04" pos=".2 0 0" mass="0"/>
        <geom name="egg" type="ellipsoid" size=".04 .05 .06" pos="-.2 0 0" mass="0"/>
        <geom name="wedge" type="mesh" mesh="wedge" pos=".1 .2 .3" euler="10 20 30" mass="0"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="mixed"><joint joint="hinge" coef="2"/><joint joint="slide" coef="-1"/></fixed></tendon>
  <actuator><motor name="push" joint="slide"/><motor name="twist" joint="hinge"/></actuator>
  <sensor>{sensors}</sensor>
</mujoco>
"""
SENSORS = '<jointpos name="x" joint="slide"/><jointpos name="angle" joint="hinge"/>'


def shapes_rig(sensors: str = SENSORS, *elements: Element) -> Rig:
    return Rig("shapes", SHAPES.format(sensors=sensors), elements)


def chunks_of(path: Path) -> dict[str, list]:
    """All chunks of a file by entity, by rerun's own reader."""
    from rerun.chunk import RrdReader

    found: dict[str, list] = {}
    for chunk in RrdReader(path).stream().to_chunks():
        found.setdefault(chunk.entity_path.replace("\\", ""), []).append(chunk)
    return found


def column(chunks: list, name: str) -> np.ndarray:
    """A component over time, in one array."""
    import pyarrow as pa

    parts = [
        c.to_record_batch() for c in chunks if not c.is_static and name in c.to_record_batch().schema.names
    ]
    values = pa.concat_arrays([part.column(name) for part in parts])
    if pa.types.is_duration(values.type):
        return values.cast(pa.int64()).to_numpy() * 1e-9
    return np.array(values.to_pylist(), dtype=float).squeeze()


@pytest.fixture(scope="module")
def case() -> tuple[dict[str, Rig], dict[str, Recording]]:
    true = sdof_rig(
        Element.of("gap", "carriage", stiffness=4000.0, clearance=0.005, name="gap"),
        Element.of("bouc_wen", "carriage", A=2000.0, beta=100.0, gamma=50.0, n=1.0, name="slide"),
        stiffness=300.0,
        damping=3.0,
    )
    rigs = {"true": true, "identified": true.with_element(true.element("gap").with_(clearance=0.006))}
    t = np.arange(2000) * 1e-3
    drive = {"shaker": 40.0 * np.sin(2.0 * np.pi * 6.0 * t) + 15.0 * np.sin(2.0 * np.pi * 17.0 * t)}
    return rigs, {name: simulate(rig, drive) for name, rig in rigs.items()}


@pytest.fixture(scope="module")
def written(case, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("rerun") / "comparison.rrd"
    assert log_comparison(path, *case) == path
    return path


def test_poses_of_a_slide_and_a_hinge_are_those_of_geometry():
    x, angle = np.array([0.0, 0.1, -0.3]), np.array([0.0, 0.5, -2.0])
    poses = body_poses(shapes_rig().scene, np.stack([x, angle], axis=1))
    arm = 3
    zero = np.zeros(3)
    np.testing.assert_allclose(poses.position[:, arm], np.stack([x, zero, zero + 0.5], axis=1), atol=1e-15)
    half = 0.5 * angle
    np.testing.assert_allclose(
        poses.quaternion[:, arm], np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1), atol=1e-15
    )


def test_joint_positions_come_from_sensors():
    drive = {"push": np.full(300, 2.0), "twist": np.full(300, 0.1)}
    record = simulate(shapes_rig(), drive)
    # The solution of two equations in two unknowns: rounding only.
    np.testing.assert_allclose(
        joint_positions(shapes_rig(), record), np.stack([record["x"], record["angle"]], axis=1), atol=1e-15
    )


def test_joint_positions_come_from_tendons_and_elements_where_sensors_are_missing():
    spring = Element.of("linear", "mixed", stiffness=3.0, damping=0.0, name="spring")
    drive = {"push": np.full(300, 2.0), "twist": np.full(300, 0.1)}
    full = simulate(shapes_rig(SENSORS, spring), drive)
    for sensors in ('<jointpos name="x" joint="slide"/>', SENSORS.replace('"angle"', '"other"')):
        rig = shapes_rig(sensors, spring)
        found = joint_positions(rig, simulate(rig, drive))
        # The displacement 2 angle - x is rounded when it is recorded: one part in 1e16 of about 1.
        np.testing.assert_allclose(found, np.stack([full["x"], full["angle"]], axis=1), atol=1e-14)


def test_a_joint_nobody_measures_stays_where_it_is_drawn():
    rig = shapes_rig('<jointpos name="x" joint="slide"/>')
    record = simulate(rig, {"push": np.full(50, 2.0), "twist": np.full(50, 0.1)})
    found = joint_positions(rig, record)
    assert np.ptp(found[:, 0]) > 0.0
    assert np.all(found[:, 1] == 0.0)


@pytest.mark.parametrize("make", [joint_rig, chain_rig, sdof_rig])
def test_joint_positions_of_the_library_reproduce_every_position_sensor(make):
    rig = make() if make is not sdof_rig else make(stiffness=200.0)
    t = np.arange(200) * 1e-3
    record = simulate(rig, {rig.actuators[0]: 50.0 * np.sin(20.0 * t)})
    qpos = joint_positions(rig, record)
    data = mujoco.MjData(rig.model)
    data.qpos[:] = qpos[-1]
    mujoco.mj_forward(rig.model, data)
    kinds = (int(mujoco.mjtSensor.mjSENS_JOINTPOS), int(mujoco.mjtSensor.mjSENS_TENDONPOS))
    sensors = [i for i in range(rig.model.nsensor) if int(rig.model.sensor_type[i]) in kinds]
    assert sensors
    for sensor in sensors:
        shown = data.sensordata[rig.model.sensor_adr[sensor]]
        # Several equations for the same joints agree to rounding only.
        assert shown == pytest.approx(record[rig.model.sensor(sensor).name][-1], abs=1e-13)


def test_a_mesh_lies_where_mujoco_draws_it():
    model = shapes_rig().scene
    mesh = mesh_of(model, model.geom("wedge").id)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    arm, geom = model.body("arm").id, model.geom("wedge").id
    world = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    local = (world - data.xpos[arm]) @ data.xmat[arm].reshape(3, 3)
    drawn = np.array(mesh.vertex_positions.as_arrow_array().to_pylist())
    np.testing.assert_allclose(drawn, local, atol=1e-7)  # rerun holds positions in single precision


@pytest.mark.parametrize(
    ("rig", "pose"),
    [(sdof_rig(), {"carriage": 0.03}), (joint_rig(), {"axial_1": 0.012, "torsional_1": 0.4})],
)
def test_skins_follow_mujocos_own_skinning_to_a_pixel(rig, pose):
    # The rigs are 1.6 m long: where one fills a screen of 2000 pixels, a pixel is 0.8 mm. The ends move 30 mm and turn
    # 22 mm; what is left is that weights are off a line at a coil's closed ends and that arcs become chords.
    tolerance = 8e-4
    model = rig.scene
    data = mujoco.MjData(model)
    qpos = np.array(data.qpos)
    for joint, value in pose.items():
        qpos[model.joint(joint).qposadr[0]] = value
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    scene = mujoco.MjvScene(model, maxgeom=1000)
    mujoco.mjv_updateScene(
        model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), int(mujoco.mjtCatBit.mjCAT_ALL), scene
    )
    everything = np.array(scene.skinvert, dtype=float).reshape(-1, 3)
    for skin in range(model.nskin):
        start = int(model.skin_vertadr[skin])
        expected = everything[start : start + int(model.skin_vertnum[skin])]
        for part in skin_slices(model, skin, body_poses(model, qpos[None])):
            drawn = part.vertices @ part.maps[0, :, :3].T + part.maps[0, :, 3]
            distance = np.linalg.norm(drawn[:, None] - expected[None], axis=2).min(axis=1)
            assert distance.max() < tolerance


def test_the_eye_looks_along_the_models_camera():
    eye = eye_of(shapes_rig().scene, "front")
    forward = (eye.target - eye.position) / np.linalg.norm(eye.target - eye.position)
    data = mujoco.MjData(shapes_rig().scene)
    mujoco.mj_forward(shapes_rig().scene, data)
    np.testing.assert_allclose(forward, -data.cam_xmat[0].reshape(3, 3)[:, 2], atol=1e-12)


@given(
    values=st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=400),
    rate=st.floats(5.0, 2000.0),
)
@settings(deadline=None)
def test_thinned_series_keep_their_extremes_and_invent_nothing(values, rate):
    y = np.array(values)
    t = np.arange(len(y)) * 1e-2
    kept_t, kept_y = extremes(t, y, rate)
    np.testing.assert_array_equal(kept_y, y[np.searchsorted(t, kept_t)])
    assert np.all(np.diff(kept_t) > 0.0)
    assert (kept_t[0], kept_t[-1]) == (t[0], t[-1])
    width = max(1, int(np.ceil(2.0 * (len(y) - 1) / ((t[-1] - t[0]) * rate))))
    whole = len(y) // width * width
    if whole:
        assert kept_y.max() >= y[:whole].max()
        assert kept_y.min() <= y[:whole].min()
    assert len(kept_t) <= (t[-1] - t[0]) * rate + 4  # two a window, and the two ends


def test_a_single_sample_impact_survives_thinning():
    y = np.zeros(30_000)
    y[12_345] = 7.0
    t, kept = extremes(np.arange(30_000) * 1e-3, y, 200.0)
    assert t[np.argmax(kept)] == pytest.approx(12.345)
    assert len(t) <= 6004


def test_a_loop_is_drawn_upright_inside_its_frame(rng):
    x, y = rng.normal(size=(2, 1000)) * [[1e-3], [1e5]]
    frame = frame_of([x], [y])
    points = frame.place(x, y)
    assert points.min() >= 0.0
    assert points.max() <= 1.0
    assert np.argmin(points[:, 1]) == np.argmax(y)  # the view's second coordinate points down
    assert frame_of([np.zeros(3)], [np.ones(3)]).place([0.0], [1.0]) == pytest.approx(np.array([[0.5, 0.5]]))


def test_the_file_holds_what_was_recorded(case, written):
    _, records = case
    chunks = chunks_of(written)
    for number, (name, record) in enumerate(records.items()):
        for channel in record.channels:
            entity = f"/channels/{channel.name} [{channel.unit}]/{number}-{name}"
            series = chunks[entity]
            time, values = column(series, "time"), column(series, "Scalars:scalars")
            assert time[0] == pytest.approx(0.0)
            assert time[-1] == pytest.approx(record.time[-1])
            assert len(time) <= 200.0 * record.time[-1] + 4
            at = np.searchsorted(record.time, time - 1e-6)
            np.testing.assert_array_equal(values, record[channel.name][at].astype(np.float32))
    for name in ("gap/force [N]", "slide/force [N]", "gap/displacement [m]"):
        assert f"/errors/{name}/1-identified" in chunks
        assert f"/errors/{name}/0-true" not in chunks


def test_the_carriage_moves_in_the_file_as_its_sensor_says(case, written):
    _, records = case
    chunks = chunks_of(written)
    for number, (name, record) in enumerate(records.items()):
        carriage = chunks[f"/rig/{number}-{name}/carriage"]
        time, place = column(carriage, "time"), column(carriage, "Transform3D:translation")
        assert len(time) == 60  # 30 a second of 1.999 s
        moved = place[:, 0] - place[0, 0]
        measured = np.interp(time, record.time, record["displacement"])
        np.testing.assert_allclose(moved, measured - measured[0], atol=1e-7)  # single precision
    assert all(chunk.is_static for chunk in chunks["/rig/0-true/base"])


def test_geometry_is_sent_once_and_hidden_groups_are_left_out(tmp_path):
    rig = shapes_rig()
    record = simulate(rig, {"push": np.full(200, 2.0), "twist": np.full(200, 0.1)})
    chunks = chunks_of(log_comparison(tmp_path / "shapes.rrd", {"true": rig}, {"true": record}))
    geometry = {
        entity.removeprefix("/rig/0-true/"): c
        for entity, c in chunks.items()
        if entity.startswith("/rig/0-true/")
    }
    assert {
        "carriage/boxes",
        "carriage/capsules",
        "arm/cylinders",
        "arm/ellipsoids",
        "arm/wedge",
        "base/boxes",
    } <= set(geometry)
    assert all(chunk.is_static for entity, parts in geometry.items() if "/" in entity for chunk in parts)
    boxes = geometry["carriage/boxes"][0].to_record_batch()
    assert boxes.column("Boxes3D:labels").to_pylist() == [["block"]]
    assert boxes.column("Boxes3D:colors").to_pylist() == [[0xFF0000FF]]
    rod = geometry["carriage/capsules"][0].to_record_batch()
    by_name = {
        name.split(":")[1]: rod.column(name).to_pylist()[0][0] for name in rod.schema.names if ":" in name
    }
    along = np.empty(3)
    mujoco.mju_rotVecQuat(along, np.array([0.0, 0.0, by_name["lengths"]]), np.roll(by_name["quaternions"], 1))
    ends = np.array([by_name["translations"], by_name["translations"] + along])
    # MuJoCo does not say which end of a capsule comes first; single precision.
    np.testing.assert_allclose(ends[np.argsort(ends[:, 0])], [[0.0, 0.0, 0.1], [0.3, 0.2, 0.4]], atol=1e-6)


def test_bands_loops_scores_and_blueprint_are_in_the_file(case, written):
    from rerun.chunk import RrdReader

    rigs, records = case
    chunks = chunks_of(written)
    for number, (name, record) in enumerate(records.items()):
        (gap,) = element_bands(rigs["true"].element("gap"))
        states = gap.of(record)
        lane = chunks[f"/bands/gap.gap/{number}-{name}"]
        at = column(lane, "time")
        assert len(at) == len(changes(states)) > 4
        np.testing.assert_allclose(at, record.time[changes(states)], atol=1e-9)
        assert f"/loops/slide/force over slide/displacement/{number}-{name}/whole" in chunks
        assert f"/loops/slide/force over slide/velocity/{number}-{name}/trail" in chunks
    (scores,) = (c.to_record_batch() for c in chunks["/scores"])
    text = scores.column("TextDocument:text").to_pylist()[0][0]
    y, yhat = (record["gap/force"] for record in records.values())
    expected = 100.0 * np.sum((y - yhat) ** 2) / (len(y) * np.var(y))
    (row,) = (line for line in text.splitlines() if line.startswith("| gap/force "))
    assert f"{expected:.3g} %" in row
    assert len(RrdReader(written).blueprints()) == 1
    assert len(RrdReader(written).recordings()) == 1


def test_a_laboratory_record_needs_no_rig(case, tmp_path):
    rigs, records = case
    simulated = records["true"]
    measured = Recording.from_arrays(
        simulated.time,
        {"displacement": simulated["displacement"], "load_cell": 1.1 * simulated["load_cell"]},
        units={"displacement": "m", "load_cell": "N"},
    )
    path = log_comparison(
        tmp_path / "lab.rrd",
        {"model": rigs["true"]},
        {"measured": measured, "model": simulated},
        loops=[("displacement", "load_cell")],
    )
    chunks = chunks_of(path)
    assert "/loops/load_cell over displacement/0-measured/whole" in chunks
    assert "/errors/load_cell [N]/1-model" in chunks
    assert not any(entity.startswith("/rig/0-measured") for entity in chunks)
    assert "/rig/1-model/carriage" in chunks


def test_given_poses_take_the_place_of_the_record(case, tmp_path):
    rigs, records = case
    still = np.zeros((len(records["true"].time), rigs["true"].model.nq))
    path = log_comparison(
        tmp_path / "still.rrd", {"true": rigs["true"]}, {"true": records["true"]}, poses={"true": still}
    )
    assert (
        np.ptp(column(chunks_of(path)["/rig/0-true/carriage"], "Transform3D:translation"), axis=0).max()
        == 0.0
    )


def test_a_failure_leaves_the_old_file_and_nothing_else(case, tmp_path):
    rigs, records = case
    path = tmp_path / "old.rrd"
    path.write_bytes(b"old")
    blind = Recording.from_arrays(
        records["true"].time, {"load_cell": records["true"]["load_cell"]}, units={"load_cell": "N"}
    )
    with pytest.raises(RecordingError, match=r"holds no joint position of rig 'sdof'.*jointpos"):
        log_comparison(path, {"true": rigs["true"]}, {"true": blind})
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["old.rrd"]


def test_bad_arguments_are_refused_before_anything_is_written(case, tmp_path):
    rigs, records = case
    true = records["true"]
    path = tmp_path / "never.rrd"
    short = Recording.from_arrays(
        true.time[:-1], {"load_cell": true["load_cell"][:-1]}, units={"load_cell": "N"}
    )
    cases = [
        ((rigs, {}), {}, ParameterError, "no records"),
        ((rigs, {"true": true}), {}, UnknownNameError, "identified"),
        (({}, {"true": true, "short": short}), {}, RecordingError, "different clocks"),
        (({}, {"true": true}), {"loops": [("displacement", "farce")]}, UnknownNameError, "farce"),
        (({}, {"true": true}), {"frame_rate": 0.0}, ParameterError, "positive"),
        (({}, {"true": true}), {"series_rate": np.nan}, ParameterError, "positive"),
        (({}, {"true": true}), {"poses": {"true": np.zeros((3, 2))}}, RecordingError, "3 poses"),
        ((rigs, records), {"camera": "nowhere"}, UnknownNameError, "nowhere"),
        (
            ({"true": rigs["true"]}, {"true": true}),
            {"poses": {"true": np.zeros((2000, 5))}},
            RecordingError,
            r"\(n, 2\)",
        ),
    ]
    for arguments, options, error, words in cases:
        with pytest.raises(error, match=words):
            log_comparison(path, *arguments, **options)
    with pytest.raises(BenchError, match="cannot write"):
        log_comparison("/proc/nowhere/x.rrd", {}, {"true": true})
    assert list(tmp_path.iterdir()) == []


def test_without_a_file_the_viewer_is_opened_or_said_to_be_missing(case, monkeypatch):
    import os

    import rerun

    rigs, records = case
    opened = []

    def spawn(_stream, **options):
        opened.append((options["default_blueprint"], os.environ["PATH"]))
        if len(opened) > 1:
            raise RuntimeError("Failed to find Rerun Viewer executable in PATH.\n  much more")

    monkeypatch.setattr(rerun.RecordingStream, "spawn", spawn)
    monkeypatch.setenv("PATH", "/nowhere")
    assert log_comparison(None, rigs, records) is None
    assert opened[0][0] is not None
    assert opened[0][1].endswith(os.pathsep + "/nowhere")
    with pytest.raises(BenchError, match=r"cannot be opened: Failed .* PATH\. Give a file"):
        log_comparison(None, rigs, records)
    assert os.environ["PATH"] == "/nowhere"


@pytest.mark.slow
def test_half_a_minute_of_three_joint_rigs_fits_in_thirty_megabytes(tmp_path, rng):
    t = np.arange(30_000) * 1e-3
    drive = {"force": 3000.0 * np.sin(40.0 * t + 3.0 * np.sin(t)), "torque": 80.0 * np.sin(31.0 * t)}
    rig = joint_rig()
    rigs = dict.fromkeys(("true", "network", "polynomial"), rig)
    record = simulate(rig, drive)
    noisy = {
        name: Recording.from_arrays(
            record.time,
            {c: record[c] + 1e-3 * np.std(record[c]) * rng.normal(size=len(t)) for c in record.names},
            units={c.name: c.unit for c in record.channels},
        )
        for name in rigs
    }
    path = log_comparison(tmp_path / "long.rrd", rigs, noisy)
    assert path.stat().st_size < 30e6
    assert len(column(chunks_of(path)["/rig/2-polynomial/body_2"], "time")) == 900


def test_an_episode_tells_the_limits_and_what_is_known_by_when(tmp_path):
    from bench.excitation import design
    from bench.excitation.methods import controls_from
    from bench.excitation.request import request
    from bench.excitation.schema import ExcitationRequest
    from bench.rerun_log.episode import episode_record, log_episode

    example = Path(__file__).resolve().parents[1] / "examples" / "excite.toml"
    document = ExcitationRequest.read(example)
    rng = np.random.default_rng(1)
    rig = document.build(example.parent)
    asked = request(rig, document.experiment, draws=2, rng=rng)
    made = design("log_sweep", asked.experiment, duration=4.0, band=asked.band, rng=rng)
    controls = controls_from(made)
    record = episode_record(asked.rig, asked.experiment, controls)
    assert record["limit/force of shaker"].max() <= 1.0 + 1e-9
    assert 0.0 < record["limit/displacement"].max() <= 1.0
    assert np.all(np.diff(record["information"]) >= -1e-9)
    # the last window's end lies a sample before that of the record
    assert record["information"].max() == pytest.approx(
        float(asked.experiment.merit(controls[None])[0]), rel=0.01
    )
    unknown = [name for name in record.names if name.startswith("unknown/")]
    assert unknown == [f"unknown/{name}" for name in asked.experiment.question.hypotheses[0].names]
    for name in unknown:  # a record that goes on never knows less
        assert record[name][0] == 1.0
        assert np.all(np.diff(record[name]) <= 1e-9)
    assert min(record[name][-1] for name in unknown) < 0.2
    path = log_episode(tmp_path / "episode.rrd", asked.rig, asked.experiment, controls)
    assert path is not None
    assert path.stat().st_size > 10_000
