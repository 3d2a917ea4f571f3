"""Polynomial-basis model of a joint, fitted to relative states and restoring forces by least squares.

A Chebyshev basis is close to orthogonal for states spread evenly over their range (condition number 45 against 880 of
the power series, order 3 in four states). Records of a joint dwell near its centre, where T_2 is nearly constant and T_3
nearly linear: on the joint rig's three records the order is reversed, 4e5 against 260. Both give the same forces.
"""

from __future__ import annotations

import itertools
import json
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import FileFormatError, IdentificationError, ParameterError
from bench.identification.fit_data import centre_and_scale, checked_data, nmse_percent, read_only
from bench.identification.polynomial_regression import SETTINGS, in_blocks, polynomial_terms, solve_in_blocks
from bench.identification.surroundings import SETTINGS as SURROUNDINGS
from bench.identification.surroundings import surroundings
from bench.identification.validity_range import ValidityRange
from bench.laws.base import ForceLaw
from bench.laws.polynomial import Basis, Kind, polynomial_exponents, polynomial_law


@dataclass(frozen=True)
class PolynomialReport:
    """How a polynomial fit went.

    Attributes:
        nmse: Normalised mean-square error of each output on the data fitted [%].
        condition_number: Ratio of the largest to the smallest singular value of the regressors, each column scaled to
            unit norm [1]; inf if singular.
        rank: Number of directions in coefficient space that the data determines.
        n_terms: Number of coefficients of each force.
        n_samples: Number of samples.
        seconds: Time taken [s].
    """

    nmse: tuple[float, ...]
    condition_number: float
    rank: int
    n_terms: int
    n_samples: int
    seconds: float


@dataclass(frozen=True)
class PolynomialModel:
    """A polynomial of the states of k joints, with its range of validity.

    Attributes:
        orders: Highest exponent of each state.
        kind: "tensor" or "total".
        degree: Largest sum of exponents where `kind` is "total", else None.
        basis: "chebyshev" or "power".
        centre: Centre of each state (2 k,) [m, rad, m/s, rad/s].
        scale: Half-range of each state (2 k,) [m, rad, m/s, rad/s].
        coefficients: ``(k, n_terms)`` [N, N m].
        range: Range of the states it was identified from.
        report: How the fit went.
        mass: Mass matrix (k, k) [kg, kg m²] identified with it, or None.
        beyond: Stiffness and damping (2, k) [N/m, N m/rad; N s/m, N m s/rad] of a bounded polynomial beyond its range, or None.
    """

    orders: tuple[int, ...]
    kind: Kind
    degree: int | None
    basis: Basis
    centre: NDArray[np.float64]
    scale: NDArray[np.float64]
    coefficients: NDArray[np.float64] = field(repr=False)
    range: ValidityRange
    report: PolynomialReport
    mass: NDArray[np.float64] | None = None
    beyond: NDArray[np.float64] | None = None

    @cached_property
    def exponents(self) -> NDArray[np.int64]:
        """Exponents of the terms ``(n_terms, 2 k)``."""
        return polynomial_exponents(self.orders, self.kind, degree=self.degree)

    @cached_property
    def law(self) -> ForceLaw:
        """The law whose parameters are the coefficients."""
        return polynomial_law(
            self.orders,
            self.kind,
            degree=self.degree,
            basis=self.basis,
            centre=self.centre,
            scale=self.scale,
            bounded=self.beyond is not None,
        )

    @cached_property
    def theta(self) -> NDArray[np.float64]:
        """Header and coefficients, as an element takes them."""
        beyond = () if self.beyond is None else self.beyond.ravel()
        return read_only(self.law.theta(np.concatenate([self.coefficients.ravel(), beyond])))

    def predict(self, states: ArrayLike) -> NDArray[np.float64]:
        """Restoring forces (n, k) [N, N m] at states (n, 2 k) [m, rad, m/s, rad/s]."""
        data = np.atleast_2d(np.asarray(states, dtype=float))
        inside = data
        if self.beyond is not None:
            inside = np.clip(data, self.centre - self.scale, self.centre + self.scale)
        blocks = polynomial_terms(inside, self.exponents, self.basis, self.centre, self.scale)
        force = np.vstack([block @ self.coefficients.T for block in blocks])
        if self.beyond is None:
            return force
        outside = (data - inside) * self.beyond.ravel()
        k = len(self.coefficients)
        return force + outside[:, :k] + outside[:, k:]

    def to_json(self) -> str:
        """The model as JSON text; numbers survive to the last bit."""
        values = {
            "type": "polynomial",
            "orders": list(self.orders),
            "kind": self.kind,
            "degree": self.degree,
            "basis": self.basis,
            "centre": self.centre.tolist(),
            "scale": self.scale.tolist(),
            "coefficients": self.coefficients.tolist(),
            "range": self.range.to_dict(),
            "report": vars(self.report),
            "mass": None if self.mass is None else self.mass.tolist(),
            "beyond": None if self.beyond is None else self.beyond.tolist(),
        }
        return json.dumps(values)

    @classmethod
    def from_json(cls, text: str) -> PolynomialModel:
        """The model from the text of `to_json`.

        Raises:
            FileFormatError: The text is not that of a polynomial model.
        """
        try:
            values = json.loads(text)
            if values["type"] != "polynomial":
                raise FileFormatError(f"a model of type '{values['type']}' came; 'polynomial' is expected")
            report = PolynomialReport(**values["report"] | {"nmse": tuple(values["report"]["nmse"])})
            return cls(
                orders=tuple(int(order) for order in values["orders"]),
                kind=values["kind"],
                degree=values["degree"],
                basis=values["basis"],
                centre=read_only(values["centre"]),
                scale=read_only(values["scale"]),
                coefficients=read_only(values["coefficients"]),
                range=ValidityRange.from_dict(values["range"]),
                report=report,
                mass=None if values["mass"] is None else read_only(values["mass"]),
                beyond=None if values.get("beyond") is None else read_only(values["beyond"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, FileFormatError):
                raise
            raise FileFormatError(f"this is no polynomial model written by `to_json`: {error}") from error


def fit_polynomial(
    states: ArrayLike,
    forces: ArrayLike,
    *,
    orders: int | Sequence[int] = 3,
    kind: Kind = "tensor",
    degree: int | None = None,
    basis: Basis = "chebyshev",
    normalise: bool = True,
    ridge: float = 0.0,
    accelerations: ArrayLike | None = None,
    rcond: float = 1e-12,
    bounded: bool = False,
    assumed: float | None = None,
) -> PolynomialModel:
    """Fit a polynomial of the states to forces by linear least squares.

    Args:
        states: Relative states ``(n, 2 k)``, displacements before velocities [m, rad, m/s, rad/s]; records one after
            the other.
        forces: Restoring forces ``(n, k)`` [N, N m]; with `accelerations`, applied forces less mounts.
        orders: Highest exponent of each state, or one for all.
        kind: "tensor" or "total".
        degree: Largest sum of exponents for "total"; the largest of `orders` if None.
        basis: "chebyshev" (default) or "power".
        normalise: Whether the states are scaled to [-1, 1] first. Without (power series only) the coefficients are
            those of the states themselves, as in the dissertation's equations.
        ridge: Penalty on the squared coefficients, each times the norm of its regressor, relative to their number [1].
        accelerations: Absolute accelerations ``(n, k)`` [m/s², rad/s²] of the body the forces act on, where its mass
            is unknown: the mass matrix is fitted along with the coefficients.
        rcond: Singular values below `rcond` times the largest are left out [1].
        bounded: Whether the polynomial is held at the edge of its range, with a spring and a damper beyond it that outweigh the
            largest force met one half-range further: they bring the motion back, where an unbounded one runs away. Both are
            needed, since a polynomial may drive the motion at the edge of the speeds. Needs `normalise`.
        assumed: Weight of what is assumed within the box of the records where none of them was
            (`bench.identification.surroundings`), relative to that of the samples [1]; None for 1e-3 where `bounded`, else 0. An
            unknown mass leaves it out.

    Returns:
        The model with condition number, rank and error in its report.

    Raises:
        IdentificationError: Arrays do not fit, are not finite, or hold fewer samples than there are unknowns.
        ParameterError: Orders do not fit the number of states, `ridge` is negative, or a Chebyshev basis is not to be
            normalised.

    References:
        Masri and Caughey 1979; Tasbihgoo 2006, eqs. 4.10-4.13 and section 4.5 (unknown mass).
    """
    begun = time.perf_counter()
    s, f, a = checked_data(states, forces, accelerations)
    powers = _orders_of(orders, s.shape[1])
    weight = (SURROUNDINGS.weight if bounded else 0.0) if assumed is None else assumed
    _check(basis, normalise=normalise, bounded=bounded, weights=(ridge, weight))
    centre, scale = centre_and_scale(s) if normalise else (np.zeros(s.shape[1]), np.ones(s.shape[1]))
    exponents = polynomial_exponents(powers, kind, degree=degree)
    n_terms = len(exponents)
    unknowns = n_terms + a.shape[1]
    if len(s) < unknowns:
        raise IdentificationError(
            f"{len(s)} samples came for {unknowns} unknowns a force; give longer records, lower orders or kind='total'"
        )
    blocks = _regression(s, f, a, exponents, basis, centre, scale)
    if weight and not a.shape[1]:
        around = surroundings(s, f, SETTINGS.around * n_terms)
        factor = math.sqrt(weight * len(s) / len(around.states))
        nothing = np.zeros((len(around.states), 0))
        beside = _regression(around.states, around.forces, nothing, exponents, basis, centre, scale)
        blocks = itertools.chain(blocks, (factor * block for block in beside))
    solution, singular, rank = solve_in_blocks(blocks, f.shape[1], unknowns, ridge, rcond)
    coefficients = read_only(solution[:n_terms].T)
    mass = read_only(solution[n_terms:].T) if a.shape[1] else None
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")
    pending = PolynomialReport((), condition, rank, n_terms, len(s), 0.0)
    model = PolynomialModel(
        orders=powers,
        kind=kind,
        degree=(max(powers) if degree is None else degree) if kind == "total" else None,
        basis=basis,
        centre=read_only(centre),
        scale=read_only(scale),
        coefficients=coefficients,
        range=ValidityRange.of(s),
        report=pending,
        mass=mass,
        beyond=slopes_beyond(f, scale) if bounded else None,
    )
    estimated = model.predict(s) + (0.0 if mass is None else a @ mass.T)
    return replace(
        model, report=replace(pending, nmse=nmse_percent(f, estimated), seconds=time.perf_counter() - begun)
    )


def _regression(
    states: NDArray[np.float64],
    forces: NDArray[np.float64],
    accelerations: NDArray[np.float64],
    exponents: NDArray[np.int64],
    basis: Basis,
    centre: NDArray[np.float64],
    scale: NDArray[np.float64],
) -> Iterator[NDArray[np.float64]]:
    """Regressors beside what they are to give, block by block."""
    terms = polynomial_terms(states, exponents, basis, centre, scale)
    for parts in zip(terms, in_blocks(accelerations), in_blocks(forces), strict=True):
        yield np.hstack(parts)


def _check(basis: Basis, *, normalise: bool, bounded: bool, weights: tuple[float, float]) -> None:
    """Raise a `ParameterError` for settings of a fit that do not go together."""
    if basis == "chebyshev" and not normalise:
        raise ParameterError(
            "a Chebyshev basis came with normalise=False; it needs states scaled to [-1, 1], use basis='power'"
        )
    if bounded and not normalise:
        raise ParameterError(
            "a bounded polynomial came with normalise=False; its range is that of the normalised states"
        )
    if min(weights) < 0.0:
        raise ParameterError(f"ridge {weights[0]:g} and assumed {weights[1]:g} came; 0 or more are expected")


def slopes_beyond(forces: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stiffness and damping (2, k) that outweigh the largest force met one half-range beyond the edge of the range."""
    largest = np.max(np.abs(forces), axis=0)
    return read_only(largest / scale.reshape(2, -1))


def _orders_of(orders: int | Sequence[int], n_states: int) -> tuple[int, ...]:
    """Highest exponent of each state."""
    powers = (int(orders),) * n_states if isinstance(orders, int) else tuple(int(order) for order in orders)
    if len(powers) != n_states:
        raise ParameterError(
            f"{len(powers)} polynomial orders came for {n_states} states; one a state is expected"
        )
    return powers
