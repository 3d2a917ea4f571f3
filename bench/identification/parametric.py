"""Parametric models: the parameters of a force law, hidden states included, fitted to records of motion and force.

The hidden states are integrated along the measured motion by the law's own kernels, so that what is fitted is the
force response to prescribed motion (an output-error fit of the component, not of a structure around it).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from bench.errors import IdentificationError, UnknownNameError
from bench.laws.base import ForceLaw
from bench.laws.evaluate import evaluate


class ComponentRecord(NamedTuple):
    """A record of a component: motion and force of its coordinates."""

    time: NDArray[np.float64]  # [s] (n,)
    displacement: NDArray[np.float64]  # (n, n_coordinates)
    velocity: NDArray[np.float64]  # (n, n_coordinates)
    force: NDArray[np.float64]  # (n, n_coordinates)


@dataclass(frozen=True)
class ParametricModel:
    """A law with fitted parameters.

    Attributes:
        law: The law.
        theta: Header and parameters (n_theta,).
        std: Standard deviation of the free parameters by name, from the Jacobian at the optimum, residuals taken as
            white; too small where they are not.
        nrmse: rms(residual)/std(force) over the records fitted.
        evaluations: Number of force responses computed.
    """

    law: ForceLaw
    theta: NDArray[np.float64]
    std: dict[str, float] = field(repr=False)
    nrmse: float
    evaluations: int

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name."""
        values = self.theta[len(self.law.header) :]
        return dict(zip(self.law.parameter_names, values.tolist(), strict=True))


class _Residual:
    """Scaled force residuals of all records as a function of the free parameters."""

    def __init__(
        self, law: ForceLaw, motions: Sequence[ComponentRecord], base: NDArray, free: NDArray
    ) -> None:
        self.law, self.motions, self.base, self.free = law, motions, base, free
        self.weights = _weights(motions)
        self.evaluations = 0

    def theta(self, x: NDArray) -> NDArray[np.float64]:
        """Header and parameters with the free ones at `x`."""
        theta = self.base.copy()
        theta[self.free] = x
        return theta

    def __call__(self, x: NDArray) -> NDArray[np.float64]:
        self.evaluations += 1
        theta = self.theta(x)
        parts = [
            (evaluate(self.law, theta, m.time, m.displacement, m.velocity)[0] - m.force).ravel() * weight
            for m, weight in zip(self.motions, self.weights, strict=True)
        ]
        return np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)


def _weights(motions: Sequence[ComponentRecord]) -> list[float]:
    """Weight of each record's residuals, so that every record counts alike and their squares add up to one."""
    if not motions:
        raise IdentificationError("no records came; at least one record of motion and force is expected")
    spreads = [float(np.std(m.force)) for m in motions]
    if min(spreads) == 0.0:
        raise IdentificationError("a record's force is constant; a law cannot be identified from it")
    return [1.0 / (s * np.sqrt(m.force.size * len(motions))) for s, m in zip(spreads, motions, strict=True)]


def fit_law(
    law: ForceLaw,
    motions: Sequence[ComponentRecord],
    *,
    start: dict[str, float],
    search: dict[str, tuple[float, float]] | None = None,
    fixed: Sequence[str] = (),
    starts: int = 8,
    rng: np.random.Generator | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> ParametricModel:
    """Fit a law's parameters to records of motion and force.

    Args:
        law: The law.
        motions: Records, each weighted by its own force level.
        start: Start values by name; the others start at the law's defaults.
        search: Ranges (low, high) that further starts are drawn from, log-uniform where both are positive; also the
            scale of parameters that start at zero.
        fixed: Parameters kept at their start.
        starts: Number of starts in all; the best is kept.
        rng: Source of the further starts.
        progress: Called with (start, cost) after each start.

    Returns:
        The best fit.

    Raises:
        UnknownNameError: A name is no parameter of the law.
        IdentificationError: No records, or no force in them.
    """
    for name in (*start, *(search or {}), *fixed):
        if name not in law.parameter_names:
            raise UnknownNameError(f"parameter of law '{law.name}'", name, law.parameter_names)
    names = [name for name in law.parameter_names if name not in fixed]
    places = len(law.header) + np.array([law.parameter_names.index(name) for name in names])
    bounds = np.array([law.parameters[i - len(law.header)].bounds for i in places], dtype=float).T
    base = law.theta(**start)
    residual = _Residual(law, motions, base, places)
    ranges = {name: 0.5 * abs(high - low) for name, (low, high) in (search or {}).items()}
    half_ranges = np.array([ranges.get(name, 1.0) for name in names])  # the scale of what starts at zero
    best = None
    for number, x0 in enumerate(_starts(base[places], names, search or {}, starts, rng)):
        scale = np.where(x0 != 0.0, np.abs(x0), half_ranges)
        inside = np.clip(x0, bounds[0], bounds[1])
        result = least_squares(
            residual, inside, bounds=tuple(bounds), x_scale=scale, diff_step=1e-5, max_nfev=60
        )
        if progress is not None:
            progress(number, float(result.cost))
        if best is None or result.cost < best.cost:
            best = result
    assert best is not None
    samples = sum(m.force.size for m in motions)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * 2.0 * best.cost / max(samples - len(names), 1)
    std = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return ParametricModel(
        law, residual.theta(best.x), std, float(np.sqrt(2.0 * best.cost)), residual.evaluations
    )


def _starts(
    first: NDArray,
    names: Sequence[str],
    search: dict[str, tuple[float, float]],
    count: int,
    rng: np.random.Generator | None,
) -> list[NDArray]:
    """The given start, then Latin-hypercube starts within the search ranges."""
    points = [first.copy()]
    if search and count > 1:
        columns = [names.index(name) for name in search if name in names]
        low, high = np.array([search[names[c]] for c in columns], dtype=float).T
        log = (low > 0.0) & (high > 0.0)
        a, b = (np.where(log, np.log(np.where(log, edge, 1.0)), edge) for edge in (low, high))
        for draw in qmc.LatinHypercube(len(columns), rng=rng or np.random.default_rng(0)).random(count - 1):
            value = a + draw * (b - a)
            point = first.copy()
            point[columns] = np.where(log, np.exp(np.where(log, value, 0.0)), value)
            points.append(point)
    return points
