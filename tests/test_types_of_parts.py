"""Parts of one type: what is off in one servo is off in its twins, and one that is missing friction has no better twins."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from test_apply import stage_case
from test_articulated import KP, LIMIT, mjcf, problem_of, write_case
from test_articulated_rounds import rubbing

from bench.discrepancy import read_case
from bench.discrepancy.articulated.naming import model_numbers
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.judgement import Judge, keys_of, ladder, simplest
from bench.discrepancy.articulated_judgement.judgement import alike as alike_in
from bench.discrepancy.articulated_judgement.predicted_errors import noise_floor, predict
from bench.discrepancy.articulated_search.joint_rounds import round_of
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.search import nominal_fit, steps
from bench.discrepancy.blind.protocol import write_case as written_again
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.multibody.nominal_parameters import nominal_parameters, twins
from bench.errors import DocumentError

COMMON, EACH = 0.4, 0.02
"""Relative uncertainty of the gain of a type of servo, and scatter of two of them."""


def of_type(folder, entries):
    """A case whose gains say of which type their servos are; entries by name of the parameter."""
    path = folder / "nominal.json"
    document = json.loads(path.read_text())
    for name, entry in entries.items():
        document["parameters"][name] |= entry
    path.write_text(json.dumps(document))
    return folder


def alike():
    """Both gains: little is known of the type, and much of how far two of it differ."""
    return {f"kp:{j}_drive": {"std": COMMON * kp, "alike": "S1", "each": EACH * kp} for j, kp in KP.items()}


def with_gain(factor):
    """The arm with other gains than stated."""
    text = mjcf(servo=True)
    for kp in KP.values():
        text = text.replace(f'kp="{kp}"', f'kp="{factor * kp}"')
    return text


def of_one_size(fits):
    """Fits with as many effects as there are parts."""
    return [f for f in fits if len(f.hypothesis) == len(KP)]


def test_deviations_of_twins_have_one_part_in_common(tmp_path):
    problem = problem_of(of_type(write_case(tmp_path, mjcf(servo=True), servo=True), alike()))
    parameters = nominal_parameters(problem.case, problem.model)
    index = {p.name: i for i, p in enumerate(parameters)}
    common, elbow = index["kp:S1"], index["kp:elbow_drive"]
    assert parameters[common].shared
    assert [twins(parameters, j) for j in range(len(problem.joints))] == [{1}, {0}]
    assert all(common in felt for felt in problem.felt)
    assert parameters[elbow].stated_std == pytest.approx(COMMON * KP["elbow"])
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((20_000, len(parameters)))
    gains = np.array([
        [parameters[i].deviation(x, i) / parameters[i].value for i in (index["kp:shoulder_drive"], elbow)] for x in draws
    ])  # fmt: skip
    assert gains.std(axis=0) == pytest.approx(COMMON, rel=0.02)
    # of two twins, (a - b) / (1 + common) has the scatter of both
    apart = (gains[:, 0] - gains[:, 1]) / (1.0 + 0.5 * gains.sum(axis=1))
    assert np.median(np.abs(apart)) == pytest.approx(0.6745 * np.sqrt(2.0) * EACH, rel=0.05)
    vector, step = draws[0], 1e-6
    for i, slope in parameters[elbow].slopes(vector, elbow).items():
        moved = vector.copy()
        moved[i] += step
        change = parameters[elbow].deviation(moved, elbow) - parameters[elbow].deviation(vector, elbow)
        assert change / step == pytest.approx(slope, rel=1e-4)


def test_what_one_twin_shows_is_known_of_the_other(tmp_path):
    factor = 0.8
    alone = {f"kp:{j}_drive": {"std": COMMON * kp} for j, kp in KP.items()}
    found = {}
    for name, entries in (("alone", alone), ("twins", alike())):
        folder = tmp_path / name
        folder.mkdir()
        problem = problem_of(of_type(write_case(folder, with_gain(factor), servo=True), entries))
        found[name] = {entry.name: entry for entry in model_numbers(problem, nominal_fit(problem))}
        assert set(found[name]) == {p.name for p in problem.case.parameters}
    for j, kp in KP.items():
        mine, twin = (found[name][f"kp:{j}_drive"] for name in ("alone", "twins"))
        assert twin.value == pytest.approx(factor * kp, rel=0.02)
        assert twin.stated_std == pytest.approx(mine.stated_std)
        assert twin.std < 1.01 * mine.std
        assert twin.shift_in_std == pytest.approx((factor - 1.0) / COMMON, rel=0.1)


def within_factor(factor, **of_a_type):
    """Both gains as known to within a factor."""
    return {
        f"kp:{j}_drive": {"value": kp, "factor": factor, "unit": "N m/rad"} | of_a_type
        for j, kp in KP.items()
    }


def stated(folder, entries):
    """A case with other entries of parameters."""
    path = folder / "nominal.json"
    document = json.loads(path.read_text())
    document["parameters"] |= entries
    path.write_text(json.dumps(document))
    return folder


def test_of_what_is_known_to_a_factor_the_logarithm_is_normal(tmp_path):
    """Its standard deviation is that of the factor, and twins differ by theirs."""
    entries = within_factor(10.0, alike="S1", each=1.1)
    problem = problem_of(stated(write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0), entries))
    parameters = problem.nominal
    index = {p.name: i for i, p in enumerate(parameters)}
    common, elbow, shoulder = index["kp:S1"], index["kp:elbow_drive"], index["kp:shoulder_drive"]
    draws = np.random.default_rng(0).standard_normal((20_000, len(parameters)))
    logs = np.array([
        [np.log1p(parameters[i].deviation(x, i) / parameters[i].value) for i in (shoulder, elbow)] for x in draws
    ])  # fmt: skip
    assert logs.std(axis=0) == pytest.approx(np.log(10.0), rel=0.02)
    assert np.std(logs[:, 0] - logs[:, 1]) == pytest.approx(np.sqrt(2.0) * np.log(1.1), rel=0.02)
    vector, step = draws[0], 1e-6
    slopes = parameters[elbow].slopes(vector, elbow)
    assert set(slopes) == {elbow, common}
    for i, slope in slopes.items():
        moved = vector.copy()
        moved[i] += step
        change = parameters[elbow].deviation(moved, elbow) - parameters[elbow].deviation(vector, elbow)
        assert change / step == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_gain_of_which_the_order_of_magnitude_is_known_is_found(tmp_path, factor):
    problem = problem_of(stated(write_case(tmp_path, with_gain(factor), servo=True), within_factor(10.0)))
    found = {entry.name: entry for entry in model_numbers(problem, nominal_fit(problem))}
    for j, kp in KP.items():
        mine = found[f"kp:{j}_drive"]
        # the stiffer servo turns at 16 Hz, of which steps of 1 ms make some 1e-2
        assert mine.value == pytest.approx(factor * kp, rel=0.02)
        assert mine.shift_in_std == pytest.approx(np.log(factor) / np.log(10.0), abs=0.01)


def test_one_kind_of_effect_is_taken_at_all_parts_of_a_type(tmp_path):
    problem = problem_of(of_type(write_case(tmp_path, rubbing(LIMIT), servo=True), alike()))
    names = {"coulomb_friction", "stribeck_friction", "load_dependent_friction", "servo_gain_error"}
    candidates = placements(problem, [effect for effect in CATALOGUE if effect.name in names])
    settings = problem.settings.articulated.search
    told = round_of(problem, nominal_fit(problem), candidates, settings, lambda text: None)
    assert told.best is not None
    assert {placed.key for placed in told.best.hypothesis} == {("coulomb_friction", j) for j in KP}
    kinds = [{placed.effect.name for placed in f.hypothesis} for f in of_one_size(told.fits)]
    assert {"coulomb_friction"} in kinds
    assert {"load_dependent_friction"} in kinds
    of_one = [f for f, kind in zip(of_one_size(told.fits), kinds, strict=True) if len(kind) == 1]
    assert told.best.log_posterior == max(f.log_posterior for f in of_one)
    # one choice is judged as one, and exchanged as one
    fits = [told.best, nominal_fit(problem), *told.fits]
    assert [len(f.hypothesis) for f in ladder(problem, fits)] == [0, len(KP)]
    other = next(
        f
        for f, kind in zip(of_one_size(told.fits), kinds, strict=True)
        if kind == {"load_dependent_friction"}
    )
    judged = problem.settings.articulated.judgement
    floor = noise_floor(problem, told.best, judged)
    near = alike_in(Judge(problem, problem), fits, other, predict(problem, other, floor, judged))
    assert keys_of(told.best) in near
    assert simplest(fits, other, near).hypothesis == told.best.hypothesis


def test_kinds_at_parts_of_no_type_are_choices_of_their_own(tmp_path):
    problem = problem_of(write_case(tmp_path, rubbing(LIMIT), servo=True))
    kind = [effect for effect in CATALOGUE if effect.name == "coulomb_friction"]
    assert steps(problem, tuple(placements(problem, kind))) == [1, 2]
    assert steps(problem, ()) == []


REFUSED = {
    "a type without a scatter": ({"kp:elbow_drive": {"alike": "S1"}}, "alike and each belong together"),
    "a scatter without a type": ({"kp:elbow_drive": {"each": 0.1}}, "alike and each belong together"),
    "more scatter than uncertainty": ({"kp:elbow_drive": {"alike": "S1", "each": 9.0}}, "std counts the scatter of the parts in"),
    "one part of a type": ({"kp:elbow_drive": {"alike": "S1", "each": 0.1}}, "no other 'kp:…' is of type 'S1'"),
    "masses of a type": (
        {name: {"alike": "S1", "each": 0.001} for name in ("mass:upper", "mass:fore")}, "are joints and drives of an MJCF",
    ),
}  # fmt: skip


FACTORS_REFUSED = {
    "a factor and a deviation": ({"std": 1.0}, "one of them says how well it is known"),
    "a factor of nothing": ({"factor": 1.0}, "a number above 1 is expected"),
    "a scatter that is none": ({"alike": "S1", "each": 0.9}, "beside a factor it is one, too"),
    "a scatter as wide as the type": (
        {"alike": "S1", "each": 10.0},
        "factor counts the scatter of the parts in",
    ),
    "nothing": ({"value": 0.0}, "what is known to within a factor is positive"),
}


@pytest.mark.parametrize("name", FACTORS_REFUSED)
def test_factors_that_say_nothing_are_refused(tmp_path, name):
    changes, says = FACTORS_REFUSED[name]
    folder = write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0)
    entries = {parameter: entry | changes for parameter, entry in within_factor(10.0).items()}
    with pytest.raises(DocumentError, match=says):
        read_case(stated(folder, entries))


@pytest.mark.parametrize("known", ["std", "factor"])
def test_a_case_that_is_written_again_keeps_what_is_stated_of_its_parts(tmp_path, known):
    folder = write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0)
    entries = within_factor(10.0, alike="S1", each=1.1)
    case = read_case(of_type(folder, alike()) if known == "std" else stated(folder, entries))
    written_again(case, tmp_path / "again")
    assert read_case(tmp_path / "again").parameters == case.parameters


def test_parts_of_a_type_are_known_in_one_way(tmp_path):
    entries = within_factor(10.0, alike="S1", each=1.1)
    entries["kp:elbow_drive"] = {"value": 40.0, "std": 8.0, "alike": "S1", "each": 1.1}
    with pytest.raises(DocumentError, match="have a factor and some a std"):
        read_case(stated(write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0), entries))


@pytest.mark.parametrize("name", REFUSED)
def test_types_of_which_nothing_follows_are_refused(tmp_path, name):
    entries, says = REFUSED[name]
    folder = of_type(write_case(tmp_path, mjcf(servo=True), servo=True, length=1.0), entries)
    with pytest.raises(DocumentError, match=says):
        read_case(folder)


def test_a_linear_structure_says_that_it_takes_parts_one_by_one(tmp_path):
    case = stage_case(tmp_path, n=400)
    roughly = tuple(replace(p, factor=3.0) for p in case.parameters[:1])
    (said,) = [
        n
        for n in admitted(replace(case, parameters=(*roughly, *case.parameters[1:]))).notes
        if "factor of 3" in n
    ]
    assert "it is taken as known to" in said
    of_a_type = tuple(replace(p, alike="S1", each=0.5 * p.std) for p in case.parameters)
    (said,) = [note for note in admitted(replace(case, parameters=of_a_type)).notes if "'S1'" in note]
    assert "is not used" in said
    assert not [note for note in admitted(case).notes if "is not used" in note]
