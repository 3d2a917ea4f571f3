"""A torque-driven robot whose model is too wrong to be run: what it misses is read off its torque along the measured motion."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt
from test_articulated import KP, RATE, mjcf, problem_of, write_case

from bench.discrepancy import read_case
from bench.discrepancy.application.applying import Findings
from bench.discrepancy.articulated.diagnosis import diagnose_articulated
from bench.discrepancy.articulated.next_test import beyond
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_judgement.predicted_errors import predict
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem, along_motion
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.soundness import sound
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joint_torque import missing_torque
from bench.discrepancy.replay.verification import verify
from bench.discrepancy.report.answers import answers, level

FRICTION, DAMPING, STATED = 1.5, 0.8, 0.1
"""Of the elbow, beside a weight of 0.6 N m: Coulomb friction, damping, and the damping as stated."""


def swung(n=4000, step=1e-3):
    """Motion (n, 3) of a joint, its inertia, its bias and its load."""
    t = np.arange(n) * step
    q, v, a = np.sin(3.0 * t), 3.0 * np.cos(3.0 * t), -9.0 * np.sin(3.0 * t)
    inertia, bias = 0.3 + 0.1 * np.cos(t), 2.0 * np.sin(q)
    return np.column_stack([q, v, a]), inertia, bias, np.abs(inertia * a + bias)


@pytest.mark.parametrize("of_actuator", [0.0, 1.0])
def test_nothing_is_missing_where_every_term_is_known(of_actuator):
    motion, inertia, bias, load = swung()
    v, mu = motion[:, 1], 0.2
    p = np.zeros(SLOTS)
    p[[Slot.GEAR, Slot.KP, Slot.RATIO, Slot.STRIBECK]] = 1.0
    p[Slot.LOW], p[Slot.HIGH] = -np.inf, np.inf
    p[Slot.INERTIA], p[Slot.DAMPING], p[Slot.LIMIT] = 0.05, 0.4, 0.7
    p[Slot.DRIVEN if of_actuator else Slot.CARRIED] = mu
    asked = (inertia + 0.05) * motion[:, 2] + bias + 0.4 * v + 0.7 * np.sign(v)
    direction = np.sign(v) * np.sign(asked)
    # of the actuator's own torque, friction that carries it takes a part where it drives, and adds one where it is driven
    drive = asked / (1.0 - mu * direction) if of_actuator else asked + mu * load * np.sign(v)
    still = 1e-6

    def missing(torque):
        return missing_torque(p, (inertia, bias, load), torque, 1e-3, motion, still)

    assert np.abs(missing(drive)).max() < 1e-9
    # in units of the torque that was logged, however much of it friction takes
    np.testing.assert_allclose(missing(drive + 0.01 * drive), 0.01 * drive, atol=1e-9)


def test_dry_friction_at_rest_holds_what_it_can():
    p = np.zeros(SLOTS)
    p[[Slot.GEAR, Slot.KP, Slot.RATIO, Slot.STRIBECK]] = 1.0
    p[Slot.LOW], p[Slot.HIGH], p[Slot.LIMIT] = -np.inf, np.inf, 0.5
    torque = np.linspace(-1.0, 1.0, 21)
    rest, one = np.zeros((21, 3)), np.ones(21)
    found = missing_torque(p, (one, 0.0 * one, 0.0 * one), torque, 1e-3, rest, 0.01)
    np.testing.assert_allclose(found, np.sign(torque) * np.maximum(np.abs(torque) - 0.5, 0.0), atol=1e-12)


@pytest.fixture(scope="module")
def stiff(tmp_path_factory):
    """A folder: an arm whose elbow has far more friction and damping than its model."""
    truth = mjcf(servo=False, friction=FRICTION).replace('damping="0.1"', f'damping="{DAMPING}"')
    return write_case(tmp_path_factory.mktemp("stiff"), truth, servo=False)


def test_friction_and_damping_of_a_model_that_runs_away_are_found_with_their_sizes(stiff):
    found = diagnose_articulated(read_case(stiff))
    verdict = found.verdict
    named = {(e.name, e.where): {k: x.value for k, x in e.parameters.items()} for e in verdict.named}
    assert set(named) == {("coulomb_friction", "elbow"), ("damping_error", "elbow")}
    assert named["coulomb_friction", "elbow"]["limit"] == pytest.approx(FRICTION, rel=0.1)
    damping = next(x.value for x in verdict.nominal if x.name == "damping:elbow")
    assert damping + named["damping_error", "elbow"]["added"] == pytest.approx(DAMPING, rel=0.15)
    assert any("runs further off" in text and "'elbow'" in text for text in verdict.warnings)
    gap = next(g for g in verdict.gaps if g.dof == "elbow")
    assert "torque NRMSE" in gap.metric
    assert gap.before > 0.8
    assert gap.after < 0.1
    assert not verdict.complete
    # what free runs miss is told beside it, and is what the corrected model misses in MuJoCo
    before, after, _ = gap.free_runs
    assert before > 1.0
    assert f"free runs {level(before)} → {level(after)}" in dict(answers(verdict))["How far"]
    first = verdict.named[0]
    twice = replace(verdict, named=(first, replace(first, where="shoulder")))
    told = dict(answers(twice))
    for line in ("Which", "How sure"):
        assert all(f"{first.name} ({joint})" in told[line] for joint in ("elbow", "shoulder"))
    put = verify(
        stiff / "model.xml", Findings(verdict.named, verdict.nominal), verdict.gaps, read_case(stiff)
    )
    assert put.worst.dof == "elbow"
    assert abs(put.worst.short) < 0.1


def test_a_joint_made_heavier_explains_no_torque(stiff):
    problem = problem_of(stiff)
    placed = next(p for p in placements(problem, CATALOGUE) if p.key == ("armature_error", "elbow"))
    vector = np.zeros(problem.size((placed,)))
    vector[-1] = 9.0  # times the inertia
    heavy = ArticulatedFit.at(problem, (placed,), vector)
    floor, settings = np.zeros(2), problem.settings.articulated.judgement
    stated, found = predict(problem, None, floor, settings), predict(problem, heavy, floor, settings)
    assert found.discrepancy[1] < 0.4 * stated.discrepancy[1]
    assert 0.4 < found.weight[1] / 10.0 < 1.1
    torque = TorqueProblem.like(problem)
    left = [
        ArticulatedFit.at(torque, h, v).reduced[1]
        for h, v in (((), np.zeros(len(torque.nominal))), ((placed,), vector))
    ]
    assert left[1] > 0.9 * left[0]


def test_a_next_test_names_what_two_explanations_do_not_share(stiff):
    problem = problem_of(stiff)
    places = {p.key: p for p in placements(problem, CATALOGUE)}
    names = ("coulomb_friction", "damping_error", "quadratic_damping")
    friction, damping, drag = (places[name, "elbow"] for name in names)

    def fit(*hypothesis):
        return ArticulatedFit.at(problem, hypothesis, np.zeros(problem.size(hypothesis)))

    ours, theirs = fit(friction, damping), fit(friction, drag)
    assert beyond(ours, theirs) == "damping_error (elbow)"
    assert beyond(theirs, ours) == "quadratic_damping (elbow)"
    assert beyond(fit(friction), ours) == "coulomb_friction (elbow)"


def test_errors_are_over_the_motion_of_all_records(stiff):
    problem = problem_of(stiff)
    case = problem.case
    records = (*case.identification, *case.validation)
    wanted = np.sqrt(np.mean([np.var(r.values["elbow_q"]) for r in records]))
    assert FreeRuns(problem).sizes[1] == pytest.approx(wanted)


def test_a_filtered_torque_is_averaged_over_what_it_holds(stiff, tmp_path):
    folder = shutil.copytree(stiff, tmp_path / "filtered")
    document = json.loads((folder / "nominal.json").read_text())
    for j in KP:
        document["channels"][f"{j}_in"]["noise_std"] = 0.02
    (folder / "nominal.json").write_text(json.dumps(document))
    how = TorqueProblem.like(problem_of(folder)).settings.articulated
    shortest = round(how.averaged / how.followed * RATE)
    found = []
    for highest in (None, 2.0):
        if highest:
            path = folder / "identification.csv"
            header, table = path.read_text().splitlines()[0], np.loadtxt(path, delimiter=",", skiprows=1)
            table[:, 1:3] = sosfiltfilt(butter(8, highest, fs=RATE, output="sos"), table[:, 1:3], axis=0)
            np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")
        found += TorqueProblem.like(problem_of(folder)).intervals
    assert found[0] == shortest
    # the filter has a slope: something is left of a few times its frequency
    assert 3 * shortest < found[1] <= how.averaged / 2.0 * RATE


def test_what_does_not_do_what_it_is_called_for_is_no_explanation(stiff):
    problem = problem_of(stiff)
    by_key = {p.key: p for p in placements(problem, CATALOGUE)}
    bristles, stop = by_key["presliding_friction", "elbow"], by_key["one_sided_stop", "elbow"]

    def works(placed, **values):
        eta = np.array([values.get(p.name, p.mean) for p in placed.effect.parameters])
        fit = ArticulatedFit.at(problem, (placed,), np.append(np.zeros(len(problem.nominal)), eta))
        fit = replace(fit, log_posterior=0.0)
        assert sound(problem, fit) == placed.effect.works(eta, placed.scales)
        return placed.effect.works(eta, placed.scales)

    assert works(bristles)
    assert not works(bristles, limit=0.0, stiffness=-1.0)  # lets go beyond the travel
    assert works(stop, position=0.5, side=1.0)
    assert works(stop, position=-0.5, side=-1.0)
    assert not works(stop, position=-1.1, side=1.0)  # always touched
    names = {p.effect.name for p in along_motion(list(by_key.values()))}
    assert {"coulomb_friction", "force_gain_error", "mass_error", "actuator_delay"} <= names
    assert not names & {
        "actuator_deadband",
        "actuator_lag",
        "actuator_saturation",
        "backlash",
        "joint_compliance",
    }


def test_a_damping_that_drives_its_joint_is_no_damping(stiff):
    problem = problem_of(stiff)
    wrong = next(p for p in placements(problem, CATALOGUE) if p.key == ("damping_error", "elbow"))
    unit = wrong.effect.parameters[0].value(1.0, wrong.scales)

    def stands(total, std):
        eta = np.array([(total - STATED) / unit])
        found = ArticulatedFit.at(problem, (wrong,), np.append(np.zeros(len(problem.nominal)), eta))
        known = found.covariance.copy()
        known[-1, -1] = (std / unit) ** 2
        return sound(problem, replace(found, covariance=known, log_posterior=0.0))

    assert stands(0.5 * STATED, 0.01 * STATED)
    assert stands(-0.02 * STATED, 0.02 * STATED)  # none, as well as it is known
    assert not stands(-STATED, 0.02 * STATED)
