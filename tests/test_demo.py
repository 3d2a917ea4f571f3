"""The main job, whole: what issue and README promise of it."""

from __future__ import annotations

import json

import pytest

from bench import demo
from bench.cli import main
from bench.record_files import read_recording


@pytest.mark.slow
def test_demo_holds_what_it_promises_and_leaves_its_files(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "demo"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    joint = {model["model"]: model["force_nmse_percent"] for model in told["joint"]}
    published = joint["published network (30)"]
    for axis in ("axial", "torsional"):
        assert 0.2 <= published[axis] <= 0.5  # the dissertation's network follows the deck's joint
        assert joint["network (30)"][axis] <= published[axis]
        assert joint["network (40)"][axis] <= 0.10
    for test in told["damper"]:
        assert test["force_nrmse"]["parametric"] <= 0.25
    page = (tmp_path / "demo" / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") >= 4
    assert (tmp_path / "demo" / "joint.rrd").stat().st_size > 100_000
    unseen = read_recording(tmp_path / "demo" / "records" / "unseen_true.parquet")
    assert unseen.duration == pytest.approx(demo.joint.JOINT_SETUP.duration, abs=0.01)
