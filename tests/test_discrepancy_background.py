"""Sealed cases with a background: what is made of it, and how their verdicts are scored."""

from __future__ import annotations

import json

import numpy as np
import pytest
from planted_cases import DAMPING, MASS, NOISE, STIFFNESS, linear_motion, motion_with, planted_case

from bench.cli import main
from bench.discrepancy import score_blind
from bench.discrepancy.blind.background_score import background_scored, background_summary
from bench.discrepancy.blind.detectability import lasting
from bench.discrepancy.blind.drawing import (
    DRAWING_SETTINGS,
    draw_case,
    draw_plan,
)
from bench.discrepancy.blind.proportions import calibration_error, calibration_scatter
from bench.discrepancy.blind.score_report import tables
from bench.discrepancy.truth.background import ACTING, RECORDED, Background, draw_background
from bench.discrepancy.truth.background_settings import STATED, BackgroundSettings
from bench.discrepancy.truth.foreign_memory import HIDDEN_RESONATOR
from bench.discrepancy.truth.loads import RIGS_SETTINGS
from bench.discrepancy.truth.rigs import BlindOptions, draw_bench
from bench.errors import ParameterError
from bench.laws.base_flexibility import BASE_FLEXIBILITY

RIGS = {"sdof": (1.0, 0.0, 0.0), "damper": (0.0, 1.0, 0.0), "joint": (0.0, 0.0, 1.0)}
SHORT = {
    "duration": 3.0,
    "sample_rate": 300.0,
    "detectability": False,
    "shares": RIGS_SETTINGS.background_shares,
}


def options(rig: str, **settings) -> BlindOptions:
    chosen = {"bare": 0.0, **settings}
    return BlindOptions(rigs=RIGS[rig], background=BackgroundSettings(**chosen), **SHORT)


@pytest.mark.parametrize("rig", RIGS)
def test_what_acts_on_a_rig_makes_the_wanted_part_of_the_discrepancy(rig):
    rng = np.random.default_rng(4)
    made = options(rig, pieces=(6, 6), share=(0.2, 0.2))
    plan = draw_plan(rng, made)
    bench = draw_bench(plan, rng, made)
    bare = bench.responses((), quick=True, judging=False)
    assert made.background is not None
    background = next(
        found
        for _ in range(20)
        if (
            found := draw_background(bench, bare, rng, made.background, DRAWING_SETTINGS.bisections, main=0.1)
        )
        is not None
    )
    assert {e.recipe.name for e in background.acting} == {recipe.name for recipe in ACTING}
    assert set(background.recorded) == set(RECORDED)
    alone = [
        max(bench.gaps(bench.responses([e], quick=True, judging=False), bare)) for e in background.acting
    ]
    # six parts, drawn between one half and the whole of the largest, whose squares add up to that of the wanted whole
    assert np.hypot.reduce([*alone, *background.recorded.values()]) == pytest.approx(0.2 * 0.1, rel=0.15)


@pytest.mark.parametrize("rig", RIGS)
def test_a_case_tells_no_one_of_its_background_and_its_answer_does(rig):
    case, answer = draw_case("case", np.random.default_rng(11), options(rig))
    assert answer["background"]
    assert 0.05 <= answer["background_share"] <= 0.3
    assert answer["noise_stated"] in STATED
    assert answer["class"] in {"none", "single", "foreign"}
    assert answer["main_gap"] > 0.0
    if answer["effects"]:  # what parameters leave, which the wanted gap bounds
        assert answer["main_gap"] <= answer["wanted_gap"]
    stated = {c.noise_std for c in case.channels if c.role == "response"}
    assert (stated == {None}) == (answer["noise_stated"] == "no")


def test_what_parameters_take_up_is_no_main_discrepancy():
    true = {"mass": MASS, "stiffness": STIFFNESS, "damping": DAMPING}
    # next to no noise in the records, as in the pure case of a maker
    stated = {name: 100.0 * level for name, level in NOISE.items()}
    softer = planted_case(lambda f: linear_motion(f, stiffness=0.96 * STIFFNESS), noise=stated)
    taken = lasting(softer, true)
    assert taken.gap < 0.02
    assert taken.log_odds < DRAWING_SETTINGS.expected
    sticking = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (2.0 * np.tanh(v / 0.003), [])), noise=stated
    )
    left = lasting(sticking, true)
    assert left.gap > 0.05
    assert left.log_odds > DRAWING_SETTINGS.expected


def test_what_comes_into_the_records_has_its_size_and_leaves_other_channels_alone():
    n, step = 4000, 0.002
    t = step * np.arange(n)
    clean = [{"force": np.sin(20.0 * t), "displacement": 0.01 * np.sin(25.0 * t)}]
    for name in RECORDED:
        background = Background(recorded={name: 0.02}, share=0.1)
        (out,) = background.recorded_in(
            clean, judged="displacement", timed=["displacement"], step=step, rng=np.random.default_rng(1)
        )
        left = np.std(out["displacement"] - clean[0]["displacement"]) / np.std(clean[0]["displacement"])
        # the jitter is held to 40 % of a sample, which at 25 rad/s is 2 %
        assert left == pytest.approx(0.02, rel=0.1)
        assert np.array_equal(out["force"], clean[0]["force"])


def test_a_background_is_put_beside_one_effect_or_none():
    with pytest.raises(ParameterError, match="whose third is zero"):
        BlindOptions(background=BackgroundSettings())
    with pytest.raises(ParameterError, match="came as"):
        BackgroundSettings(share=(0.3, 0.05))


def test_the_command_makes_cases_with_a_background(tmp_path, capsys):
    folders = [str(tmp_path / "c"), str(tmp_path / "a")]
    rigs = ["--rigs", "0", "1", "0"]
    assert (
        main(
            [
                "blind",
                "make",
                *folders,
                "--background",
                "--n",
                "2",
                "--duration",
                "3",
                "--no-detectability",
                *rigs,
            ]
        )
        == 0
    )
    answers = [json.loads(path.read_text()) for path in (tmp_path / "a").glob("*.json")]
    assert len(answers) == 2
    assert all("background" in answer for answer in answers)
    assert "2 cases" in capsys.readouterr().out


def result(verdict, named, *, sets=(), after=0.1, complete=False):
    gap = {"before": 0.4, "after": after, "noise_floor": 0.01}
    effects = [{"name": n, "where": "", "probability": p, "parameters": {}} for n, p in named]
    return {
        "verdict": verdict, "named": effects, "indistinguishable": list(sets), "gap": gap, "gaps": [gap], "complete": complete,
        "nominal": [], "probabilities": {},
    }  # fmt: skip


def answer(effects, background, *, stated="true", kind="single"):
    told = [{"name": n, "where": "", "parameters": [1.0]} for n in effects]
    return {
        "class": kind if effects else "none", "effects": told, "background": background, "background_share": 0.2,
        "noise_stated": stated, "noise": 0.01, "gap_nrmse_identification": [0.4],
    }  # fmt: skip


MAIN = "main effect named or in a declared set"


@pytest.mark.parametrize(
    ("said", "truth", "missed"),
    [
        (result("effect", [("gap", 0.9)]), answer(["gap"], ["hum"]), set()),
        (result("effect", [("gap", 0.9)], complete=True), answer(["gap"], ["hum"]), {"not said to be complete"}),
        (result("effect", [("gap", 0.9)], complete=True), answer(["gap"], [], stated="no"), set()),
        (result("effect", [("cubic_stiffness", 0.5)], sets=[["cubic_stiffness", "gap"]]), answer(["gap"], ["hum"]), set()),
        (result("effect", [("cubic_stiffness", 0.5)]), answer(["gap"], ["hum"]), {MAIN, "and first"}),
        (result("unknown", []), answer(["gap"], ["hum"]), {MAIN, "and first"}),
        (result("none", []), answer(["gap"], ["hum"]), {MAIN, "and first", "not none"}),
        (result("effect", [("gap", 0.95)]), answer([], ["hum"]), set()),  # it pays
        (result("none", []) | {"seconds": float("nan")}, answer([], ["hum"]), {"every number is finite"}),
        (result("effect", [("gap", 0.9)]) | {"named": [{"name": "gap", "probability": 0.9, "parameters": {}, "closed": -0.1}]},
         answer([], ["hum"]), {"none of them makes it larger"}),
        (result("effect", [("gap", 0.95)], after=0.39), answer([], ["hum"]),
         {"background: no certain name that does not pay on the judging record", "names shrink the judged discrepancy"}),
        (result("effect", [("gap", 0.95)]), answer([], [], stated="no"),
         {"clean: no certain name that does not pay on the judging record"}),
        (result("unknown", []), answer(["hertz_contact"], ["hum"], kind="foreign"), set()),
        (result("effect", [("gap", 0.95)]), answer(["hertz_contact"], ["hum"], kind="foreign"), set()),  # not said to be all
        (result("effect", [("gap", 0.95)], complete=True), answer(["hertz_contact"], ["hum"], kind="foreign"),
         {"foreign beside a background: unknown, or said not to be complete"}),
        (result("effect", [("base_flexibility", 0.95)], complete=True), answer(["hidden_resonator"], ["hum"], kind="foreign"), set()),
        (result("none", []), answer(["hertz_contact"], ["hum"], kind="foreign"),
         {"foreign beside a background: unknown, or said not to be complete", "foreign beside a background: not none"}),
    ],
)  # fmt: skip
def test_what_counts_as_right_beside_a_background(said, truth, missed):
    assert {what for what, hit in background_scored(truth, said) if not hit} == missed


@pytest.mark.parametrize(("rate", "held"), [(7.2, True), (6.0, False), (70.0, False)])
def test_an_interval_is_held_against_the_parameter_that_the_law_has(rate, held):
    drift = {
        "name": "stiffness_drift", "where": "", "probability": 0.9, "law": "stiffness_drift", "theta": [7.0, 0.0],
        "parameters": {"stiffness_change": {"value": 70.0, "std": 4.0, "unit": "N/m"}},
    }  # fmt: skip
    truth = answer(["stiffness_drift"], ["hum"])
    truth["effects"][0] |= {"names": ["rate"], "parameters": [rate]}
    said = result("effect", []) | {"named": [drift]}
    assert (
        dict(background_scored(truth, said))["95 % intervals of the main effect's parameters hold the truth"]
        is held
    )


@pytest.mark.parametrize(("left", "counted"), [(0.05, True), (0.004, False)])
def test_effects_that_parameters_take_up_are_counted_apart(left, counted):
    told = dict(background_scored(answer(["gap"], ["hum"]) | {"main_gap": left}, result("unknown", [])))
    line = "the same, of effects that leave more than noise does when parameters are re-estimated"
    assert told[MAIN] is False
    assert (line in told) is counted


def test_both_worlds_have_figures_of_their_own(tmp_path):
    cases = {
        "a": (result("effect", [("gap", 0.95)]), answer(["gap"], ["hum"])),
        "b": (result("unknown", []), answer(["gap"], ["hum"])),
        "c": (
            result("effect", [("gap", 0.95)]),
            {"class": "single", "effects": [{"name": "gap", "where": ""}], "noise": 0.01},
        ),
    }
    for name, pair in cases.items():
        for folder, content in zip(("r", "a"), pair, strict=True):
            (tmp_path / folder).mkdir(exist_ok=True)
            (tmp_path / folder / f"{name}.json").write_text(json.dumps(content))
    score = score_blind(tmp_path / "r", tmp_path / "a")
    assert score.n == 3
    assert score.exact == 1.0
    assert score.shares["exact"].n == 1
    assert score.background is not None
    assert score.background.shares[MAIN].value == 0.5
    assert score.background.calibration == pytest.approx(0.05)
    assert score.background.wrong == (
        "b: ['gap'] -> unknown []; not: main effect named or in a declared set, and first",
    )
    base = result("effect", [("base_flexibility", 0.9), ("gap", 0.5)])
    for background, error in ((["hidden_resonator"], 0.3), (["slow_stiffness"], 0.7)):
        told = background_summary([("a", answer([], background), base)])
        # 0.9 and 0.5, of which the base is so in the first case only
        assert told.calibration == pytest.approx(error)
        assert told.interval[0] <= told.calibration <= told.interval[1]
    assert "With a background" in [table.caption for table in tables(score)]
    assert score.to_json()["background"]["shares"][MAIN]


def test_a_hidden_resonator_pulls_as_a_base_flexibility_beside_a_spring_and_a_damper():
    k, m, c = 120.0, 0.05, 0.4
    omega = np.sqrt(k / m)
    resonator, base = np.array([k, m, c]), np.array([k, omega / (2.0 * np.pi), 0.5 * omega * c / k, c / k])

    def force(law, theta, q, v, z):
        out = np.zeros(1)
        law.force(0.0, np.array([q]), np.array([v]), z, theta, out)
        return out[0]

    def rate(law, theta, q, v, z):
        out = np.zeros(2)
        law.rate(0.0, np.array([q]), np.array([v]), z, theta, out)
        return out

    rng = np.random.default_rng(5)
    for q, v, y, w in rng.standard_normal((20, 4)):
        z = np.array([y, w])
        # one state equation, hence one state from rest on, and forces that differ by a spring and a damper
        np.testing.assert_allclose(
            rate(BASE_FLEXIBILITY, base, q, v, z), rate(HIDDEN_RESONATOR, resonator, q, v, z)
        )
        beside = k * q + c * v + force(BASE_FLEXIBILITY, base, q, v, z)
        assert force(HIDDEN_RESONATOR, resonator, q, v, z) == pytest.approx(beside)


def test_exact_probabilities_of_few_names_have_a_calibration_error_all_the_same():
    rng = np.random.default_rng(0)
    stated = rng.uniform(0.3, 1.0, 40)
    expected = calibration_scatter(stated)
    seen = [
        calibration_error(
            [(float(p), bool(hit)) for p, hit in zip(stated, rng.random(40) < stated, strict=True)]
        )
        for _ in range(50)
    ]
    assert expected == pytest.approx(np.mean(seen), abs=0.02)
    assert expected > 0.05
    assert calibration_scatter(np.full(4000, 0.9)) < 0.01
