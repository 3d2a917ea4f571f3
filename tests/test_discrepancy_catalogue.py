"""The rarer half of the catalogue: what is planted is named, and nothing of it is seen where nothing was planted."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from planted_cases import (
    BASE_DAMPING,
    BASE_MASS,
    BASE_STIFFNESS,
    CARRIED_FREQUENCY,
    CARRIED_MASS,
    CARRIED_RATIO,
    DAMPING,
    MASS,
    SAMPLE_RATE,
    STIFFNESS,
    base_motion,
    carried_motion,
    degraded,
    linear_motion,
    load,
    motion_with,
    pinched,
    planted_case,
)
from scipy.signal import lsim

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.case.channel_noise import quantisation_step, raised_noise
from bench.discrepancy.effects.catalogue import CATALOGUE, effect_named
from bench.discrepancy.effects.channel_operators import high_pass, low_pass, second_order_low_pass
from bench.discrepancy.effects.effect import unit_of
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.settings import DiagnosisSettings
from bench.laws import LAWS
from bench.laws.evaluate import evaluate


def named(case, *rivals, most=1):
    """Verdict with a part of the catalogue: the rivals that could take an effect's place; a wrong sign does not stop it."""
    chosen = [effect_named(name) for name in rivals]
    return diagnose(case, catalogue=chosen, most=most, anyway=True).verdict


def estimate(verdict, parameter):
    return verdict.named[0].parameters[parameter].value


def test_names_are_single_and_units_can_be_printed():
    names = [effect.name for effect in CATALOGUE]
    assert len(set(names)) == len(names)
    for effect in CATALOGUE:
        for parameter in effect.parameters:
            assert parameter.unit or unit_of(parameter.scale, "m", "N")


@pytest.mark.slow
def test_nothing_is_seen_in_a_clean_record():
    verdict = diagnose(planted_case()).verdict
    assert verdict.verdict == "none"
    assert verdict.named == ()
    assert verdict.warnings == ()


@pytest.mark.slow
def test_a_gap_with_two_different_sides_is_named():
    def sides(x, v, z):
        return 900.0 * max(x - 0.004, 0.0) - 450.0 * max(-x - 0.007, 0.0), []

    verdict = named(
        planted_case(lambda f: motion_with(f, sides)),
        "asymmetric_gap", "gap", "one_sided_stop", "cubic_stiffness", "quadratic_stiffness",
    )  # fmt: skip
    assert [e.name for e in verdict.named] == ["asymmetric_gap"]
    # noise of 1e-4 m over some dozen contacts: 2e-5 m, half a percent
    assert estimate(verdict, "clearance_positive") == pytest.approx(0.004, rel=0.05)
    assert estimate(verdict, "clearance_negative") == pytest.approx(0.007, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("pitch", [0.012, 0.004])
def test_cogging_is_named_with_its_pitch(pitch):
    """Some seven teeth in the stroke, and twenty, of which a sample at full speed passes over more than one."""

    def teeth(x, v, z):
        return 1.5 * math.sin(2.0 * math.pi * x / pitch), []

    verdict = named(
        planted_case(lambda f: motion_with(f, teeth)), "cogging", "cubic_stiffness", "coulomb_friction", "gap"
    )
    assert [e.name for e in verdict.named] == ["cogging"]
    assert estimate(verdict, "period") == pytest.approx(pitch, rel=0.02)
    assert estimate(verdict, "sine") == pytest.approx(1.5, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "effect", "hidden"), [("degrading_hysteresis", degraded, 2), ("pinching_hysteresis", pinched, 1)]
)
def test_hysteresis_that_changes_or_pinches_is_named(name, effect, hidden):
    verdict = named(
        planted_case(lambda f: motion_with(f, effect, hidden)),
        "degrading_hysteresis", "pinching_hysteresis", "bouc_wen_hysteresis", "presliding_friction",
    )  # fmt: skip
    assert [e.name for e in verdict.named] == [name]


@pytest.mark.slow
def test_slack_hysteresis_is_pinched_from_the_first_motion_on():
    verdict = named(planted_case(lambda f: motion_with(f, pinched, 1)), "pinching_hysteresis")
    # noise of 1e-4 m under motions of 1e-2 m, two hundred times the samples of a cycle: a few per cent
    assert estimate(verdict, "severity") == pytest.approx(0.8, rel=0.05)
    assert estimate(verdict, "level") == pytest.approx(0.1, abs=0.02)
    assert verdict.gap.after < 1.05 * verdict.gap.noise_floor


@pytest.mark.slow
def test_a_base_on_a_spring_is_named_with_its_frequency():
    verdict = named(
        planted_case(base_motion),
        "base_flexibility", "viscoelastic_relaxation", "stiffness_error", "mass_error", "acceleration_delay",
    )  # fmt: skip
    assert [e.name for e in verdict.named] == ["base_flexibility"]
    frequency = math.sqrt((STIFFNESS + BASE_STIFFNESS) / BASE_MASS) / (2.0 * math.pi)
    assert estimate(verdict, "frequency") == pytest.approx(frequency, rel=0.05)
    assert estimate(verdict, "stiffness_loss") == pytest.approx(
        STIFFNESS**2 / (STIFFNESS + BASE_STIFFNESS), rel=0.3
    )


@pytest.mark.slow
def test_a_part_of_the_mass_on_a_spring_is_named_with_its_share():
    verdict = named(
        planted_case(carried_motion),
        "carried_mass", "base_flexibility", "viscoelastic_relaxation", "mass_error", "stiffness_error", "acceleration_delay",
    )  # fmt: skip
    assert [e.name for e in verdict.named] == ["carried_mass"]
    assert estimate(verdict, "share") == pytest.approx(CARRIED_MASS / MASS, rel=0.05)
    assert estimate(verdict, "frequency") == pytest.approx(CARRIED_FREQUENCY, rel=0.01)
    assert estimate(verdict, "damping_ratio") == pytest.approx(CARRIED_RATIO, rel=0.2)
    assert verdict.gap.after < 1.05 * verdict.gap.noise_floor


def test_the_law_of_a_carried_mass_is_the_difference_of_two_linear_systems():
    """Along the exact motion: what the mass takes, less its share of a rigid one's inertia, is what the nominal model lacks."""
    force = load(3, 3000)
    x, a = carried_motion(force)
    # trapezoidal integration of the exact acceleration, see below
    v = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]))]) / SAMPLE_RATE
    law = LAWS["carried_mass"]
    theta = law.theta(mass=CARRIED_MASS, frequency=CARRIED_FREQUENCY, damping_ratio=CARRIED_RATIO)
    t = np.arange(len(force)) / SAMPLE_RATE
    taken = np.ravel(evaluate(law, theta, t, x, v).force)
    lacking = force - MASS * a - STIFFNESS * x - DAMPING * v
    np.testing.assert_allclose(taken - CARRIED_MASS * a, lacking, atol=0.01 * np.abs(lacking).max())


def test_a_carried_mass_is_looked_for_where_a_mass_moves_in_the_room():
    effect = effect_named("carried_mass")
    case = planted_case()
    structure = structure_of(case, settings=DiagnosisSettings())
    assert [p.place for p in placements(case, structure, [effect])] == list(structure.places)
    base = Observer("base", 0, np.array([1.0]))
    assert placements(case, replace(structure, prescribed=(base,)), [effect]) == []
    (place,) = structure.places
    relative = replace(structure, places=(replace(place, rows=0.5 * place.rows),))
    assert placements(case, relative, [effect]) == []


def test_the_law_of_a_flexible_base_is_the_difference_of_two_linear_systems():
    """Along the exact motion: k x + c v plus the law is the force that the sprung base really lets through."""
    force = load(3, 3000)
    x, a = base_motion(force)
    # trapezoidal integration of the exact acceleration: relative error (omega h)^2/12, 3e-4 at 5 Hz and 500 Hz
    v = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]))]) / SAMPLE_RATE
    law = LAWS["base_flexibility"]
    kappa = STIFFNESS**2 / (STIFFNESS + BASE_STIFFNESS)
    omega = math.sqrt((STIFFNESS + BASE_STIFFNESS) / BASE_MASS)
    theta = law.theta(
        stiffness_loss=kappa,
        frequency=omega / (2.0 * math.pi),
        damping_ratio=(DAMPING + BASE_DAMPING) / (2.0 * omega * BASE_MASS),
        lead=DAMPING / STIFFNESS,
    )
    t = np.arange(len(force)) / SAMPLE_RATE
    extra = np.ravel(evaluate(law, theta, t, x, v).force)
    through = force - MASS * a
    np.testing.assert_allclose(
        STIFFNESS * x + DAMPING * v + extra, through, atol=0.01 * np.abs(through).max()
    )


SENSORS = (
    "displacement_crosstalk", "acceleration_crosstalk", "displacement_polarity", "acceleration_polarity",
    "displacement_gain_error", "acceleration_gain_error", "displacement_bias", "acceleration_bias",
    "displacement_clipping", "acceleration_clipping", "displacement_delay", "acceleration_delay",
    "displacement_lag", "acceleration_lag", "displacement_filter", "acceleration_filter",
    "displacement_high_pass", "acceleration_high_pass",
)  # fmt: skip


def through(numerator, denominator, x):
    """What an analogue filter makes of a signal."""
    return lsim((numerator, denominator), x, np.arange(len(x)) / SAMPLE_RATE)[1]


def filtered(x, tau):
    """What an amplifier with a low-pass of first order makes of a signal."""
    return through([1.0], [tau, 1.0], x)


def butterworth(x, cutoff):
    """What an anti-alias filter makes of a signal."""
    w = 2.0 * np.pi * cutoff
    return through([w * w], [1.0, math.sqrt(2.0) * w, w * w], x)


def ac_coupled(x, corner):
    """What a coupling that lets no constant through makes of a signal."""
    return through([1.0, 0.0], [1.0, 2.0 * np.pi * corner], x)


@pytest.mark.parametrize(
    ("filter_of", "analogue", "frequency"),
    [(second_order_low_pass, butterworth, 40.0), (high_pass, ac_coupled, 0.8)],
)
def test_filters_of_a_sensor_are_exact_between_samples(filter_of, analogue, frequency):
    x = np.sin(np.arange(500) / 7.0)
    np.testing.assert_allclose(
        filter_of(x, np.array([frequency]), 1.0 / SAMPLE_RATE), analogue(x, frequency), atol=1e-9
    )


def test_a_low_pass_of_second_order_starts_at_the_first_sample_and_a_high_pass_lets_no_constant_through():
    x, step = np.full(4000, 3.0), 1.0 / SAMPLE_RATE
    np.testing.assert_allclose(second_order_low_pass(x, np.array([40.0]), step), x)
    assert abs(high_pass(x, np.array([5.0]), step)[-1]) < 1e-6


def test_a_low_pass_starts_at_the_first_sample_and_is_exact_between_samples():
    x = np.sin(np.arange(500) / 7.0)
    np.testing.assert_allclose(
        low_pass(x, np.array([0.006]), 1.0 / SAMPLE_RATE), filtered(x, 0.006), atol=1e-12
    )
    np.testing.assert_allclose(low_pass(x + 3.0, np.array([0.006]), 1.0 / SAMPLE_RATE)[:1], x[:1] + 3.0)


@pytest.mark.parametrize(
    ("name", "measured"),
    [
        ("displacement_lag", lambda x, a, f: (filtered(x, 0.01), a)),
        ("acceleration_lag", lambda x, a, f: (x, filtered(a, 0.01))),
        ("displacement_filter", lambda x, a, f: (butterworth(x, 8.0), a)),
        ("acceleration_filter", lambda x, a, f: (x, butterworth(a, 30.0))),
        ("displacement_high_pass", lambda x, a, f: (ac_coupled(x, 0.5), a)),
        ("acceleration_high_pass", lambda x, a, f: (x, ac_coupled(a, 0.5))),
        ("displacement_crosstalk", lambda x, a, f: (x + 5e-5 * f, a)),
        ("acceleration_crosstalk", lambda x, a, f: (x, a + 0.05 * f)),
        ("displacement_polarity", lambda x, a, f: (-x, a)),
        ("acceleration_polarity", lambda x, a, f: (x, -a)),
        ("displacement_clipping", lambda x, a, f: (np.clip(x, -0.01, 0.01), a)),
        ("acceleration_clipping", lambda x, a, f: (x, np.clip(a, -8.0, 8.0))),
        ("displacement_bias", lambda x, a, f: (x + 0.002, a)),
        ("acceleration_bias", lambda x, a, f: (x, a + 0.3)),
    ],
)
def test_faults_of_a_sensor_are_named(name, measured):
    verdict = named(planted_case(measured=measured), *SENSORS)
    assert [e.name for e in verdict.named] == [name]
    assert verdict.named[0].channel.startswith(name.split("_", maxsplit=1)[0])


@pytest.mark.parametrize(
    ("name", "driven"),
    [
        ("force_polarity", lambda f: linear_motion(-f)),
        ("actuator_saturation", lambda f: linear_motion(np.clip(f, -10.0, 10.0))),
    ],
)
def test_faults_of_an_actuator_are_named(name, driven):
    rivals = ("force_polarity", "actuator_saturation", "force_gain_error", "actuator_delay", "actuator_lag")
    verdict = named(planted_case(driven, role="command"), *rivals)
    assert [e.name for e in verdict.named] == [name]


@pytest.mark.parametrize("channel", ["displacement", "acceleration"])
def test_a_coarse_converter_is_read_off_the_samples(channel):
    case = planted_case()
    step = {"displacement": 1e-3, "acceleration": 0.8}[channel]
    records = []
    for record in (*case.identification, *case.validation):
        values = dict(record.values) | {channel: step * np.round(record.values[channel] / step)}
        records.append(type(record)(record.name, record.step, record.start, values))
    coarse = type(case)(case.name, case.rig, case.parameters, case.channels, (records[0],), (records[1],))
    verdict = named(coarse, f"{channel}_quantisation", *SENSORS)
    assert verdict.verdict == "effect"
    assert [e.name for e in verdict.named] == [f"{channel}_quantisation"]
    assert estimate(verdict, "step") == pytest.approx(step, rel=1e-6)
    assert verdict.gap.after < 1.2 * verdict.gap.noise_floor  # the floor includes the step


def test_a_lattice_is_seen_through_the_rounding_of_a_text_file_and_not_elsewhere():
    rng = np.random.default_rng(3)
    x = rng.standard_normal(4000)
    printed = np.array([float(f"{v:.8g}") for v in 0.0123 * np.round(x / 0.0123)])
    assert quantisation_step(printed) == pytest.approx(0.0123, rel=1e-6)
    assert quantisation_step(x) == 0.0
    assert quantisation_step(np.sign(x)) == 0.0
    assert raised_noise(1e-3, printed) == pytest.approx(math.hypot(1e-3, 0.0123 / math.sqrt(12.0)))
    assert raised_noise(0.1, printed) == 0.1


def test_a_wrong_inertia_is_asked_for_once_at_the_innermost_joint_that_moves_it(tmp_path):
    """A disc on a shaft turns with both joints: its inertia is one number, and one candidate."""
    (tmp_path / "discs.xml").write_text(
        """<mujoco><option gravity="0 0 0"/><worldbody><body name="flywheel">
        <joint name="bearing" type="hinge" axis="0 0 1" stiffness="300" damping="0.6"/>
        <inertial pos="0 0 0" mass="6" diaginertia="0.03 0.03 0.05"/>
        <body name="disc"><joint name="coupling" type="hinge" axis="0 0 1" stiffness="240" damping="0.4"/>
        <inertial pos="0 0 0" mass="3" diaginertia="0.02 0.02 0.03"/></body></body></worldbody>
        <actuator><motor name="motor" joint="bearing"/></actuator></mujoco>""",
        encoding="utf-8",
    )
    told = {
        "rig": "discs.xml",
        "sample_rate_hz": 500,
        "parameters": {
            "inertia:flywheel": {"value": 0.05, "std": 0.001, "unit": "kg m^2"},
            "inertia:disc": {"value": 0.03, "std": 0.001, "unit": "kg m^2"},
        },
        "channels": {
            "torque": {"unit": "N m", "role": "measured", "actuator": "motor", "noise_std": 0.01},
            "speed": {"unit": "rad/s", "joint": "bearing", "quantity": "velocity", "noise_std": 0.01},
        },
    }
    (tmp_path / "nominal.json").write_text(json.dumps(told), encoding="utf-8")
    for name in ("identification", "validation"):
        np.savetxt(
            tmp_path / f"{name}.csv", np.zeros((500, 2)), delimiter=",", header="torque,speed", comments=""
        )
    case = read_case(tmp_path)
    structure = structure_of(case)
    found = placements(case, structure, [effect_named("mass_error")])
    assert [(p.place.name, p.target) for p in found] == [
        ("bearing", "inertia:flywheel"),
        ("coupling", "inertia:disc"),
    ]
    assert names(tuple(found[1:])) == "mass_error (coupling: inertia:disc)"
