"""The core job by command: a joint identified from records, swapped in, compared with the true one, exported, records converted."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bench.cli import main
from bench.identification import ValidityRange
from bench.joint_models import JointColumns, joint_motions, read_joint
from bench.laws.evaluate import evaluate
from bench.record_files import read_recording

RIG = """
rig = "sdof"
structure.mass.carriage = 2.0
structure.stiffness.carriage = 1500.0
structure.damping.carriage = 4.0
[[elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = 3000.0, clearance = 0.005 }
[excitation]
duration = 4.0
sample_rate = 1000.0
signals.shaker = { type = "band_limited_noise", cutoff = 15.0, peak = 60.0 }
"""
MODEL = """<mujoco><option gravity="0 0 0" timestep=".001"/><worldbody><body><joint name="carriage" type="slide"/>
<geom size=".1" mass="2"/></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("joints")
    (path / "rig.toml").write_text(RIG)
    (path / "model.xml").write_text(MODEL)
    for seed in (1, 2):
        record = str(path / f"run_{seed}.parquet")
        assert main(["simulate", str(path / "rig.toml"), "-o", record, "--seed", str(seed), "--json"]) == 0
    settings = {
        "polynomial": ["--order", "3"],
        "network": ["--hidden", "12", "--starts", "2"],
        "law": ["--law", "coulomb", "gap"],
    }
    for kind, more in settings.items():
        out = str(path / f"{kind}.json")
        words = ["identify", record, "--model", kind, "-o", out, *more, "--json"]
        assert main(words) == 0
    return path


def _forces(joint, states):
    q, v = states[:, :1], states[:, 1:]
    return evaluate(joint.element.law, joint.element.theta, np.arange(len(q)) * 1e-3, q, v)[0]


def test_a_law_is_found_again_and_judged_on_what_it_did_not_see(folder):
    joint = read_joint(folder / "law.json")
    assert joint.element.law.name == "gap"  # coulomb was offered too
    # noise-free force of the same law: what is left is the optimiser's own tolerance, 1e-8 of each step, some orders below 1e-3
    assert joint.element.parameters["stiffness"] == pytest.approx(3000.0, rel=1e-3)
    assert joint.element.parameters["clearance"] == pytest.approx(0.005, rel=1e-3)
    network = read_joint(folder / "network.json")
    assert network.scores["held out"][0] < 0.1 * read_joint(folder / "polynomial.json").scores["held out"][0]


def test_swapped_and_compared_the_law_beats_the_network_beats_the_polynomial(folder, capsys):
    found = {}
    for kind in ("polynomial", "network", "law"):
        joint, reduced = str(folder / f"{kind}.json"), str(folder / f"reduced_{kind}.json")
        assert main(["swap", str(folder / "rig.toml"), joint, "-o", reduced, "--json", "--force"]) == 0
        assert json.loads(capsys.readouterr().out)["replaced"] == ["carriage.gap"]
        for twin in (reduced, joint):
            assert main(["compare", str(folder / "rig.toml"), twin, "--seed", "3", "--json"]) == 0
            score = json.loads(capsys.readouterr().out)["nmse_percent"]["carriage.gap/force"]
            assert found.setdefault(kind, score) == score  # the joint by itself and in its rig are one
    assert found["law"] < found["network"] < found["polynomial"]


def test_exports_compute_the_same_forces(folder):
    import onnx.reference

    rng = np.random.default_rng(0)
    for kind in ("polynomial", "network"):
        joint = read_joint(folder / f"{kind}.json")
        validity = joint.element.validity
        assert isinstance(validity, ValidityRange)
        low, high = validity.minimum, validity.maximum
        states = low + (high - low) * rng.random((50, 2))
        expected = _forces(joint, states)
        for suffix in (".py", ".onnx"):
            out = str(folder / f"{kind}{suffix}")
            assert main(["export", str(folder / f"{kind}.json"), "-o", out, "--force", "--json"]) == 0
        module = runpy.run_path(str(folder / f"{kind}.py"))
        # sums of some ten terms in another order: rounding of the largest
        close = {"rtol": 1e-10, "atol": 1e-10 * np.abs(expected).max()}
        np.testing.assert_allclose(module["force"](states[:, :1], states[:, 1:]), expected, **close)
        (forces,) = onnx.reference.ReferenceEvaluator(str(folder / f"{kind}.onnx")).run(
            None, {"states": states}
        )
        np.testing.assert_allclose(forces, expected, **close)
    from bench.nastran import read_network

    deck = folder / "network.bdf"
    assert main(["export", str(folder / "network.json"), "-o", str(deck), "--force", "--json"]) == 0
    joint = read_joint(folder / "network.json")
    read = read_network(deck).element(("carriage",))
    np.testing.assert_allclose(read.theta, joint.element.theta, rtol=1e-9)  # what large field holds


def test_mjcf_holds_a_gap_by_itself_and_a_network_through_the_snippet(folder):
    out = folder / "with_gap.xml"
    words = ["--mjcf", str(folder / "model.xml"), "--force", "--json"]
    assert main(["export", str(folder / "law.json"), "-o", str(out), *words]) == 0
    model = mujoco.MjModel.from_xml_path(str(out))
    data = mujoco.MjData(model)
    data.qpos[0] = 0.007
    mujoco.mj_forward(model, data)
    # 3000 N/m beyond 5 mm, times 2 mm; the law carries a damping and an offset of a billionth
    assert data.qfrc_constraint[0] == pytest.approx(-6.0, rel=2e-3)
    network = folder / "with_network.xml"
    assert main(["export", str(folder / "network.json"), "-o", str(network), *words]) == 0
    made = runpy.run_path(str(network.with_suffix(".py")))["rig"]
    assert made.elements[0].law.name == "network"
    assert np.array_equal(made.elements[0].theta, read_joint(folder / "network.json").element.theta)


def test_force_from_load_and_inertia(folder):
    out = folder / "applied.json"
    words = ["--displacement", "displacement", "--velocity", "velocity", "--applied", "load_cell"]
    words += ["--acceleration", "acceleration_x", "--mass", "2.0", "--joint", "carriage"]
    judge = ["--judge", str(folder / "run_2.parquet")]
    assert main(["identify", str(folder / "run_1.parquet"), *words, *judge, "-o", str(out), "--json"]) == 0
    assert set(read_joint(out).scores) == {"identification", "judging records"}
    record = read_recording(folder / "run_1.parquet")
    columns = JointColumns(("displacement",), ("velocity",), (), ("load_cell",), ("acceleration_x",), (2.0,))
    (motion,), _ = joint_motions([record], columns)
    guide = 1500.0 * record["displacement"] + 4.0 * record["velocity"]
    # guide and gap together; MuJoCo's own equation of motion, so that only rounding parts them
    assert np.abs(motion.force[:, 0] - guide - record["carriage.gap/force"]).max() < 1e-9 * 60.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["identify", "RUN", "--model", "networks"], "Did you mean 'network'"),
        (["identify", "RUN", "--model", "law"], "name one or several with --law"),
        (["identify", "RUN", "--displacement", "displacement"], "go together"),
        (["identify", "RUN", "--element", "gap"], "known: carriage.gap"),
        (["export", "LAW", "-o", "x.onnx"], "export it as MJCF"),
        (["export", "LAW", "-o", "x.bdf"], "only a network"),
        (["export", "LAW", "-o", "x.doc"], "unknown suffix"),
        (["export", "LAW", "-o", "x.xml"], "--mjcf model.xml"),
        (["swap", "RIG", "LAW", "--replace", "spring"], "known: carriage.gap"),
        (["compare", "LAW", "RIG"], "unknown entry"),
        (["convert", "RUN", "-o", "x.doc"], "records are written as"),
        (["plot", "RUN", "--kind", "loop", "--channels", "displacement"], "name two"),
    ],
)
def test_mistakes_are_answered_in_one_sentence(folder, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    names = {"RUN": folder / "run_1.parquet", "RIG": folder / "rig.toml", "LAW": folder / "law.json"}
    assert main([str(names.get(word, word)) for word in words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_convert_and_plot(folder, tmp_path):
    source = read_recording(folder / "run_1.parquet")
    for suffix in (".csv", ".mat", ".npz"):
        out = tmp_path / f"run{suffix}"
        assert main(["convert", str(folder / "run_1.parquet"), "-o", str(out), "--json"]) == 0
        units = None if suffix == ".csv" else {c.name: c.unit for c in source.channels}
        columns = {"displacement": "displacement"}
        back = read_recording(out, columns=columns, units={"displacement": "m"} if units else None)
        assert np.array_equal(back["displacement"], source["displacement"])
    picture = tmp_path / "run.png"
    assert main(["plot", str(tmp_path / "run.csv"), "-o", str(picture), "--channels", "displacement"]) == 0
    assert picture.read_bytes()[:4] == b"\x89PNG"
