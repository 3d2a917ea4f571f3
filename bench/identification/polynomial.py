"""Polynomial-basis model of a joint, fitted to relative states and restoring forces by least squares.

A Chebyshev basis is close to orthogonal for states spread evenly over their range (condition number 45 against 880 of
the power series, order 3 in four states). Records of a joint dwell near its centre, where T_2 is nearly constant and T_3
nearly linear: on the joint rig's three records the order is reversed, 4e5 against 260. Both give the same forces.

The records are read in blocks and folded into one triangular factor (sequential QR), whose singular values give the
condition number and a minimum-norm solution: forming ``A'A`` would square the condition number, and the whole regressor
matrix of three 30 s records at 1 kHz and 256 terms would take 180 MB.

`ValidityRange`, which every reduced-order model carries, lives here too.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dgeqrf
from threadpoolctl import threadpool_limits

from bench.errors import FileFormatError, IdentificationError, ParameterError
from bench.identification.fit_data import centre_and_scale, checked_data, nmse_percent, read_only
from bench.identification.validity_range import ValidityRange
from bench.laws.base import ForceLaw
from bench.laws.polynomial import Basis, Kind, polynomial_exponents, polynomial_law


@dataclass(frozen=True)
class PolynomialSettings:
    """Numbers of `bench.identification.polynomial`."""

    block: int = 4096


SETTINGS = PolynomialSettings()


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
        blocks = _regressors(inside, self.exponents, self.basis, self.centre, self.scale)
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
            report = PolynomialReport(**{**values["report"], "nmse": tuple(values["report"]["nmse"])})
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
    _check(basis, normalise=normalise, bounded=bounded, ridge=ridge)
    centre, scale = centre_and_scale(s) if normalise else (np.zeros(s.shape[1]), np.ones(s.shape[1]))
    exponents = polynomial_exponents(powers, kind, degree=degree)
    n_terms = len(exponents)
    unknowns = n_terms + a.shape[1]
    if len(s) < unknowns:
        raise IdentificationError(
            f"{len(s)} samples came for {unknowns} unknowns a force; give longer records, lower orders or kind='total'"
        )
    blocks = (
        np.hstack(parts)
        for parts in zip(_regressors(s, exponents, basis, centre, scale), _blocks(a), strict=True)
    )
    solution, singular, rank = _solve(blocks, f, unknowns, ridge, rcond)
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
        beyond=_beyond(f, scale) if bounded else None,
    )
    estimated = model.predict(s) + (0.0 if mass is None else a @ mass.T)
    return replace(
        model, report=replace(pending, nmse=nmse_percent(f, estimated), seconds=time.perf_counter() - begun)
    )


def _check(basis: Basis, *, normalise: bool, bounded: bool, ridge: float) -> None:
    """Raise a `ParameterError` for settings of a fit that do not go together."""
    if basis == "chebyshev" and not normalise:
        raise ParameterError(
            "a Chebyshev basis came with normalise=False; it needs states scaled to [-1, 1], use basis='power'"
        )
    if bounded and not normalise:
        raise ParameterError(
            "a bounded polynomial came with normalise=False; its range is that of the normalised states"
        )
    if ridge < 0.0:
        raise ParameterError(f"ridge is {ridge:g}; 0 or more is expected")


def _beyond(forces: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
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


def _blocks(array: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    for first in range(0, len(array), SETTINGS.block):
        yield array[first : first + SETTINGS.block]


def _regressors(
    states: NDArray[np.float64],
    exponents: NDArray[np.int64],
    basis: Basis,
    centre: NDArray[np.float64],
    scale: NDArray[np.float64],
) -> Iterator[NDArray[np.float64]]:
    """The terms at all states, in blocks (up to `block`, n_terms)."""
    c = 1.0 if basis == "chebyshev" else 0.0
    orders = exponents.max(axis=0)
    for block in _blocks(states):
        terms = np.ones((len(exponents), len(block)))
        for i, order in enumerate(orders):
            u = (block[:, i] - centre[i]) / scale[i]
            table = [np.ones_like(u), u]
            for _ in range(1, order):
                table.append((1.0 + c) * u * table[-1] - c * table[-2])
            terms *= np.array(table)[exponents[:, i]]
        yield terms.T


def _solve(
    blocks: Iterator[NDArray[np.float64]],
    forces: NDArray[np.float64],
    unknowns: int,
    ridge: float,
    rcond: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Least-squares solution (unknowns, n_outputs), singular values and rank, by sequential QR."""
    width = unknowns + forces.shape[1]
    triangle = np.zeros((0, width))
    # One BLAS thread: OpenBLAS' own spin when another process is busy, which made this twenty times slower.
    with threadpool_limits(1, user_api="blas"):
        for regressors, target in zip(blocks, _blocks(forces), strict=True):
            stacked = np.vstack([triangle, np.hstack([regressors, target])])
            factor = dgeqrf(np.asfortranarray(stacked), lwork=64 * width, overwrite_a=1)[0]
            triangle = np.triu(factor[:width])
        # Columns of unit norm: rank and condition then speak of the data, not of the units of the states.
        size = np.linalg.norm(triangle[:unknowns, :unknowns], axis=0)
        size = np.where(size > 0.0, size, 1.0)
        left, singular, right = np.linalg.svd(triangle[:unknowns, :unknowns] / size)
    projected = left.T @ triangle[:unknowns, unknowns:]
    kept = singular > rcond * singular[0]
    penalty = ridge * float(np.sum(singular**2)) / unknowns
    gains = np.where(kept, singular / np.where(kept, singular**2 + penalty, 1.0), 0.0)
    return (right.T @ (gains[:, None] * projected)) / size[:, None], singular, int(kept.sum())
