"""Laws of the bench as parts of the nominal model."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from planted_cases import MASS, motion_with, planted_case

from bench.discrepancy import Case, CaseChannel, NominalParameter, diagnose, read_case, record_from_arrays
from bench.discrepancy.case.free_decay import with_no_load
from bench.discrepancy.case.schema import check_units
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.screening.screen import Screen
from bench.errors import FileFormatError, ParameterError, UnknownNameError
from bench.laws import LAWS

STIFFNESS, LIMIT, OFFSET = 1200.0, 3.0, 0.8
SLIP = {
    "law": "jenkins", "name": "slip",
    "parameters": {"stiffness": {"value": 1.05 * STIFFNESS, "std": 100.0}, "limit": {"value": 0.95 * LIMIT, "std": 0.2}, "transition": 0.1},
}  # fmt: skip


def slipping(x, v, z):
    """A Jenkins element and a constant force."""
    rate, force = np.zeros(1), np.zeros(1)
    theta = LAWS["jenkins"].theta([STIFFNESS, LIMIT, 0.1])
    slip = LAWS["jenkins"].rate
    assert slip is not None
    slip(0.0, [x], [v], z, theta, rate)
    LAWS["jenkins"].force(0.0, [x], [v], z, theta, force)
    return force[0] + OFFSET, [rate[0]]


def with_parameters(case: Case, **values: tuple[float, float]) -> Case:
    more = tuple(NominalParameter(name, *pair) for name, pair in values.items())
    return replace(case, parameters=(*case.parameters, *more))


@pytest.fixture(scope="module")
def slipping_case() -> Case:
    return planted_case(lambda force: motion_with(force, slipping, hidden=1), n=1500)


def test_an_element_with_uncertain_parameters_explains_what_it_makes(slipping_case):
    free = {"slip.stiffness": (1.05 * STIFFNESS, 100.0), "slip.limit": (0.95 * LIMIT, 0.2)}
    case = with_parameters(slipping_case, force_offset=(0.7, 0.2), **free)
    case = replace(case, options={"elements": [SLIP]})
    problem = Problem(case, structure_of(case), case.identification)
    fitted = fit(problem, (), start=np.zeros(6), iterations=40)
    assert fitted.reduced < 1.1  # chi-squared of some hundred residuals is known to 0.07
    values = dict(
        zip(problem.structure.parameters, problem.nominal + problem.spread * fitted.vector, strict=True)
    )
    assert values["slip.limit"] == pytest.approx(LIMIT, rel=0.03)
    assert values["force_offset"] == pytest.approx(OFFSET, rel=0.1)
    assert values["mass"] == pytest.approx(MASS, rel=0.01)
    # the columns of a screening are what the free run says where the motion is the true one: they point the same way
    screen = Screen(problem, [])
    i = problem.structure.parameters.index("slip.limit")
    step = np.zeros(6)
    step[i] = 0.1
    run = (problem.residual((), step) - problem.residual((), np.zeros(6))) / -0.1
    cosine = run @ screen.nominal[:, i] / np.linalg.norm(run) / np.linalg.norm(screen.nominal[:, i])
    assert cosine > 0.7


@pytest.mark.slow
def test_friction_of_the_wrong_kind_in_the_model_gives_place_to_the_right_one(slipping_case):
    case = with_parameters(
        slipping_case, coulomb=(LIMIT, 0.3), slip_stiffness=(0.5 * STIFFNESS, 30.0), force_offset=(0.8, 0.1)
    )
    verdict = diagnose(case).verdict
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor < verdict.gap.before


def test_a_declaration_that_makes_no_sense_is_refused(tmp_path, slipping_case):
    nominal = {
        "rig": "sdof", "sample_rate_hz": 500.0, "elements": [SLIP],
        "parameters": {p.name: {"value": p.value, "std": p.std} for p in slipping_case.parameters},
        "channels": {c.name: {"unit": c.unit, "noise_std": c.noise_std} for c in slipping_case.channels},
    }  # fmt: skip
    for record in (*slipping_case.identification, *slipping_case.validation):
        names = list(record.values)
        table = np.column_stack([record.values[name] for name in names])
        np.savetxt(tmp_path / f"{record.name}.csv", table, delimiter=",", header=",".join(names), comments="")

    def read(**changes):
        document = {**nominal, "elements": [{**SLIP, **changes}]}
        (tmp_path / "nominal.json").write_text(json.dumps(document))
        case = read_case(tmp_path)
        return structure_of(case)

    assert read().parameters == ("mass", "damping", "stiffness", "slip.stiffness", "slip.limit")
    for error, wrong in (
        (UnknownNameError, {"law": "jenkin"}),
        (UnknownNameError, {"place": "elbow"}),
        (UnknownNameError, {"where": ""}),
        (UnknownNameError, {"parameters": {"limits": 1.0}}),
        (FileFormatError, {"parameters": {"limit": "3 N"}}),
        (ParameterError, {"parameters": {"limit": -1.0}}),
    ):
        with pytest.raises(error):
            read(**wrong)


def test_a_rotary_component_under_prescribed_motion_has_torque_and_angle():
    rng, t = np.random.default_rng(2), np.arange(2000) / 500.0
    records = []
    for name, frequency in (("identification", 0.5), ("validation", 0.8)):
        q = 1.5 * np.sin(2 * np.pi * frequency * t + 0.3)
        v = np.gradient(q, t)
        torque = 0.12 * np.sign(v) + 0.05 * v + rng.normal(0.0, 0.002, len(t))
        records.append(record_from_arrays(name, t, {"angle": q, "torque": torque}))
    case = Case(
        "drive", "damper", (NominalParameter("damping", 0.05, 0.01, "N m s/rad"),),
        (CaseChannel("angle", "rad", "prescribed", 1e-7), CaseChannel("torque", "N m", "response", 0.002)),
        (records[0],), (records[1],),
    )  # fmt: skip
    check_units(case)
    problem = Problem(case, structure_of(case), case.identification)
    friction = Placed(effect_named("coulomb_friction"), problem.structure.places[0])
    fitted = fit(problem, (friction,), start=np.array([0.0, 0.0]))
    level = friction.effect.values(fitted.vector[1:], problem.scales_of(friction))[0]
    assert level == pytest.approx(0.12, rel=0.01)
    assert problem.structure.places[0].force_unit == "N m"


def test_a_free_decay_needs_no_load_and_responses_alone_are_refused_in_words():
    t = np.arange(2000) / 500.0
    x = 0.02 * np.exp(-0.8 * t) * np.cos(30.0 * t)
    noisy = x + 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    records = [
        record_from_arrays(n, t, {"displacement": noisy}, at_rest=False)
        for n in ("identification", "validation")
    ]
    parameters = (
        NominalParameter("mass", 1.0, 0.01), NominalParameter("stiffness", 900.64, 20.0), NominalParameter("damping", 1.5, 0.3)
    )  # fmt: skip
    channels = (CaseChannel("displacement", "m", "response", 1e-5),)
    case = Case("decay", "sdof", parameters, channels, (records[0],), (records[1],))
    with pytest.raises(FileFormatError, match="responses alone"):
        structure_of(case)
    free = with_no_load(case)
    problem = Problem(free, structure_of(free), free.identification)
    fitted = fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=40)
    assert fitted.reduced < 1.1
    assert problem.nominal[1] + problem.spread[1] * fitted.vector[1] == pytest.approx(1.6, rel=0.02)
