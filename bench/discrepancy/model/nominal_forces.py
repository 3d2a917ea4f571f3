"""Forces that the nominal model has itself and that no matrix holds: its dry friction, and its nonlinear springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.numerics.cubic_spline import spline_of
from bench.discrepancy.simulation.stick_slip import Motion


class NominalForcesLimits(NamedTuple):
    """Numbers of `bench.discrepancy.model.nominal_forces` that compiled code holds."""

    pieces: int = 256
    """Pieces of the spline that a bending spring is tabulated as: over a turn of a pendulum either way it is good to 2e-8 of the
    torque."""


NOMINAL_FORCES_LIMITS = NominalForcesLimits()


@dataclass(frozen=True)
class NominalFriction:
    """Dry friction that the nominal model has already.

    Attributes:
        row: (n_dof,) relative coordinate that it acts on.
        parameter: Name of the nominal parameter that is its limit; empty where the limit is fixed.
        value: The limit where it is fixed [N or N m].
        creep: Velocity of creep at the limit, over the limit [m/s/N or rad/s/(N m)]; zero where it sticks.
        lead: Time by which it turns round before the velocity does [s], see `bench.laws.soft_friction`.
    """

    row: Array
    parameter: str = ""
    value: float = 0.0
    creep: float = 0.0
    lead: float = 0.0

    def level(self, parameters: Sequence[str], values: Array) -> float:
        """Limit of the friction at the values (n_parameters,) of nominal parameters of such names."""
        if not self.parameter:
            return self.value
        return max(float(values[parameters.index(self.parameter)]), 0.0)

    def theta(self, parameters: Sequence[str], values: Array) -> Array:
        """Limit, creep velocity and lead time (3,) at the values (n_parameters,) of nominal parameters of such names."""
        level = self.level(parameters, values)
        return np.array([level, level * self.creep, self.lead])

    def acts_along(self, row: Array) -> bool:
        """Whether it acts on a coordinate (n_dof,), and on it alone."""
        return bool(np.array_equal(self.row, row))

    def along(self, level: float, motion: Motion) -> Array:
        """Force (n,) of a limit of `level` along a motion."""
        ahead = (motion.velocity + self.lead * motion.acceleration) @ self.row
        if self.creep == 0.0 or level == 0.0:
            return level * np.sign(ahead)
        return np.clip(ahead / self.creep, -level, level)

    def change(self, level: float, motion: Motion) -> Array:
        """Change (n,) of the force with a unit of its limit: none where it creeps, since the limit then is not reached."""
        ahead = (motion.velocity + self.lead * motion.acceleration) @ self.row
        return np.sign(ahead) * (np.abs(ahead) >= level * self.creep)

    def rate(self, mass: Array) -> float:
        """How fast the creep of a structure of such mass (n_dof, n_dof) settles [1/s]; zero where friction sticks."""
        slow = self.lead + self.creep / float(self.row @ np.linalg.solve(mass, self.row))
        return 1.0 / slow if slow > 0.0 else 0.0

    def restricted(self, keep: Sequence[int]) -> NominalFriction:
        """The same on some degrees of freedom."""
        return replace(self, row=self.row[list(keep)])


@dataclass(frozen=True)
class NominalSpring:
    """What a restoring force of the nominal model is beyond its tangent: gravity on a pendulum that swings far.

    Attributes:
        row: (n_dof,) coordinate that it acts on.
        reach: Displacement either way up to which it is known; beyond it stays what it is there [m or rad].
        fixed: (PIECES + 3,) coefficients of the cubic spline that no parameter changes [N or N m].
        slopes: (n_parameters, PIECES + 3) their change with a unit of each nominal parameter.
    """

    row: Array
    reach: float
    fixed: Array
    slopes: Array

    def coefficients(self, values: Array) -> Array:
        """Coefficients (PIECES + 3,) at nominal parameter values; initial states may follow these."""
        changed = values[: len(self.slopes)] @ self.slopes
        return np.asarray(self.fixed + changed, dtype=np.float64)

    def along(self, coefficients: Array, position: Array) -> Array:
        """Force (n,) of a spline of such coefficients at positions (n, n_dof)."""
        x = np.asarray(position @ self.row / self.reach, dtype=np.float64)
        return np.asarray(spline_of(coefficients)(np.clip(x, -1.0, 1.0)), dtype=np.float64)

    def slope_along(self, coefficients: Array, position: Array) -> Array:
        """Stiffness (n,) of a spline of such coefficients at positions (n, n_dof); none beyond its reach."""
        x = np.asarray(position @ self.row / self.reach, dtype=np.float64)
        inside = np.abs(x) <= 1.0
        slope = spline_of(coefficients).derivative()
        return np.asarray(
            np.where(inside, slope(np.where(inside, x, 0.0)), 0.0) / self.reach, dtype=np.float64
        )

    def restricted(self, keep: Sequence[int], active: Sequence[int]) -> NominalSpring:
        """The same on some degrees of freedom, with some of the parameters."""
        own = [i for i in active if i < len(self.slopes)]
        return NominalSpring(self.row[list(keep)], self.reach, self.fixed, self.slopes[own])
