"""What is left of a robot's log is weighed octave by octave, and every joint is given what it misses in one round."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from scipy.integrate import quad
from test_articulated import LIMIT, NOISE, mjcf, problem_of, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.articulated import further_fits
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.judgement import Judge, kept
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, refitted
from bench.discrepancy.articulated_search.misfit import Octaves, transformed
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import exchanged, nominal_fit, search
from bench.discrepancy.multibody.model import ArticulatedModel


@pytest.mark.slow
def test_a_number_that_no_judgement_believes_is_named_instead_of_what_it_hides(tmp_path):
    """The shoulder's motor gives three quarters of what is stated, far less surely than 4 %; its friction is what gains most there."""
    text = mjcf(servo=False, friction=LIMIT).replace('joint="shoulder"/>', 'joint="shoulder" gear="0.74"/>')
    text = text.replace('frictionloss="0.0"', f'frictionloss="{3.0 * LIMIT}"')
    folder = write_case(tmp_path, text, servo=False, velocity=True, offset=0.05)
    document = json.loads((folder / "nominal.json").read_text())
    document["parameters"]["gear:shoulder_drive"] = {"value": 1.0, "std": 0.04, "unit": "N m/(N m)"}
    (folder / "nominal.json").write_text(json.dumps(document))
    case, compiled, _ = admitted_robot(read_case(folder))
    problem = TorqueProblem.of(case, ArticulatedModel.of(compiled), case.identification)
    (gear,) = (i for i, p in enumerate(problem.nominal) if p.kind == "gear")

    def misled(of, before, after):  # predictions are made with it no further out than is believed
        return bool(abs(after.vector[gear]) > of.settings.articulated.judgement.strained)

    asked = ("coulomb_friction", "position_offset", "force_gain_error")
    candidates = [c for c in placements(problem, CATALOGUE) if c.effect.name in asked]
    found = search(problem, candidates, misled=misled).fits[0]
    assert not misled(problem, found, found)
    etas = problem.etas(found.hypothesis, found.vector)
    pairs = zip(found.hypothesis, etas, strict=True)
    named = {placed.key: placed.effect.values(eta, placed.scales) for placed, eta in pairs}
    assert named["force_gain_error", "shoulder_drive"]["relative_error"] == pytest.approx(-0.26, abs=0.03)
    assert named["coulomb_friction", "elbow"]["limit"] == pytest.approx(LIMIT, rel=0.1)


def test_a_friction_that_closes_next_to_nothing_owes_its_form_to_noise():
    """Beside a payload, of a twentieth of what friction is known to: whether it is higher at rest no record of this size tells."""
    effects = {effect.name: effect for effect in CATALOGUE}
    kinds = ("mass_error", "stribeck_friction", "stribeck_friction", "cogging", "coulomb_friction")
    hypothesis = [SimpleNamespace(effect=effects[kind], key=(kind, f"j{k}")) for k, kind in enumerate(kinds)]

    def left(power):
        return SimpleNamespace(excess=np.array([power]))

    small = 0.05
    predictions, without = [left(100.0), left(1.0)], [left(60.0), left(1.2), left(2.0), left(1.01), None]
    faint = further_fits.faint_frictions(hypothesis, predictions, without, small)
    # 0.2 of 100 is less than a twentieth of an amplitude, 1 is not
    assert faint == {("stribeck_friction", "j1")}


def test_friction_in_the_place_of_another_law_begins_as_large_as_the_records_say(tmp_path):
    """Expected twenty times as large, it holds the joint; a fit does not find back from there."""
    small = 0.03
    folder = write_case(tmp_path, mjcf(servo=False, friction=small), servo=False)
    case, compiled, _ = admitted_robot(read_case(folder))
    problem = ArticulatedProblem.of(case, ArticulatedModel.of(compiled), case.identification)
    laws = {p.effect.name: p for p in placements(problem, CATALOGUE) if p.where == "elbow"}
    rich, dry = laws["stribeck_friction"], laws["coulomb_friction"]
    (limit,) = dry.effect.parameters
    expected = replace(limit, mean=limit.mean + 2.0)  # a logarithm
    dry = replace(dry, effect=replace(dry.effect, parameters=(expected,)))
    nominal = nominal_fit(problem)
    begin = [rich.effect.parameters[0].mean - 1.0, *(p.mean for p in rich.effect.parameters[1:])]
    found = refitted(problem, (rich,), np.append(nominal.vector, begin), scale=nominal.scale)
    plain = exchanged(problem, found, (rich,), (dry,))
    (eta,) = problem.etas(plain.hypothesis, plain.vector)
    assert dry.effect.values(eta, dry.scales)["limit"] == pytest.approx(small, rel=0.1)
    assert plain.log_posterior > nominal.log_posterior


def octaves(n: float, samples: float) -> Octaves:
    """One joint, one octave of n ordinates."""
    count = np.array([[float(n)]])
    return Octaves((np.zeros(int(n), dtype=np.int64),), count, samples, 1.0 + 2.0 * np.sqrt(2.0 / count))


@pytest.mark.parametrize(("n", "samples"), [(500, 16.0), (30, 16.0), (20, 40.0)])
def test_model_error_counts_as_few_samples_and_noise_as_all(n, samples):
    known, few = octaves(n, samples), min(samples, n)
    chance = float(known.chance[0, 0])

    def misfit(r: float) -> float:
        return known.misfit(0, np.array([n * r]))

    assert misfit(0.5) == pytest.approx(0.5 * n)
    for r in (chance + 0.2, 3.0, 1e3):
        u = r - chance
        told, _ = quad(lambda s: (1 + s) / ((1 + 2 * s) / n + s**2 / few), 0.0, u, limit=200, points=[min(u, 1.0)])  # fmt: skip
        assert misfit(r) == pytest.approx(n * chance + told, rel=1e-6)
        step = 1e-5 * r
        slope = (misfit(r + step) - misfit(r - step)) / (2 * step)
        # what a fit with these scales minimises has the slope of the misfit
        assert slope == pytest.approx(n / known.scale(np.array([[n * r]]))[0, 0] ** 2, rel=1e-4)
    # ten times as much model error is as surprising as `few` samples make it
    assert misfit(1e5) - misfit(1e4) == pytest.approx(few * np.log(10.0), rel=2e-2)


def test_the_transform_of_white_noise_is_white_in_every_octave(tmp_path):
    problem = problem_of(write_case(tmp_path, mjcf(servo=True), servo=True))
    known, rng = problem.octaves, np.random.default_rng(3)
    powers = []
    for _ in range(200):
        noise = [rng.standard_normal(r.joints[0].weight.shape) * r.joints[0].weight for r in problem.records]
        residual = transformed(noise)
        assert residual @ residual == pytest.approx(sum(float(np.sum(one**2)) for one in noise))
        powers.append(known.power(0, residual))
    assert np.mean(powers, axis=0) == pytest.approx(known.count[0], rel=0.05)
    assert (
        np.diff(known.count[0])[:-1] < 0.0
    ).all()  # the highest octave first, the lowest with what is below it


def test_priors_hold_against_a_wrong_law_however_finely_it_was_logged(tmp_path):
    problem = problem_of(write_case(tmp_path, mjcf(servo=True, friction=LIMIT), servo=True))
    found = nominal_fit(problem)
    assert found.reduced.max() > 10.0
    assert np.abs(found.vector).max() < 4.0


def rubbing(friction: float) -> str:
    """The arm with friction at both joints."""
    whole = mjcf(servo=True, friction=friction)
    return whole.replace('frictionloss="0.0"', f'frictionloss="{0.75 * friction}"')


@pytest.mark.slow
def test_every_joint_is_given_what_it_misses_though_one_effect_is_asked_for(tmp_path):
    folder = write_case(tmp_path, rubbing(LIMIT), servo=True)
    left_out = {e.name for e in CATALOGUE} - {
        "coulomb_friction",
        "damping_error",
        "mass_error",
        "actuator_delay",
    }
    verdict = diagnose(read_case(folder), most=1, exclude=left_out).verdict
    found = {effect.where: effect for effect in verdict.named}
    assert {(e.name, e.where) for e in verdict.named} == {
        ("coulomb_friction", j) for j in ("shoulder", "elbow")
    }
    assert found["elbow"].parameters["limit"].value == pytest.approx(LIMIT, rel=0.05)
    assert found["shoulder"].parameters["limit"].value == pytest.approx(0.75 * LIMIT, rel=0.05)


def test_what_showed_nothing_when_it_was_added_is_taken_out_again(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=True, friction=LIMIT), servo=True)
    problem = problem_of(folder)
    judging = ArticulatedProblem.of(problem.case, problem.model, problem.case.validation)
    places = {p.key: p for p in placements(problem, CATALOGUE)}
    lag, friction = places["actuator_lag", "elbow_drive"], places["coulomb_friction", "elbow"]
    start = np.zeros(len(problem.nominal))
    fits = [nominal_fit(problem)]
    for hypothesis, eta in (((lag,), [-6.0]), ((lag, friction), [-6.0, -2.0])):
        vector = np.concatenate([start, eta])
        scale = ArticulatedFit.at(problem, hypothesis, vector).scale
        fits.insert(0, refitted(problem, hypothesis, vector, scale=scale))
    told = kept(Judge(problem, judging), fits)
    assert [placed.key for placed in told.rungs[told.last].hypothesis] == [friction.key]
    assert told.predictions[told.last].discrepancy.max() < 100.0 * NOISE
    assert told.fits


@pytest.mark.parametrize(
    ("other", "in_place", "kept_names"),
    [(0.9, False, {"b"}), (1.1, False, {"a", "b"}), (0.9, True, {"a", "b"})],
)
def test_what_another_effect_has_made_idle_goes_but_for_a_number_in_the_place_of_a_parameter(
    monkeypatch, other, in_place, kept_names
):
    """Fitted without it, the judging records are left no larger; what was never fitted without is not asked."""
    a, b = (SimpleNamespace(key=(name, "elbow"), joint=0) for name in "ab")
    fits = [
        SimpleNamespace(hypothesis=hypothesis, log_posterior=value)
        for hypothesis, value in (((a, b), 5.0), ((b,), 3.0), ((b,), 2.0))
    ]
    left = {frozenset("ab"): 1.0, frozenset("b"): other}
    monkeypatch.setattr(further_fits, "twins", lambda nominal, joint: set())
    monkeypatch.setattr(further_fits, "takes_the_place", lambda *asked: in_place)

    def predicted(found):
        return SimpleNamespace(excess=np.array([left[frozenset(p.key[0] for p in found.hypothesis)]]))

    found = further_fits.without_the_idle(SimpleNamespace(nominal=()), fits, fits[0], predicted)
    assert {placed.key[0] for placed in found.hypothesis} == kept_names
    assert found.log_posterior == max(f.log_posterior for f in fits if f.hypothesis == found.hypothesis)


def test_a_short_log_of_a_servo_is_diagnosed(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=True, friction=LIMIT), servo=True, length=1.0)
    left_out = {e.name for e in CATALOGUE} - {"coulomb_friction", "damping_error"}
    verdict = diagnose(read_case(folder), exclude=left_out).verdict
    assert {(e.name, e.where) for e in verdict.named} == {("coulomb_friction", "elbow")}


@pytest.mark.slow
def test_cogging_along_a_slide_has_a_pitch_in_metres(tmp_path):
    """A carriage on a linear motor with poles 30 mm apart, a mast that swings on it: periods in a turn say nothing of a slide."""
    text = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody><body name="carriage">
      <joint name="rail" type="slide" axis="1 0 0" damping="12"/><geom type="box" size="0.1 0.1 0.05" mass="4"/>
      <body name="mast" pos="0 0 -0.1"><joint name="pivot" type="hinge" axis="0 1 0" damping="0.05" armature="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.6"/></body></body></worldbody>
      <actuator><motor name="linear" joint="rail"/><position name="swing" joint="pivot" kp="20" kv="1"/></actuator></mujoco>"""
    (tmp_path / "cart.xml").write_text(text, encoding="utf-8")
    for seed, name in enumerate(("identification", "validation")):
        model = mujoco.MjModel.from_xml_string(text)
        data, rng, rows = mujoco.MjData(model), np.random.default_rng(seed), []
        phases = 6.0 * rng.random(6)
        for k in range(2500):
            t = 0.005 * k
            ramp = min(t, 1.0)
            wanted = (
                ramp
                * 0.08
                * sum(np.sin(2 * np.pi * f * t + p) for f, p in zip((0.3, 0.7, 1.1), phases, strict=False))
            )
            goal = ramp * 0.3 * np.sin(2 * np.pi * 0.5 * t + phases[3])
            force = 2000.0 * (wanted - data.qpos[0]) - 120.0 * data.qvel[0]
            data.ctrl[:] = force, goal
            noisy = data.qpos + (1e-6, 1e-5) * rng.standard_normal(2)
            rows.append([t, force + 0.02 * rng.standard_normal(), goal, *noisy])
            for _ in range(5):
                data.qfrc_applied[0] = -6.0 * np.sin(2.0 * np.pi * data.qpos[0] / 0.03 + 0.5)
                mujoco.mj_step(model, data)
        np.savetxt(
            tmp_path / f"{name}.csv",
            rows,
            delimiter=",",
            header="time,force,goal,x,angle",
            comments="",
            fmt="%.9g",
        )
    parameters = {
        "mass:carriage": {"value": 4.0, "std": 0.1, "unit": "kg"},
        "damping:rail": {"value": 12.0, "std": 2.0, "unit": "N s/m"},
        "damping:pivot": {"value": 0.05, "std": 0.01, "unit": "N m s/rad"},
    }
    channels = {
        "force": {"unit": "N", "role": "measured", "actuator": "linear", "noise_std": 0.02},
        "goal": {"unit": "rad", "role": "command", "actuator": "swing", "noise_std": 0},
        "x": {"unit": "m", "joint": "rail", "quantity": "position", "noise_std": 1e-6},
        "angle": {"unit": "rad", "joint": "pivot", "quantity": "position", "noise_std": 1e-5},
    }
    told = {
        "rig": "cart.xml",
        "load_interpolation": "zero_order_hold",
        "parameters": parameters,
        "channels": channels,
    }
    (tmp_path / "nominal.json").write_text(json.dumps(told), encoding="utf-8")
    verdict = diagnose(read_case(tmp_path)).verdict
    (found,) = (e for e in verdict.named if e.name == "cogging")
    assert found.where == "rail"
    assert found.parameters["pitch"].value == pytest.approx(0.03, rel=0.01)
    assert found.parameters["pitch"].unit == "m"
    assert np.hypot(found.parameters["sine"].value, found.parameters["cosine"].value) == pytest.approx(
        6.0, rel=0.1
    )


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "kind"), [(0.0, "none"), (LIMIT, "effect")])
def test_encoders_that_are_noisier_than_stated_are_said_to_be_and_hide_nothing(tmp_path, friction, kind):
    folder = write_case(tmp_path, mjcf(servo=True, friction=friction), servo=True)
    document = json.loads((folder / "nominal.json").read_text())
    for joint in ("shoulder", "elbow"):
        document["channels"][f"{joint}_q"]["noise_std"] = NOISE / 2.0
    (folder / "nominal.json").write_text(json.dumps(document))
    verdict = diagnose(read_case(folder)).verdict
    assert verdict.verdict == kind
    assert not verdict.complete
    if kind == "none":
        said = [line for line in verdict.warnings if "larger than stated, by a factor of 2" in line]
        assert len(said) == 2
    else:
        assert ("coulomb_friction", "elbow") in {(e.name, e.where) for e in verdict.named}
