"""The diagnosis as a whole: on cases made here, whose effect is known."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from browser import CHROMIUM, shown_whole

from bench.discrepancy import (
    BlindOptions,
    Case,
    CaseChannel,
    NominalParameter,
    diagnose,
    make_blind,
    read_case,
    record_from_arrays,
    run_blind,
    score_blind,
    write_report,
)
from bench.discrepancy.blind.proportions import calibration_error
from bench.discrepancy.blind.protocol import draw_case, write_case
from bench.discrepancy.effects.catalogue import CATALOGUE, effect_named
from bench.discrepancy.effects.effect import Scales
from bench.discrepancy.prediction.validation_discrepancy import closed_share, nrmse
from bench.errors import FileFormatError, ParameterError, RecordingError, UnknownNameError

SCALES = Scales(2.0, 0.01, 0.2, 500.0, 20.0, 1e-3, 2.0, 0.01, 0.2)
QUIET = {
    "noise": (0.005, 0.005),
    "gap": (0.2, 0.3),
    "duration": 10.0,
    "sample_rate": 500.0,
    "sensors": ("both",),
    "rigs": (1.0, 0.0, 0.0),
    "detectability": False,
}


@cache
def single(name: str, seed: int) -> tuple[Case, dict]:
    options = BlindOptions(shares=(0.0, 1.0, 0.0, 0.0), effects=(name,), **QUIET)
    return draw_case(name, np.random.default_rng(seed), options)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coulomb_friction", "gap", "bouc_wen_hysteresis", "displacement_delay"])
def test_a_withheld_effect_is_named_and_its_gap_closed(name):
    case, answer = single(name, seed=11)
    verdict = diagnose(case).verdict
    assert verdict.verdict == "effect"
    assert [effect.name for effect in verdict.named] == [name]
    assert verdict.gap.before > 3 * verdict.gap.noise_floor
    assert verdict.gap.after < 1.2 * verdict.gap.noise_floor  # parameters are estimated from another record
    assert verdict.gap.closed_ci95[0] <= verdict.gap.closed <= verdict.gap.closed_ci95[1]
    truth = answer["effects"][0]["parameters"][0]
    estimate = next(iter(verdict.named[0].parameters.values()))
    # five stated standard deviations, and one percent for the interpolation of the loads
    assert abs(estimate.value - truth) < 5 * estimate.std + 0.01 * abs(truth)
    assert json.loads(json.dumps(verdict.to_json()))["named"][0]["name"] == name


def test_wrong_parameters_within_their_uncertainty_are_no_effect():
    options = BlindOptions(shares=(1.0, 0.0, 0.0, 0.0), **QUIET)
    case, _ = draw_case("clean", np.random.default_rng(4), options)
    verdict = diagnose(case).verdict
    assert verdict.verdict == "none"
    assert verdict.named == ()
    assert verdict.gap.parameters_only < 1.2 * verdict.gap.noise_floor


@pytest.mark.slow
def test_an_effect_outside_the_catalogue_is_unknown_and_the_gap_says_where_no_closure_helps():
    """The withheld stiffness is modulated in time, which no force of the state can follow."""
    options = BlindOptions(shares=(0.0, 0.0, 0.0, 1.0), effects=("modulated_stiffness",), **QUIET)
    case, _ = draw_case("foreign", np.random.default_rng(8), options)
    verdict = diagnose(case, most=1).verdict
    assert verdict.verdict == "unknown"
    assert verdict.named == ()
    assert verdict.closure == ""
    assert verdict.gap.after > 2.0 * verdict.gap.noise_floor
    assert verdict.gap.after < 1.1 * verdict.gap.parameters_only


@pytest.mark.slow
def test_striking_the_true_effect_from_the_catalogue_leaves_its_generalisation_and_without_that_unknown():
    case, answer = single("gap", seed=11)
    kin = diagnose(case, exclude=("gap",), most=1).verdict
    assert [effect.name for effect in kin.named] == ["asymmetric_gap"]
    found = kin.named[0].parameters
    for name, truth in zip(("stiffness", "clearance"), answer["effects"][0]["parameters"], strict=True):
        for side in ("positive", "negative"):
            estimate = found[f"{name}_{side}"]
            # five stated standard deviations, and one percent for the interpolation of the loads
            assert abs(estimate.value - truth) < 5 * estimate.std + 0.01 * truth
    stranger = diagnose(case, exclude=("gap", "asymmetric_gap"), most=1).verdict
    assert stranger.verdict == "unknown"
    assert stranger.named == ()


@pytest.mark.slow
def test_a_component_under_prescribed_motion_is_diagnosed(tmp_path):
    rng = np.random.default_rng(2)
    t = np.arange(3000) / 500.0

    def record(name, frequency):
        q = 5.0 * np.sin(2 * np.pi * frequency * t + 0.3)  # no reversal falls on a sample
        v = np.gradient(q, t)
        force = 40.0 * np.sign(v) + 1.5 * q + rng.normal(0.0, 0.4, len(t))
        return record_from_arrays(name, t, {"displacement": q, "force": force})

    case = Case(
        "component", "damper", (NominalParameter("stiffness", 1.5, 0.05, "N/mm"),),
        (CaseChannel("displacement", "mm", "prescribed", 1e-6), CaseChannel("force", "N", "response", 0.4)),
        (record("identification", 0.5),), (record("validation", 0.8),),
    )  # fmt: skip
    diagnosis = diagnose(case)
    best = diagnosis.explanations[0].hypothesis
    assert {p.effect.family for p in best} & {"friction", "hysteresis", "damping"}
    assert diagnosis.verdict.gap.after < 0.1 * diagnosis.verdict.gap.before
    path = tmp_path / "report.html"
    write_report(diagnosis, path)
    text = path.read_text()
    assert "http://" not in text  # self-contained
    assert "https://" not in text
    assert "How far the discrepancy shrinks" in text
    if CHROMIUM is not None:
        shown_whole(path)


def test_the_blind_protocol_seals_runs_and_scores(tmp_path):
    options = BlindOptions(shares=(1.0, 0.0, 0.0, 0.0), **QUIET)
    cases, answers, results = (tmp_path / name for name in ("cases", "answers", "results"))
    made = make_blind(cases, answers, n=2, rng=np.random.default_rng(5), options=options)
    run_blind(cases, results)
    score = score_blind(results, answers, cases=cases)
    assert score.n == 2
    assert score.false_alarms == 0.0
    assert score.median_ratio == pytest.approx(1.0, abs=0.1)
    answer = answers / f"{made[0]}.json"
    answer.write_text(answer.read_text().replace('"none"', '"single"'))
    with pytest.raises(FileFormatError, match="hash"):
        score_blind(results, answers, cases=cases)
    with pytest.raises(ParameterError, match="folder of their own"):
        make_blind(cases, cases, n=1, rng=np.random.default_rng(5))


def test_scoring_counts_what_the_protocol_asks(tmp_path):
    gap = {"after": 0.02, "noise_floor": 0.01}

    def write(name, verdict, named, kind, truth, sets=()):
        effects = [{"name": n, "where": w, "probability": 0.9} for n, w in named]
        result = {
            "verdict": verdict,
            "named": effects,
            "indistinguishable": list(sets),
            "gap": gap,
            "gaps": [gap],
        }
        (tmp_path / "r").mkdir(exist_ok=True)
        (tmp_path / "a").mkdir(exist_ok=True)
        (tmp_path / "r" / f"{name}.json").write_text(json.dumps(result))
        answer = {"class": kind, "effects": [{"name": n, "where": w} for n, w in truth]}
        (tmp_path / "a" / f"{name}.json").write_text(json.dumps(answer))

    write("a", "effect", [("gap", "axial")], "single", [("gap", "axial")])
    write("b", "effect", [("gap", "axial")], "single", [("gap", "torsional")])
    write("c", "effect", [("gap", "")], "single", [("cubic_stiffness", "")], [["cubic_stiffness", "gap"]])
    write("d", "effect", [("gap", "")], "none", [])
    write("e", "unknown", [], "foreign", [("strange", "")])
    write(
        "f",
        "effect",
        [("gap", "")],
        "double",
        [("gap", ""), ("coulomb_friction", "")],
        [["gap", "cubic_stiffness"]],
    )
    either = [["coulomb_friction + gap", "gap"]]
    write("g", "effect", [("gap", "")], "double", [("gap", ""), ("coulomb_friction", "")], either)
    score = score_blind(tmp_path / "r", tmp_path / "a")
    assert score.sets_hold_truth == pytest.approx(2 / 3)  # of "c", "f" and "g"
    assert score.exact == pytest.approx(2 / 3)
    assert score.family == 1.0
    assert score.false_alarms == 1.0
    assert score.unknown_caught == 1.0
    assert score.both_named == 0.0
    assert score.place == pytest.approx(0.5)
    assert score.median_ratio == pytest.approx(2.0)
    assert len(score.wrong) == 4


def test_calibration_error_of_honest_and_of_boastful_probabilities():
    assert calibration_error([(0.75, True)] * 3 + [(0.75, False)]) == pytest.approx(0.0)
    assert calibration_error([(1.0, False)] * 4) == pytest.approx(1.0)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_every_effect_keeps_the_contract_of_the_catalogue(effect):
    grid = effect.grid()
    assert grid
    for eta in grid:
        assert np.isfinite(effect.values(eta, SCALES)).all()
    if effect.site == "joint":
        theta = effect.kernel_theta(grid[0], SCALES)
        assert effect.law.theta(theta).shape == theta.shape  # the found effect can go back into a rig
    for parameter, value in zip(effect.parameters, effect.values(grid[0], SCALES), strict=True):
        assert parameter.eta(value, SCALES) == pytest.approx(
            float(np.clip(grid[0][effect.parameters.index(parameter)], *parameter.bounds)), abs=1e-9
        )


def test_catalogue_names_are_unique_and_found():
    names = [effect.name for effect in CATALOGUE]
    assert len(set(names)) == len(names)
    assert effect_named("gap").name == "gap"
    # what is read off the records first can be left out and scored like any other
    assert effect_named("timed_force").family == "external"
    assert effect_named("scheduled_bouc_wen_hysteresis").family == "hysteresis"
    assert effect_named("record_dependent_friction").family == "friction"
    with pytest.raises(UnknownNameError, match="Did you mean 'gap'"):
        effect_named("gapp")


def test_gap_figures():
    y = np.sin(np.linspace(0.0, 20.0, 500))
    assert nrmse(y, y) == 0.0
    assert nrmse(y, np.full(500, y.mean())) == pytest.approx(1.0)
    assert closed_share(0.5, 0.05, 0.05) == pytest.approx(1.0)
    assert closed_share(0.5, 0.5, 0.05) == 0.0


def test_a_written_case_is_read_back(tmp_path):
    case, _ = single("gap", seed=3)
    write_case(case, tmp_path / "case")
    again = read_case(tmp_path / "case")
    assert [p.name for p in again.parameters] == [p.name for p in case.parameters]
    for name, samples in case.identification[0].values.items():
        # eight printed digits
        np.testing.assert_allclose(again.identification[0].values[name], samples, rtol=1e-7, atol=1e-12)
    assert not again.identification[0].values["force"].flags.writeable


def test_bad_cases_are_refused_with_what_to_do(tmp_path):
    with pytest.raises(FileFormatError, match=r"nominal\.json"):
        read_case(tmp_path)
    with pytest.raises(RecordingError, match="longer record"):
        record_from_arrays("short", np.arange(10.0), {"force": np.zeros(10)})
    t = np.arange(400.0)
    (note,) = record_from_arrays("bad", t, {"force": np.where(t == 7.0, np.nan, 0.0)}).notes
    assert "not finite are bridged" in note
    with pytest.raises(RecordingError, match="30 successive samples are lost"):
        record_from_arrays("jumps", np.where(t > 200, t + 30.0, t), {"force": t})
    case, _ = single("gap", seed=3)
    write_case(case, tmp_path / "case")
    nominal = json.loads((tmp_path / "case" / "nominal.json").read_text())
    nominal["rig"] = "crane"
    (tmp_path / "case" / "nominal.json").write_text(json.dumps(nominal))
    with pytest.raises(FileFormatError, match="crane"):
        diagnose(read_case(tmp_path / "case"))
    with pytest.raises(UnknownNameError, match="effect"):
        diagnose(case, exclude=("gapp",))
