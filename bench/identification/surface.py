"""Restoring-force surface r(x, v): Chebyshev and power series through measured states, and where they were measured.

Masri and Caughey integrated an interpolated surface against Chebyshev polynomials, which needs values on the whole
rectangle; here the coefficients are fitted to the samples themselves by least squares, which needs none in the corners a
motion never visits, and `SurfaceCoverage` says where the samples lie. A surface is a function of the present state: a joint with
memory (hysteresis) has none, and leaves a loop as the misfit.

Both bases span the same functions and convert into each other exactly. The Chebyshev coefficients of a low order
change little when the order is raised, and are the better conditioned; those of the power series are physical constants
(stiffness, damping, cubic stiffness) in the units of the record.

References:
    Masri, S. F. and Caughey, T. K. 1979, A nonparametric identification technique for nonlinear dynamic problems, J. Appl.
    Mech. 46. Worden, K. and Tomlinson, G. R. 2001, Nonlinearity in Structural Dynamics, ch. 7. Tasbihgoo 2006, fig. 2.8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial, chebyshev, polynomial
from numpy.typing import ArrayLike, NDArray

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.laws.polynomial import Basis
from bench.recording import nmse


class SurfaceCoverage(NamedTuple):
    """Where the states of a record lie.

    Attributes:
        counts: Samples in each cell (n_x, n_v).
        x_edges: Cell borders (n_x + 1,) [unit of x].
        v_edges: Cell borders (n_v + 1,) [unit of v].
        fraction: Share of the cells that hold at least `min_count` samples.
        min_count: Samples that make a cell covered.
    """

    counts: NDArray[np.int64]
    x_edges: NDArray[np.float64]
    v_edges: NDArray[np.float64]
    fraction: float
    min_count: int

    def contains(self, x: ArrayLike, v: ArrayLike) -> NDArray[np.bool_]:
        """Whether states lie in covered cells.

        Args:
            x: Displacements, any shape.
            v: Velocities, of the same shape.
        """
        cells = []
        inside = np.ones(np.broadcast(x, v).shape, dtype=bool)
        for values, edges in ((x, self.x_edges), (v, self.v_edges)):
            array = np.asarray(values, dtype=float)
            inside &= (array >= edges[0]) & (array <= edges[-1])
            # the last edge belongs to the last cell, as in np.histogram
            cells.append(np.clip(np.searchsorted(edges, array, side="right") - 1, 0, edges.size - 2))
        return inside & (self.counts[cells[0], cells[1]] >= self.min_count)


class SurfaceGrid(NamedTuple):
    """A surface on a grid, ready to be drawn.

    Attributes:
        x: (n_x,) [unit of x].
        v: (n_v,) [unit of v].
        force: r (n_x, n_v); NaN outside the covered cells.
        covered: (n_x, n_v) bool.
    """

    x: NDArray[np.float64]
    v: NDArray[np.float64]
    force: NDArray[np.float64]
    covered: NDArray[np.bool_]


@dataclass(frozen=True)
class RestoringSurface:
    """A fitted surface ``r = sum c_ij B_i(x) B_j(v)``.

    Attributes:
        basis: "chebyshev", in x and v scaled to [-1, 1] over their ranges, or "power", in x and v themselves.
        coefficients: c (k + 1, l + 1), rows for powers of x.
        x_range: Smallest and largest displacement fitted.
        v_range: Smallest and largest velocity fitted.
        coverage: Where the samples lie.
        nmse: Misfit on the samples fitted [%].
        condition: Condition number of the fit, in the basis it was made in.
    """

    basis: Basis
    coefficients: NDArray[np.float64]
    x_range: tuple[float, float]
    v_range: tuple[float, float]
    coverage: SurfaceCoverage
    nmse: float
    condition: float

    def __post_init__(self) -> None:
        array = np.array(self.coefficients, dtype=float)
        array.flags.writeable = False
        object.__setattr__(self, "coefficients", array)

    def __call__(self, x: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Restoring force at states, also outside the data: ask `coverage` whether to believe it.

        Args:
            x: Displacements, any shape.
            v: Velocities, of the same shape.

        Returns:
            r, of that shape.
        """
        x, v = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(v, dtype=float))
        if self.basis == "power":
            return np.asarray(polynomial.polyval2d(x, v, self.coefficients), dtype=float)
        values = chebyshev.chebval2d(_scaled(x, self.x_range), _scaled(v, self.v_range), self.coefficients)
        return np.asarray(values, dtype=float)

    def to_power(self) -> RestoringSurface:
        """The same surface as a power series in x and v.

        Coefficients of high order come from cancelling Chebyshev coefficients: about one digit is lost for every two
        orders, so that beyond order 20 the power series is worth little in double precision.
        """
        if self.basis == "power":
            return self
        left, right = (
            _chebyshev_to_power(size, span)
            for size, span in zip(self.coefficients.shape, (self.x_range, self.v_range), strict=True)
        )
        return replace(self, basis="power", coefficients=left @ self.coefficients @ right.T)

    def to_chebyshev(self) -> RestoringSurface:
        """The same surface as a Chebyshev series over the ranges of the data."""
        if self.basis == "chebyshev":
            return self
        left, right = (
            _power_to_chebyshev(size, span)
            for size, span in zip(self.coefficients.shape, (self.x_range, self.v_range), strict=True)
        )
        return replace(self, basis="chebyshev", coefficients=left @ self.coefficients @ right.T)

    def grid(self, points: tuple[int, int] = (60, 60)) -> SurfaceGrid:
        """The surface on an even grid over the ranges of the data, masked where no samples were.

        Args:
            points: Number of grid points in x and v.
        """
        x = np.linspace(*self.x_range, points[0])
        v = np.linspace(*self.v_range, points[1])
        states = np.meshgrid(x, v, indexing="ij")
        covered = self.coverage.contains(*states)
        return SurfaceGrid(x, v, np.where(covered, self(*states), np.nan), covered)

    def contributions(self, x: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Contribution of each term along a record.

        Args:
            x: Displacements (n,).
            v: Velocities (n,).

        Returns:
            ``c_ij B_i(x) B_j(v)``, (k + 1, l + 1, n).
        """
        rows = _vandermonde(
            np.asarray(x, dtype=float), self.coefficients.shape[0] - 1, self.basis, self.x_range
        )
        columns = _vandermonde(
            np.asarray(v, dtype=float), self.coefficients.shape[1] - 1, self.basis, self.v_range
        )
        return np.einsum("ij,ni,nj->ijn", self.coefficients, rows, columns)


def restoring_force(force: ArrayLike, acceleration: ArrayLike, *, mass: float) -> NDArray[np.float64]:
    """``r = F - m x''`` of a single mass (eq. 2.4).

    Args:
        force: Applied force F (n,).
        acceleration: x'' (n,).
        mass: m, in the unit of force over that of acceleration.
    """
    return np.asarray(force, dtype=float) - mass * np.asarray(acceleration, dtype=float)


def coverage(
    x: ArrayLike, v: ArrayLike, *, cells: tuple[int, int] = (30, 30), min_count: int = 1
) -> SurfaceCoverage:
    """Count the samples of a record over a grid of cells in the phase plane.

    Args:
        x: Displacements (n,).
        v: Velocities (n,).
        cells: Number of cells in x and v.
        min_count: Samples that make a cell covered.

    Raises:
        RecordingError: Lengths differ, values are not finite, or a channel does not move.
        ParameterError: No cells.
    """
    x, v = _columns(x=x, v=v)
    if min(cells) < 1 or min_count < 1:
        raise ParameterError(f"cells {cells} and min_count {min_count} came; at least 1 each is expected")
    counts, x_edges, v_edges = np.histogram2d(x, v, bins=cells)
    whole = counts.astype(np.int64)
    return SurfaceCoverage(whole, x_edges, v_edges, float(np.mean(whole >= min_count)), min_count)


def fit_surface(
    x: ArrayLike,
    v: ArrayLike,
    r: ArrayLike,
    *,
    orders: tuple[int, int] = (5, 5),
    basis: Basis = "chebyshev",
    balance: bool = False,
    cells: tuple[int, int] = (30, 30),
    min_count: int = 1,
) -> RestoringSurface:
    """Fit a restoring-force surface to a record.

    Args:
        x: Displacements (n,).
        v: Velocities (n,).
        r: Restoring forces (n,), see `restoring_force`.
        orders: Highest powers of x and of v.
        basis: "chebyshev" or "power".
        balance: Weight every covered cell alike, instead of every sample: a random record dwells near the origin, and
            the rim of the surface else counts for little.
        cells: Cells of the coverage map.
        min_count: Samples that make a cell covered.

    Returns:
        The surface.

    Raises:
        RecordingError: Lengths differ, values are not finite, or a channel does not move.
        IdentificationError: Fewer samples than coefficients, or samples that do not determine them (a single harmonic
            draws one ellipse in the phase plane and determines no surface of order beyond one).
        ParameterError: A negative order, or an unknown basis.
    """
    x, v, r = _columns(x=x, v=v, r=r)
    if min(orders) < 0 or basis not in ("chebyshev", "power"):
        raise ParameterError(
            f"orders {orders} and basis '{basis}' came; orders of at least 0 and 'chebyshev' or 'power' are expected"
        )
    n_terms = (orders[0] + 1) * (orders[1] + 1)
    if x.size < n_terms:
        raise IdentificationError(
            f"{x.size} samples came for {n_terms} coefficients; take a longer record or lower orders"
        )
    covered = coverage(x, v, cells=cells, min_count=min_count)
    x_range, v_range = (float(x.min()), float(x.max())), (float(v.min()), float(v.max()))
    rows = _vandermonde(x, orders[0], basis, x_range)
    columns = _vandermonde(v, orders[1], basis, v_range)
    matrix = (rows[:, :, None] * columns[:, None, :]).reshape(x.size, n_terms)
    weight = _cell_weights(x, v, covered) if balance else np.ones(x.size)
    # Columns of equal norm: the rank is then judged on angles between terms, not on units.
    scale = np.linalg.norm(matrix * weight[:, None], axis=0)
    solution, _, rank, singular = np.linalg.lstsq(matrix * (weight[:, None] / scale), r * weight, rcond=1e-12)
    if rank < n_terms:
        raise IdentificationError(
            f"the record determines {rank} of {n_terms} coefficients only; lower the orders, or excite other states "
            f"({100 * covered.fraction:.0f} % of the cells of the phase plane are covered)"
        )
    coefficients = (solution / scale).reshape(orders[0] + 1, orders[1] + 1)
    return RestoringSurface(
        basis=basis,
        coefficients=coefficients,
        x_range=x_range,
        v_range=v_range,
        coverage=covered,
        nmse=nmse(r, matrix @ coefficients.ravel()),
        condition=float(singular[0] / singular[-1]),
    )


def _cell_weights(
    x: NDArray[np.float64], v: NDArray[np.float64], covered: SurfaceCoverage
) -> NDArray[np.float64]:
    """Weights that make the squares of each cell count as those of one sample."""
    i, j = (
        np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
        for values, edges in ((x, covered.x_edges), (v, covered.v_edges))
    )
    return 1.0 / np.sqrt(covered.counts[i, j])


def _columns(**channels: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    arrays = {name: np.asarray(values, dtype=float) for name, values in channels.items()}
    shape = arrays["x"].shape
    for name, array in arrays.items():
        if array.ndim != 1 or array.shape != shape:
            raise RecordingError(
                f"'{name}' of shape {array.shape} came; x has {shape}, equal rows (n,) are expected"
            )
        if not np.all(np.isfinite(array)):
            raise RecordingError(
                f"'{name}' is not finite at sample {int(np.argmin(np.isfinite(array)))}; cut or repair the record"
            )
        if array.size == 0 or np.ptp(array) == 0.0:
            raise RecordingError(f"'{name}' does not move; a surface needs states that vary")
    return tuple(arrays.values())


def _scaled(values: NDArray[np.float64], span: tuple[float, float]) -> NDArray[np.float64]:
    return (2.0 * values - span[0] - span[1]) / (span[1] - span[0])


def _vandermonde(
    values: NDArray[np.float64], order: int, basis: Basis, span: tuple[float, float]
) -> NDArray[np.float64]:
    if basis == "power":
        return np.asarray(polynomial.polyvander(values, order), dtype=float)
    return np.asarray(chebyshev.chebvander(_scaled(values, span), order), dtype=float)


def _chebyshev_to_power(size: int, span: tuple[float, float]) -> NDArray[np.float64]:
    """Columns: the power coefficients in the physical variable of T_0 … T_(size-1) of the scaled one."""
    line = Polynomial([-(span[0] + span[1]) / (span[1] - span[0]), 2.0 / (span[1] - span[0])])
    matrix = np.zeros((size, size))
    for j in range(size):
        column = Polynomial(chebyshev.cheb2poly(np.eye(size)[j]))(line)
        matrix[: column.coef.size, j] = column.coef[:size]
    return matrix


def _power_to_chebyshev(size: int, span: tuple[float, float]) -> NDArray[np.float64]:
    """Columns: the Chebyshev coefficients of the powers of the physical variable."""
    line = Polynomial([0.5 * (span[0] + span[1]), 0.5 * (span[1] - span[0])])
    matrix = np.zeros((size, size))
    for j in range(size):
        column = chebyshev.poly2cheb((line**j).coef)
        matrix[: column.size, j] = column[:size]
    return matrix
