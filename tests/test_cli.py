"""The command line as a newcomer meets it: results, JSON, and messages without tracebacks."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pytest

from bench.cli import main
from bench.files import json_values
from bench.record_files import read_recording

CONFIGURATION = """
rig = "sdof"
[structure.mass]
carriage = 2.0
[structure.stiffness]
carriage = 1500.0
[[elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = 3000.0, clearance = 0.005 }
[excitation]
duration = 1.0
sample_rate = 1000.0
signals.shaker = { type = "harmonic", amplitude = 30.0, frequency = 4.0 }
"""


@pytest.fixture
def configuration(tmp_path: Path) -> Path:
    path = tmp_path / "gap.toml"
    path.write_text(CONFIGURATION)
    return path


def test_simulate_writes_a_record_that_reads_back(configuration, tmp_path, capsys):
    out = tmp_path / "gap.parquet"
    assert main(["simulate", str(configuration), "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    record = read_recording(out)
    assert told["samples"] == len(record.time) == 1000
    rows = {row["channel"]: row for row in told["channels"]}
    assert rows["carriage.gap/force"]["max"] == record["carriage.gap/force"].max() > 0.0


def test_view_saves_a_rerun_recording(configuration, tmp_path, capsys):
    other = tmp_path / "wider.toml"
    other.write_text(CONFIGURATION.replace("clearance = 0.005", "clearance = 0.01"))
    out = tmp_path / "both.rrd"
    assert main(["view", str(configuration), str(other), "-o", str(out)]) == 0
    assert out.read_bytes()[:4] in {b"RRF2", b"RRIO"}
    assert "rerun" in capsys.readouterr().out


def test_laws_lists_and_describes(capsys):
    assert main(["laws", "--json"]) == 0
    names = {law["name"] for law in json.loads(capsys.readouterr().out)}
    assert {"gap", "bouc_wen", "coulomb", "axial_torsional_joint"} <= names
    assert main(["laws", "gap"]) == 0
    assert "clearance" in capsys.readouterr().out


def test_own_mjcf_with_an_element(tmp_path, capsys):
    (tmp_path / "mine.xml").write_text(
        """<mujoco><option gravity="0 0 0" timestep="0.002"/><worldbody><body><joint name="slider" type="slide"/>
        <geom size=".1" mass="1"/></body></worldbody><actuator><motor name="motor" joint="slider"/></actuator></mujoco>"""
    )
    (tmp_path / "mine.toml").write_text(
        CONFIGURATION.replace('"sdof"', '"mine.xml"')
        .replace("[structure.mass]\ncarriage = 2.0\n[structure.stiffness]\ncarriage = 1500.0", "")
        .replace('["carriage"]', '["slider"]')
        .replace("signals.shaker", "signals.motor")
        .replace("1000.0\n", "500.0\n")
    )
    out = tmp_path / "mine.parquet"
    assert main(["simulate", str(tmp_path / "mine.toml"), "-o", str(out), "--json"]) == 0
    capsys.readouterr()
    record = read_recording(out)
    assert record.sample_rate == 500.0
    assert np.ptp(record["slider.gap/displacement"]) > 0.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('law = "gap"', 'law = "gapp"', "unknown law 'gapp'"),
        ("clearance = 0.005", "clearanc = 0.005", "Did you mean 'clearance'"),
        ("clearance = 0.005", "clearance = -1.0", "a finite value in [0, inf] is expected"),
        ('joints = ["carriage"]', 'joints = ["cart"]', "unknown joint or tendon"),
        ('joints = ["carriage"]', "", "an element needs law, joints; joints missing"),
        ('rig = "sdof"', 'rig = "sdoff"', "Did you mean 'sdof'"),
        ('rig = "sdof"', 'rig = "nowhere.xml"', "cannot read the model"),
        ('rig = "sdof"', 'machine = "sdof"', "unknown entry of a rig configuration 'machine'"),
        ("[excitation]", "[excite]", "unknown entry of a rig configuration 'excite'"),
        ("signals.shaker", "signals.shakre", "Did you mean 'shaker'"),
        ('"harmonic"', '"harmonics"', "Did you mean 'harmonic'"),
        ("rig =", "rig ", "cannot read"),
        ("sample_rate = 1000.0", "sample_rate = 700.0", "does not divide"),
    ],
)
def test_mistakes_are_answered_in_one_sentence(configuration, tmp_path, capsys, old, new, message):
    assert old in CONFIGURATION
    configuration.write_text(CONFIGURATION.replace(old, new))
    out = tmp_path / "none.parquet"
    assert main(["simulate", str(configuration), "-o", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error.replace("\n", " ")
    assert "Traceback" not in error
    assert not out.exists()


def test_missing_and_corrupted_files(tmp_path, capsys):
    assert main(["simulate", str(tmp_path / "nope.toml")]) == 2
    assert "cannot read" in capsys.readouterr().err
    assert main(["view"]) == 2
    assert "at least one rig configuration" in capsys.readouterr().err


def test_every_command_explains_itself(capsys):
    from bench.cli import COMMANDS

    for words in ([name] for name in COMMANDS):
        with pytest.raises(SystemExit) as stop:
            main([*words, "--help"])
        assert stop.value.code == 0
        assert words[0] in capsys.readouterr().out


def test_blind_score_of_nothing_says_so(tmp_path, capsys):
    (tmp_path / "results").mkdir()
    assert main(["blind", "score", str(tmp_path / "results"), str(tmp_path)]) == 2
    assert "no result" in capsys.readouterr().err


def test_json_values_are_finite_and_plain():
    class Point(NamedTuple):
        x: float
        y: float

    document = {
        "a": (1.0, math.nan),
        "b": [Point(math.inf, 2.0)],
        "c": MappingProxyType({"d": "inf"}),
        "e": True,
    }
    plain = json_values(document)
    assert plain == {"a": [1.0, None], "b": [{"x": None, "y": 2.0}], "c": {"d": "inf"}, "e": True}
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain


def test_version_is_told(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("jointbench ")


@pytest.mark.slow
def test_results_are_readable_whatever_the_locale_says():
    code = "import sys; from bench.cli import main; sys.exit(main())"
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG", "PYTHONUTF8"))}
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}

    def told(locale: dict[str, str]) -> bytes:
        command = [sys.executable, "-c", code, "laws", "gap"]
        return subprocess.run(command, env=plain | locale, capture_output=True, check=True).stdout

    expected = told({"PYTHONIOENCODING": "utf-8"})
    assert not expected.isascii()
    assert told({"LANG": "C"}) == told(ascii_only) == expected
    assert "\\u2026" in told({"PYTHONIOENCODING": "latin-1"}).decode("latin-1")  # … is none of its letters
