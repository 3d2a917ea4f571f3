"""Loads on a joint besides its drive: bands, brakes, hands; and what free runs say where every sample is explained."""

from __future__ import annotations

import json
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import Findings
from bench.discrepancy.articulated import explaining
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.explaining import Question, explained
from bench.discrepancy.articulated.naming import ranking_of
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.judgement import Judge, alike, keys_of, simplest
from bench.discrepancy.articulated_judgement.predicted_errors import noise_floor, predict
from bench.discrepancy.articulated_judgement.whiteness import astray
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, refitted
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import Searched, exchanged, nominal_fit
from bench.discrepancy.multibody.joints import joint_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.replay.verification import verify
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.errors import FileFormatError, ModelError

KP, DAMPING, LIMIT, RATE, FINE, NOISE = 20.0, 0.6, 0.12, 50.0, 40, 1e-4
DRIVE = f'<position name="servo" joint="pivot" kp="{KP}"/>'
BANDS = '<motor name="bands" joint="pivot" gear="0.5"/>'


def lever(friction=0.0, drives=DRIVE + BANDS):
    """A lever that a servo holds, and bands that pull at it."""
    dry = f'frictionloss="{friction}" solreffriction="0.002 1"' if friction else ""
    return (
        f'<mujoco><option timestep="{1.0 / RATE / FINE}"/><worldbody><body name="lever">'
        f'<joint name="pivot" axis="0 0 1" armature="0.02" damping="{DAMPING}" {dry}/>'
        '<inertial pos="0.05 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/></body></worldbody>'
        f"<actuator>{drives}</actuator></mujoco>"
    )


def pulled(seed, seconds=12.0):
    """Forces of the bands [N m before the gear]: on and off, to either side."""
    t, rng = np.arange(int(seconds * RATE)) / RATE, np.random.default_rng(seed)
    sides = np.repeat(rng.choice([-1.0, 0.0, 1.0], int(seconds)), int(RATE))[: len(t)]
    smooth = np.convolve(sides, np.hanning(15) / np.hanning(15).sum(), "same")
    return t, (smooth + 0.1 * np.sin(2.0 * np.pi * 0.9 * t)) * np.minimum(t / 0.5, 1.0) ** 2


def folder_of(path, *, friction=LIMIT, pull_noise=0.002, drop=""):
    """A case: the target stands still, the bands pull."""
    (path / "model.xml").write_text(lever())
    truth = mujoco.MjModel.from_xml_string(lever(friction))
    for seed, name in enumerate(("identification", "validation")):
        data, rng = mujoco.MjData(truth), np.random.default_rng(10 + seed)
        t, pull = pulled(seed)
        angle = []
        for force in pull:
            angle.append(data.qpos[0])
            data.ctrl[:] = 0.0, force
            mujoco.mj_step(truth, data, FINE)
        columns = {
            "time": t,
            "target": 0.0 * t,
            "pull": pull,
            "angle": angle + NOISE * rng.standard_normal(len(t)),
        }
        columns.pop(drop, None)
        np.savetxt(
            path / f"{name}.csv",
            np.column_stack(list(columns.values())),
            delimiter=",",
            header=",".join(columns),
            comments="",
            fmt="%.9g",
        )
    channels = {
        "time": {"unit": "s"},
        "target": {"unit": "rad", "role": "command", "actuator": "servo", "noise_std": 0.0},
        "pull": {"unit": "N m", "role": "measured", "actuator": "bands", "noise_std": pull_noise},
        "angle": {"unit": "rad", "joint": "pivot", "quantity": "position", "noise_std": NOISE},
    }
    channels.pop(drop, None)
    document = {
        "rig": "model.xml", "sample_rate_hz": RATE, "load_interpolation": "zero_order_hold", "channels": channels,
        "parameters": {
            "kp:servo": {"value": KP, "std": 0.1 * KP, "unit": "N m/rad"},
            "damping:pivot": {"value": DAMPING, "std": 0.2 * DAMPING, "unit": "N m s/rad"},
        },
    }  # fmt: skip
    (path / "nominal.json").write_text(json.dumps(document))
    return path


def test_friction_is_found_under_a_load_that_was_measured_and_closes_in_mujoco(tmp_path):
    folder = folder_of(tmp_path)
    case = read_case(folder)
    found = diagnose(case)
    (named,) = found.verdict.named
    assert "friction" in named.name
    assert named.parameters["limit"].value == pytest.approx(LIMIT, rel=0.1)
    (gap,) = found.verdict.gaps
    assert gap.after < 0.2 * gap.before
    (figure,) = verify(
        folder / "model.xml",
        Findings(tuple(found.verdict.named), found.verdict.nominal),
        found.verdict.gaps,
        case,
    ).figures
    assert figure.after < 0.3 * figure.before


def test_without_what_is_missing_nothing_is(tmp_path):
    found = diagnose(read_case(folder_of(tmp_path, friction=0.0)))
    assert (found.verdict.verdict, found.verdict.complete) == ("none", True)


def test_an_error_that_no_noise_makes_is_not_complete_however_well_samples_are_explained(tmp_path):
    case, compiled, _ = admitted_robot(read_case(folder_of(tmp_path, pull_noise=0.02)))
    judging = ArticulatedProblem.of(case, ArticulatedModel.of(compiled), case.validation)
    settings = JudgementSettings()
    found = replace(ArticulatedFit.at(judging, (), np.zeros(2)), covariance=np.zeros((2, 2)))
    floor = noise_floor(judging, found, settings)
    lost = astray(judging, found, predict(judging, found, floor, settings), settings)
    assert lost is not None
    assert (lost.joint, lost.times > settings.astray) == (0, True)
    # where the parameters are not known either, they may be what brings it there
    unsure = replace(found, covariance=np.diag([9.0, 9.0]))
    less = astray(judging, unsure, predict(judging, unsure, floor, settings), settings)
    assert less is None or less.times < lost.times


def test_what_the_search_gave_up_is_named_where_the_judging_records_bear_it_out(tmp_path, monkeypatch):
    case, compiled, _ = admitted_robot(read_case(folder_of(tmp_path)))
    model = ArticulatedModel.of(compiled)
    problem, judging = (
        ArticulatedProblem.of(case, model, records) for records in (case.identification, case.validation)
    )
    nominal = nominal_fit(problem)
    candidates = placements(problem, CATALOGUE)
    fits = {}
    for placed in candidates:
        if placed.effect.name in ("coulomb_friction", "force_offset"):
            start = np.append(nominal.vector, [p.mean for p in placed.effect.parameters])
            fits[placed.effect.name] = refitted(problem, (placed,), start, scale=nominal.scale)
    settings = problem.settings.articulated.search
    question = Question(judging, settings, np.random.default_rng(0), True, lambda text: None)
    named = []
    for left in ([], [fits["coulomb_friction"]]):
        told = Searched(problem, [fits["force_offset"], fits["coulomb_friction"], nominal], left)
        monkeypatch.setattr(explaining, "search", lambda *a, told=told, **k: told)
        monkeypatch.setattr(explaining, "_asks_torque", lambda found: False)
        final = explained(problem, candidates, question).final
        named.append([placed.effect.name for placed in final.hypothesis])
    assert named == [[], ["coulomb_friction"]]


def test_explanations_that_predict_as_well_are_told_beside_what_is_named(tmp_path):
    case, compiled, _ = admitted_robot(read_case(folder_of(tmp_path)))
    model = ArticulatedModel.of(compiled)
    problem, judging = (
        ArticulatedProblem.of(case, model, records) for records in (case.identification, case.validation)
    )
    nominal = nominal_fit(problem)
    wanted = ("coulomb_friction", "stribeck_friction", "force_offset")
    fits = []
    for placed in placements(problem, CATALOGUE):
        if placed.effect.name in wanted:
            start = np.append(nominal.vector, [p.mean for p in placed.effect.parameters])
            fits.append(refitted(problem, (placed,), start, scale=nominal.scale))
    settings = JudgementSettings()
    final = next(f for f in fits if f.hypothesis[0].effect.name == "coulomb_friction")
    predicted = predict(judging, final, noise_floor(judging, final, settings), settings)
    found = alike(Judge(problem, judging), fits, final, predicted)
    assert frozenset({("stribeck_friction", "pivot")}) in found
    assert frozenset({("force_offset", "pivot")}) not in found
    # what is as good counts as much, however much likelier the one is
    behind = [replace(f, log_posterior=f.log_posterior - 100.0 * (f is not final)) for f in fits]
    ranking = {r.name: r.probability for r in ranking_of(behind, behind[fits.index(final)], 0.0, found)}
    assert ranking["stribeck_friction"] == pytest.approx(ranking["coulomb_friction"])
    assert ranking["force_offset"] < 1e-6
    # what has most parameters is named only where it predicts better for sure
    rich = next(f for f in fits if f.hypothesis[0].effect.name == "stribeck_friction")
    assert simplest(fits, rich, {keys_of(final)}) is final
    assert simplest(fits, rich, set()) is rich
    assert simplest(fits, final, {keys_of(rich)}) is final
    plain = exchanged(problem, rich, rich.hypothesis[:1], final.hypothesis[:1])
    assert keys_of(plain) == keys_of(final)
    np.testing.assert_allclose(plain.vector, final.vector, atol=0.05)


def test_what_a_motor_did_has_to_be_known(tmp_path):
    with pytest.raises(FileFormatError, match=r"no channel says what motor 'bands' did on joint 'pivot'"):
        diagnose(read_case(folder_of(tmp_path, drop="pull")))


def test_a_joint_has_one_drive_that_is_no_plain_motor():
    model = mujoco.MjModel.from_xml_string(lever(drives=BANDS + DRIVE))
    joint = joint_of(model, 0)
    assert joint.drive is not None
    assert (joint.drive.name, [load.name for load in joint.loads]) == ("servo", ["bands"])
    motors = mujoco.MjModel.from_xml_string(lever(drives=BANDS + '<motor name="brake" joint="pivot"/>'))
    first = joint_of(motors, 0)
    assert first.drive is not None
    assert (first.drive.name, [load.name for load in first.loads]) == ("bands", ["brake"])
    both = mujoco.MjModel.from_xml_string(
        lever(drives=DRIVE + '<velocity name="second" joint="pivot" kv="1"/>')
    )
    with pytest.raises(ModelError, match="'servo', 'second', none of them a plain motor"):
        joint_of(both, 0)
