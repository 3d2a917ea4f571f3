"""The day in the laboratory before it happens: signals within their limits, effects put in and found, native effects, formats, units."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bench.cli import main
from bench.discrepancy import Case, read_case
from bench.discrepancy.application.applying import Findings
from bench.discrepancy.precheck.checking import check_folder
from bench.discrepancy.rehearsal import rehearsing
from bench.discrepancy.rehearsal.placing import sites
from bench.discrepancy.rehearsal.rehearsing import STORE, Outcome, Rehearsal, rehearse
from bench.discrepancy.rehearsal.truth import ModelLaboratory
from bench.record_files import read_recording
from bench.record_files.plain_writing import write_record
from bench.recording import Channel, Recording

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
import applied
import native_effects
import same_formats
from native_effects import EFFECTS, MODELS, measure


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> Path:
    """A servo whose model is right."""
    folder = tmp_path_factory.mktemp("arm")
    measure(folder, MODELS["arm"], lambda spec: None)
    return folder


def shortened(folder: Path) -> Case:
    """Two records of three seconds."""
    case = read_case(folder, planned=True)

    def cut(record):
        return replace(record, values={name: samples[:600] for name, samples in record.values.items()})

    return replace(case, identification=(cut(case.identification[0]),), validation=(cut(case.validation[0]),))


def test_units_survive_npz_and_mat(tmp_path):
    time = np.arange(300) / 100.0
    channels = (Channel("force", "kN"), Channel("x", "mm"))
    written = Recording(time, np.column_stack([np.sin(time), np.cos(time)]), channels)
    for suffix in (".npz", ".mat", ".csv", ".parquet"):
        path = tmp_path / f"run{suffix}"
        write_record(path, written)
        read = read_recording(path)
        assert [(c.name, c.unit) for c in read.channels] == [("force", "kN"), ("x", "mm")], suffix
        np.testing.assert_array_equal(read.values, written.values)
    # an array of that name that tells nothing is a channel like any other
    np.savez(tmp_path / "other.npz", time=time, units=np.sin(time))
    assert read_recording(tmp_path / "other.npz", units={"units": "m"}).names == ("units",)


@pytest.mark.parametrize("kind", same_formats.FORMATS)
def test_a_case_is_the_same_from_every_format(kind, arm, tmp_path):
    plain, other = read_case(arm), read_case(same_formats.rewritten(arm, kind, tmp_path / arm.name))
    for mine, theirs in zip(plain.identification, other.identification, strict=True):
        assert mine.name == theirs.name
        # what a format says of its clock may be a rate, whose inverse is rounded
        assert theirs.step == pytest.approx(mine.step, rel=1e-12)
        for channel in mine.values:
            np.testing.assert_array_equal(mine.values[channel], theirs.values[channel])
    assert plain.channels == other.channels


def test_a_trial_written_as_mjcf_is_the_same_structure(tmp_path):
    from bench.discrepancy.model.rigs import structure_of

    source = tmp_path / "trial"
    source.mkdir()
    nominal = {
        "rig": "sdof", "parameters": {"mass": {"value": 2.0, "std": 0.1}, "stiffness": {"value": 800.0, "std": 8.0},
                                      "damping": {"value": 3.0, "std": 0.3}},
        "channels": {"force": {"unit": "N"}, "displacement": {"unit": "m", "noise_std": 1e-4}},
    }  # fmt: skip
    (source / "nominal.json").write_text(json.dumps(nominal))
    rows = np.column_stack([np.arange(300) / 200.0, np.ones(300), np.ones(300)])
    for name in ("identification", "validation"):
        np.savetxt(source / f"{name}.csv", rows, delimiter=",", header="time,force,displacement", comments="")
    own, other = read_case(source), read_case(applied.as_mjcf(source, tmp_path / "mjcf"))
    values = [{p.name.partition(":")[0]: p.value for p in case.parameters} for case in (own, other)]
    assert values[0] == values[1]
    for case in (own, other):
        structure = structure_of(case)
        table = {p.name: p.value for p in case.parameters}
        at = structure.at(np.array([table[name] for name in structure.parameters]))
        assert at.stiffness[0, 0] / at.mass[0, 0] == pytest.approx(400.0)
        assert [o.order for o in structure.observers] == [0]


def test_check_grades_the_parameters_and_effects_of_a_servo(arm):
    found = check_folder(arm)
    assert found.word == "ready"
    told = {one.name: one for one in found.parameters}
    assert set(told) == set(MODELS["arm"].believed)
    assert all(0.0 < one.figure < 1.0 for one in found.parameters)
    assert told["damping:elbow"].word == "identifiable"
    effects = {one.name: one for one in found.effects}
    assert effects["coulomb_friction"].word == "identifiable"
    # what a nominal parameter can do as well keeps little of its own
    assert effects["coulomb_friction"].figure > 5.0 * effects["damping_error"].figure
    # a limit of the force acts the more the lower it is, and only below the peak of these records
    assert effects["actuator_saturation"].word == "identifiable"


def test_check_tells_nothing_of_a_servo_that_stands(arm, tmp_path):
    case = json.loads((arm / "nominal.json").read_text())
    (tmp_path / "nominal.json").write_text(json.dumps(case))
    (tmp_path / "model.xml").write_text((arm / "model.xml").read_text())
    rng = np.random.default_rng(0)
    for name in native_effects.RECORDS:
        time, noise = np.arange(800) / 200.0, rng.standard_normal(800)
        rows = np.column_stack(
            [time, 1e-6 * np.sin(time), 1e-3 * noise]
        )  # a command that never changes is refused
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="time,command,position", comments="")
    found = check_folder(tmp_path)
    assert found.word == "doubtful"
    assert any("hardly moves" in doubt for doubt in found.doubts)
    assert {one.word for one in found.parameters} <= {"weak", "not identifiable"}


def test_an_effect_of_a_size_changes_the_motion_by_as_much(arm):
    case = shortened(arm)
    laboratory = ModelLaboratory.of(case)
    rng = np.random.default_rng(0)
    base = laboratory.measured(Findings(()), rng, noisy=False)
    before = base.validation[0].values["position"]
    # the laboratory is converged, the records came of the model's own step
    np.testing.assert_allclose(before, case.validation[0].values["position"], atol=0.05 * np.std(before))
    for wanted in ("coulomb_friction", "actuator_delay:drive"):
        (site,) = sites(laboratory.logged_case(base, rng), (wanted,), articulated=True)
        effect = site.at(0.1)
        moved = laboratory.measured(Findings((effect,)), rng, noisy=False).validation[0].values["position"]
        # the size is that of a run of the nominal model on the identification records
        assert np.std(moved - before) / np.std(before) == pytest.approx(0.1, rel=0.3)


def test_a_rehearsal_goes_on_where_it_was_and_tells_from_which_size_on(arm, tmp_path, monkeypatch):
    sealed = []

    def found(laboratory, site, size, seed):
        sealed.append((site.name, size))
        return Outcome(site.name, site.where, size, "limit 1 N m", "effect", ("x:y",), size > 0.05, 1.0, 0.1)

    monkeypatch.setattr(rehearsing, "_sealed", found)
    monkeypatch.setattr(rehearsing, "_alarms", lambda laboratory, seed: ())
    case = shortened(arm)
    done = rehearse(case, tmp_path, effects=("coulomb_friction",), sizes=(0.01, 0.3, 0.1, 0.03))
    assert sealed == [("coulomb_friction", size) for size in (0.3, 0.1, 0.03)]
    assert done.threshold(("coulomb_friction", "elbow")).size == 0.1
    again = rehearse(
        case, tmp_path, effects=("coulomb_friction", "actuator_delay"), sizes=(0.3, 0.1, 0.03, 0.01)
    )
    assert [name for name, _ in sealed[3:]] == ["actuator_delay"] * 3
    assert Rehearsal.read(tmp_path / STORE).outcomes == again.outcomes
    with pytest.raises(ValueError, match="rehearsal of other records"):
        rehearse(case, tmp_path, effects=("coulomb_friction",), sizes=(0.3,))


def test_signals_are_designed_without_records_and_keep_their_limits(arm, tmp_path, capsys):
    nominal = json.loads((arm / "nominal.json").read_text())
    source, folder = tmp_path / "case", tmp_path / "signals"
    source.mkdir()
    (source / "model.xml").write_text((arm / "model.xml").read_text())
    (source / "nominal.json").write_text(json.dumps(nominal))
    command = [
        "design",
        str(source),
        "-o",
        str(folder),
        "--seconds",
        "6",
        "--effects",
        "coulomb_friction",
        "--json",
    ]
    assert main([*command, "--rate", "200"]) == 2
    assert "nothing limits 'command'" in capsys.readouterr().err
    for channel in ("command", "position"):
        nominal["channels"][channel]["unit"] = "deg"
    largest, reach = np.degrees([0.8, 0.9])
    nominal |= {"limits": {"command": largest, "position": reach}, "sample_rate_hz": 200}
    (source / "nominal.json").write_text(json.dumps(nominal))
    assert main(command) == 0
    told = json.loads(capsys.readouterr().out)
    information = [one["information"] for one in told["tried"]]
    assert information == sorted(information, reverse=True)
    assert all(0.1 * reach < one["responses"]["position"] <= reach for one in told["tried"])
    planned = read_case(folder, planned=True)
    assert len({record.name for record in (*planned.identification, *planned.validation)}) == 3
    for record in planned.identification:
        assert 0.1 * largest < np.abs(record.values["command"]).max() <= largest + 1e-6
        # what is commanded starts from rest
        assert abs(record.values["command"][0]) < 1e-9
    with pytest.raises(ValueError, match="lacks a column"):
        read_case(folder)  # nothing is measured yet


@pytest.mark.slow
def test_a_native_effect_is_named_applied_and_closed(tmp_path):
    row = native_effects.attempt("kp", tmp_path)  # the others: scripts/native_effects.py
    assert row.right, row
    assert row.applied, row
    assert row.after < 0.05 * row.before
    assert row.before > 10.0 * row.floor


def test_every_native_effect_changes_the_motion(tmp_path):
    moved = []
    for name, native in EFFECTS.items():
        for folder, change in (
            (tmp_path / name / "with", native.change),
            (tmp_path / name / "without", lambda spec: None),
        ):
            folder.mkdir(parents=True)
            measure(folder, MODELS[native.model], change)
        one, other = (
            np.loadtxt(tmp_path / name / part / "validation.csv", delimiter=",", skiprows=1)[:, 2] for part in ("with", "without")
        )  # fmt: skip
        moved.append(np.sqrt(np.mean((one - other) ** 2)) / np.std(other))
        assert mujoco.MjModel.from_xml_path(str(tmp_path / name / "with" / "model.xml")).nu == 1
    assert min(moved) > 0.03, dict(zip(EFFECTS, moved, strict=True))
