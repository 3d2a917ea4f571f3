"""How many powers of displacement and velocity a record bears: polynomial models of all orders, judged on another record.

The training error of nested models can only fall; the error on a record not used for the fit falls to an optimum and then
rises, slowly on long records and by orders of magnitude on short ones, where the highest powers follow the noise and the
record leaves corners of the phase plane empty.

References:
    Tasbihgoo 2006, section 3.4.2, figs 3.11 and 3.12.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy import linalg

from bench.errors import IdentificationError, ParameterError


class ForceRecord(Protocol):
    """What the study reads of a record: equal channels (n,)."""

    @property
    def displacement(self) -> NDArray[np.float64]:
        """[m]."""
        ...

    @property
    def velocity(self) -> NDArray[np.float64]:
        """[m/s]."""
        ...

    @property
    def acceleration(self) -> NDArray[np.float64]:
        """[m/s²]."""
        ...

    @property
    def force(self) -> NDArray[np.float64]:
        """[N]."""
        ...


class OrderStudy(NamedTuple):
    """Polynomial models of all orders on one record, judged on another.

    Attributes:
        orders: 0 … highest (p + 1,).
        training: NMSE on the training record (p + 1, p + 1), rows: order in x, columns: order in v [%].
        validation: NMSE on the validation record, likewise [%].
        mass: Coefficient of the acceleration, likewise [kg].
        optimum: Common order of x and v with the least validation error.
        sufficient: Lowest common order within a tenth of that error.
        blow_up: Lowest common order above the optimum whose validation error is twice the least; None if there is none.
        mass_leaves: Lowest common order above `sufficient` whose mass estimate leaves the plateau; None if it never does.
        mass_plateau: Median mass of the common orders from 1 to `optimum` [kg].
        mass_band: Half width of the plateau [kg].
    """

    orders: NDArray[np.int64]
    training: NDArray[np.float64]
    validation: NDArray[np.float64]
    mass: NDArray[np.float64]
    optimum: int
    sufficient: int
    blow_up: int | None
    mass_leaves: int | None
    mass_plateau: float
    mass_band: float


def order_study(
    training: ForceRecord, validation: ForceRecord, *, highest: int = 35, every: int = 5
) -> OrderStudy:
    """Fit polynomial models of all orders 0 … highest in x and v, and find where they are too many.

    The columns are Chebyshev polynomials, which span the same models as powers and leave the mass as it is; powers
    beyond order 15 or so could not be told apart in double precision, and the study would show rounding. All orders of
    x come from one Cholesky factor for each order of v, since its leading blocks factor the smaller models.

    The coefficient of the acceleration is the moving mass plus what memory leaves in phase with it: a spring in series
    shows as negative mass. It is an indicator by staying the same, not by its value. In this well-conditioned form it
    stays longer than the validation error does: of the two signs of too many terms, the error is the sharper.

    Args:
        training: Record to fit.
        validation: Record to judge on, of the same kind of motion.
        highest: Highest order in x and v.
        every: Take every so many samples.

    Returns:
        The study.

    Raises:
        IdentificationError: Fewer samples than coefficients of the largest model.
        ParameterError: A highest order below 2.
    """
    if highest < 2:
        raise ParameterError(f"highest = {highest} came; an order study needs at least orders 0 to 2")
    n_terms = 1 + (highest + 1) ** 2
    if training.force[::every].size < n_terms:
        raise IdentificationError(
            f"{training.force[::every].size} samples came for {n_terms} coefficients; lower `every` or `highest`"
        )
    spans = [
        (float(channel.min()), float(channel.max())) for channel in (training.displacement, training.velocity)
    ]
    a_scale = float(np.abs(training.acceleration).max())
    (g, b, y), (g_new, b_new, y_new) = (
        _normal_equations(record, every, spans, a_scale, highest) for record in (training, validation)
    )
    size = highest + 1
    shape = (size, size)
    errors, errors_new, mass = np.empty(shape), np.empty(shape), np.empty(shape)
    for order_v in range(size):
        # mass first, then for each power of x the powers of v up to order_v
        chosen = np.concatenate([[0], (1 + size * np.arange(size)[:, None] + np.arange(order_v + 1)).ravel()])
        matrix, right = g[np.ix_(chosen, chosen)], b[chosen]
        matrix_new, right_new = g_new[np.ix_(chosen, chosen)], b_new[chosen]
        factor = _factor(matrix)
        half = linalg.solve_triangular(factor, right, lower=True)
        for order_x in range(size):
            m = 1 + (order_x + 1) * (order_v + 1)
            c = np.asarray(linalg.solve_triangular(factor[:m, :m].T, half[:m], lower=False))
            errors[order_x, order_v] = _error(matrix[:m, :m], right[:m], c, y)
            errors_new[order_x, order_v] = _error(matrix_new[:m, :m], right_new[:m], c, y_new)
            mass[order_x, order_v] = c[0] / a_scale
    return _judge(np.arange(size), errors, errors_new, mass)


def _normal_equations(
    record: ForceRecord, every: int, spans: list[tuple[float, float]], a_scale: float, highest: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[float, float]]:
    """Phi^T Phi, Phi^T F and (sum F^2, n var F)."""
    scaled = [
        (2.0 * channel[::every] - low - high) / (high - low)
        for channel, (low, high) in zip((record.displacement, record.velocity), spans, strict=True)
    ]
    x, v = (np.asarray(chebyshev.chebvander(channel, highest), dtype=float) for channel in scaled)
    phi = np.column_stack(
        [record.acceleration[::every] / a_scale, (x[:, :, None] * v[:, None, :]).reshape(x.shape[0], -1)]
    )
    f = record.force[::every]
    return phi.T @ phi, phi.T @ f, (float(f @ f), f.size * float(np.var(f)))


def _factor(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cholesky factor, with the least ridge that lets rounding pass."""
    # 1e-12 of the mean diagonal changes a coefficient that the data determine by 1e-12 of itself over its eigenvalue.
    ridge = 1e-12 * float(np.mean(np.diag(matrix)))
    while True:
        try:
            return np.asarray(np.linalg.cholesky(matrix + ridge * np.eye(matrix.shape[0])), dtype=float)
        except np.linalg.LinAlgError:
            ridge *= 10.0


def _error(
    matrix: NDArray[np.float64], right: NDArray[np.float64], c: NDArray[np.float64], y: tuple[float, float]
) -> float:
    return max(100.0 * (y[0] - 2.0 * float(right @ c) + float(c @ matrix @ c)) / y[1], 0.0)


def _judge(
    orders: NDArray[np.int64],
    training: NDArray[np.float64],
    validation: NDArray[np.float64],
    mass: NDArray[np.float64],
) -> OrderStudy:
    """Read optimum, blow-up and mass plateau off the models of equal order in x and v."""
    error = np.diag(validation)
    masses = np.diag(mass)
    optimum = int(np.argmin(error))
    sufficient = int(np.flatnonzero(error <= 1.1 * error[optimum])[0])
    above = np.flatnonzero((orders > optimum) & (error > 2.0 * error[optimum]))
    plateau_values = masses[1 : max(optimum, 3) + 1]
    plateau = float(np.median(plateau_values))
    # Three standard deviations by the median, and not less than 2 % of the value: three orders may agree by chance.
    band = max(3.0 * 1.4826 * float(np.median(np.abs(plateau_values - plateau))), 0.02 * abs(plateau))
    leaves = np.flatnonzero((orders > sufficient) & (np.abs(masses - plateau) > band))
    return OrderStudy(
        orders=orders,
        training=training,
        validation=validation,
        mass=mass,
        optimum=optimum,
        sufficient=sufficient,
        blow_up=int(above[0]) if above.size else None,
        mass_leaves=int(leaves[0]) if leaves.size else None,
        mass_plateau=plateau,
        mass_band=band,
    )
