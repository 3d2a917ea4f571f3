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

import itertools
import json
import math
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dgeqrf
from threadpoolctl import threadpool_limits

from bench.errors import FileFormatError, IdentificationError, ParameterError, RangeWarning
from bench.identification.surroundings import SETTINGS as SURROUNDINGS
from bench.identification.surroundings import surroundings
from bench.laws.base import ForceLaw
from bench.laws.polynomial import Basis, Kind, polynomial_exponents, polynomial_law


@dataclass(frozen=True)
class PolynomialSettings:
    """Numbers of `bench.identification.polynomial`."""

    block: int = 4096
    around: int = 20
    """Points of the surroundings for each term: as many times over-determined as a record should be."""


SETTINGS = PolynomialSettings()


def frozen(values: ArrayLike) -> NDArray[np.float64]:
    """A read-only float copy of `values`."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def centre_and_scale(columns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre and half-range of each column ``(n_columns,)`` each; a half-range of 1 where a column does not vary."""
    low, high = columns.min(axis=0), columns.max(axis=0)
    return 0.5 * (low + high), np.where(high > low, 0.5 * (high - low), 1.0)


@dataclass(frozen=True)
class ValidityRange:
    """The region of states a model was identified from: a box, and an ellipsoid inside it.

    The ellipsoid (Mahalanobis distance up to the largest one met) cuts the corners of the box, which records of
    separately excited joints never reach and where a model is pure extrapolation. Both are convex; a hole inside the
    data is not seen.

    Attributes:
        names: Names of the states, for messages.
        minimum: Smallest value of each state (n_states,) [m, rad, m/s, rad/s].
        maximum: Largest value of each state (n_states,) [m, rad, m/s, rad/s].
        mean: Mean of each state (n_states,) [m, rad, m/s, rad/s].
        precision: Inverse covariance of the states, pseudo-inverse where a state did not move (n_states, n_states).
        radius: Largest Mahalanobis distance met [1].
    """

    names: tuple[str, ...]
    minimum: NDArray[np.float64]
    maximum: NDArray[np.float64]
    mean: NDArray[np.float64] = field(repr=False)
    precision: NDArray[np.float64] = field(repr=False)
    radius: float

    @classmethod
    def of(cls, states: ArrayLike, names: Sequence[str] = ()) -> ValidityRange:
        """The range of `states` (n, n_states)."""
        data = np.asarray(states, dtype=float)
        mean, deviation = data.mean(axis=0), data.std(axis=0)
        unit = np.where(deviation > 0.0, deviation, 1.0)
        correlation = ((data - mean) / unit).T @ ((data - mean) / unit) / len(data)
        precision = np.linalg.pinv(correlation, rcond=1e-10, hermitian=True) / np.outer(unit, unit)
        centred = data - mean
        distance = np.einsum("ni,ij,nj->n", centred, precision, centred, optimize=True)
        return cls(
            tuple(names) or state_names(data.shape[1] // 2),
            frozen(data.min(axis=0)),
            frozen(data.max(axis=0)),
            frozen(mean),
            frozen(precision),
            float(np.sqrt(distance.max())),
        )

    def outside(self, states: ArrayLike, *, margin: float = 0.0) -> NDArray[np.bool_]:
        """Which states lie outside.

        Args:
            states: ``(n, n_states)`` [m, rad, m/s, rad/s].
            margin: Widening of box and ellipsoid, as a fraction of their size [1].

        Returns:
            Mask (n,).
        """
        data = np.atleast_2d(np.asarray(states, dtype=float))
        slack = margin * 0.5 * (self.maximum - self.minimum)
        box = np.any((data < self.minimum - slack) | (data > self.maximum + slack), axis=1)
        centred = data - self.mean
        distance = np.sqrt(
            np.maximum(np.einsum("ni,ij,nj->n", centred, self.precision, centred, optimize=True), 0.0)
        )
        # 1e-9: the farthest sample itself must count as inside whatever the order of summation.
        return box | (distance > self.radius * (1.0 + margin + 1e-9))

    def fraction_outside(self, states: ArrayLike, *, margin: float = 0.0) -> float:
        """Fraction of `states` (n, n_states) outside [1]."""
        return float(np.mean(self.outside(states, margin=margin)))

    def warn(self, states: ArrayLike, *, margin: float = 0.0) -> float:
        """Issue a `RangeWarning` where states leave the range.

        Args:
            states: ``(n, n_states)`` [m, rad, m/s, rad/s].
            margin: As in `outside`.

        Returns:
            Fraction of states outside [1].
        """
        fraction = self.fraction_outside(states, margin=margin)
        if fraction > 0.0:
            data = np.atleast_2d(np.asarray(states, dtype=float))
            half = np.where(self.maximum > self.minimum, 0.5 * (self.maximum - self.minimum), 1.0)
            excess = np.maximum(data - self.maximum, self.minimum - data).max(axis=0) / half
            worst = int(np.argmax(excess))
            where = (
                f"'{self.names[worst]}' leaves [{self.minimum[worst]:.3g}, {self.maximum[worst]:.3g}] "
                f"by {100 * excess[worst]:.1f} % of its half-width"
                if excess[worst] > 0.0
                else "the states meet in combinations that were not met in identification"
            )
            warnings.warn(
                f"{100 * fraction:.2g} % of the samples lie outside the range the model was identified from: {where}",
                RangeWarning,
                stacklevel=2,
            )
        return fraction

    def to_dict(self) -> dict[str, Any]:
        """JSON values of the range."""
        return {
            "names": list(self.names),
            "minimum": self.minimum.tolist(),
            "maximum": self.maximum.tolist(),
            "mean": self.mean.tolist(),
            "precision": self.precision.tolist(),
            "radius": self.radius,
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ValidityRange:
        """The range from the values of `to_dict`."""
        return cls(
            names=tuple(values["names"]),
            minimum=frozen(values["minimum"]),
            maximum=frozen(values["maximum"]),
            mean=frozen(values["mean"]),
            precision=frozen(values["precision"]),
            radius=float(values["radius"]),
        )


def state_names(n_joints: int) -> tuple[str, ...]:
    """Names ``q1 … qn, v1 … vn`` of the relative states of n joints."""
    return tuple(f"{letter}{i + 1}" for letter in "qv" for i in range(n_joints))


def checked_data(
    states: ArrayLike, forces: ArrayLike, accelerations: ArrayLike | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """States (n, 2 k), forces (n, k) and accelerations (n, k or 0) as arrays that fit together.

    Raises:
        IdentificationError: Shapes do not fit, or a value is NaN or inf.
    """
    s = np.asarray(states, dtype=float)
    f = np.asarray(forces, dtype=float)
    f = f[:, None] if f.ndim == 1 else f
    a = np.zeros((len(s), 0)) if accelerations is None else np.asarray(accelerations, dtype=float)
    a = a[:, None] if a.ndim == 1 else a
    if s.ndim != 2 or f.ndim != 2 or s.shape != (len(f), 2 * f.shape[1]):
        raise IdentificationError(
            f"states of shape {s.shape} came with forces of shape {f.shape}; (n, 2 k) and (n, k) are expected, "
            "the displacements of the k joints before their velocities"
        )
    if accelerations is not None and a.shape != f.shape:
        raise IdentificationError(
            f"accelerations of shape {a.shape} came; the shape of the forces {f.shape} is expected"
        )
    for name, array in (("states", s), ("forces", f), ("accelerations", a)):
        if not np.all(np.isfinite(array)):
            row, column = np.argwhere(~np.isfinite(array))[0]
            raise IdentificationError(
                f"{name} hold a value that is not finite at sample {row}, column {column}; cut the gap out of the record first"
            )
    return s, f, a


def nmse_percent(measured: NDArray[np.float64], estimated: NDArray[np.float64]) -> tuple[float, ...]:
    """``100 / (N var(y)) sum((y - yhat)²)`` of each column [%]; inf for a column that does not vary but is missed."""
    error = np.mean((measured - estimated) ** 2, axis=0)
    variance = np.var(measured, axis=0)
    return tuple(
        float(100.0 * e / v) if v > 0.0 else (0.0 if e == 0.0 else float("inf"))
        for e, v in zip(error, variance, strict=True)
    )


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
        return frozen(self.law.theta(np.concatenate([self.coefficients.ravel(), beyond])))

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
                centre=frozen(values["centre"]),
                scale=frozen(values["scale"]),
                coefficients=frozen(values["coefficients"]),
                range=ValidityRange.from_dict(values["range"]),
                report=report,
                mass=None if values["mass"] is None else frozen(values["mass"]),
                beyond=None if values.get("beyond") is None else frozen(values["beyond"]),
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
    if basis == "chebyshev" and not normalise:
        raise ParameterError(
            "a Chebyshev basis came with normalise=False; it needs states scaled to [-1, 1], use basis='power'"
        )
    if bounded and not normalise:
        raise ParameterError(
            "a bounded polynomial came with normalise=False; its range is that of the normalised states"
        )
    weight = (SURROUNDINGS.weight if bounded else 0.0) if assumed is None else assumed
    if min(ridge, weight) < 0.0:
        raise ParameterError(f"ridge {ridge:g} and assumed {weight:g} came; 0 or more are expected")
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
        for parts in zip(_regressors(s, exponents, basis, centre, scale), _blocks(a), _blocks(f), strict=True)
    )
    if weight and not a.shape[1]:
        around = surroundings(s, f, SETTINGS.around * n_terms)
        factor = math.sqrt(weight * len(s) / len(around.states))
        terms = _regressors(around.states, exponents, basis, centre, scale)
        beside = (factor * np.hstack(parts) for parts in zip(terms, _blocks(around.forces), strict=True))
        blocks = itertools.chain(blocks, beside)
    solution, singular, rank = _solve(blocks, f.shape[1], unknowns, ridge, rcond)
    coefficients = frozen(solution[:n_terms].T)
    mass = frozen(solution[n_terms:].T) if a.shape[1] else None
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")
    pending = PolynomialReport((), condition, rank, n_terms, len(s), 0.0)
    model = PolynomialModel(
        orders=powers,
        kind=kind,
        degree=(max(powers) if degree is None else degree) if kind == "total" else None,
        basis=basis,
        centre=frozen(centre),
        scale=frozen(scale),
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


def slopes_beyond(forces: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stiffness and damping (2, k) that outweigh the largest force met one half-range beyond the edge of the range."""
    largest = np.max(np.abs(forces), axis=0)
    return frozen(largest / scale.reshape(2, -1))


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
    n_outputs: int,
    unknowns: int,
    ridge: float,
    rcond: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Least-squares solution (unknowns, n_outputs), singular values and rank, by sequential QR of regressors beside targets."""
    width = unknowns + n_outputs
    triangle = np.zeros((0, width))
    # One BLAS thread: OpenBLAS' own spin when another process is busy, which made this twenty times slower.
    with threadpool_limits(1, user_api="blas"):
        for block in blocks:
            stacked = np.vstack([triangle, block])
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
