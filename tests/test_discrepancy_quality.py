"""Bad input: refused or noted plainly, and nothing noted where the input is good."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_cases import DAMPING, MASS, NOISE, SAMPLE_RATE, STIFFNESS, linear_motion, load, planted_case

from bench.cli import main
from bench.discrepancy import Case, diagnose, read_case, record_from_arrays
from bench.discrepancy.blind.protocol import write_case
from bench.discrepancy.case.schema import check_units
from bench.discrepancy.checks.channel_comparison import compare_channels, unit_factor
from bench.discrepancy.checks.data_quality import notes, refuse_unusable, untried_points
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.errors import BenchError, IdentificationError, RecordingError, UnitError


def noted(case: Case) -> tuple[str, ...]:
    return notes(case, Problem(case, structure_of(case), case.identification))


def with_values(case: Case, change: Callable[[dict], dict]) -> Case:
    """The case with the samples of all records changed."""
    changed = [
        [record_from_arrays(r.name, r.time, change(dict(r.values)), at_rest=r.at_rest) for r in records]
        for records in (case.identification, case.validation)
    ]
    return replace(case, identification=tuple(changed[0]), validation=tuple(changed[1]))


def with_channel(case: Case, name: str, **changes) -> Case:
    channels = tuple(replace(c, **changes) if c.name == name else c for c in case.channels)
    return replace(case, channels=channels)


def with_parameter(case: Case, name: str, **changes) -> Case:
    parameters = tuple(replace(p, **changes) if p.name == name else p for p in case.parameters)
    return replace(case, parameters=parameters)


def test_nothing_is_noted_of_a_good_case():
    case = planted_case()
    problem = Problem(case, structure_of(case), case.identification)
    refuse_unusable(problem)
    check_units(case)
    assert notes(case, problem) == ()


def scaled(channel: str, factor: float):
    return lambda values: values | {channel: factor * values[channel]}


BODY = """<body name="{0}"><joint name="{0}" type="slide" axis="1 0 0" stiffness="900" damping="2"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{1}</body>"""
CHAIN = f"""<mujoco><option gravity="0 0 0"/><worldbody>{BODY.format("q1", BODY.format("q2", '<site name="tip"/>'))}</worldbody>
<tendon>TENDON</tendon><actuator><motor name="shaker" joint="q1"/></actuator>
<sensor><jointpos name="base" joint="q1"/><accelerometer name="tip" site="tip"/></sensor></mujoco>"""


@pytest.mark.parametrize(
    ("tendon", "told"),
    [("", 1), ('<fixed name="reach"><joint joint="q1" coef="2"/><joint joint="q2" coef="2"/></fixed>', 0)],
)
def test_a_point_that_no_place_of_an_effect_moves_along_is_told(tendon, told, tmp_path):
    nominal = {
        "rig": "model.xml",
        "parameters": {"stiffness:q1": {"value": 900.0, "std": 20.0}},
        "channels": {
            "shaker": {"unit": "N", "role": "measured"},
            "base": {"unit": "m"},
            "tip": {"unit": "m/s^2"},
        },
    }
    (tmp_path / "model.xml").write_text(CHAIN.replace("TENDON", tendon))
    (tmp_path / "nominal.json").write_text(json.dumps(nominal))
    rng = np.random.default_rng(1)
    for name in ("identification", "validation"):
        table = np.column_stack([np.arange(800) * 0.004, rng.standard_normal((800, 3))])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="time,shaker,base,tip", comments="")
    case = read_case(tmp_path)
    found = untried_points(Problem(case, structure_of(case), case.identification))
    assert [("'tip' moves with q1 and q2" in note, "fixed tendon" in note) for note in found] == [
        (True, True)
    ] * told


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (scaled("displacement", 1000.0), "m against mm"),
        (scaled("acceleration", 1.0 / 9.80665), "m/s^2 against g"),
        (scaled("displacement", 180.0 / np.pi), "rad against degrees"),
        (scaled("acceleration", -1.0), "opposite signs"),
        (scaled("force", -1.0), "the sign of the load"),
        (scaled("force", 1.0 / 4.44822), "N against lbf"),
        (lambda v: v | {"displacement": np.roll(v["displacement"], 3)}, "'displacement' lags 'acceleration' by"),
        (lambda v: v | {"force": np.concatenate([np.zeros(10), v["force"][:-10]])}, "all responses lead the measured load by 20"),
        (lambda v: v | {"displacement": np.clip(v["displacement"], -0.007, 0.007)}, "dwells at its extreme"),
        (lambda v: v | {"displacement": drifting(v["displacement"])}, "clocks drift apart"),
        (lambda v: v | {c: 1e-3 * v[c] for c in ("displacement", "acceleration")}, "hardly rises above its noise"),
    ],
)  # fmt: skip
def test_what_a_channel_does_wrong_is_noted(change, words):
    assert any(words in note for note in noted(with_values(planted_case(), change)))


@pytest.mark.parametrize(
    "held",
    [
        lambda t: 6.0 * np.sign(np.sin(1.3 * t)) * (np.abs(np.sin(1.3 * t)) > 0.6),  # steps
        lambda t: 6.0 * np.tanh(4.0 * np.sin(0.8 * t)),  # moves that come to rest
        lambda t: 6.0 * (1.0 - np.exp(-3.0 * (t % 4.0))) * (t % 8.0 < 4.0),  # a lag behind steps
    ],
    ids=["steps", "moves", "lag"],
)
def test_a_load_that_is_held_is_not_called_saturated(held):
    case = planted_case()
    force = case.identification[0].values["force"]
    noise = 0.02 * np.random.default_rng(2).standard_normal(len(force))
    told = noted(with_values(case, lambda v: v | {"force": held(np.arange(len(force)) / 500.0) + noise}))
    assert not any("dwells" in note for note in told)
    ends = np.percentile(force, (8, 92))
    told = noted(with_values(case, lambda v: v | {"force": np.clip(v["force"], *ends)}))
    assert any("dwells" in note for note in told)


def drifting(x: np.ndarray) -> np.ndarray:
    """Samples taken by a clock that loses ten samples along the record."""
    n = np.arange(len(x))
    return np.interp(n * (1.0 - 10.0 / len(x)), n, x)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: with_channel(c, "displacement", noise_std=None), "is not stated"),
        (lambda c: with_channel(c, "acceleration", noise_std=1e-4), "measure it at rest"),
        (lambda c: replace(c, options={"sample_rate_hz": 400}), "check which clock is right"),
        (lambda c: replace(c, validation=c.identification), "give another record for judging"),
        (lambda c: planted_case(n=400), "at least 10 are wanted"),
        (lambda c: with_parameter(c, "stiffness", value=1e3 * STIFFNESS), "samples a period"),
    ],
)
def test_what_limits_a_diagnosis_is_noted(change, words):
    assert any(words in note for note in noted(change(planted_case())))


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda v: v | {"force": np.full_like(v["force"], 2.0)}, RecordingError, "nothing excites the rig"),
        (lambda v: v | {"acceleration": v["displacement"]}, RecordingError, "are the same numbers"),
        (
            lambda v: v | dict.fromkeys(("displacement", "acceleration"), np.zeros_like(v["force"])),
            RecordingError,
            "sensor was connected",
        ),
    ],
)
def test_records_of_no_use_are_refused(change, error, words):
    with pytest.raises(error, match=words):
        diagnose(with_values(planted_case(), change))


def test_a_nominal_model_that_diverges_is_refused():
    case = with_parameter(planted_case(), "stiffness", value=1e12)
    with pytest.raises(IdentificationError, match=r"diverges in 'identification'.*check sign and unit"):
        diagnose(case)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: with_channel(c, "displacement", unit="kg"), "'displacement' is in kg"),
        (lambda c: with_channel(c, "displacement", unit="mm"), "do not belong together"),
        (lambda c: with_parameter(c, "stiffness", unit="N/mm"), "multiply its value and std by 1000"),
        (lambda c: with_parameter(c, "mass", unit="N/m"), "'mass' is in N/m"),
        (lambda c: with_parameter(c, "damping", unit="N"), "'damping' is in N"),
    ],
)
def test_units_that_do_not_belong_together_are_refused(change, words):
    with pytest.raises(UnitError, match=words):
        check_units(change(planted_case()))


def test_a_coherent_system_of_other_units_is_accepted():
    """N, mm, s and tonnes; the same model as in SI."""
    case = planted_case()
    for name, unit in (("displacement", "mm"), ("acceleration", "mm/s^2")):
        case = with_channel(case, name, unit=unit)
    for name, unit in (("mass", "tonne"), ("stiffness", "N/mm"), ("damping", "N s/mm")):
        case = with_parameter(case, name, unit=unit)
    check_units(case)


def test_factors_of_units_are_told_from_others():
    assert unit_factor(1020.0, 0.04) == unit_factor(1 / 1000.0, 0.04) == "m against mm"
    assert unit_factor(9.7, 0.04) == "m/s^2 against g"
    for harmless in (1.0, 1.4, 0.5, 12.0, 300.0, 0.0, np.nan):
        assert unit_factor(harmless, 0.04) == ""


def test_comparison_of_two_channels_finds_factor_and_lag():
    x, a = linear_motion(load(4, 4000))
    pair = compare_channels(
        2.0 * np.interp(np.arange(4000) - 1.5, np.arange(4000), x),
        a,
        orders=(0, 2),
        noise=(1e-6, 1e-3),
        step=1.0 / SAMPLE_RATE,
    )
    assert pair is not None
    assert pair.factor == pytest.approx(2.0, rel=0.01)  # the window leaks a little
    assert pair.lag == pytest.approx(1.5 / SAMPLE_RATE, rel=0.05)  # so does it here
    assert pair.correlation > 0.99


GOOD = {
    "rig": "sdof",
    "sample_rate_hz": SAMPLE_RATE,
    "parameters": {
        "mass": {"value": MASS, "std": 0.02, "unit": "kg"},
        "stiffness": {"value": STIFFNESS, "std": 50.0, "unit": "N/m"},
        "damping": {"value": DAMPING, "std": 0.5, "unit": "N s/m"},
    },
    "channels": {
        "force": {"unit": "N", "role": "measured"},
        "displacement": {"unit": "m", "noise_std": NOISE["displacement"]},
        "acceleration": {"unit": "m/s^2", "noise_std": NOISE["acceleration"]},
    },
}


def altered(*path, value):
    """The good nominal.json with one entry changed, or taken out where the value is None."""
    document = json.loads(json.dumps(GOOD))
    entry = document
    for key in path[:-1]:
        entry = entry[key]
    if value is None:
        del entry[path[-1]]
    else:
        entry[path[-1]] = value
    return json.dumps(document)


def write_folder(folder: Path, nominal: str | None = None, **files: str | None) -> Path:
    """A case folder on disk; single files replaced by the given text, or taken out."""
    write_case(planted_case(n=300), folder)
    (folder / "nominal.json").write_text(json.dumps(GOOD) if nominal is None else nominal)
    for stem, text in files.items():
        (folder / f"{stem}.csv.gz").unlink()
        if text is not None:
            (folder / f"{stem}.csv").write_text(text)
    return folder


HEADER = "time,force,displacement,acceleration\n"


def rows(n=300, step=0.004, cell="0.1"):
    return "".join(f"{step * k},{k % 7},{cell},{k % 5}\n" for k in range(n))


BROKEN: dict[str, tuple[dict, str]] = {
    "not json": ({"nominal": "{"}, "as JSON"),
    "a list": ({"nominal": "[1, 2]"}, "holds [1, 2]; a table of entries"),
    "no rig": ({"nominal": altered("rig", value=None)}, "rig missing"),
    "unknown rig": ({"nominal": altered("rig", value="sdfo")}, "sdfo"),
    "rig is a number": ({"nominal": altered("rig", value=3)}, "rig: 3 came; text is expected"),
    "parameters are a list": ({"nominal": altered("parameters", value=[1])}, "parameters: [1] came; a table of entries is expected"),
    "parameter is a number": ({"nominal": altered("parameters", "mass", value=2.0)}, "parameters.mass: 2.0 came"),
    "value is text": ({"nominal": altered("parameters", "mass", "value", value="two")}, "mass.value: 'two' came"),
    "negative mass": ({"nominal": altered("parameters", "mass", "value", value=-2.0)}, "check its sign"),
    "negative std": ({"nominal": altered("parameters", "mass", "std", value=-1)}, "parameters.mass.std: -1 came; a number of at least 0"),
    "misnamed std": ({"nominal": altered("parameters", "mass", value={"value": 2, "sigma": 1})}, "Did you mean 'std'"),
    "std left out": ({"nominal": altered("parameters", "mass", "std", value=None)}, "write 0 to mean certain"),
    "foreign parameter": ({"nominal": altered("parameters", "dampnig", value={"value": 1, "std": 1})}, "Did you mean 'damping'"),
    "foreign response": ({"nominal": altered("channels", "displacment", value={"unit": "m"})}, "Did you mean 'displacement'"),
    "foreign option": ({"nominal": altered("load_interpolaton", value="linear")}, "Did you mean 'load_interpolation'"),
    "capital entry": ({"nominal": altered("channels", "force", "Role", value="command")}, "Did you mean 'role'"),
    "no mass": ({"nominal": altered("parameters", "mass", value=None)}, "lacks the nominal parameter(s) mass"),
    "unknown unit": ({"nominal": altered("parameters", "mass", "unit", value="kgg")}, "unknown unit 'kgg'"),
    "units that clash": (
        {"nominal": altered("channels", "displacement", "unit", value="mm")}, "what the nominal model predicts from 'force'",
    ),
    "unknown role": ({"nominal": altered("channels", "force", "role", value="loadcell")}, "loadcell"),
    "negative noise": ({"nominal": altered("channels", "force", "noise_std", value=-1)}, "channels.force.noise_std: -1 came"),
    "no channels": ({"nominal": altered("channels", value={})}, "channels: no channel besides time"),
    "rate of zero": ({"nominal": altered("sample_rate_hz", value=0)}, "sample_rate_hz: 0 came; a number above 0"),
    "no validation": ({"validation": None}, "no record validation*"),
    "empty record": ({"validation": ""}, "it is empty"),
    "header only": ({"validation": HEADER}, "no line of numbers"),
    "missing column": ({"validation": "time,force\n" + "0,1\n" * 300}, "lacks a column: unknown column of 'validation.csv' 'displacement'"),
    "single line": ({"validation": "time;force;displacement\n0;1;2\n"}, "single line"),
    "words": ({"validation": HEADER + rows(cell="high")}, "line 2 holds 'high'"),
    "nan": ({"validation": HEADER + rows(cell="nan")}, "values are lost"),
    "ragged": ({"validation": HEADER + "0,1\n0.1,2,3,4\n"}, "4 columns at line 2"),
    "more names than columns": ({"validation": HEADER + "0,1,2\n" * 300}, "4 names over 3 columns"),
    "short": ({"validation": HEADER + rows(20)}, "at least 32"),
    "short for a structure": ({"validation": HEADER + rows(100)}, "100 samples; at least 200"),
    "clock that stands": ({"validation": HEADER + rows(step=0.0)}, "stands still"),
    "binary": ({"identification": "\x00\x01"}, "identification.csv"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_folder_is_refused_in_one_line_with_a_hint(name, tmp_path, capsys):
    files, words = BROKEN[name]
    folder = write_folder(tmp_path / "case", **files)
    out = tmp_path / "verdict.json"
    assert main(["diagnose", str(folder), "--json", str(out), "--no-progress"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("jointbench: ")
    assert words in told
    assert "Traceback" not in told
    assert len(told.strip().splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case"]


def test_places_and_names_are_checked_before_the_work(tmp_path, capsys):
    folder = write_folder(tmp_path / "case")
    (tmp_path / "file").write_text("")
    for arguments, words in (
        (["--json", str(tmp_path)], "it is a folder"),
        (["--html", str(tmp_path / "file" / "report.html")], "no folder one may write to"),
        (["--json", str(tmp_path / "a"), "--html", str(tmp_path / "a")], "two results"),
        (["--exclude", "gapp"], "Did you mean 'gap'?"),
        (["--most", "0"], "at least one effect"),
    ):
        assert main(["diagnose", str(folder), *arguments, "--no-progress"]) == 2
        assert words in capsys.readouterr().err
    assert main(["diagnose", str(tmp_path / "nowhere"), "--no-progress"]) == 2
    assert "is no folder" in capsys.readouterr().err


def test_a_folder_without_csv_suffix_or_with_a_second_clock_is_read(tmp_path):
    folder = write_folder(tmp_path / "case", validation=HEADER + rows())
    case = read_case(folder)
    assert [r.name for r in case.validation] == ["validation"]
    assert case.validation[0].step == pytest.approx(0.004)


def test_stopped_by_hand_leaves_nothing_behind(tmp_path, capsys, monkeypatch):
    folder = write_folder(tmp_path / "case")

    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("bench.discrepancy.diagnosis.found_of", stopped)
    out = tmp_path / "verdict.json"
    assert main(["diagnose", str(folder), "--json", str(out), "--no-progress"]) == 130
    assert "Traceback" not in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case"]


@pytest.mark.slow
def test_the_verdict_is_printed_for_people_and_as_json(tmp_path, capsys):
    folder = tmp_path / "case"
    write_case(planted_case(n=800), folder)
    (folder / "nominal.json").write_text(json.dumps(GOOD))
    assert main(["diagnose", str(folder), "--json", "-", "--no-progress", "--most", "1"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == "none"
    out, page = tmp_path / "new" / "verdict.json", tmp_path / "new" / "report.html"
    assert main(["diagnose", str(folder), "--json", str(out), "--html", str(page), "--no-progress"]) == 0
    told = capsys.readouterr().out
    assert "nothing is missing" in told
    assert "noise" in told
    assert json.loads(out.read_text())["verdict"] == "none"
    assert page.read_text().startswith("<!")


def test_every_refusal_is_an_error_of_the_bench():
    assert all(issubclass(e, BenchError) for e in (UnitError, RecordingError, IdentificationError))
