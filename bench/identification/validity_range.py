"""The region of states that a model was identified from, which every reduced-order model carries."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RangeWarning
from bench.identification.fit_data import read_only


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
            read_only(data.min(axis=0)),
            read_only(data.max(axis=0)),
            read_only(mean),
            read_only(precision),
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
            minimum=read_only(values["minimum"]),
            maximum=read_only(values["maximum"]),
            mean=read_only(values["mean"]),
            precision=read_only(values["precision"]),
            radius=float(values["radius"]),
        )


def state_names(n_joints: int) -> tuple[str, ...]:
    """Names ``q1 … qn, v1 … vn`` of the relative states of n joints."""
    return tuple(f"{letter}{i + 1}" for letter in "qv" for i in range(n_joints))
