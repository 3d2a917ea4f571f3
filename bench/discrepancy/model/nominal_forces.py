"""Forces that the nominal model has itself and that no matrix holds: its dry friction, and springs that bend with the angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.effects.friction_limits import soft_coulomb_limit
from bench.discrepancy.numerics.cubic_spline import cubic, spline_of
from bench.discrepancy.simulation.stick_slip import ROW, SCALE, THETA, Elements, Motion, full
from bench.laws.base import kernel

if TYPE_CHECKING:
    from bench.discrepancy.model.structure import Structure

Array = NDArray[np.float64]
PIECES = 256
"""Pieces of the spline that a bending spring is tabulated as: over a turn of a pendulum either way it is good to 2e-8 of the torque."""


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

    def level(self, structure: Structure, values: Array) -> float:
        """Limit of the friction at nominal parameter values (n_parameters,)."""
        if not self.parameter:
            return self.value
        return max(float(values[structure.parameters.index(self.parameter)]), 0.0)

    def theta(self, structure: Structure, values: Array) -> Array:
        """Limit, creep velocity and lead time (3,) at nominal parameter values (n_parameters,)."""
        level = self.level(structure, values)
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


@kernel
def spline_force(t, q, v, z, theta, f):
    """A cubic spline over the displacement: its reach, then B-spline coefficients of `PIECES` equal pieces."""
    x = min(max(q[0] / theta[0], -1.0), 1.0)
    f[0] += cubic(theta, 1, PIECES, 0.5 * PIECES * (1.0 + x))


def with_own_forces(
    elements: Elements, structure: Structure, values: Array, replaced: Sequence[Array] = ()
) -> Elements:
    """Elements preceded by the nominal model's own forces.

    Args:
        elements: Force laws of a hypothesis.
        structure: The nominal model.
        values: (n_parameters,) its parameters.
        replaced: Coordinates (n_dof,) along which its dry friction is left out.
    """
    frictions, springs = _kept(structure, replaced), structure.springs
    laws = [e for e in structure.elements if not (e.rubs and any(e.acts_along(row) for row in replaced))]
    if not (frictions or springs or laws):
        return elements
    theta = [friction.theta(structure, values) for friction in frictions]
    theta += [np.append(spring.reach, spring.coefficients(values)) for spring in springs]
    theta += [law.theta(structure, values) for law in laws]
    firsts = np.cumsum([0, *(len(own) for own in theta)])
    own = [[0, 0, soft_coulomb_limit.address, 1, i, firsts[i], 0, 0] for i in range(len(frictions))]
    others = len(frictions) + len(springs)
    own += [[spline_force.address, 0, 0, 1, i, firsts[i], 0, 0] for i in range(len(frictions), others)]
    own = [[*entry, 0] for entry in own]
    start = elements.start
    for i, law in enumerate(laws, start=others):
        own.append(law.entry(i, int(firsts[i]), len(start)))
        start = np.concatenate([start, law.law.start()])
    table = full(elements.table).copy()
    table[:, ROW] += len(own)
    table[:, THETA] += firsts[-1]
    table[:, SCALE] += firsts[-1] * (table[:, SCALE] != 0)
    return Elements(
        np.vstack([np.array(own, dtype=np.int64), table]),
        np.vstack([*(force.row for force in (*frictions, *springs, *laws)), elements.rows]),
        np.concatenate([*theta, elements.theta]),
        start,
    )


def _kept(structure: Structure, replaced: Sequence[Array]) -> tuple[NominalFriction, ...]:
    return tuple(f for f in structure.frictions if not any(f.acts_along(row) for row in replaced))


def own_friction(structure: Structure, values: Array, motion: Motion, row: Array, step: float) -> Array:
    """Force (n,) of the nominal model's own dry friction along one coordinate (n_dof,)."""
    force = np.zeros(len(motion.position))
    for friction in structure.frictions:
        if friction.acts_along(row):
            force += friction.along(friction.level(structure, values), motion)
    for law in structure.elements:
        if law.rubs and law.acts_along(row):
            force += law.along(law.theta(structure, values), motion, step)
    return force


def own_force(structure: Structure, values: Array, motion: Motion, step: float) -> Array:
    """Force (n, n_dof) that the nominal model's own forces take from the structure along a motion of such a step [s]."""
    force = np.zeros_like(motion.position)
    for friction in structure.frictions:
        force += np.outer(friction.along(friction.level(structure, values), motion), friction.row)
    for spring in structure.springs:
        force += np.outer(spring.along(spring.coefficients(values), motion.position), spring.row)
    for law in structure.elements:
        force += np.outer(law.along(law.theta(structure, values), motion, step), law.row)
    return force


def own_change(structure: Structure, parameter: int, motion: Motion, values: Array, step: float) -> Array:
    """Change of `own_force` (n, n_dof) with a unit of a nominal parameter about its values (n_parameters,)."""
    force = np.zeros_like(motion.position)
    for friction in structure.frictions:
        if friction.parameter == structure.parameters[parameter]:
            force += np.outer(friction.change(max(values[parameter], 0.0), motion), friction.row)
    for spring in structure.springs:
        if parameter < len(spring.slopes):
            force += np.outer(spring.along(spring.slopes[parameter], motion.position), spring.row)
    for law in structure.elements:
        if structure.parameters[parameter] in law.parameters:
            force += np.outer(law.change(structure, values, parameter, motion, step), law.row)
    return force
