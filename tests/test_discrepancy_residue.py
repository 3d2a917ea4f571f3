"""What an explanation leaves: free models that find a force in it, delays of a fraction of a sample, jumps a sample early."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import NOISE, SAMPLE_RATE, bouc_wen_slope, motion_with, planted_case
from sealed_cases import fitted

from bench.discrepancy import diagnose
from bench.discrepancy.effects.catalogue import CATALOGUE, effect_named
from bench.discrepancy.effects.channel_operators import delay, sensor_delay
from bench.discrepancy.effects.nonparametric import CLOSURES
from bench.discrepancy.fitting.fits import Search, integrate_finer
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.judgement.predictive_check import contradicted
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.likelihood.whitening import timed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.screening.candidates import tells_motion
from bench.discrepancy.screening.score_test import LackOfFit, lack_of_fit
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.closures import close
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.search.forward_selection import attribute
from bench.discrepancy.search.rivals import challenge
from bench.discrepancy.settings import DEFAULT

STEP = 1.0 / SAMPLE_RATE


def one_relaxation(x, v, z):
    return z[0], [200.0 * v - z[0] / 0.05]


def a_spectrum_of_relaxations(x, v, z):
    return z[0] + z[1] + z[2], [300.0 * v - z[0] / 0.01, 100.0 * v - z[1] / 0.2, 100.0 * v - z[2] / 2.0]


@pytest.mark.slow
def test_free_models_find_nothing_beside_the_right_law():
    problem, explained = fitted(
        planted_case(lambda f: motion_with(f, one_relaxation, 1)), "viscoelastic_relaxation", [-2.2, -3.0]
    )
    lack = lack_of_fit(problem, explained)
    assert not lack.significant(0.0)
    assert lack.p_value > 1e-3


@pytest.mark.parametrize(("quieter", "refined"), [(300.0, True), (1.0, False)])
def test_integration_is_as_fine_as_the_law_found_needs_it(quieter, refined):
    """A record that is known to some millionths shows where a law switches between two steps; usual noise hides it."""
    noise = {name: level / quieter for name, level in NOISE.items()}
    case = planted_case(noise=noise | {"force": 0.0})
    problem = Problem(case, structure_of(case), case.identification)
    law = placements(case, problem.structure, [effect_named("bouc_wen_hysteresis")])[0]
    truth = np.array([0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0])
    (record,) = case.identification
    made = problem.finer(16).simulate((law,), truth, record)
    made += problem.noise * np.random.default_rng(0).standard_normal(made.shape)
    values = record.values | dict(zip(problem.structure.channels, made.T, strict=True))
    problem = Problem(case, problem.structure, (replace(record, values=values),))
    search = Search(problem)
    search.add(fit(problem, (law,), start=truth, iterations=30))
    (coarse,) = search.ranked()
    integrate_finer(search)
    (fine,) = search.ranked()
    assert consistent(fine)
    assert (problem.refinement > 1) == refined
    assert consistent(coarse) != refined


def test_one_more_effect_is_screened_along_a_free_run_that_follows_the_motion_and_does_not_stick():
    case = planted_case(lambda f: motion_with(f, one_relaxation, 1))
    problem, relaxing = fitted(case, "viscoelastic_relaxation", [-2.2, -3.0])
    friction = placements(case, problem.structure, [effect_named("coulomb_friction")])
    assert tells_motion(replace(relaxing, chi2=1.5 * relaxing.n_residuals), problem)
    assert not tells_motion(replace(relaxing, chi2=2.5 * relaxing.n_residuals), problem)
    sticking = replace(relaxing, hypothesis=tuple(friction))
    assert not tells_motion(replace(sticking, chi2=1.5 * relaxing.n_residuals), problem)
    assert tells_motion(replace(sticking, chi2=relaxing.n_residuals), problem)


def test_several_effects_are_doubted_sooner_than_one():
    lack = LackOfFit("memory", gain=20.0, freedom=3, expected=3.0, p_value=4e-3, n_residuals=5000)
    assert not lack.significant(0.0)
    assert lack.significant(0.0, effects=2)
    assert not lack.significant(1e6, effects=2)  # laws are held to a hundredth of the force
    assert lack.significant(1e6, effects=3)  # but three of them imitate nearly any


@pytest.mark.slow
def test_forces_of_one_parameter_are_fitted_whatever_others_promise():
    case = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (z[0], [bouc_wen_slope(v, z[0], 900.0, 200.0, 100.0)]), 1)
    )
    problem = Problem(case, structure_of(case), case.identification)
    chosen = placements(case, problem.structure, [e for e in CATALOGUE if e.site == "joint" and not e.rare])
    screen = Screen(problem, chosen)
    gains: dict[str, float] = {}
    for point in screen.ranked():
        gains.setdefault(point.placed.effect.name, point.gain)
    weak = [
        name
        for name, gain in gains.items()
        if DEFAULT.screening.worth_a_fit < gain < 0.05 * max(gains.values())
    ]
    simple = [name for name in weak if len(effect_named(name).parameters) == 1]
    assert simple
    fits = attribute(problem, chosen, most=1).fits.values()
    assert set(simple) <= {f.hypothesis[0].effect.name for f in fits if f.hypothesis}


@pytest.mark.slow
def test_free_models_find_the_memory_that_one_relaxation_lacks():
    case = planted_case(lambda f: motion_with(f, a_spectrum_of_relaxations, 3))
    problem, explained = fitted(case, "viscoelastic_relaxation", [-2.7, -1.9])
    lack = lack_of_fit(problem, explained)
    assert lack.significant(0.0)
    verdict = diagnose(case, catalogue=[effect_named("viscoelastic_relaxation")]).verdict
    assert verdict.verdict == "unknown"


@pytest.mark.slow
def test_a_small_memory_is_screened_behind_a_wrong_gain_of_the_accelerometer():
    case = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (z[0], [60.0 * v - z[0] / 0.05]), 1),
        lambda x, a, f: (x, 1.07 * a),
    )
    problem, explained = fitted(case, "acceleration_gain_error", [0.07])
    memory = placements(case, problem.structure, [effect_named("viscoelastic_relaxation")])
    screen = Screen(problem, memory).beside(explained, simulated=True)
    screened = screen.ranked(explained, screen.ground(explained, simulated=True))[0].gain
    start = np.concatenate([explained.vector, [-3.4, -3.0]])
    found = fit(problem, (*explained.hypothesis, *memory), start=start, iterations=30)
    # on a grid of relaxation times, and to first order
    assert screened == pytest.approx(explained.chi2 - found.chi2, rel=0.2)


@pytest.mark.parametrize("share", [0.1, 0.5, 3.37])
def test_a_delayed_sine_is_the_sine_of_the_delayed_time(share):
    t = STEP * np.arange(2000)
    for frequency in (0.01, 0.2, 0.44):  # of the sample rate
        omega = 2.0 * np.pi * frequency * SAMPLE_RATE
        late = sensor_delay(np.sin(omega * t), np.array([share * STEP]), STEP)
        np.testing.assert_allclose(late[50:-50], np.sin(omega * (t - share * STEP))[50:-50], atol=2e-3)


def test_a_delay_leaves_noise_what_it_was():
    noise = np.random.default_rng(3).standard_normal(20000)
    half = np.array([0.5 * STEP])
    # the interpolation is flat to nine tenths of the Nyquist frequency; that along straight lines halves the power
    assert np.var(sensor_delay(noise, half, STEP)) == pytest.approx(1.0, abs=0.05)
    assert np.var(delay(noise, half, STEP)) == pytest.approx(0.5, abs=0.02)


def test_a_jump_a_sample_early_is_limited_and_nothing_else_is():
    t = STEP * np.arange(500)
    predicted = np.sin(2.0 * np.pi * 3.0 * t) - np.where(t > 0.5, 2.0, 0.0)
    early = predicted.copy()
    jump = int(np.argmax(t > 0.5))
    early[jump - 1] -= 2.0
    noise = 0.01
    limited = timed(early - predicted, predicted, noise)
    assert limited[jump - 1] == pytest.approx(-0.05)
    assert np.all(limited[np.arange(500) != jump - 1] == 0.0)
    # the wrong way, away from a jump, and beyond its height, a residual stays what it is
    for place, wrong in ((jump - 1, 2.0), (100, -2.0), (jump - 1, -2.5)):
        residual = np.zeros(500)
        residual[place] = wrong
        np.testing.assert_array_equal(timed(residual, predicted, noise), residual)


def snap(x, v, z):
    """A negative stiffness within a window about rest, as a buckled leaf gives."""
    u = min(abs(x) / 0.006, 1.0)
    return -700.0 * x * (1.0 - u * u) ** 2, []


def drag(x, v, z):
    """A force of the velocity that levels off and falls again."""
    return 4.0 * v / 0.05 / (1.0 + (v / 0.05) ** 2), []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "hidden", "closure"),
    [
        (snap, 0, "free_displacement"),
        (drag, 0, "free_velocity"),
        (a_spectrum_of_relaxations, 3, "free_memory"),
    ],
)
def test_closures_follow_any_force_of_one_variable_and_any_linear_memory(law, hidden, closure):
    case = planted_case(lambda f: motion_with(f, law, hidden))
    problem = Problem(case, structure_of(case), case.identification)
    nothing = Explanation(((problem, fit(problem, (), start=np.zeros(len(problem.nominal)))),))
    closed, used = close(nothing, nothing, CLOSURES)
    assert closure in used.split(" + ")
    (record,) = case.validation
    before, after = nothing.reduced_on(record), closed.reduced_on(record)
    assert after - 1.0 < 0.05 * (before - 1.0)


@pytest.mark.slow
def test_judging_records_contradict_a_law_that_they_do_not_follow():
    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (1e6 * x**3, [])))
    problem, explained = fitted(case, "cubic_stiffness", [0.05])
    found = Explanation(((problem, explained),))
    assert not contradicted(case, problem, found, np.random.default_rng(1))
    other = planted_case(lambda f: motion_with(f, lambda x, v, z: (12.0 * np.tanh(x / 0.005), [])))
    elsewhere = replace(case, validation=other.validation)
    assert contradicted(elsewhere, problem, found, np.random.default_rng(1))
    # a softening spring that the judging loads tear through does not follow them either
    (record,) = case.validation
    wild = replace(record, values=record.values | {"force": 1e4 * record.values["force"]})
    torn = Explanation(((problem, replace(explained, vector=-explained.vector)),))
    assert not np.isfinite(torn.predict(wild)["displacement"]).all()
    assert contradicted(replace(case, validation=(wild,)), problem, torn, np.random.default_rng(1))


@pytest.mark.slow
def test_a_fit_starts_with_the_nominal_parameters_that_go_with_the_effect():
    problem, explained = fitted(
        planted_case(lambda f: motion_with(f, one_relaxation, 1)), "viscoelastic_relaxation", [-2.2, -3.0]
    )
    (placed,) = explained.hypothesis
    n = len(problem.nominal)
    screen = Screen(problem, [placed])
    ground = screen.ground()
    alone = fit(problem, (), start=np.zeros(n)).vector
    (start,) = screen.starts(Point(placed, 0.0, explained.vector[n:]), ground)
    # what the nominal model alone takes for a stiffness and a damping is off by the relaxation's share of them
    assert np.abs(alone - explained.vector[:n]).max() > 2.0
    assert np.abs(start[:n] - explained.vector[:n]).max() < 0.3


@pytest.mark.slow
def test_an_error_of_mass_shows_behind_a_hysteresis_by_what_its_prior_costs():
    case = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (z[0], [bouc_wen_slope(v, z[0], 900.0, 200.0, 100.0)]), 1)
    )
    mass = case.parameters[0]
    case = replace(case, parameters=(replace(mass, value=1.06 * mass.value), *case.parameters[1:]))
    problem = Problem(case, structure_of(case), case.identification)
    hysteresis = placements(case, problem.structure, [effect_named("bouc_wen_hysteresis")])
    explained = attribute(problem, hysteresis, most=1).ranked()[0]
    error = next(p for p in placements(case, problem.structure, [effect_named("mass_error")]))
    screen = Screen(problem, [error]).beside(explained, simulated=True)
    points = screen.inertia_points(explained, screen.ground(explained, simulated=True))
    screened = next(point.gain for point in points if point.placed.key == error.key)
    start = np.append(explained.vector, 0.0)
    freed = fit(problem, (*explained.hypothesis, error), start=start, iterations=30)
    # the prior of the size of the error costs a unit or two
    assert screened == pytest.approx(explained.cost - freed.cost, rel=0.1, abs=3.0)
    assert screened > 20.0
    # although the hysteresis explains the records, the search goes on to the error
    best = attribute(problem, [*hysteresis, error], most=2).ranked()[0]
    assert {placed.effect.name for placed in best.hypothesis} == {"bouc_wen_hysteresis", "mass_error"}


@pytest.mark.slow
def test_behind_a_sensor_that_clips_an_effect_is_screened_by_its_small_changes():
    def measured(x, a, f):
        return np.clip(x, -0.01, 0.01), a

    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (-3e5 * x**3, [])), measured)
    problem, clipped = fitted(case, "displacement_clipping", [0.0])
    cubic = placements(case, problem.structure, [effect_named("cubic_stiffness")])
    assert clipped.reduced > 1.1
    screen = Screen(problem, cubic).beside(clipped, simulated=False)
    # a unit of the effect would clip all of the motion
    np.testing.assert_allclose(
        screen.effect_response(cubic[0], np.array([1.0])),
        1e3 * screen.effect_response(cubic[0], np.array([1e-3])),
        rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    ground = screen.ground(clipped)
    point = screen.ranked(clipped, ground)[0]
    freed = fit(
        problem, (*clipped.hypothesis, cubic[0]), start=screen.starts(point, ground, clipped), iterations=30
    )
    assert freed.reduced < 1.05
    assert point.gain > 0.5 * (clipped.chi2 - freed.chi2)


def test_the_corners_of_a_delayed_load_move_with_it():
    case = planted_case(role="command")
    problem = Problem(case, structure_of(case), case.identification)
    (record,) = case.identification
    late = placements(case, problem.structure, [effect_named("actuator_delay")])[0]
    eta = np.array([late.effect.parameters[0].mean + 0.3])
    tau = late.effect.values(eta, problem.scales_of(late))[0]
    assert 0.1 < tau / record.step % 1.0 < 0.9
    loads, rows = problem.driving_loads((late,), [eta], record, 1)
    clock = np.arange(len(record)) * record.step
    fine = np.arange(len(loads)) * record.step / rows
    chords = np.interp(fine - tau, clock, record.values["force"], left=0.0)
    sampled = np.interp(fine, clock, delay(record.values["force"], np.array([tau]), record.step))
    inside = slice(rows * int(tau / record.step + 2), None)  # the load may begin with a jump
    error, by_samples = (np.abs(x[inside] - chords[inside]).max() for x in (loads[:, 0], sampled))
    assert error < 2.0 * by_samples / rows  # what is left is a corner's way within an eighth of a sample


def test_a_delayed_load_is_that_of_a_delay_on_samples_where_it_is_held():
    case = replace(planted_case(role="command"), options={"load_interpolation": "zero_order_hold"})
    problem = Problem(case, structure_of(case), case.identification)
    late = placements(case, problem.structure, [effect_named("actuator_delay")])[0]
    loads, rows = problem.driving_loads((late,), [np.zeros(1)], case.identification[0], 1)
    assert (rows, len(loads)) == (0, len(case.identification[0]))


@pytest.mark.parametrize("walls", [(1.0,), (1.0, -1.0)])
def test_a_base_at_the_edge_of_divergence_is_screened_all_the_same(monkeypatch, walls):
    """Columns are taken from the side on which the free run stays finite; where neither does, nothing is known of them."""
    problem, explained = fitted(
        planted_case(lambda f: motion_with(f, lambda x, v, z: (3e5 * x**3, []))), "cubic_stiffness", [0.05]
    )
    plain = Screen(problem, []).ground(explained, simulated=True)
    finite, edge = Problem.residual, explained.vector[-1]

    def diverging(self, hypothesis, vector):
        if any(side * (vector[-1] - edge) > 0.0 for side in walls):
            return np.array([np.inf])
        return finite(self, hypothesis, vector)

    monkeypatch.setattr(Problem, "residual", diverging)
    ground = Screen(problem, []).ground(explained, simulated=True)
    assert np.isfinite(ground.left).all()
    for response in (plain.nominal[:, 0], plain.residual):
        assert np.isfinite(ground.moves(response)).all()
    if walls == (1.0,):  # a column from the other side is the same to first order
        assert np.sum(ground.left**2) == pytest.approx(np.sum(plain.left**2), rel=1e-3)


@pytest.mark.slow
def test_what_is_superfluous_beside_rivals_is_struck():
    """Of a best hypothesis that got there by rivals, as of one that grew effect by effect."""

    def two_forces(x, v, z):
        return 900.0 * (max(x - 0.004, 0.0) + min(x + 0.004, 0.0)) + 10.0 * v * abs(v), []

    case = planted_case(lambda f: motion_with(f, two_forces))
    problem = Problem(case, structure_of(case), case.identification)
    names = ("gap", "quadratic_damping", "cubic_stiffness")
    chosen = placements(case, problem.structure, [effect_named(name) for name in names])
    screen = Screen(problem, chosen)
    search = Search(problem)
    still = np.zeros(len(problem.nominal))
    search.add(fit(problem, (), start=still))
    search.add(fit(problem, tuple(chosen), start=np.append(still, [-0.7, -1.5, -2.0, 0.0]), iterations=60))
    assert len(search.ranked()[0].hypothesis) == 3
    challenge(search, screen)
    best = search.ranked()[0]
    assert {placed.effect.name for placed in best.hypothesis} == {"gap", "quadratic_damping"}
    assert consistent(best)
