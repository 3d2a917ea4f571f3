"""The check before any fit: faults of every kind are found in words, sound records are called ready, and what they tell is graded."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_articulated import LIMIT, mjcf, write_case

from bench.cli import main
from bench.discrepancy import read_case
from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.precheck.joints import admitted_joints, joint_doubts
from bench.discrepancy.precheck.positions import position_doubts
from bench.discrepancy.precheck.samples import sample_doubts
from bench.discrepancy.precheck.settings import CheckSettings

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
from planted_faults import FAULTS, check_one
from planted_machines import measured


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_each_kind_is_found(fault, tmp_path):
    word, _, doubts = check_one(fault, 3, tmp_path / "case")
    assert word != "ready"
    assert doubts


@pytest.mark.parametrize(
    ("fault", "seed", "said"),
    [
        ("skew", 68, "drift apart"),
        ("torque meaning", 16, "magnitude"),
        ("saturation", 15, "never beyond"),
        ("delay", 4, "later than"),
    ],
)
def test_a_fault_of_an_arm_is_told_for_what_it_is(fault, seed, said, tmp_path):
    word, _, doubts = check_one(fault, seed, tmp_path / "case", "arm")
    assert word == "doubtful"
    assert any(said in doubt for doubt in doubts), doubts


def test_an_arm_whose_drives_are_late_by_their_own_delay_is_ready(tmp_path):
    word, _, doubts = check_one("", 100_049, tmp_path / "case", "arm")
    assert word == "ready", doubts


def test_times_in_milliseconds_are_refused_at_once(tmp_path):
    word, _, doubts = check_one("clock", 10, tmp_path / "case", "arm")
    assert word == "unusable"
    assert "milliseconds" in doubts[0]


class Held:
    """A joint of a coarse encoder that its friction holds at every reversal, under a servo whose target goes a little further."""

    STEP, QUANTUM = 0.02, 1.5e-3
    time = np.arange(3000) * STEP
    target = 0.15 * np.sin(0.4 * time + 0.001 * time**2)
    position = np.round(np.clip(target, -0.1411, 0.1411) / QUANTUM) * QUANTUM

    @classmethod
    def record(cls, **more):
        """The record, as read: rows that repeat a number are told apart by the clock that they were brought onto."""
        values = {"goal": cls.target, "angle": cls.position, **more}
        return CaseRecord("run", cls.STEP, 0.0, values)

    @classmethod
    def doubts(cls, record):
        """What is said of its samples and its position."""
        channels = (CaseChannel("goal", role="command"), CaseChannel("angle", quantity="position"))
        case = Case("", "arm.xml", (), channels, (record,), ())
        found = [*sample_doubts(case, CheckSettings())]
        return [*found, *position_doubts("angle", record, 5e-4, record.values["goal"])]


def test_a_joint_that_its_friction_holds_is_no_stuck_sensor_and_at_no_end_of_its_range():
    assert not Held.doubts(Held.record())
    # the same with a reading that ends where the motion goes on
    far = np.clip(Held.target, -0.1, 0.1) + 1e-5 * np.random.default_rng(0).standard_normal(len(Held.time))
    cut = np.where(np.abs(Held.target) > 0.1, np.sign(Held.target) * 0.1, far)
    assert any("never beyond" in doubt for doubt in Held.doubts(Held.record(angle=cut)))
    # and with one that stands while the joint moves on
    stuck = Held.target + 1e-5 * np.random.default_rng(0).standard_normal(len(Held.time))
    stuck[1000:1030] = stuck[1000]
    assert any("stands still" in doubt for doubt in Held.doubts(Held.record(angle=stuck)))
    # a goal rests where it is told to
    assert not any("stands still" in doubt for doubt in Held.doubts(Held.record(goal=stuck)))


def test_a_joint_that_some_record_holds_is_told_by_the_others(tmp_path):
    """A test of one joint at a time holds the others; what no record moves is said once."""
    folder = write_case(tmp_path, mjcf(servo=True, friction=LIMIT), servo=True)
    case = read_case(folder)

    def said(*held):
        records = []
        for k, record in enumerate((case.identification[0], case.identification[0])):
            still = {
                name: np.full_like(x, x[0])
                for name, x in record.values.items()
                if k in held and name.startswith("elbow")
            }
            records.append(replace(record, name=f"run {k}", values=record.values | still))
        own, model, _ = admitted_joints(replace(case, identification=tuple(records)))
        return [doubt for doubt in joint_doubts(own, model) if "elbow" in doubt]

    assert not said()
    assert not said(0)
    assert said(0, 1) == [
        "joint 'elbow' hardly moves in any record: its friction, inertia and drive cannot be told from that"
    ]


def _write(folder, records, nominal):
    folder.mkdir()
    (folder / "nominal.json").write_text(json.dumps(nominal))
    for name, columns in records.items():
        table = np.column_stack(list(columns.values()))
        np.savetxt(
            folder / f"{name}.csv", table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g"
        )
    return folder


@pytest.mark.slow
def test_sound_records_are_ready_and_graded(tmp_path, capsys):
    folder = _write(tmp_path / "case", *measured(np.random.default_rng(7)))
    assert main(["check", str(folder), "--json"]) == 0  # as "--json -": no file follows
    found = json.loads(capsys.readouterr().out)
    assert found["word"] == "ready"
    told = {one["name"]: one["word"] for one in found["parameters"]}
    assert told == {"mass": "identifiable", "stiffness": "identifiable", "damping": "identifiable"}
    effects = {one["name"]: one for one in found["effects"]}
    assert effects["cubic_stiffness"]["word"] == "identifiable"
    # what a nominal parameter can do as well keeps next to nothing of its own
    assert effects["cubic_stiffness"]["figure"] > 3.0 * effects["stiffness_error"]["figure"]
    assert effects["stiffness_error"]["imitated"] > 0.9 > effects["cubic_stiffness"]["imitated"]
    # at the console a line for each effect, and a mark on what nominal parameters imitate
    assert main(["check", str(folder)]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if " stiffness_error " in line)
    assert "~" in line


def test_exit_status_says_what_was_found(tmp_path, capsys):
    records, nominal = measured(np.random.default_rng(8))
    for columns in records.values():
        columns["acceleration"] = -columns["acceleration"]
    folder = _write(tmp_path / "turned", records, nominal)
    with pytest.raises(SystemExit) as stop:
        main(["check", str(folder), "--no-information"])
    assert stop.value.code == 2
    assert "unusable" in capsys.readouterr().out
    for columns in records.values():
        columns["acceleration"] = -columns["acceleration"]
        columns["acceleration"] = np.clip(columns["acceleration"], -0.5 * columns["acceleration"].max(), None)
    folder = _write(tmp_path / "clipped", records, nominal)
    with pytest.raises(SystemExit) as stop:
        main(["check", str(folder), "--no-information"])
    assert stop.value.code == 1
    assert "dwells at its extreme" in capsys.readouterr().out
