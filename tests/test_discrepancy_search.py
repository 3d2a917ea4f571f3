"""The parts of the search: minimisation, exact linear runs, whitening, refinement of starts."""

from __future__ import annotations

import numpy as np
import pytest
from planted_cases import motion_with, planted_case
from scipy.optimize import least_squares

from bench.discrepancy import BlindOptions
from bench.discrepancy.blind.protocol import draw_case
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.fits import converge
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.numerics.least_squares import Prior, minimise
from bench.discrepancy.numerics.spectral_product import whiten
from bench.discrepancy.screening.candidates import refined
from bench.discrepancy.screening.linear_amplitudes import (
    LINEAR_AMPLITUDES_SETTINGS,
    products,
)
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.forward_selection import prepare
from bench.discrepancy.search.rivals import divide, simplify
from bench.discrepancy.simulation.linear_response import linear_run
from bench.discrepancy.simulation.stick_slip import NO_ELEMENTS, StructureMatrices, free_run

TIME = np.linspace(0.0, 3.0, 200)
DATA = 2.0 * np.exp(-1.3 * TIME) * np.cos(4.0 * TIME)


def residual(x: np.ndarray) -> np.ndarray:
    return (x[0] * np.exp(-x[1] * TIME) * np.cos(x[2] * TIME) - DATA) / 0.05


def broad(n: int) -> Prior:
    return Prior(np.zeros(n), np.full(n, 10.0), np.full(n, -np.inf), np.full(n, np.inf))


def search(start, prior, **options):
    free = np.arange(len(start))
    return minimise(
        residual,
        np.array(start),
        prior=prior,
        free=free,
        reach=np.full(len(free), 2.0),
        iterations=40,
        **options,
    )


def test_minimum_and_curvature_agree_with_another_optimiser():
    prior = broad(3)
    found = search([1.0, 1.0, 3.8], prior, tolerance=1e-6)
    other = least_squares(
        lambda x: np.concatenate([residual(x), (x - prior.mean) / prior.std]), [1.0, 1.0, 3.8], xtol=1e-12
    )
    assert found.settled
    np.testing.assert_allclose(found.vector, other.x, rtol=1e-4)  # forward differences
    scaled = other.jac.T @ other.jac * np.outer(prior.std, prior.std)
    np.testing.assert_allclose(found.curvature, scaled, rtol=2e-2, atol=1e-3 * np.abs(scaled).max())


def test_a_minimum_on_a_bound_is_found_and_ends_the_iteration():
    # just short of the true 1.3: residuals far above the noise are not followed to their minimum
    prior = broad(3)._replace(high=np.array([np.inf, 1.29, np.inf]))
    found = search([1.0, 0.5, 3.8], prior)
    assert found.settled
    assert found.vector[1] == 1.29
    free = least_squares(lambda x: residual(np.array([x[0], 1.29, x[1]])), [1.0, 3.8]).x
    np.testing.assert_allclose(
        found.vector[[0, 2]], free, rtol=1e-3
    )  # the prior's pull, and forward differences


def test_a_minimisation_without_prospects_is_given_up():
    calls = []

    def stubborn(x: np.ndarray) -> np.ndarray:
        calls.append(1)
        return np.append(residual(x), 400.0)

    options = {"prior": broad(3), "free": np.arange(3), "reach": np.full(3, 0.02), "iterations": 200}
    given_up = minimise(stubborn, np.array([1.0, 1.0, 3.0]), limit=1e3, **options)
    few = len(calls)
    minimise(stubborn, np.array([1.0, 1.0, 3.0]), **options)
    assert not given_up.settled
    assert few < 0.7 * (len(calls) - few)  # without the limit it goes on to the minimum


def test_a_cost_that_is_rough_on_a_small_scale_is_followed_by_coarse_differences():
    def stairs(x: np.ndarray) -> np.ndarray:
        return residual(np.round(x / 0.005) * 0.005)  # flat between the steps

    options = {"prior": broad(3), "free": np.arange(3), "reach": np.full(3, 2.0), "iterations": 40}
    start = np.array([1.9, 1.2, 3.95])
    found = minimise(stairs, start, **options)
    assert float(stairs(start) @ stairs(start)) > 50.0
    # two steps of the stairs from the smooth minimum, 0, leave as much
    assert float(found.residual @ found.residual) < 5.0
    np.testing.assert_array_equal(minimise(stairs, start, exact=False, **options).vector, start)


def test_a_start_that_diverges_has_infinite_cost():
    found = minimise(
        lambda x: np.array([np.inf]),
        np.zeros(2),
        prior=broad(2),
        free=np.arange(2),
        reach=np.ones(2),
        iterations=5,
    )
    assert found.cost == np.inf


def test_slopes_whose_squares_overflow_end_a_minimisation_where_it_is():
    def steep(x: np.ndarray) -> np.ndarray:
        return 1e152 * np.cos(1e8 * x)

    start = np.array([0.3])
    found = minimise(steep, start, prior=broad(1), free=np.arange(1), reach=np.ones(1), iterations=5)
    np.testing.assert_array_equal(found.vector, start)
    assert np.isfinite(found.cost)
    assert np.isfinite(found.curvature).all()
    assert not found.settled


@pytest.mark.parametrize("factor", [0, 1, 2])
def test_exact_linear_runs_agree_with_the_integrator(factor):
    rng = np.random.default_rng(3)
    structure = StructureMatrices(
        np.diag([1.0, 2.5]), np.array([[1.2, -0.4], [-0.4, 2.0]]), np.array([[900.0, -300.0], [-300.0, 1500.0]]),
        np.eye(2),
    )  # fmt: skip
    loads = rng.normal(size=(500 * max(factor, 1) + 1, 2))
    start = np.array([0.01, -0.02, 0.1, 0.3])
    exact = linear_run(structure, loads=loads, step=2e-3, load_factor=factor, start=start)
    stepped = free_run(
        structure, NO_ELEMENTS, loads=loads, step=2e-3, substeps=4, load_factor=factor, start=start
    )
    for a, b in zip(exact, stepped, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7 * np.abs(b).max())  # RK4 with omega h = 0.02


def test_restarts_are_runs_of_their_own():
    structure = StructureMatrices(np.eye(1), np.full((1, 1), 0.3), np.full((1, 1), 80.0), np.eye(1))
    loads = np.random.default_rng(1).normal(size=(300, 1))
    whole = linear_run(structure, loads=loads, step=5e-3, restarts=np.array([120]))
    second = linear_run(structure, loads=loads[120:], step=5e-3)
    np.testing.assert_allclose(whole.position[120:], second.position, rtol=1e-12, atol=1e-15)


def test_whitening_is_the_matrix_product():
    rng = np.random.default_rng(0)
    factor = np.tril(rng.normal(size=(7, 3, 3)) + 1j * rng.normal(size=(7, 3, 3)))
    spectrum = rng.normal(size=(7, 3)) + 1j * rng.normal(size=(7, 3))
    product = np.einsum("kij,kj->ki", factor, spectrum)
    np.testing.assert_allclose(whiten(spectrum, factor), [product.real, product.imag], rtol=1e-12)


@pytest.mark.slow
def test_refinement_along_the_measured_motion_nears_the_truth_without_a_nonlinear_run():
    options = BlindOptions(
        shares=(0.0, 1.0, 0.0, 0.0), effects=("gap",), noise=(0.005, 0.005), gap=(0.2, 0.3), duration=10.0,
        sample_rate=500.0, sensors=("both",),
    )  # fmt: skip
    case, answer = draw_case("gap", np.random.default_rng(11), options)
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    candidates = placements(case, structure, [effect_named("gap")])
    screen = Screen(problem, candidates)
    ground = screen.ground()
    coarse = screen.ranked(None, ground)
    fine = refined(screen, ground, coarse)
    assert fine[0].gain >= coarse[0].gain
    scales = problem.scales_of(candidates[0])
    clearance = candidates[0].effect.values(fine[0].eta, scales)[1]
    # the smoothed motion carries some percent of the noise of a record into the force along it
    assert clearance == pytest.approx(answer["effects"][0]["parameters"][1], rel=0.05)


def test_products_of_rounded_columns_are_summed_in_double_precision():
    rng = np.random.default_rng(5)
    # the last rows do not fill a block
    rough = (1.0 + rng.standard_normal((2 * LINEAR_AMPLITUDES_SETTINGS.rows + 17, 3))).astype(np.float32)
    other = 1.0 + rng.standard_normal((len(rough), 2))
    found = products(rough, other)
    assert found.dtype == np.float64
    # rounding of sums of 2e4 terms of order one; single precision would leave 1e-7 and more
    np.testing.assert_allclose(found, rough.astype(np.float64).T @ other, rtol=1e-12)


def dry_with_drag(*names):
    """Problem of a carriage that misses dry friction and quadratic drag, and effects at their places."""
    case = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (1.5 * np.tanh(v / 1e-3) + 8.0 * v * abs(v), [])), n=1000
    )
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    return problem, placements(case, structure, [effect_named(name) for name in names])


def test_two_plain_laws_are_fitted_in_the_place_of_one_with_a_curve_to_bend():
    """Dry friction and drag together are a friction that first falls and then rises: Stribeck's may stand in for them."""
    problem, candidates = dry_with_drag(
        "stribeck_friction", "coulomb_friction", "quadratic_damping", "cubic_stiffness"
    )
    found, screen, _ = prepare(problem, candidates)
    alone = [p for p in candidates if p.effect.name in ("stribeck_friction", "coulomb_friction")]
    converge(found, [((p,), np.append(np.zeros(len(problem.nominal)), p.effect.grid()[0])) for p in alone])
    best = found.ranked()[0]
    assert [p.effect.name for p in best.hypothesis] == ["stribeck_friction"]
    divide(found, screen, candidates)
    pair = next(
        f
        for f in found.ranked(2)
        if {p.effect.name for p in f.hypothesis} == {"coulomb_friction", "quadratic_damping"}
    )
    assert pair.cost < best.cost
    # nothing else is asked for: a law of one parameter has no such stand-ins
    assert all("coulomb_friction" in {p.effect.name for p in f.hypothesis} for f in found.ranked(2))


def test_a_relative_of_fewer_parameters_is_fitted_beside_what_else_is_missing():
    problem, candidates = dry_with_drag(
        "stribeck_friction", "quadratic_damping", "coulomb_friction", "cubic_stiffness"
    )
    stribeck, drag, dry, spring = candidates
    found, _, _ = prepare(problem, candidates)
    start = np.concatenate([np.zeros(len(problem.nominal)), stribeck.effect.grid()[0], drag.effect.grid()[0]])
    converge(found, [((stribeck, drag), start)])
    assert found.ranked()[0].hypothesis == (stribeck, drag)
    simplify(found, candidates, most=1)
    assert {p.key for p in found.ranked()[0].hypothesis} == {dry.key, drag.key}  # the curve gains nothing
    assert not any(spring in f.hypothesis for f in found.ranked(2))  # it is no relative of friction


def test_what_a_sensor_changes_is_read_off_the_motion_of_one_free_run(monkeypatch):
    case = planted_case(lambda force: motion_with(force, lambda x, v, z: (1.5 * np.tanh(v / 1e-3), [])))
    problem = Problem(case, structure := structure_of(case), case.identification)
    chosen = {
        name: next(p for p in placements(case, structure, [effect_named(name)]))
        for name in ("coulomb_friction", "displacement_gain_error", "acceleration_delay", "force_delay")
    }
    hypothesis = (chosen["coulomb_friction"], chosen["displacement_gain_error"])
    vector = np.array([0.1, -0.2, 0.3, -1.0, 0.4])
    near = problem.residual_near(hypothesis, vector)
    runs, whole = [], type(problem).free_motion
    monkeypatch.setattr(
        type(problem),
        "free_motion",
        lambda self, *given, **more: runs.append(1) or whole(self, *given, **more),
    )
    moved = vector + np.array([0.0, 0.0, 0.0, 0.0, 0.5])
    delay = chosen["acceleration_delay"]
    late = np.append(vector, [p.mean for p in delay.effect.parameters])
    found = [near(moved), near(late, delay)]
    assert len(runs) == len(case.identification)
    near(np.append(vector, -3.0), chosen["force_delay"])  # acts on what moves
    near(vector + np.array([0.1, 0.0, 0.0, 0.0, 0.0]))
    assert len(runs) == 3 * len(case.identification)
    np.testing.assert_array_equal(found[0], problem.residual(hypothesis, moved))
    np.testing.assert_array_equal(found[1], problem.residual((*hypothesis, delay), late))
    assert np.any(found[0] != found[1])
