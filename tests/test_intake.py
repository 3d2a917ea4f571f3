"""Logs and a model without a nominal.json: columns matched by name, what is assumed is told, the same verdict as of the case folder."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest

import bench
from bench.cli import main
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.intake.matching import match_columns
from bench.discrepancy.report.fleet import fleet_page, trends

ARM = """<mujoco><worldbody><body name="upper"><joint name="shoulder_joint" type="hinge" axis="0 1 0" damping=".1" range="-2 2"/>
<geom size=".02" fromto="0 0 0 .3 0 0" type="capsule" mass="1"/><body name="lower" pos=".3 0 0"><joint name="elbow_joint" axis="0 1 0"/>
<geom size=".02" fromto="0 0 0 .3 0 0" type="capsule" mass=".5"/></body></body></worldbody>
<actuator><position name="shoulder_servo" joint="shoulder_joint" kp="50" kv="1"/><motor name="elbow_motor" joint="elbow_joint"/>
</actuator></mujoco>"""
STAGE = """<mujoco><option gravity="0 0 0" timestep=".0005" integrator="RK4"/><worldbody><body name="table">
<joint name="guide" type="slide" axis="1 0 0" stiffness="1500" damping="6"/><geom size=".1" mass="2.4"/></body></worldbody>
<actuator><motor name="shaker" joint="guide"/></actuator></mujoco>"""


def _matched(columns, asked=None):
    found = match_columns(columns, mujoco.MjModel.from_xml_string(ARM), asked)
    return {m.column: (m.kind, m.name, m.quantity, m.role) for m in found.matches}, found.unused


@pytest.mark.parametrize(
    "columns",
    [
        ("position_shoulder", "cmd_shoulder", "elbow_pos", "elbow_torque"),
        ("shoulderJointPosition", "shoulder_servo", "q_elbow_measured", "tau_elbow"),
        ("pos1", "cmd1", "pos2", "tau2"),
        ("q0", "goal_q0", "q1", "effort1"),
        ("shoulder_joint.position", "shoulder_joint.target", "elbow_joint.position", "elbow_motor"),
    ],
)
def test_dialects_of_headings_say_the_same(columns):
    tau1 = ("tau1", "effort0") if columns[0] in ("pos1", "q0") else ()
    more = [name for name in tau1 if name.startswith(columns[3][:3])] + (
        ["cmd2"] if "cmd1" in columns else []
    )
    more += ["goal_q1"] if "q0" in columns else []
    found, unused = _matched([*columns, *more, "battery"])
    shoulder, servo, elbow, motor = columns
    assert found[shoulder] == ("joint", "shoulder_joint", "position", "response")
    assert found[servo] == ("actuator", "shoulder_servo", "", "command")
    assert found[elbow] == ("joint", "elbow_joint", "position", "response")
    assert found[motor] == ("actuator", "elbow_motor", "", "measured")
    assert (
        "battery" in unused
    )  # and torque of a servo, and a command beside the measured torque, with their reasons
    assert len(found) == 4


def test_a_sensor_is_known_whatever_its_capitals_and_a_motor_without_a_column_is_told(tmp_path, capsys):
    sensed = STAGE.replace(
        "</actuator>",
        '<motor name="brake" joint="guide"/></actuator><sensor><jointpos name="weg" joint="guide"/></sensor>',
    )
    model = tmp_path / "stage.xml"
    model.write_text(sensed)
    found = match_columns(("Shaker", "Weg"), mujoco.MjModel.from_xml_string(sensed), None)
    assert {m.column: m.name for m in found.matches} == {"Shaker": "shaker", "Weg": "weg"}
    t = np.arange(0.0, 4.0, 0.005)
    for k in (1, 2):
        table = np.column_stack([t, np.sin(7.0 * t + k), 1e-3 * np.sin(7.0 * t + k - 0.3)])
        np.savetxt(tmp_path / f"log_{k}.csv", table, delimiter=",", header="time,Shaker,Weg", comments="")
    logs = [str(tmp_path / f"log_{k}.csv") for k in (1, 2)]
    assert main(["init", *logs, str(model), "-o", str(tmp_path / "case"), "--unit", "Shaker=N", "Weg=m"]) == 0
    told = capsys.readouterr()
    assert "actuator 'brake' has no column: nothing drives it" in told.out + told.err


def test_one_map_teaches_the_other_columns(capsys):
    found, _ = _matched(
        ["position_Pan", "command_Pan", "velocity_Pan"], {"position_Pan": "shoulder_joint.position"}
    )
    assert found["command_Pan"] == ("actuator", "shoulder_servo", "", "command")
    assert found["velocity_Pan"] == ("joint", "shoulder_joint", "velocity", "response")


def _run(seed, gap, n=1600, step=0.005):
    """Displacement of the stage between buffers of 1200 N/m, forced by straight lines between samples."""
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(STAGE)
    data = mujoco.MjData(model)
    force = np.convolve(rng.standard_normal(n + 40), np.hanning(24), "same")[:n]
    force *= 12.0 / force.std()
    force[:20] *= np.linspace(0.0, 1.0, 20)
    x = np.empty(n)
    inner = round(step / model.opt.timestep)
    for k in range(n):
        x[k] = data.qpos[0]
        for i in range(inner):
            a = force[k] + (force[min(k + 1, n - 1)] - force[k]) * (i + 0.5) / inner
            q = data.qpos[0]
            data.ctrl[0] = a - 1200.0 * (np.sign(q) * max(abs(q) - gap, 0.0))
            mujoco.mj_step(model, data)
    return np.arange(n) * step, force, x + 2e-5 * rng.standard_normal(n)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    (folder / "stage.xml").write_text(STAGE)
    for k in (1, 2):
        t, f, x = _run(k, 0.003)
        rows = np.column_stack([t, f / 1000.0, x * 1000.0])
        np.savetxt(
            folder / f"run_{k}.csv",
            rows,
            delimiter=",",
            header="time [s],shaker [kN],guide_position [mm]",
            comments="",
        )
    return folder


def test_init_writes_a_case_that_reads(logs, tmp_path, capsys):
    out = tmp_path / "case"
    words = [str(logs / "run_1.csv"), str(logs / "run_2.csv"), str(logs / "stage.xml")]
    assert main(["init", *words, "-o", str(out)]) == 0
    told = capsys.readouterr().out
    assert "shaker: kN converted to N" in told
    assert "mass:table = 2.4 ± 0.12 kg" in told
    case = read_case(out)
    assert {p.name for p in case.parameters} == {"mass:table", "stiffness:guide", "damping:guide"}
    _, f, x = _run(1, 0.003)
    np.testing.assert_allclose(case.identification[0].values["guide_position"], x, atol=1e-12)
    np.testing.assert_allclose(case.identification[0].values["shaker"], f, rtol=1e-9, atol=1e-9)
    assert main(["init", *words, "-o", str(out)]) == 2  # what exists is not overwritten unasked
    assert "--force" in capsys.readouterr().err


def test_drives_of_equal_numbers_are_of_one_type_and_their_gains_known_to_a_factor(tmp_path, capsys):
    servo = ARM.replace(
        '<motor name="elbow_motor" joint="elbow_joint"/>',
        '<position name="elbow_servo" joint="elbow_joint" kp="50" kv="1"/>',
    )
    (tmp_path / "arm.xml").write_text(servo)
    t = np.arange(900) * 0.01
    columns = np.column_stack([t, *[0.03 * np.sin(t + phase) for phase in (0.0, 0.1, 0.2, 0.3)]])
    head = "time,shoulder_pos,shoulder_cmd,elbow_pos,elbow_cmd"
    np.savetxt(tmp_path / "run.csv", columns, delimiter=",", header=head, comments="")
    words = ["init", str(tmp_path / "run.csv"), str(tmp_path / "arm.xml"), "-o", str(tmp_path / "case")]
    assert main(words) == 0
    told = capsys.readouterr().out
    assert (
        "kp:elbow_servo = 50 N m/rad to within a factor of 10, of one type (drives like shoulder_servo)"
        in told
    )
    case = read_case(tmp_path / "case")
    found = {p.name: p for p in case.parameters}
    assert {p.alike for p in found.values() if p.name.partition(":")[0] in ("kp", "kv")} == {
        "drives like shoulder_servo"
    }
    assert (found["kp:elbow_servo"].factor, found["kp:elbow_servo"].each) == (10.0, 1.1)
    assert not found["damping:shoulder_joint"].alike  # the other joint has none
    assert main([*words, "--force", "--assume", "kp=0.05", "twins=0.02"]) == 0
    known = {p.name: p for p in read_case(tmp_path / "case").parameters}["kp:elbow_servo"]
    assert (known.std, known.each, known.factor) == pytest.approx((2.5, 1.0, 1.0))


@pytest.mark.slow
def test_logs_give_the_verdict_of_the_case_folder(logs, tmp_path, capsys):
    words = [str(logs / "run_1.csv"), str(logs / "run_2.csv"), str(logs / "stage.xml")]
    options = ["--most", "1", "--json", "-", "--no-progress"]
    assert main(["diagnose", *words, *options]) == 0
    printed = capsys.readouterr()
    direct = json.loads(printed.out)
    assert "assumed: column guide_position -> position of joint 'guide'" in printed.err
    assert [(e["name"], e["where"]) for e in direct["named"]] == [("gap", "guide")]
    clearance = direct["named"][0]["parameters"]["clearance"]
    assert abs(clearance["value"] - 0.003) < 4.0 * clearance["std"]
    case = tmp_path / "case"
    assert main(["init", *words, "-o", str(case), "--json"]) == 0
    capsys.readouterr()
    page, out = tmp_path / "fleet.html", tmp_path / "fleet.json"
    fleet = ["diagnose", str(case), str(case), "--most", "1", "--no-progress"]
    assert main([*fleet, "--html", str(page), "--json", str(out)]) == 0
    cases = json.loads(out.read_text())["cases"]
    assert [entry["named"] for entry in cases] == [direct["named"]] * 2
    assert "gap" in page.read_text()


@pytest.mark.slow
def test_in_python_from_arrays_and_a_spec_and_the_simulator_is_named_before_physics():
    runs = []
    for seed in (1, 2):
        t, f, x = _run(seed, 1.0)  # buffers that are never reached: the model lacks nothing
        runs.append({"time": t, "shaker": f, "guide_position": x})
    answer = bench.diagnose(mujoco.MjSpec.from_string(STAGE), runs, most=1)
    assert answer.verdict.verdict == "none"
    assert all(place.kind != "simulator" for place in answer.verdict.locations)
    assert {"mass:table", "stiffness:guide"} <= set(answer.to_pandas()["parameter"])
    assert answer._repr_html_().startswith("<p>")
    assert answer.plot().axes
    coarse = STAGE.replace('timestep=".0005" integrator="RK4"', 'timestep=".02" integrator="Euler"')
    other = bench.diagnose(coarse, runs, most=1)
    assert other.verdict.verdict == "none"
    assert other.verdict.locations[-1].kind == "simulator"
    assert "step of 0.02 s, Euler" in other.verdict.warnings[0]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["init", "RUN", "-o", "OUT"], "give logs and one MJCF"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--map", "x=guide.position"], "unknown column of the logs"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--map", "shaker=giude.position"], "Did you mean 'guide'"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--map", "guide_position"], "NAME=VALUE"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--map", "guide_position=-"], "no column bears the name"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--unit", "guide_position=N"], "cannot be converted"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--assume", "mas=0.1"], "Did you mean 'mass'"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--assume", "mass=1"], "a share below 1 is expected"),
        (["init", "RUN", "MODEL", "-o", "OUT", "--assume", "mass=much"], "a share below 1 is expected"),
        (
            ["diagnose", "FOLDER", "--assume", "mass=0.1", "--rate", "50"],
            "--rate, --assume came with a case folder",
        ),
        (["diagnose", "RUN", "RUN"], "the MJCF they are held against"),
        (["diagnose"], "give one case folder"),
    ],
)
def test_mistakes_are_answered_in_one_sentence(logs, tmp_path, capsys, words, message):
    names = {"RUN": logs / "run_1.csv", "MODEL": logs / "stage.xml", "OUT": tmp_path / "out", "FOLDER": logs}
    assert main([str(names.get(word, word)) for word in words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert not list(tmp_path.iterdir())


def test_degrees_are_not_taken_for_radians(tmp_path, capsys):
    (tmp_path / "arm.xml").write_text(ARM)
    t = np.arange(900) * 0.01
    rows = np.column_stack([t, 40.0 * np.sin(t), 40.0 * np.sin(t)])
    np.savetxt(
        tmp_path / "run.csv", rows, delimiter=",", header="time,shoulder_pos,shoulder_cmd", comments=""
    )
    words = [
        "init",
        str(tmp_path / "run.csv"),
        str(tmp_path / "arm.xml"),
        "-o",
        str(tmp_path / "case"),
        "--json",
    ]
    assert main(words) == 2
    assert "--unit shoulder_pos=deg" in capsys.readouterr().err
    assert main([*words, "--unit", "shoulder_pos=deg", "shoulder_cmd=deg"]) == 0
    found = read_case(tmp_path / "case").identification[0].values["shoulder_pos"]
    np.testing.assert_allclose(found, np.radians(rows[: len(found), 1]), rtol=1e-9)


def test_what_grows_over_a_fleet_is_told_and_chance_is_not():
    def entry(k, value):
        named = [
            {
                "name": "gap",
                "where": "guide",
                "closed": 0.9,
                "parameters": {"clearance": {"value": value, "std": 0.1}},
            }
        ]
        gap = {"before": 1.0, "after": 0.1}
        return {"case": f"robot_{k}", "verdict": "effect", "named": named, "nearest": [], "gap": gap}

    rising = [entry(k, v) for k, v in enumerate((1.0, 1.2, 1.3, 1.9, 2.4, 2.5))]
    assert [t.parameter for t in trends(rising)] == ["gap guide clearance"]
    assert trends([entry(k, v) for k, v in enumerate((1.0, 2.2, 0.3, 1.9, 0.4, 1.5))]) == []
    text = fleet_page([*rising, {"case": "robot_9", "error": "no records"}]).to_html()
    assert "rises" in text
    assert "not diagnosed" in text
