"""Polynomial law and model: exact recovery, counts, equality of bases, kernel against prediction, forces from records."""

from __future__ import annotations

import ctypes
from math import comb
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.errors import FileFormatError, IdentificationError, ParameterError, RangeWarning, UnknownNameError
from bench.identification.polynomial import PolynomialModel, fit_polynomial
from bench.identification.restoring_force import Body, joint_data, joint_forces, unknown_mass_data
from bench.identification.validity_range import ValidityRange
from bench.laws.polynomial import polynomial_exponents, polynomial_law, polynomial_law_of


def compiled_force(law, theta, states):
    """Forces of the compiled kernel at states (n, 2 k)."""
    pointer = ctypes.POINTER(ctypes.c_double)
    function = law.force.compiled.ctypes
    k = law.n_coordinates
    theta = np.ascontiguousarray(theta)
    forces = np.zeros((len(states), k))
    for state, out in zip(states, forces, strict=True):
        q, v, z = state[:k].copy(), state[k:].copy(), np.zeros(1)
        function(0.0, *(array.ctypes.data_as(pointer) for array in (q, v, z, theta, out)))
    return forces


def some_states(rng, n=600, k=2):
    """States with offsets and very different sizes, as displacements in metres and velocities are."""
    size = np.array([0.015] * k + [0.6] * k)
    return rng.uniform(-1.0, 1.0, (n, 2 * k)) * size + 0.1 * size


@pytest.mark.parametrize("n_states", [2, 4, 6])
@pytest.mark.parametrize("degree", [1, 3])
def test_number_of_terms(n_states, degree):
    tensor = polynomial_exponents((degree,) * n_states)
    total = polynomial_exponents((degree,) * n_states, "total")
    assert len(tensor) == (degree + 1) ** n_states
    assert len(total) == comb(n_states + degree, degree)
    assert {tuple(row) for row in total.tolist()} == {
        tuple(row) for row in tensor.tolist() if sum(row) <= degree
    }


@pytest.mark.parametrize("kind", ["tensor", "total"])
@pytest.mark.parametrize("basis", ["chebyshev", "power"])
def test_kernel_equals_an_independent_evaluation(rng, kind, basis):
    """numpy's own polynomial classes, term by term, in Python and compiled."""
    orders, centre, scale = (3, 1, 2, 4), np.array([0.1, -0.2, 0.3, 0.0]), np.array([0.5, 2.0, 1.5, 3.0])
    law = polynomial_law(orders, kind, basis=basis, centre=centre, scale=scale)
    coefficients = rng.standard_normal((2, len(law.parameters) // 2))
    states = rng.uniform(-2.0, 2.0, (7, 4))
    one = {"chebyshev": np.polynomial.chebyshev.Chebyshev, "power": np.polynomial.Polynomial}[basis]
    terms = [
        np.prod([one.basis(e)(u) for e, u in zip(row, ((states - centre) / scale).T, strict=True)], axis=0)
        for row in polynomial_exponents(orders, kind)
    ]
    expected = np.array(terms).T @ coefficients.T
    theta = law.theta(coefficients.ravel())
    in_python = np.zeros_like(expected)
    for state, out in zip(states, in_python, strict=True):
        law.force(0.0, state[:2], state[2:], None, theta, out)
    # Sums of up to 120 terms of size up to 1e4: rounding of 1e-12 of the largest.
    tolerance = 1e-12 * np.abs(np.array(terms)).max() * 10.0
    np.testing.assert_allclose(in_python, expected, rtol=0, atol=tolerance)
    np.testing.assert_allclose(compiled_force(law, theta, states), in_python, rtol=0, atol=tolerance)


def test_law_of_one_joint_and_of_six():
    spring = polynomial_law((1, 1), basis="power")
    f = np.zeros(1)
    spring.force(0.0, [0.01], [2.0], None, spring.theta(), f)
    assert f[0] == pytest.approx(1000.0 * 0.01 + 1.0 * 2.0, rel=1e-15)  # the default is the linear element
    six = polynomial_law((3,) * 12, "total")
    assert six.n_coordinates == 6
    assert len(six.parameters) == 6 * comb(15, 3)
    states = np.linspace(-0.3, 0.4, 12)[None]
    out = compiled_force(six, six.theta(), states)
    np.testing.assert_allclose(out[0], 1000.0 * states[0, :6] + states[0, 6:], rtol=1e-12)


@given(
    orders=st.lists(st.integers(0, 3), min_size=2, max_size=4).filter(lambda orders: len(orders) % 2 == 0),
    kind=st.sampled_from(["tensor", "total"]),
    basis=st.sampled_from(["chebyshev", "power"]),
    scale=st.floats(1e-3, 1e3),
)
@settings(max_examples=30, deadline=None)
def test_law_is_found_again_from_its_header(orders, kind, basis, scale):
    law = polynomial_law(orders, kind, basis=basis, centre=0.3 * scale, scale=scale)
    again = polynomial_law_of(law.header)
    assert again.header == law.header
    assert again.parameter_names == law.parameter_names


@pytest.mark.parametrize(("kind", "normalise"), [("tensor", True), ("tensor", False), ("total", True)])
def test_recovers_a_polynomial_exactly(rng, kind, normalise):
    states = some_states(rng, 2000)
    x, y, v, w = (states / np.array([0.015, 0.015, 0.6, 0.6])).T
    forces = np.stack(
        [3.0 + 40.0 * x - 7.0 * x**3 + 2.0 * v + 5.0 * x * v * w, 11.0 * y**2 * w - y + 0.5 * w**3], axis=1
    )
    basis = "chebyshev" if normalise else "power"
    model = fit_polynomial(states, forces, orders=3, kind=kind, basis=basis, normalise=normalise)
    unseen = some_states(rng, 50)
    x, y, v, w = (unseen / np.array([0.015, 0.015, 0.6, 0.6])).T
    exact = np.stack(
        [3.0 + 40.0 * x - 7.0 * x**3 + 2.0 * v + 5.0 * x * v * w, 11.0 * y**2 * w - y + 0.5 * w**3], axis=1
    )
    # Rounding 1e-16 times a condition number of 1e3 times forces of 50 N; 2e-13 was the worst of ten seeds.
    np.testing.assert_allclose(model.predict(unseen), exact, rtol=0, atol=1e-11)
    assert max(model.report.nmse) < 1e-12
    assert model.report.rank == model.report.n_terms


def test_bases_span_the_same_functions(rng):
    states = some_states(rng, 1500)
    forces = np.tanh(states[:, :2] / 0.01) * 100.0 + states[:, 2:]
    models = {basis: fit_polynomial(states, forces, basis=basis) for basis in ("chebyshev", "power")}
    # Both are the same projection; the power series' condition number, about 1e3, times rounding and 100 N.
    np.testing.assert_allclose(
        models["power"].predict(states), models["chebyshev"].predict(states), rtol=0, atol=1e-8
    )
    numbers = {basis: model.report.condition_number for basis, model in models.items()}
    assert numbers["chebyshev"] < numbers["power"]  # on states that fill their range
    in_metres = fit_polynomial(states, forces, basis="power", normalise=False)
    np.testing.assert_allclose(in_metres.predict(states), models["power"].predict(states), rtol=0, atol=1e-9)


def test_residual_is_orthogonal_to_the_terms(rng):
    """The normal equations, which the sequential QR never forms, must hold; 5000 samples are two blocks."""
    states = some_states(rng, 5000)
    forces = np.sign(states[:, :2]) + 0.1 * rng.standard_normal((5000, 2))
    model = fit_polynomial(states, forces, orders=2)
    residual = forces - model.predict(states)
    u = (states - model.centre) / model.scale
    for row in model.exponents[::7]:
        term = np.prod(np.cos(row * np.arccos(np.clip(u, -1, 1))), axis=1)
        assert (
            np.abs(term @ residual).max() < 1e-8
        )  # 5000 terms of size 1, rounding times a condition number of 1e2


def test_ridge_shrinks_and_singular_data_is_handled(rng):
    states = some_states(rng, 800)
    forces = np.tanh(states[:, :2] / 0.01) + 0.3 * rng.standard_normal((800, 2))
    plain, shrunk = (fit_polynomial(states, forces, ridge=ridge) for ridge in (0.0, 1.0))
    assert np.linalg.norm(shrunk.coefficients) < np.linalg.norm(plain.coefficients)
    assert min(np.array(shrunk.report.nmse) - np.array(plain.report.nmse)) > 0.0
    states[:, [1, 3]] = 0.0  # the second joint never moved
    still = fit_polynomial(states, forces)
    assert still.report.rank == 16  # of 256: those in q1 and v1 alone
    assert np.all(np.isfinite(still.coefficients))
    assert still.report.condition_number > 1e12  # rounding, or exactly singular


def test_unknown_mass_is_fitted_along(rng):
    states = some_states(rng, 3000)
    acceleration = rng.standard_normal((3000, 2)) * [5.0, 40.0]
    joint = np.stack(
        [500.0 * states[:, 0] + 1e6 * states[:, 0] ** 3, 20.0 * states[:, 1] * states[:, 2]], axis=1
    )
    mass = np.array([[2.0, 0.1], [0.1, 0.05]])
    exact = fit_polynomial(states, joint + acceleration @ mass.T, accelerations=acceleration)
    assert exact.mass is not None
    np.testing.assert_allclose(exact.mass, mass, rtol=1e-9)
    np.testing.assert_allclose(exact.predict(states), joint, rtol=0, atol=1e-8)
    noisy = joint + acceleration @ mass.T + rng.standard_normal((3000, 2)) * 0.5
    estimated = fit_polynomial(states, noisy, accelerations=acceleration, kind="total").mass
    assert estimated is not None
    # Standard error of a regression slope: 0.5 / (sqrt(3000) * std(a)); six of them.
    assert np.all(np.abs(estimated - mass) < 6 * 0.5 / (np.sqrt(3000) * np.array([5.0, 40.0])))


@pytest.mark.parametrize("basis", ["chebyshev", "power"])
def test_kernel_equals_prediction_and_json_round_trip(rng, basis):
    states = some_states(rng, 700)
    model = fit_polynomial(states, np.tanh(states[:, :2] / 0.01) * 50.0, basis=basis, orders=(3, 2, 1, 2))
    predicted = model.predict(states[:40])
    # Up to 72 terms of size up to 1e2: 1e-12 of 50 N.
    np.testing.assert_allclose(
        compiled_force(model.law, model.theta, states[:40]), predicted, rtol=0, atol=5e-11
    )
    again = PolynomialModel.from_json(model.to_json())
    assert np.array_equal(again.theta, model.theta)
    assert again.report == model.report
    assert np.array_equal(again.range.outside(2 * states), model.range.outside(2 * states))
    with pytest.raises(ValueError, match="read-only"):
        again.coefficients[0, 0] = 1.0


def test_fit_refuses_what_it_cannot_use(rng):
    states = some_states(rng, 300)
    forces = states[:, :2]
    with pytest.raises(IdentificationError, match="200 samples came for 256"):
        fit_polynomial(states[:200], forces[:200])
    with pytest.raises(IdentificationError, match="displacements of the k joints"):
        fit_polynomial(states, forces[:, :1])
    broken = states.copy()
    broken[17, 3] = np.nan
    with pytest.raises(IdentificationError, match="sample 17, column 3"):
        fit_polynomial(broken, forces)
    with pytest.raises(ParameterError, match="use basis='power'"):
        fit_polynomial(states, forces, normalise=False)
    with pytest.raises(ParameterError, match="one a state"):
        fit_polynomial(states, forces, orders=(3, 3))
    with pytest.raises(ParameterError, match="total"):
        polynomial_law((3,) * 12)
    with pytest.raises(UnknownNameError, match="chebyshev"):
        polynomial_law((3, 3), basis="chebychev")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="above 0"):
        polynomial_law((3, 3), scale=0.0)
    with pytest.raises(FileFormatError, match="polynomial"):
        PolynomialModel.from_json('{"type": "network"}')
    with pytest.raises(FileFormatError):
        PolynomialModel.from_json("not JSON")


def test_range_of_validity(rng):
    corner = rng.uniform(-1.0, 1.0, (2000, 2))
    states = np.zeros((4000, 4))
    states[:2000, [0, 2]] = corner
    states[2000:, [1, 3]] = corner  # the joints were never moved together
    validity = ValidityRange.of(states)
    assert not validity.outside(states).any()
    assert validity.outside([[1.5, 0.0, 0.0, 0.0]]).all()  # leaves the box
    assert validity.outside([[0.95, 0.95, 0.95, 0.95]]).all()  # in the box, leaves the ellipsoid
    assert not validity.outside([[1.2, 0.0, 0.0, 0.0]], margin=0.5).any()
    with pytest.warns(RangeWarning, match="'q1' leaves"):
        fraction = validity.warn([[1.5, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    assert fraction == 0.5
    alone = ValidityRange.of(states[:2000])  # the second joint never moved: any motion of it is outside
    assert alone.outside([[0.0, 1e-3, 0.0, 0.0]]).all()


class TestRestoringForce:
    """A body of known mass and mounts between the ground and the joint, either side of it."""

    mass, stiffness, damping = np.array([2.0, 0.3]), np.array([1000.0, 40.0]), np.array([10.0, 0.2])

    def motion(self, rng):
        x, v, a = rng.standard_normal((3, 200, 2))
        return x, v, a, rng.standard_normal((200, 2)) * 30.0

    @pytest.mark.parametrize(("body", "sign"), [("second", 1.0), ("first", -1.0)])
    def test_what_is_left_is_the_joint(self, rng, body, sign):
        x, v, a, joint = self.motion(rng)
        applied = self.mass * a + self.damping * v + self.stiffness * x + sign * joint
        mounts = {"displacement": x, "velocity": v, "stiffness": self.stiffness, "damping": self.damping}
        r = joint_forces(applied, a, mass=self.mass, body=body, **mounts)
        np.testing.assert_allclose(r, joint, rtol=0, atol=1e-11)  # rounding of forces of 1e3 N
        matrix = joint_forces(applied, a, mass=np.diag(self.mass), body=body, **mounts)
        np.testing.assert_allclose(matrix, r, rtol=0, atol=1e-11)

    def test_unknown_mass_comes_out_positive_on_either_body(self, rng):
        states = rng.standard_normal((2000, 4))
        a = rng.standard_normal((2000, 2))
        joint = states[:, :2] * 30.0 + states[:, 2:]
        sides: tuple[tuple[Body, float], ...] = (("second", 1.0), ("first", -1.0))
        for body, sign in sides:
            data = unknown_mass_data(states, self.mass * a + sign * joint, a, body=body)
            model = fit_polynomial(data.states, data.forces, orders=1, accelerations=data.accelerations)
            assert model.mass is not None
            np.testing.assert_allclose(model.mass, np.diag(self.mass), atol=1e-12)
            np.testing.assert_allclose(model.predict(states), joint, rtol=0, atol=1e-10)

    def test_recordings_are_read_by_channel(self, rng):
        from bench.recording import Recording

        time = np.arange(100) * 0.01
        x, v, a, f = rng.standard_normal((4, 100))
        units = {"x": "m", "v": "m/s", "a": "m/s^2", "f": "N"}
        record = Recording.from_arrays(time, {"x": x, "v": v, "a": a, "f": f}, units=units, settle=0.2)
        names: dict[str, Any] = {
            "displacements": ["x"],
            "velocities": ["v"],
            "accelerations": ["a"],
            "applied": ["f"],
        }
        data = joint_data([record, record], mass=2.0, **names)
        kept = time >= 0.2 - 1e-9
        np.testing.assert_allclose(data.forces[:, 0], np.tile((f - 2.0 * a)[kept], 2), atol=1e-14)
        np.testing.assert_array_equal(data.states, np.tile(np.stack([x, v], axis=1)[kept], (2, 1)))
        assert joint_data(record, mass=None, **names).accelerations is not None
        with pytest.raises(UnknownNameError):
            joint_data(record, mass=2.0, **{**names, "applied": ["force"]})

    def test_refuses_what_does_not_fit(self, rng):
        _, v, a, f = self.motion(rng)
        with pytest.raises(ParameterError, match="without the body's displacement"):
            joint_forces(f, a, mass=1.0, stiffness=100.0)
        with pytest.raises(ParameterError, match="mass has shape"):
            joint_forces(f, a, mass=[1.0, 2.0, 3.0])
        with pytest.raises(IdentificationError, match="acceleration has shape"):
            joint_forces(f, a[:-1], mass=1.0)
        with pytest.raises(IdentificationError, match="velocity has shape"):
            joint_forces(f, a, mass=1.0, damping=1.0, velocity=v[:, :1])
        with pytest.raises(IdentificationError, match="sample 3"):
            joint_forces(np.where(np.arange(200)[:, None] == 3, np.nan, f), a, mass=1.0)
        with pytest.raises(UnknownNameError, match="second"):
            joint_forces(f, a, mass=1.0, body="third")  # type: ignore[arg-type]
