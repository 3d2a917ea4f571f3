"""The nominal model's own forces as elements of the integrator, and along a given motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.effects.friction_limits import soft_coulomb_limit
from bench.discrepancy.model.nominal_forces import PIECES, NominalFriction
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.numerics.cubic_spline import cubic
from bench.discrepancy.simulation.stick_slip import ROW, SCALE, THETA, Elements, Motion, full
from bench.laws.base import kernel

Array = NDArray[np.float64]


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
    if not (frictions or springs):
        return elements
    theta = [friction.theta(structure.parameters, values) for friction in frictions]
    theta += [np.append(spring.reach, spring.coefficients(values)) for spring in springs]
    firsts = np.cumsum([0, *(len(own) for own in theta)])
    own = [[0, 0, soft_coulomb_limit.address, 1, i, firsts[i], 0, 0] for i in range(len(frictions))]
    own += [[spline_force.address, 0, 0, 1, i, firsts[i], 0, 0] for i in range(len(frictions), len(theta))]
    table = full(elements.table).copy()
    table[:, ROW] += len(own)
    table[:, THETA] += firsts[-1]
    table[:, SCALE] += firsts[-1] * (table[:, SCALE] != 0)
    return Elements(
        np.vstack([full(np.array(own, dtype=np.int64)), table]),
        np.vstack([*(force.row for force in (*frictions, *springs)), elements.rows]),
        np.concatenate([*theta, elements.theta]),
        elements.start,
    )


def _kept(structure: Structure, replaced: Sequence[Array]) -> tuple[NominalFriction, ...]:
    return tuple(f for f in structure.frictions if not any(f.acts_along(row) for row in replaced))


def own_friction(structure: Structure, values: Array, motion: Motion, row: Array) -> Array:
    """Force (n,) of the nominal model's own dry friction along one coordinate (n_dof,)."""
    force = np.zeros(len(motion.position))
    for friction in structure.frictions:
        if friction.acts_along(row):
            force += friction.along(friction.level(structure.parameters, values), motion)
    return force


def own_force(structure: Structure, values: Array, motion: Motion) -> Array:
    """Force (n, n_dof) that the nominal model's own forces take from the structure along a motion."""
    force = np.zeros_like(motion.position)
    for friction in structure.frictions:
        force += np.outer(friction.along(friction.level(structure.parameters, values), motion), friction.row)
    for spring in structure.springs:
        force += np.outer(spring.along(spring.coefficients(values), motion.position), spring.row)
    return force


def own_change(structure: Structure, parameter: int, motion: Motion, nominal: float) -> Array:
    """Change of `own_force` (n, n_dof) with a unit of a nominal parameter about its value."""
    force = np.zeros_like(motion.position)
    for friction in structure.frictions:
        if friction.parameter == structure.parameters[parameter]:
            force += np.outer(friction.change(max(nominal, 0.0), motion), friction.row)
    for spring in structure.springs:
        if parameter < len(spring.slopes):
            force += np.outer(spring.along(spring.slopes[parameter], motion.position), spring.row)
    return force
