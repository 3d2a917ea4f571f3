"""Arms before any fit: units by the model, values of nominal.json, factors and signs of the recording, and what the equations leave out."""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_articulated import KP, mjcf, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.errors import BenchError, ModelError, RecordingError, UnitError

DEGREES = 180.0 / np.pi


@pytest.fixture(scope="module", params=[True, False], ids=["servo", "torque"])
def clean(request, tmp_path_factory):
    """A case of a sound arm, with the velocities of its encoders, and whether servos drive it."""
    folder = write_case(
        tmp_path_factory.mktemp("arm"),
        mjcf(servo=request.param),
        servo=request.param,
        velocity=True,
        length=20.0,
    )
    return folder, request.param


def changed(clean, tmp_path, *, columns=None, document=None, model=None):
    """A copy with columns multiplied by factors, nominal.json changed in place, words of the model replaced."""
    folder, _ = clean
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    for path in tmp_path.glob("*.csv"):
        names = path.read_text().partition("\n")[0].split(",")
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        for name, factor in (columns or {}).items():
            table[:, names.index(name)] *= factor
        np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    if document is not None:
        path = tmp_path / "nominal.json"
        entries = json.loads(path.read_text())
        document(entries)
        path.write_text(json.dumps(entries))
    for old, new in (model or {}).items():
        path = tmp_path / "model.xml"
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))
    case = read_case(tmp_path)
    assert applies(case)
    return case


def refused(case, kind, *words):
    """Refused in one line that holds all the words, and with --anyway only noted."""
    with pytest.raises(kind) as error:
        admitted_robot(case)
    text = str(error.value)
    assert all(word in text for word in words), text
    assert "\n" not in text
    assert any(words[0] in note for note in admitted_robot(case, anyway=True).notes)


def test_a_sound_arm_is_admitted_without_a_word(clean):
    assert admitted_robot(read_case(clean[0])).notes == ()


def test_declared_units_are_converted(clean, tmp_path):
    def document(entries):
        for joint in KP:
            entries["channels"][f"{joint}_q"] |= {
                "unit": "deg",
                "noise_std": 2e-4 * DEGREES,
                "resolution": 0.5,
            }
            entries["channels"][f"{joint}_v"] |= {"unit": "rpm"}
        entries["parameters"]["mass:fore"] = {"value": 500.0, "std": 15.0, "unit": "g"}

    columns = {f"{joint}_q": DEGREES for joint in KP} | {f"{joint}_v": 60.0 / (2.0 * np.pi) for joint in KP}
    plain = admitted_robot(read_case(clean[0])).case
    found = admitted_robot(changed(clean, tmp_path, columns=columns, document=document))
    assert len(found.notes) == 5
    assert all("converted to" in note for note in found.notes)
    for name, samples in plain.identification[0].values.items():
        assert found.case.identification[0].values[name] == pytest.approx(samples, rel=1e-6, abs=1e-8)
    assert found.case.channel("elbow_q").noise_std == pytest.approx(2e-4)
    assert found.case.channel("elbow_q").resolution == pytest.approx(0.5 / DEGREES)
    values = {parameter.name: parameter.value for parameter in found.case.parameters}
    assert values["mass:fore"] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("entry", "name", "unit"), [("channels", "elbow_q", "kg"), ("parameters", "damping:elbow", "N s/m")]
)
def test_units_of_another_dimension_are_refused(clean, tmp_path, entry, name, unit):
    def document(entries):
        entries[entry][name]["unit"] = unit

    with pytest.raises(UnitError, match=name):
        admitted_robot(changed(clean, tmp_path, document=document))


WRONG = {
    "velocity in deg/s": ({"elbow_v": DEGREES}, ("'elbow_v'", "deg/s")),
    "velocity turned": ({"elbow_v": -1.0}, ("'elbow_v'", "opposite signs")),
    "encoder in deg": ({"elbow_q": DEGREES, "elbow_v": DEGREES}, ("'elbow_q'", "deg")),
    "encoder turned": ({"elbow_q": -1.0, "elbow_v": -1.0}, ("'elbow_q'", "sign")),
    "input in thousandths": ({"elbow_in": 1000.0}, ("'elbow_in'", '"unit": "')),
    "input turned": ({"elbow_in": -1.0}, ("'elbow_in'", "sign")),
}


@pytest.mark.parametrize("name", WRONG)
def test_factors_and_signs_of_the_recording_stop_before_the_fit(clean, tmp_path, name):
    columns, words = WRONG[name]
    refused(changed(clean, tmp_path, columns=columns), UnitError, *words)


def test_a_joint_far_out_of_its_stops_is_in_another_unit(clean, tmp_path):
    both = {f"{joint}_{what}": DEGREES for joint in KP for what in ("q", "v")}
    if clean[1]:
        both |= {f"{joint}_in": DEGREES for joint in KP}
    stops = {
        'name="elbow" type="hinge"': 'name="elbow" type="hinge" range="-120 120"'
    }  # MJCF counts in degrees
    assert not admitted_robot(changed(clean, tmp_path, model=stops)).notes
    with pytest.raises(UnitError, match=r"elbow_q.*deg"):
        admitted_robot(changed(clean, tmp_path, columns=both, model=stops))


LEFT_OUT = {
    "a stop": (
        {'name="elbow" type="hinge"': 'name="elbow" type="hinge" range="-25 170"'},
        "range of a joint",
    ),
    "an equality": (
        {"</mujoco>": '<equality><connect body1="fore" anchor="0 0 -0.1"/></equality></mujoco>'},
        "equality",
    ),
}
GEARED = {'name="elbow_drive" joint="elbow" kp': 'name="elbow_drive" joint="elbow" gear="3" kp'}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_what_the_equations_of_the_joints_leave_out_is_refused_where_it_acts(clean, tmp_path, name):
    model, word = LEFT_OUT[name]
    refused(changed(clean, tmp_path, model=model), ModelError, word)


@pytest.mark.parametrize("clean", [True], indirect=True, ids=["servo"])
def test_a_servo_behind_a_gear_is_what_mujoco_makes_of_it(clean, tmp_path):
    def document(entries):
        for number in ("value", "std"):
            entries["parameters"]["kp:elbow_drive"][number] /= 9.0

    case = changed(clean, tmp_path, model=GEARED, columns={"elbow_in": 3.0}, document=document)
    (shoulder, elbow) = ArticulatedModel.of(admitted_robot(case).compiled).joints
    assert elbow.drive.gear == 3.0
    assert elbow.drive.stiffness == pytest.approx(KP["elbow"])
    assert shoulder.drive.stiffness == KP["shoulder"]
    # the target of a gear that is not there is off by its factor
    refused(changed(clean, tmp_path, columns={"elbow_in": 3.0}), UnitError, "elbow_in")


def test_commands_beyond_their_range_are_clipped_as_mujoco_clips_them(clean, tmp_path):
    words = 'name="elbow_drive" joint="elbow"'
    case = changed(clean, tmp_path, model={words: f'{words} ctrllimited="true" ctrlrange="-0.3 0.3"'})
    found = admitted_robot(case, anyway=True)
    assert np.ptp(found.case.identification[0].values["elbow_in"]) == pytest.approx(0.6)
    assert any("ctrlrange of actuator 'elbow_drive'" in note for note in found.notes)


def test_values_of_nominal_json_stand_in_the_model(clean, tmp_path):
    def document(entries):
        entries["parameters"]["mass:fore"] |= {"value": 0.8, "std": 0.01}
        if clean[1]:
            entries["parameters"]["kp:elbow_drive"] |= {"value": 55.0, "std": 1.0}

    found = admitted_robot(changed(clean, tmp_path, document=document), anyway=True)
    assert found.compiled.body_mass[found.compiled.body("fore").id] == pytest.approx(0.8)
    assert any("'mass:fore' is 0.8 kg in nominal.json and 0.5 in the model" in note for note in found.notes)
    if clean[1]:
        u = found.compiled.actuator("elbow_drive").id
        assert found.compiled.actuator_gainprm[u, 0] == -found.compiled.actuator_biasprm[u, 1] == 55.0
        assert any("'kp:elbow_drive'" in note for note in found.notes)


def test_records_that_no_diagnosis_can_use_are_refused(clean, tmp_path):
    still = {f"{joint}_{what}": 0.0 for joint in KP for what in ("in", "q", "v")}
    with pytest.raises(RecordingError, match="never change"):
        admitted_robot(changed(clean, tmp_path, columns=still))


def test_a_hostile_model_is_refused_by_the_same_limits(clean, tmp_path):
    case = changed(clean, tmp_path)
    path = tmp_path / "model.xml"
    path.write_text(path.read_text().replace("<worldbody>", '<include file="model.xml"/><worldbody>', 1))
    with pytest.raises(BenchError, match="includes itself"):
        diagnose(case)
    with pytest.raises(BenchError, match="includes itself"):
        admitted_robot(read_case(tmp_path))
