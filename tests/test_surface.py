"""Restoring-force surface: exact recovery, conversion between bases, coverage, what a record cannot determine."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.identification.surface import coverage, fit_surface, restoring_force


def states(rng, n=4000):
    """States of a random motion off the origin: rings of all sizes."""
    radius, angle = np.sqrt(rng.uniform(0, 1, n)), rng.uniform(0, 2 * np.pi, n)
    return 0.01 + 0.03 * radius * np.cos(angle), -0.2 + 0.8 * radius * np.sin(angle)


def duffing(x, v):
    return 900.0 * x + 12.0 * v + 4e5 * x**3 + 3.0 * x * v


@pytest.mark.parametrize("basis", ["chebyshev", "power"])
@pytest.mark.parametrize("balance", [False, True])
def test_polynomial_surface_is_recovered(rng, basis, balance):
    x, v = states(rng)
    surface = fit_surface(x, v, duffing(x, v), orders=(4, 3), basis=basis, balance=balance)
    expected = np.zeros((5, 4))
    expected[1, 0], expected[0, 1], expected[3, 0], expected[1, 1] = 900.0, 12.0, 4e5, 3.0
    # coefficients compared by what they contribute at the rim: 0.04^i * 1^j; the forces are of the order of 50
    reach = 0.04 ** np.arange(5)[:, None] * np.ones(4)
    np.testing.assert_allclose(surface.to_power().coefficients * reach, expected * reach, atol=1e-8)
    assert surface.nmse < 1e-20
    assert surface.coefficients.flags.writeable is False


@settings(max_examples=30, deadline=None)
@given(k=st.integers(0, 8), m=st.integers(0, 8), seed=st.integers(0, 1000))
def test_bases_convert_into_each_other(k, m, seed):
    rng = np.random.default_rng(seed)
    x, v = states(rng, 600)
    surface = fit_surface(x, v, rng.standard_normal(600), orders=(k, m))
    power = surface.to_power()
    back = power.to_chebyshev()
    size = np.abs(surface.coefficients).max()
    # half a digit an order is lost on the way through powers, twice: 1e-16 * 10^8 at the most
    np.testing.assert_allclose(back.coefficients, surface.coefficients, atol=1e-8 * size)
    values = surface(x, v)
    np.testing.assert_allclose(power(x, v), values, atol=1e-8 * size)
    np.testing.assert_allclose(surface.contributions(x, v).sum(axis=(0, 1)), values, atol=1e-10 * size)


def test_chebyshev_approximates_a_dead_space(rng):
    x, v = rng.uniform(-1, 1, (2, 20_000))
    r = 20.0 * np.sign(x) * np.maximum(np.abs(x) - 0.4, 0.0) + 0.5 * v
    errors = [fit_surface(x, v, r, orders=(order, 1)).nmse for order in (1, 3, 5, 9, 13)]
    assert np.all(np.diff(errors) < 0)
    # the best polynomial of order p misses a kink by the order of 1/p
    assert errors[-1] < 0.1


def test_noise_leaves_the_expected_misfit(rng):
    x, v = states(rng)
    clean = duffing(x, v)
    r = clean + 0.1 * clean.std() * rng.standard_normal(x.size)
    surface = fit_surface(x, v, r, orders=(3, 3))
    # noise of 10 % of the force is 100 * 0.01 / 1.01 = 0.99 % NMSE; 4000 samples scatter it by 2 %
    assert surface.nmse == pytest.approx(0.99, rel=0.08)


def test_coverage_and_mask(rng):
    x, v = states(rng, 50_000)
    surface = fit_surface(x, v, duffing(x, v), orders=(3, 1), cells=(20, 20), min_count=5)
    assert surface.coverage.counts.sum() == x.size
    # an ellipse fills pi/4 of its rectangle; cells on the rim count in part
    assert surface.coverage.fraction == pytest.approx(np.pi / 4, abs=0.08)
    grid = surface.grid((50, 40))
    assert grid.force.shape == grid.covered.shape == (50, 40)
    assert not grid.covered[0, 0]
    assert grid.covered[25, 20]
    np.testing.assert_array_equal(np.isnan(grid.force), ~grid.covered)
    np.testing.assert_allclose(grid.force[25, 20], duffing(grid.x[25], grid.v[20]), rtol=1e-9)
    assert surface.coverage.contains(x, v).mean() > 0.999
    assert not surface.coverage.contains(10.0, 0.0)


def test_balance_helps_the_rim(rng):
    x, v = 0.2 * rng.standard_normal((2, 20_000))
    keep = (np.abs(x) < 0.7) & (np.abs(v) < 0.7)
    x, v = x[keep], v[keep]
    r = np.tanh(4 * x) + v
    plain, fair = (fit_surface(x, v, r, orders=(5, 1), balance=flag) for flag in (False, True))
    rim = np.abs(x) > 0.6
    assert np.std(fair(x, v)[rim] - r[rim]) < 0.5 * np.std(plain(x, v)[rim] - r[rim])
    assert plain.nmse < fair.nmse  # the plain fit is the best on the samples as they are


def test_single_harmonic_determines_no_surface():
    phase = np.linspace(0, 20 * np.pi, 5000)
    with pytest.raises(IdentificationError, match="determines"):
        fit_surface(np.sin(phase), np.cos(phase), np.sin(phase), orders=(3, 3))


def test_restoring_force_is_force_less_inertia():
    np.testing.assert_allclose(restoring_force([3.0, 4.0], [1.0, -1.0], mass=2.0), [1.0, 6.0])


@pytest.mark.parametrize(
    ("arguments", "options", "error", "word"),
    [
        (([0.0, 1.0], [0.0], [0.0, 1.0]), {}, RecordingError, "'v'"),
        (([0.0, np.nan], [0.0, 1.0], [0.0, 1.0]), {}, RecordingError, "sample 1"),
        (([0.0, 1.0], [1.0, 1.0], [0.0, 1.0]), {}, RecordingError, "does not move"),
        (([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]), {}, IdentificationError, "36 coefficients"),
        (([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]), {"orders": (-1, 0)}, ParameterError, "orders"),
    ],
)
def test_bad_records_are_named(arguments, options, error, word):
    with pytest.raises(error, match=word):
        fit_surface(*arguments, **options)
    with pytest.raises(ParameterError, match="cells"):
        coverage([0.0, 1.0], [0.0, 1.0], cells=(0, 3))
