"""The blind protocol: the integrators of the truth, what is drawn, sealing, running and scoring."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.cli import main
from bench.discrepancy import make_blind, read_case, run_blind, score_blind
from bench.discrepancy.blind.drawing import (
    DRAWING_SETTINGS,
    draw_case,
    draw_plan,
)
from bench.discrepancy.blind.proportions import calibration_error, share_of
from bench.discrepancy.blind.region_overlap import region_scores
from bench.discrepancy.blind.score_report import markdown, score_page, tables
from bench.discrepancy.blind.scoring import score_cases
from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.simulation.stick_slip import Elements, StructureMatrices, free_run
from bench.discrepancy.truth import out_of_catalogue as foreign
from bench.discrepancy.truth.ground_truth import ROWS, Truth, WithheldEffect, motion_of, played, sensed
from bench.discrepancy.truth.loads import SIGNALS, load
from bench.discrepancy.truth.moreau_time_stepping import Acting, RigMatrices, Stop, march
from bench.discrepancy.truth.recipe import Reach
from bench.discrepancy.truth.rigs import BlindOptions, CasePlan, draw_bench, reach_of
from bench.discrepancy.truth.withheld_effects import RECIPES, recipe_named
from bench.errors import FileFormatError, ParameterError, UnknownNameError
from bench.laws import LAWS
from bench.laws.coulomb import COULOMB

SDOF = RigMatrices(np.array([[2.0]]), np.array([[3.0]]), np.array([[800.0]]), np.ones((1, 1)))
REACH = Reach(10.0, 0.01, 0.2, 800.0, 20.0, 8.0, 0.5, 0.05, 1.0, 20.0)
SHORT = {"duration": 4.0, "sample_rate": 400.0, "detectability": False}
TRUTH = {"mass": 2.0, "stiffness": 800.0, "damping": 3.0}


def coulomb(level: float) -> Acting:
    return Acting(COULOMB, np.array([level, 1e-4]), np.ones((1, 1)), limits.coulomb_limit)


def relative(a, b) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)) / np.std(b))


# the truth ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["bouc_wen_hysteresis", "gap", "fractional_damping"])
def test_time_stepping_agrees_with_mujoco(name):
    rng = np.random.default_rng(1)
    recipe = recipe_named(name)
    effects = [WithheldEffect(recipe, "", recipe.draw(rng, REACH)(0.4))]
    loads = 10.0 * load("random", 3.0, 1200, 400.0, rng)[:, None]
    engine = motion_of(Truth("sdof", TRUTH, 400.0), effects, loads)
    laws = [Acting(recipe.law, np.asarray(effects[0].drawn.theta), np.ones((1, 1)))]
    own = march(SDOF, laws, loads=loads, step=1 / 400, substeps=60)
    # both are of second order where a law has kinks; 1e-5 is a hundredth of the smallest noise that cases have
    assert relative(own.position, engine.position) < 1e-5
    assert relative(own.acceleration, engine.acceleration) < 1e-5


def test_time_stepping_agrees_with_mujoco_on_the_joint():
    rng = np.random.default_rng(2)
    plan = CasePlan("single", "joint", (recipe_named("gap_coupling"),), ("joint",), "both", False, 0.1, 0.01)
    bench = draw_bench(plan, rng, BlindOptions(**SHORT | {"duration": 2.0}))
    effects = [
        WithheldEffect(plan.recipes[0], "joint", plan.recipes[0].draw(rng, reach_of(bench, "joint"))(0.5))
    ]
    loads = bench.loads[2]
    engine = motion_of(bench.truth, effects, loads)
    laws = [Acting(plan.recipes[0].law, np.asarray(effects[0].drawn.theta), ROWS["joint"]["joint"])]
    own = march(bench.truth.matrices(), laws, loads=loads, step=1 / 400, substeps=60)
    for column in range(4):
        assert relative(own.position[:, column], engine.position[:, column]) < 1e-5
        assert relative(own.acceleration[:, column], engine.acceleration[:, column]) < 1e-5


def test_time_stepping_agrees_with_located_stick_slip():
    loads = 6.0 * load("multisine", 3.0, 2000, 500.0, np.random.default_rng(3))[:, None]
    own = march(SDOF, [coulomb(3.0)], loads=loads, step=1 / 500)
    table = np.array([[0, 0, limits.coulomb_limit.address, 1, 0, 0, 0, 0]], dtype=np.int64)
    elements = Elements(table, np.ones((1, 1)), np.array([3.0, 0.0]), np.zeros(0))
    located = free_run(StructureMatrices(*SDOF), elements, loads=loads, step=1 / 500, substeps=8)
    # an event costs the time stepping one step of 10 microseconds, of some 0.1 s between events
    assert relative(own.position, located.position) < 3e-4
    assert np.mean(np.abs(own.velocity) < 1e-12) > 0.02  # it does stick


def test_the_error_of_time_stepping_falls_with_the_step():
    loads = 6.0 * load("multisine", 3.0, 1000, 500.0, np.random.default_rng(3))[:, None]
    runs = [
        march(SDOF, [coulomb(3.0)], loads=loads, step=1 / 500, substeps=n).position for n in (10, 40, 2000)
    ]
    # first order in events: a quarter of the step gives about a quarter of the error; half is what a few events allow
    assert relative(runs[1], runs[2]) < 0.5 * relative(runs[0], runs[2])


def test_friction_holds_what_is_below_its_limit_and_lets_go_above():
    held = march(SDOF, [coulomb(5.0)], loads=np.full((300, 1), 4.9), step=1e-3)
    assert np.all(held.position == 0.0)
    assert np.all(held.acceleration == 0.0)
    free = march(SDOF, [coulomb(5.0)], loads=np.full((300, 1), 7.0), step=1e-3)
    assert free.acceleration[0, 0] == pytest.approx((7.0 - 5.0) / 2.0)
    # slides to twice the static deflection of the surplus force less what damping takes, and rests there
    assert 0.9 * 2 * 2.0 / 800.0 < free.position.max() < 2 * 2.0 / 800.0


def test_a_rigid_stop_throws_back_with_its_restitution():
    free = RigMatrices(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)))
    stop = Stop(np.ones(1), 0.01, 1.0, 0.6)
    motion = march(free, [], loads=np.full((1200, 1), 2.0), step=1e-3, stop=stop)
    v = motion.velocity[:, 0]
    impacts = np.flatnonzero(np.diff(np.sign(v)) < 0)[:4]
    ratios = -v[impacts + 1] / v[impacts]
    # samples lie up to 1 ms beside an impact, in which the load changes the velocity of 0.2 m/s by 2 mm/s
    assert ratios[0] == pytest.approx(0.6, abs=0.02)
    apexes = 0.01 - np.array(
        [motion.position[a:b, 0].min() for a, b in zip(impacts + 1, impacts[1:], strict=False)]
    )
    # heights fall by the square of the restitution, whatever the load
    np.testing.assert_allclose(apexes[1:] / apexes[:-1], 0.36, rtol=0.03)
    assert motion.position.max() < 0.01 + 1e-5


def test_fractional_damping_has_the_stiffness_of_a_fractional_derivative():
    alpha, shortest, ratio = 0.5, 1e-3, math.sqrt(10.0)
    law = foreign.FRACTIONAL_DAMPING
    matrices = np.zeros(8)
    law.rate(
        0.0, [0.0], [1.0], np.zeros(8), [3.0, alpha, shortest, ratio], matrices
    )  # z' at z = 0: the branches' stiffness
    times = shortest * ratio ** np.arange(8)
    omega = np.array([10.0, 20.0, 40.0])  # well inside 1 / times, 0.3 to 1000 rad/s
    branches = sum(k * 1j * omega * t / (1 + 1j * omega * t) for k, t in zip(matrices, times, strict=True))
    exact = 3.0 * (1j * omega) ** alpha
    # two branches a decade ripple by some percent, and the missing decades at both ends take some more
    np.testing.assert_allclose(np.angle(branches), np.angle(exact), atol=0.12)
    np.testing.assert_allclose(np.abs(branches), np.abs(exact), rtol=0.12)


@settings(max_examples=20, deadline=None)
@given(angle=st.floats(0.0, 6.28), speed=st.floats(0.01, 2.0))
def test_the_friction_cone_has_one_limit_for_all_directions(angle, speed):
    theta = [5.0, 1e4, 0.05]
    v = [speed * math.cos(angle), speed * math.sin(angle) / 0.05]
    z = np.array(
        [5.0e-4 * math.cos(angle), 5.0e-4 * math.sin(angle)]
    )  # bristles bent to the limit along the slip
    zdot, force = np.zeros(2), np.zeros(2)
    foreign.FRICTION_CONE.rate(0.0, [0.0, 0.0], v, z, theta, zdot)
    foreign.FRICTION_CONE.force(0.0, [0.0, 0.0], v, z, theta, force)
    np.testing.assert_allclose(zdot, 0.0, atol=1e-12 + 1e-9 * speed)
    assert math.hypot(force[0], force[1] / 0.05) == pytest.approx(5.0)


def test_loads_and_sensors_do_what_their_effects_say():
    t = np.arange(2000) / 1000.0
    x = np.sin(2 * np.pi * 3.0 * t)

    def drawn(name, strength=0.2):
        recipe = recipe_named(name)
        return WithheldEffect(recipe, "", recipe.draw(np.random.default_rng(0), REACH)(strength))

    late = drawn("displacement_delay")
    tau = late.drawn.values["delay"]
    # the record begins at rest where a true one does; a cubic spline of a 3 Hz sine at 1 kHz is good to 1e-8
    after = t > tau + 0.01
    np.testing.assert_allclose(
        sensed([late], "displacement", x, 1e-3)[after], np.sin(2 * np.pi * 3 * (t - tau))[after], atol=1e-6
    )
    assert sensed([late], "acceleration", x, 1e-3) is not x
    np.testing.assert_array_equal(sensed([late], "acceleration", x, 1e-3), x)
    fine, each = played([drawn("actuator_delay")], x[:, None], 1e-3)
    assert each > 1
    assert len(fine) == each * len(x)
    lag, _ = played([drawn("actuator_lag")], np.ones((2000, 1)), 1e-3)
    tau = drawn("actuator_lag").drawn.values["time_constant"]
    assert lag[round(tau * 1000) - 1, 0] == pytest.approx(
        1 - math.exp(-1.0), abs=0.05
    )  # one sample of tau = 10
    clipped, _ = played([drawn("actuator_saturation", 9.0)], 100.0 * x[:, None], 1e-3)
    assert np.abs(clipped).max() == pytest.approx(3.0)


# what is drawn --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda r: r.name)
def test_every_recipe_keeps_the_contract(recipe):
    catalogue = {e.name: e for e in CATALOGUE}
    if recipe.foreign:
        assert recipe.name not in catalogue
        assert recipe.law is None or recipe.law.name not in LAWS
    else:
        effect = catalogue[recipe.name]
        assert effect.site == recipe.site
        assert effect.law is recipe.law
        assert effect.limit is recipe.limit
        assert effect.n_coordinates == recipe.n_coordinates
    for seed in range(5):
        shape = recipe.draw(np.random.default_rng(seed), REACH)
        weak, strong = shape(0.1), shape(0.2)
        assert weak.values.keys() == strong.values.keys()
        assert dict(weak.values) != dict(strong.values)
        assert np.isfinite(list(strong.values.values())).all()
        if recipe.law is not None:
            np.testing.assert_array_equal(
                recipe.law.theta(strong.theta), strong.theta
            )  # within the law's bounds


@pytest.mark.parametrize("kind", SIGNALS)
def test_loads_have_unit_rms_and_start_from_zero(kind):
    u = load(kind, 4.0, 4000, 400.0, np.random.default_rng(5))
    assert np.sqrt(np.mean(u**2)) == pytest.approx(1.0)
    assert abs(u[0]) < 1e-12
    spectrum = np.abs(np.fft.rfft(u)) ** 2
    f = np.fft.rfftfreq(4000, 1 / 400.0)
    assert spectrum[f < 14.0].sum() > 0.98 * spectrum.sum()


@pytest.mark.parametrize(
    ("name", "sensors"), [("coulomb_friction", "position"), ("cubic_stiffness", "acceleration")]
)
def test_a_drawn_effect_reaches_the_wanted_gap_and_the_noise_is_the_stated_one(name, sensors):
    options = BlindOptions(
        shares=(0.0, 1.0, 0.0, 0.0), rigs=(1.0, 0.0, 0.0), effects=(name,), sensors=(sensors,), noise=(0.003, 0.004),
        gap=(0.2, 0.2001), **SHORT,
    )  # fmt: skip
    case, answer = draw_case("case", np.random.default_rng(9), options)
    values = np.array([answer["true"][n] for n in ("mass", "damping", "stiffness")])
    linear = StructureMatrices(*(v * np.ones((1, 1)) for v in values), np.ones((1, 1)))
    (channel,) = (c for c in case.channels if c.name != "force")
    for record, low, high in (
        (case.identification[0], *DRAWING_SETTINGS.close),
        (case.validation[0], *DRAWING_SETTINGS.alike),
    ):
        motion = free_run(linear, Elements(np.zeros((0, 8), dtype=np.int64), np.zeros((0, 1)), np.zeros(1), np.zeros(0)),
                          loads=record.values["force"][:, None], step=record.step)  # fmt: skip
        real = record.values[channel.name]
        gap = relative(motion[0 if sensors == "position" else 2][:, 0], real)
        # the noise of both channels, 0.4 % each, adds less than a hundredth of the gap in quadrature
        assert 0.98 * low < gap / 0.2 < 1.02 * high
    assert answer["gap_nrmse_identification"][0] == pytest.approx(0.2, rel=0.03)
    if sensors == "position":
        # fourth differences of white noise have 70 times its power, and leave 2e-5 of a motion below 6 Hz
        assert np.std(np.diff(real, 4)) == pytest.approx(channel.noise_std * math.sqrt(70.0), rel=0.1)


def test_nominal_parameters_scatter_by_their_stated_uncertainty():
    options = BlindOptions(shares=(1.0, 0.0, 0.0, 0.0), rigs=(0.0, 1.0, 0.0), **SHORT)
    pulls = []
    for seed in range(60):
        case, answer = draw_case("clean", np.random.default_rng(seed), options)
        pulls += [(p.value - answer["true"][p.name]) / p.std for p in case.parameters]
    # 120 unit normals: mean within 3 / sqrt(120), spread within 3 / sqrt(240)
    assert abs(np.mean(pulls)) < 0.28
    assert np.std(pulls) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("name", ["acceleration_gain_error", "acceleration_delay"])
def test_an_error_of_the_accelerometer_is_drawn_by_the_gap_of_its_own_channel(name):
    options = BlindOptions(
        shares=(0.0, 1.0, 0.0, 0.0), rigs=(1.0, 0.0, 0.0), effects=(name,), gap=(0.2, 0.2001), **SHORT
    )
    _, answer = draw_case("case", np.random.default_rng(9), options)
    assert [effect["name"] for effect in answer["effects"]] == [name]
    assert answer["gap_nrmse_identification"] == [pytest.approx(0.2, rel=0.03)]


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["sdof", "damper", "joint"])
def test_a_double_case_is_made_on_every_rig(rig):
    shares = [float(rig == r) for r in ("sdof", "damper", "joint")]
    options = BlindOptions(shares=(0.0, 0.0, 1.0, 0.0), rigs=tuple(shares), **SHORT | {"duration": 3.0})
    case, answer = draw_case("double", np.random.default_rng(4), options)
    assert case.rig == rig
    assert len(answer["effects"]) == 2
    assert (
        DRAWING_SETTINGS.alike[0]
        < max(answer["gap_nrmse_validation"]) / answer["wanted_gap"]
        < DRAWING_SETTINGS.alike[1]
    )


def test_no_effect_is_drawn_beside_one_that_holds_it():
    options = BlindOptions(
        shares=(0.0, 0.0, 1.0, 0.0),
        rigs=(0.0, 0.0, 1.0),
        effects=("coulomb_friction", "stribeck_friction", "time_varying_friction"),
    )
    rng = np.random.default_rng(8)
    plans = [draw_plan(rng, options) for _ in range(200)]
    alike = [p for p in plans if len(set(p.places)) == 1]
    assert {r.name for p in alike for r in p.recipes} == {"stribeck_friction", "time_varying_friction"}
    assert any("coulomb_friction" in {r.name for r in p.recipes} for p in plans)


def test_options_that_allow_no_case_are_refused():
    options = BlindOptions(
        shares=(0.0, 0.0, 1.0, 0.0),
        rigs=(1.0, 0.0, 0.0),
        effects=("coulomb_friction", "stribeck_friction"),
    )
    with pytest.raises(ParameterError, match="no case can be drawn from effects coulomb_friction, stribeck"):
        draw_plan(np.random.default_rng(1), options)


def test_options_are_checked():
    with pytest.raises(UnknownNameError, match="Did you mean 'gap'"):
        BlindOptions(effects=("gapp",))
    with pytest.raises(ParameterError, match="smell"):
        BlindOptions(sensors=("smell",))


# sealing and running --------------------------------------------------------------------------------------------------

DAMPERS = BlindOptions(rigs=(0.0, 1.0, 0.0), **SHORT)


def make(tmp_path, seed=5, n=3, name="", **changes):
    options = BlindOptions(**{**vars(DAMPERS), **changes})
    cases, answers = tmp_path / f"cases{name}", tmp_path / f"answers{name}"
    return cases, answers, make_blind(cases, answers, n=n, rng=np.random.default_rng(seed), options=options)


def test_the_same_seed_makes_the_same_bytes_and_a_stopped_maker_goes_on(tmp_path):
    cases, answers, names = make(tmp_path)
    again, _, _ = make(tmp_path, name="2")
    files = sorted(p.relative_to(cases) for p in cases.rglob("*") if p.is_file())
    assert len(files) == 4 * len(names)
    assert all((cases / f).read_bytes() == (again / f).read_bytes() for f in files)
    (answers / "case-001.json").unlink()
    kept = (cases / "case-000" / "nominal.json").stat().st_mtime_ns
    make(tmp_path)
    assert (cases / "case-000" / "nominal.json").stat().st_mtime_ns == kept
    assert (answers / "case-001.json").read_bytes() == (tmp_path / "answers2" / "case-001.json").read_bytes()
    with pytest.raises(FileFormatError, match="another seed"):
        make(tmp_path, seed=6)
    read_case(cases / "case-002")


def test_answers_stay_apart_from_cases(tmp_path):
    for inside in (tmp_path / "x", tmp_path / "x" / "answers"):
        with pytest.raises(ParameterError, match="folder of their own"):
            make_blind(tmp_path / "x", inside, n=1, rng=np.random.default_rng(1))
    cases, answers, _ = make(tmp_path, n=4)
    secret = {e["name"] for p in answers.glob("*.json") for e in json.loads(p.read_text())["effects"]}
    shown = " ".join(p.read_text() for p in cases.rglob("*.json"))
    assert secret
    assert not any(name in shown for name in secret)


class Said:
    """A diagnosis that says what it was asked to leave out."""

    def __init__(self, exclude):
        self.verdict = self
        self.exclude = exclude
        self.explanation = "told"
        self.seconds = 0.1

    def to_json(self):
        return {"verdict": "unknown", "named": [], "indistinguishable": [], "warnings": list(self.exclude)}


def test_the_runner_obeys_the_protocol_skips_what_is_there_and_survives_a_failure(tmp_path, monkeypatch):
    cases, answers, names = make(tmp_path, leave_one_out=True)
    results = tmp_path / "results"
    asked = []

    def told(path, *, exclude=(), anyway=False):
        assert anyway  # planted faults of polarity are to be diagnosed, not refused
        asked.append(path.name)
        if path.name == "case-002":
            raise RuntimeError("no luck")
        return Said(exclude)

    monkeypatch.setattr("bench.discrepancy.diagnosis.diagnose_folder", told)
    lines = []
    written = run_blind(cases, results, progress=lines.append)
    assert [p.name for p in written] == [f"{n}.json" for n in names]
    for name in names[:2]:
        truth = json.loads((answers / f"{name}.json").read_text())["effects"][0]["name"]
        assert json.loads((results / f"{name}.json").read_text())["warnings"] == [truth]
    failed = json.loads((results / "case-002.json").read_text())
    assert failed["verdict"] == "failed"
    assert "no luck" in failed["error"]
    run_blind(cases, results)
    assert asked == names
    run_blind(cases, results, again=True)
    assert asked == [*names, *names]
    score = score_blind(results, answers, cases=cases)
    assert score.struck_right == pytest.approx(2 / 3)
    assert score.failed == 1
    assert math.isnan(score.exact)
    with pytest.raises(FileFormatError, match="no case folder"):
        run_blind(tmp_path / "nothing", results)


# scoring --------------------------------------------------------------------------------------------------------------


def write(tmp_path, name, verdict, named, kind, truth, *, sets=(), p=0.9, answer=None, result=None):
    gap = {"after": 0.02, "noise_floor": 0.01}
    effects = [{"name": n, "where": w, "probability": p} for n, w in named]
    document = {
        "verdict": verdict,
        "named": effects,
        "indistinguishable": list(sets),
        "gap": gap,
        "gaps": [gap],
        "seconds": 2.0,
    }
    told = {"class": kind, "effects": [{"name": n, "where": w} for n, w in truth], "noise": 0.01} | (
        answer or {}
    )
    for folder, content in (("r", document | (result or {})), ("a", told)):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / f"{name}.json").write_text(json.dumps(content))


def test_what_counts_as_right(tmp_path):
    gap, cubic, coulomb_ = ("gap", ""), ("cubic_stiffness", ""), ("coulomb_friction", "")
    table = [
        ("effect", [gap], "single", [gap], {}, True),
        ("effect", [gap], "single", [cubic], {}, False),
        ("effect", [gap], "single", [cubic], {"sets": [["cubic_stiffness", "gap"]]}, True),
        ("effect", [("gap", "axial")], "single", [("gap", "torsional")], {}, False),
        ("effect", [gap, cubic], "single", [gap], {}, False),
        ("effect", [gap], "double", [gap, cubic], {}, False),
        ("effect", [cubic, gap], "double", [gap, cubic], {}, True),
        ("effect", [gap, coulomb_], "double", [gap, ("power_law_damping", "")],
         {"sets": [["coulomb_friction", "power_law_damping"]]}, True),
        ("none", [], "none", [], {}, True),
        ("unknown", [], "none", [], {}, False),
        ("unknown", [], "foreign", [("strange", "")], {}, True),
        ("none", [], "foreign", [("strange", "")], {}, False),
        ("effect", [gap], "foreign", [("strange", "")], {"result": {"complete": False}}, False),
        ("effect", [gap], "foreign", [("strange", "")], {"result": {"complete": True}}, False),
        # what is in a catalogue by now, named as it is, is right
        ("effect", [gap], "foreign", [("gap", "")], {"result": {"complete": True}}, True),
        ("effect", [cubic], "single", [gap], {"answer": {"struck": ["gap"]}}, True),
        ("effect", [coulomb_], "single", [gap], {"answer": {"struck": ["gap"]}}, False),
        ("unknown", [], "single", [gap], {"answer": {"struck": ["gap"]}}, True),
        ("failed", [], "single", [gap], {}, False),
    ]  # fmt: skip
    for i, (verdict, named, kind, truth, more, _) in enumerate(table):
        write(tmp_path, f"case-{i:02d}", verdict, named, kind, truth, **more)
    scored = score_cases(tmp_path / "r", tmp_path / "a")
    assert [s.right for s in scored] == [row[-1] for row in table]
    score = score_blind(tmp_path / "r", tmp_path / "a")
    assert score.shares["exact"][:2] == (pytest.approx(2 / 6), 6)
    assert score.strict == pytest.approx(1 / 6)
    # the wrong axis and cubic for gap are of the family; two names for one effect, and no name, are not
    assert score.family == pytest.approx(4 / 6)
    assert score.false_alarms == 0.5
    assert score.unknown_caught == 0.4
    assert score.unfinished == 0.6
    assert score.p90_ratio == score.p90_ratio_catalogued == 2.0
    assert score.both_named == pytest.approx(2 / 3)
    assert score.struck_right == pytest.approx(2 / 3)
    assert score.sets_hold_truth == 1.0
    assert score.median_seconds == 2.0
    assert set(score.seconds.values()) == {(2.0, 2.0)}
    assert score.confusion["gap"] == {"gap": 2, "cubic_stiffness + gap": 1, "failed": 1}
    assert len(score.wrong) == 10
    assert json.loads(json.dumps(score.to_json()))["shares"]["exact"]["n"] == 6


def test_bands_are_read_off_the_answers(tmp_path):
    odds = {"detectability": {"log_odds_none": 500.0, "log_odds_rival": 2.0, "rival": "cubic_stiffness"}}
    told = {
        "gap_nrmse_identification": [0.02, 0.3],
        "noise": 0.004,
        "rig": "joint",
        "sensors": "position",
        **odds,
    }
    write(tmp_path, "a", "effect", [("gap", "")], "single", [("cubic_stiffness", "")], answer=told)
    write(tmp_path, "b", "none", [], "none", [], answer={"noise": 0.02, "signals": ["sweep", "random"]})
    bands = score_blind(tmp_path / "r", tmp_path / "a").bands
    assert bands["gap"]["above 25 %"].n == 1
    assert bands["noise"].keys() == {"0 to 0.6 %", "above 1.2 %"}
    assert bands["sensors"]["position"].value == 0.0
    assert bands["log odds against the nearest rival"].keys() == {"below 3"}
    assert bands["identification signal"]["sweep"].value == 1.0
    assert bands["rig"].keys() == {"b", "joint"}
    assert (
        "expected log odds 2.0 against cubic_stiffness"
        in score_blind(tmp_path / "r", tmp_path / "a").wrong[0]
    )


def test_regions_are_compared_cell_by_cell():
    planted = {"dof": "", "coordinate": "displacement", "reach": 1.0, "intervals": [[-1.0, -0.5], [0.5, 1.0]]}

    def f1(*locations):
        return region_scores({"locations": list(locations)}, {"regions": [planted]})

    exact = {"dof": "x", "regions": [{"displacement": [-1.0, -0.5]}, {"displacement": [0.5, 1.0]}]}
    assert f1(exact) == [1.0]
    assert f1({"dof": "x", "state_region": {"displacement": [0.5, 1.0]}}) == [
        pytest.approx(2 / 3)
    ]  # half of the truth
    assert f1({"dof": "x", "state_region": {"displacement": [-1.0, 1.0]}}) == [
        pytest.approx(2 / 3)
    ]  # twice too much
    assert f1({"dof": "x", "state_region": {"displacement": None, "share": 1.0}}) == [
        pytest.approx(2 / 3)
    ]  # null: without limits
    assert f1({"dof": "x", "state_region": {"displacement": [-0.4, 0.4]}}) == [0.0]
    assert f1() == [0.0]
    # the forces of two effects at one place add up, so they are found together
    two = [planted, planted | {"intervals": [[-0.5, 0.0]]}]
    all_of_it = exact["regions"] + [{"displacement": [-0.5, 0.0]}]
    assert region_scores({"locations": [exact | {"regions": all_of_it}]}, {"regions": two}) == [1.0]
    narrow = {"regions": [planted | {"intervals": [[0.999, 1.0]]}]}
    assert region_scores(
        {"locations": [{"dof": "x", "regions": [{"displacement": [0.95, 1.0]}]}]}, narrow
    ) == [1.0]
    joint = {"regions": [planted | {"dof": "axial"}]}
    assert region_scores({"locations": [exact | {"dof": "theta1"}]}, joint) == [0.0]
    assert region_scores({"locations": [exact | {"dof": "x2"}]}, joint) == [1.0]


def test_wilson_and_calibration_have_their_textbook_values():
    share = share_of([True] * 8 + [False] * 2)
    assert share.value == 0.8
    assert (share.low, share.high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert share_of([True] * 20).high == 1.0
    assert share_of([False] * 20).low == 0.0
    assert math.isnan(share_of([]).value)
    rng = np.random.default_rng(0)
    stated = rng.random(4000)
    honest = [(float(p), bool(rng.random() < p)) for p in stated]
    # ten bins of 400: each frequency is off by 0.02 on average
    assert calibration_error(honest) < 0.04
    assert calibration_error([(float(p), True) for p in stated]) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("said", "share"),
    [
        ([("gap", "axial"), ("coulomb_friction", "torsional")], 1.0),
        ([("gap", "axial"), ("gap", "torsional")], 1.0),  # the second gap stands for the friction
        ([("gap", "torsional"), ("coulomb_friction", "torsional")], 0.5),
        ([("gap", "torsional"), ("coulomb_friction", "axial")], 0.0),
    ],
)
def test_a_place_is_held_against_the_effect_of_that_name(tmp_path, said, share):
    write(tmp_path, "a", "effect", said, "double", [("gap", "axial"), ("coulomb_friction", "torsional")])
    assert score_blind(tmp_path / "r", tmp_path / "a").place == share


def test_scores_are_told_as_tables_markdown_and_a_page(tmp_path, capsys):
    write(
        tmp_path, "a", "effect", [("gap", "")], "single", [("gap", "")], answer={"gap_nrmse_validation": 0.2}
    )
    write(tmp_path, "b", "effect", [("gap", "")], "none", [])
    score = score_blind(tmp_path / "r", tmp_path / "a")
    assert any("Figures over 2 cases" in table.caption for table in tables(score))
    text = markdown(score, title="Trials")
    assert text.startswith("# Trials")
    assert "| gap | gap 1 |" in text
    html = score_page(score).to_html()
    assert "data:image/png;base64" in html
    folders = [str(tmp_path / "r"), str(tmp_path / "a")]
    told = tmp_path / "told.md"
    assert main(["blind", "score", *folders, "--markdown", str(told)]) == 0
    assert "false alarms" in capsys.readouterr().out
    assert "| b: none, nothing diagnosed as gap |" in told.read_text()
    assert main(["blind", "score", *folders, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["false_alarms"] == 1.0


def test_the_command_makes_cases(tmp_path, capsys):
    folders = [str(tmp_path / "c"), str(tmp_path / "a")]
    options = [
        "--n",
        "1",
        "--rigs",
        "0",
        "1",
        "0",
        "--duration",
        "3",
        "--no-detectability",
        "--leave-one-out",
    ]
    assert main(["blind", "make", *folders, *options]) == 0
    assert "1 cases" in capsys.readouterr().out
    assert (tmp_path / "c" / "case-000" / "protocol.json").is_file()
