"""Motions that a machine prescribes: dwells, reversals, and what the noise leaves open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lsim

from bench.discrepancy.case.case import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.checks.data_quality import notes
from bench.discrepancy.diagnosis import diagnose
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.motion.prescribed import decided, held, prescribed_motion, remembering
from bench.errors import RecordingError

STEP = 0.002
TIME = np.arange(5000) * STEP
STIFFNESS, DAMPING, FRICTION = 4000.0, 150.0, 12.0
NOISE = {"displacement": 2e-5, "force": 0.4}


def strokes(first: float, second: float) -> np.ndarray:
    """Strokes of two rates with a dwell of a second in the middle of every four."""
    phase = 2.0 * np.pi * (first * TIME + second * np.sin(0.3 * TIME))
    hold = (TIME % 4.0 > 1.5) & (TIME % 4.0 < 2.5)
    turning = np.cumsum(np.where(hold, 0.0, np.gradient(phase)))
    return 0.01 * np.convolve(np.sin(turning), np.hanning(201) / np.hanning(201).sum(), mode="same")


def case(
    rng: np.random.Generator,
    *,
    friction: float = 0.0,
    quadratic: float = 0.0,
    late: float = 0.0,
    known: float = 1.0,
) -> Case:
    """A component on a machine; its force is logged `late` samples after the displacement, its parameters `known` times less well."""
    records = []
    for name, measured in (("identification", strokes(0.8, 0.3)), ("validation", strokes(1.1, 0.5))):
        x = CubicSpline(TIME, measured)(TIME - late * STEP)
        v = np.gradient(x, STEP)
        direction = np.sign(v)
        for k in range(1, len(v)):  # set-valued: at rest the force of the last slip is held
            direction[k] = np.sign(v[k]) if abs(v[k]) > 1e-9 else direction[k - 1]
        clean = {
            "displacement": measured,
            "force": STIFFNESS * x + DAMPING * v + friction * direction + quadratic * v * np.abs(v),
        }
        noisy = {k: y + NOISE[k] * rng.standard_normal(len(y)) for k, y in clean.items()}
        records.append(record_from_arrays(name, TIME, noisy))
    channels = (
        CaseChannel("displacement", "m", "prescribed", NOISE["displacement"]),
        CaseChannel("force", "N", "response", NOISE["force"]),
    )
    parameters = (
        NominalParameter("stiffness", (1.0 + 0.01 * known) * STIFFNESS, 0.02 * known * STIFFNESS, "N/m"),
        NominalParameter("damping", (1.0 - 0.03 * known) * DAMPING, 0.05 * known * DAMPING, "N s/m"),
    )
    return Case("machine", "damper", parameters, channels, (records[0],), (records[1],))


def test_dry_friction_is_found_through_dwells_and_noise(rng: np.random.Generator) -> None:
    verdict = diagnose(case(rng, friction=FRICTION)).verdict
    (effect,) = verdict.named
    assert effect.name == "coulomb_friction"
    estimate = effect.parameters["friction_force"]
    assert (
        abs(estimate.value - FRICTION) < 5.0 * estimate.std
    )  # 5 sigma: the noise of the motion is counted to first order
    assert verdict.gap.closed > 0.8


def test_delay_between_force_and_motion_is_told_beside_friction(rng: np.random.Generator) -> None:
    """Of two transducers one is logged later; parameters that are known well do not take it up."""
    verdict = diagnose(case(rng, friction=FRICTION, late=2.0, known=0.02)).verdict
    delay = next(effect for effect in verdict.named if effect.name != "coulomb_friction")
    assert len(verdict.named) == 2
    assert (delay.name, delay.channel) == ("force_delay", "force")
    told = delay.parameters["delay"]
    assert abs(told.value - 2.0 * STEP) < 5.0 * told.std  # the noise of the motion is counted to first order


@pytest.mark.parametrize("late", [0.6, -0.6])
def test_parts_of_a_sample_are_measured_though_friction_turns_within_one(
    rng: np.random.Generator, late: float
) -> None:
    known = case(rng, friction=FRICTION, late=late, known=0.02)
    problem = Problem(known, structure_of(known), known.identification)
    catalogue = [effect_named(name) for name in ("coulomb_friction", "force_delay", "displacement_delay")]
    friction, *delays = placements(known, problem.structure, catalogue)
    late_force, late_motion = (
        fit(problem, (friction, delay), start=np.array([0.0, 0.0, 0.0, np.log(STEP)]), iterations=30)
        for delay in delays
    )
    right, wrong = (late_force, late_motion) if late > 0.0 else (late_motion, late_force)
    assert right.chi2 < wrong.chi2
    assert right.reduced == pytest.approx(1.0, abs=0.05)
    # the logarithm of the delay, and 5 sigma for the same reason
    assert abs(right.vector[-1] - np.log(abs(late) * STEP)) < 5.0 * np.sqrt(right.covariance[-1, -1])


def test_noise_of_the_motion_is_counted_as_a_law_found_passes_it_on(rng: np.random.Generator) -> None:
    """At full speed this damper makes some thirty times as much of the noise of the motion as the nominal one."""
    known = case(rng, quadratic=40000.0)
    problem = Problem(known, structure_of(known), known.identification)
    placed = Placed(effect_named("quadratic_damping"), problem.structure.places[0])
    fitted = fit(problem, (placed,), start=np.zeros(3), iterations=30)
    assert not consistent(fitted)  # the right law, refuted by noise that it makes itself
    behind = problem.behind(fitted.hypothesis, fitted.vector)
    left = behind.residual(fitted.hypothesis, fitted.vector)
    # that noise comes in bursts, at full speed, so chi-squared scatters by some 2 to 3 % between draws
    assert left @ left / behind.n_residuals == pytest.approx(1.0, abs=0.1)
    assert fitted.reduced > 1.4
    verdict = diagnose(known).verdict
    (effect,) = verdict.named
    assert effect.name == "quadratic_damping"


def test_a_component_as_modelled_raises_no_alarm(rng: np.random.Generator) -> None:
    assert diagnose(case(rng, friction=0.0)).verdict.verdict == "none"


def test_reversals_smaller_than_the_noise_do_not_count() -> None:
    position = np.array([0.0, 1.0, 2.0, 1.9, 2.0, 1.9, 3.0, 2.0, 1.0])
    velocity = np.array([1.0, 1.0, 0.5, -0.1, 0.1, -0.1, 1.0, -1.0, -1.0])
    out = held(position, velocity, 0.5)
    assert np.array_equal(np.sign(out), [1, 1, 1, 1, 1, 1, 1, -1, -1])
    kept = [0, 1, 2, 4, 6, 7, 8]
    assert np.array_equal(out[kept], velocity[kept])


def test_a_component_remembers_where_it_stood_until_it_was_dragged_both_ways() -> None:
    t = np.linspace(0.0, 10.0, 5001)
    # reversals at pi/2 and 3 pi/2 of the phase
    until = remembering(0.01 * (1.0 + t) * np.sin(2.0 * np.pi * t))
    assert t[until] == pytest.approx(0.75, abs=0.05)
    assert remembering(np.sin(2.0 * np.pi * t) + 1e-3 * np.sin(300.0 * t)) == pytest.approx(until, abs=30)
    # no reversals, or so late that hardly anything would be left
    assert remembering(t) == 0
    assert remembering(np.sin(2.0 * np.pi * 0.1 * t)) == 0


def test_what_a_loop_was_before_its_record_is_held_against_no_law(rng: np.random.Generator) -> None:
    known = case(rng)
    x = known.identification[0].values["displacement"]
    until = remembering(x)
    problem = Problem(known, structure_of(known), known.identification)
    (data,) = problem.data
    assert data.compared is not None
    assert not data.compared[:until].any()
    assert data.compared[until : until + 500].any()


def test_channels_of_a_prescribed_motion_are_held_against_one_another(rng: np.random.Generator) -> None:
    known = case(rng)
    records = []
    for record in (*known.identification, *known.validation):
        v = np.gradient(record.values["displacement"], STEP)
        smooth = np.convolve(v, np.ones(25) / 25.0, mode="same")
        late = np.interp(record.time - 0.02, record.time, smooth)
        records.append(record_from_arrays(record.name, record.time, {**record.values, "velocity": late}))
    channels = (*known.channels, CaseChannel("velocity", "m/s", "prescribed", 2e-3))
    both = replace(known, channels=channels, identification=(records[0],), validation=(records[1],))
    said = notes(both, Problem(both, structure_of(both), both.identification))
    assert any("'velocity' lags 'displacement' by" in note for note in said)


def test_only_reversals_and_dwells_are_in_doubt(rng: np.random.Generator) -> None:
    known = case(rng, friction=FRICTION)
    record = known.identification[0]
    prescribed = prescribed_motion(known, record, 8)
    compared = decided(prescribed)
    assert compared is not None
    true = np.gradient(strokes(0.8, 0.3), STEP)
    fast = np.abs(true) > 0.3 * np.abs(true).max()
    fast[: remembering(prescribed.motion.position[:, 0])] = False
    assert compared[fast].mean() > 0.99
    assert compared[np.abs(true) < 1e-9].mean() < 0.2
    # a smoother knows one side of the first samples only: nothing is compared there
    assert not compared[:3].any()
    assert not compared[-3:].any()
    # drawn errors are as large as the one that was made, to within the spread of some hundred independent values
    motion, draws = prescribed
    made = motion.velocity[:, 0] - true
    drawn = [draw.velocity[:, 0] - motion.velocity[:, 0] for draw in draws]
    assert 0.5 < np.std(np.array(drawn)[:, 200:-200]) / np.std(made[200:-200]) < 2.0


@pytest.mark.parametrize("position", [0.0, 3e-3])
def test_a_motion_that_stands_still_is_said_to_excite_nothing(
    rng: np.random.Generator, position: float
) -> None:
    known = case(rng, friction=FRICTION)
    (record,) = known.identification
    still = replace(record, values=record.values | {"displacement": np.full(len(TIME), position)})
    with pytest.raises(RecordingError, match="'displacement' never changes"):
        diagnose(replace(known, identification=(still,)))


def test_hysteresis_that_a_weak_spring_does_not_measure_is_found(rng: np.random.Generator) -> None:
    """A magnetorheological damper: its hysteresis is two hundred times as stiff as the spring beside it."""
    A, beta, gamma, spring = 120000.0, 900.0, 500.0, 600.0
    records = []
    for name, x in (("identification", strokes(0.8, 0.3)), ("validation", strokes(1.1, 0.5))):
        v, z, force = np.gradient(x, STEP), 0.0, np.zeros(len(x))
        for k in range(len(x)):
            force[k] = z + spring * x[k] + DAMPING * v[k]
            for _ in range(20):  # a yield within 1 mm at 0.1 m/s takes 10 ms
                z += STEP / 20 * (A * v[k] - beta * abs(v[k]) * z - gamma * v[k] * abs(z))
        noisy = {
            "displacement": x + 2e-5 * rng.standard_normal(len(x)),
            "force": force + rng.standard_normal(len(x)),
        }
        records.append(record_from_arrays(name, TIME, noisy))
    channels = (CaseChannel("displacement", "m", "prescribed"), CaseChannel("force", "N", "response"))
    parameters = (
        NominalParameter("stiffness", 1.05 * spring, 0.1 * spring, "N/m"),
        NominalParameter("damping", 0.9 * DAMPING, 0.3 * DAMPING, "N s/m"),
    )
    own = Case("damper", "damper", parameters, channels, (records[0],), (records[1],))
    names = ("bouc_wen_hysteresis", "backlash_friction", "coulomb_friction", "force_offset")
    verdict = diagnose(own, catalogue=[effect_named(name) for name in names]).verdict
    (effect,) = verdict.named
    assert effect.name == "bouc_wen_hysteresis"
    stiffness = effect.parameters["A"]
    assert abs(stiffness.value - A) < 3.0 * stiffness.std < A
    assert verdict.gap.closed > 0.9


def test_a_charge_amplifier_that_forgets_what_is_slow_is_a_filter_of_the_force():
    clean = case(np.random.default_rng(11))

    def forgetful(record):
        force = lsim(([1.0, 0.0], [1.0, 2.0 * np.pi * 0.5]), record.values["force"], TIME)[1]
        return record_from_arrays(record.name, TIME, dict(record.values) | {"force": force})

    amplified = replace(
        clean,
        identification=tuple(map(forgetful, clean.identification)),
        validation=tuple(map(forgetful, clean.validation)),
    )
    verdict = diagnose(amplified).verdict
    assert [e.name for e in verdict.named] == ["force_high_pass"]
    assert verdict.named[0].parameters["corner"].value == pytest.approx(0.5, rel=0.02)
