"""Friction in a gear: by what drives it, by what hangs on it, more at rest than in motion."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from test_articulated import problem_of

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_judgement.judgement import Judge
from bench.discrepancy.articulated_search.containing import begun_again
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, refitted
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.search import believable, nominal_fit
from bench.discrepancy.articulated_search.soundness import sound
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joint_torque import missing_torque

LIMIT, DRIVEN, WEIGHED, AT_REST, VELOCITY, GROWTH = 0.02, 0.2, 0.05, 0.25, 0.6, 0.4


def limit_of(drive, weight, v):
    at_rest = AT_REST * np.abs(weight) * np.exp(-((v / VELOCITY) ** 2))
    return LIMIT + np.abs(DRIVEN * drive + WEIGHED * weight) + at_rest + GROWTH * drive**2


def test_nothing_is_missing_along_a_motion_where_the_gear_is_known():
    t = 1e-3 * np.arange(3000)
    q, v, a = 0.8 * np.sin(3.0 * t), 2.4 * np.cos(3.0 * t), -7.2 * np.sin(3.0 * t)
    inertia, weight = 0.005 + 0.0 * t, 0.4 * np.sin(q)
    drive = np.array([
        brentq(lambda u, i=i: u - np.sign(v[i]) * limit_of(u, weight[i], v[i]) - inertia[i] * a[i] - weight[i], -1.2, 1.2)
        for i in range(len(t))
    ])  # fmt: skip
    p = np.zeros(SLOTS)
    p[[Slot.GEAR, Slot.KP, Slot.RATIO]] = 1.0
    p[Slot.LOW], p[Slot.HIGH] = -np.inf, np.inf
    p[Slot.LIMIT], p[Slot.DRIVEN], p[Slot.WEIGHED] = LIMIT, DRIVEN, WEIGHED
    p[Slot.WEIGHED_RISE], p[Slot.STRIBECK], p[Slot.DRIVEN_SQUARE] = AT_REST, VELOCITY, GROWTH
    motion, arrays = np.column_stack([q, v, a]), (inertia, weight, np.abs(weight))
    found = missing_torque(p, arrays, drive, 1e-3, motion, 1e-6)
    assert np.abs(found).max() < 1e-9
    # of a little more drive the gear takes its part, which is not missing
    more = missing_torque(p, arrays, drive + 1e-6, 1e-3, motion, 1e-6)
    np.testing.assert_allclose(more, 1e-6, rtol=0.01)


KP, BACK_EMF, STALL, MASS, LENGTH, ROTOR, RATE = 0.8, 0.03, 0.75, 0.5, 0.1, 0.002, 200.0
SERVO = f"""<mujoco><option timestep="0.001"/><worldbody><body name="arm"><joint name="pivot" axis="0 1 0" armature="{ROTOR}"/>
<inertial pos="0 0 -{LENGTH}" mass="{MASS}" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody><actuator>
<dcmotor name="drive" joint="pivot" motorconst="0.3" resistance="3" input="pos" controller="{KP} 0 {BACK_EMF} 0 0 {STALL * 10.0}"/>
</actuator></mujoco>"""


def swung(target, fine=20):
    """Positions of the servo with friction in its gear; the limit follows from the step before, and the joint truly sticks."""
    step, inertia = 1.0 / (RATE * fine), MASS * LENGTH**2 + ROTOR
    q = v = 0.0
    out = []
    for wanted in target:
        out.append(q)
        for _ in range(fine):
            drive = np.clip(KP * (wanted - q), -STALL, STALL) - BACK_EMF * v
            weight = MASS * 9.81 * LENGTH * np.sin(q)
            free = v + step / inertia * (drive - weight)
            v = np.sign(free) * max(abs(free) - step / inertia * limit_of(drive, weight, v), 0.0)
            q += step * v
    return np.array(out)


@pytest.fixture(scope="module")
def servo(tmp_path_factory):
    """A folder: a hobby servo with a pendulum on it, its voltage in proportion to the error."""
    folder, rng = tmp_path_factory.mktemp("servo"), np.random.default_rng(3)
    (folder / "model.xml").write_text(SERVO)
    t = np.arange(int(6.0 * RATE)) / RATE
    targets = {
        "identification": 1.2 * np.sin(2.0 * t) * np.sin(0.7 * t), "identification_2": 1.4 * np.sin(0.5 * t),
        "validation": 0.9 * np.sin(0.5 * t**2),
    }  # fmt: skip
    for name, target in targets.items():
        measured = swung(target) + 3e-4 * rng.standard_normal(len(t))
        table = np.column_stack([t, target, measured])
        np.savetxt(
            folder / f"{name}.csv", table, delimiter=",", header="time,target,angle", comments="", fmt="%.9g"
        )
    parameters = {
        "mass:arm": (MASS, 0.02, "kg"),
        "armature:pivot": (ROTOR, 0.1, "kg m^2"),
        "kp:drive": (KP, 0.05, "N m/rad"),
    }
    document = {
        "rig": "model.xml", "sample_rate_hz": RATE, "load_interpolation": "zero_order_hold",
        "parameters": {k: {"value": v, "std": part * v, "unit": unit} for k, (v, part, unit) in parameters.items()},
        "channels": {
            "time": {"unit": "s"},
            "target": {"unit": "rad", "role": "command", "actuator": "drive", "noise_std": 0.0},
            "angle": {"unit": "rad", "joint": "pivot", "quantity": "position", "noise_std": 3e-4},
        },
    }  # fmt: skip
    (folder / "nominal.json").write_text(json.dumps(document))
    return folder


def test_friction_in_the_gear_of_a_servo_is_named_and_its_size_found(servo):
    verdict = diagnose(read_case(servo)).verdict
    (named,) = verdict.named
    assert (named.name, named.where) == ("gear_friction", "pivot")
    found = {name: estimate.value for name, estimate in named.parameters.items()}
    assert found["mu_rest"] == pytest.approx(AT_REST, rel=0.2)
    assert found["velocity"] == pytest.approx(VELOCITY, rel=0.2)
    # the parts that grow with the drive stand in for one another over the range of its torque; their sum does not
    torque = 0.5
    sought = DRIVEN * torque + WEIGHED * torque + GROWTH * torque**2
    whole = (found["mu_drive"] + found["mu_weight"]) * torque + found["growth"] * torque**2
    assert whole == pytest.approx(sought, rel=0.1)
    (gap,) = verdict.gaps
    assert gap.after < 0.05 * gap.before


def test_a_law_is_never_less_likely_than_one_within_it(servo):
    problem = problem_of(servo)
    places = {placed.effect.name: placed for placed in placements(problem, CATALOGUE)}
    nominal = nominal_fit(problem)

    def fitted(name, eta):
        placed, start = places[name], np.concatenate([nominal.vector, eta])
        return refitted(problem, (placed,), start, scale=nominal.scale)

    simple = fitted("load_dependent_friction", [-2.0, -1.0, 1.0])
    gear = places["gear_friction"]
    far = ArticulatedFit.at(
        problem, (gear,), np.concatenate([nominal.vector, [3.0] * len(gear.effect.parameters)])
    )
    assert far.log_posterior < simple.log_posterior
    kept, again = begun_again(
        problem, [simple, far], lambda f, start: refitted(problem, f.hypothesis, start, scale=simple.scale)
    )
    assert kept is simple
    assert again.hypothesis == far.hypothesis
    assert again.log_posterior > simple.log_posterior
    # what contains nothing better stays
    assert begun_again(problem, [again, simple], lambda f, start: far)[0] is again


def test_a_gear_out_of_which_less_comes_the_harder_it_is_driven_is_no_explanation(servo):
    problem = problem_of(servo)
    gear = next(p for p in placements(problem, CATALOGUE) if p.effect.name == "gear_friction")
    assert gear.scales.limit == pytest.approx(STALL)
    start = [p.mean for p in gear.effect.parameters]
    names = [p.name for p in gear.effect.parameters]
    values = gear.effect.values(np.array(start), gear.scales)
    for part, whole in ((0.95, True), (1.05, False)):  # of what the last bit of drive adds, friction takes
        growth = (part - values["mu_drive"]) / (2.0 * STALL)
        eta = np.array(start)
        eta[names.index("growth")] = gear.effect.parameters[-1].eta(growth, gear.scales)
        found = ArticulatedFit.at(problem, (gear,), np.append(np.zeros(len(problem.nominal)), eta))
        assert sound(problem, replace(found, log_posterior=0.0)) is whole


def test_what_is_moved_together_is_held_back_together(servo):
    problem = problem_of(servo)
    most = problem.settings.articulated.judgement.strained
    names = [entry.name for entry in problem.nominal]
    mass, gain = names.index("mass:arm"), names.index("kp:drive")
    vector = np.zeros(len(names))
    vector[mass] = 2.0 * most
    vector[gain] = (
        2.0 * most * 0.02 / 0.05
    )  # a servo as much stiffer holds an arm that much heavier where it was
    far = ArticulatedFit.at(problem, (), vector)
    clipped = ArticulatedFit.at(problem, (), np.clip(vector, -most, most))
    near = believable(problem, far)
    assert np.abs(near.vector).max() <= most
    assert near.misfit.sum() < clipped.misfit.sum()
    assert believable(problem, near) is near
    judge = Judge(problem, problem)
    floor = np.zeros(1)
    assert judge.believed(far) is judge.believed(far)
    np.testing.assert_array_equal(
        judge.predict(far, floor).power, judge.predict(judge.believed(far), floor).power
    )
    assert judge.predict(far, floor).discrepancy[0] < judge.predict(clipped, floor).discrepancy[0]
