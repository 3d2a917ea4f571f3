"""The nominal model's own forces as elements of the integrator, and along a given motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.arrays import Array
from bench.discrepancy.effects.friction_limits import soft_coulomb_limit
from bench.discrepancy.model.nominal_forces import (
    NOMINAL_FORCES_LIMITS,
    NominalFriction,
)
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.numerics.cubic_spline import cubic
from bench.discrepancy.simulation.equations_of_motion import ROW, SCALE, THETA
from bench.discrepancy.simulation.stick_slip import Elements, Motion, full
from bench.laws.base import kernel


@kernel
def spline_force(t, q, v, z, theta, f):
    """A cubic spline over the displacement: its reach, then B-spline coefficients of `pieces` equal pieces."""
    x = min(max(q[0] / theta[0], -1.0), 1.0)
    f[0] += cubic(theta, 1, NOMINAL_FORCES_LIMITS.pieces, 0.5 * NOMINAL_FORCES_LIMITS.pieces * (1.0 + x))


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
    theta = [friction.theta(structure.parameters, values) for friction in frictions]
    theta += [np.append(spring.reach, spring.coefficients(values)) for spring in springs]
    theta += [law.theta(structure.parameters, values) for law in laws]
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
            force += friction.along(friction.level(structure.parameters, values), motion)
    for law in structure.elements:
        if law.rubs and law.acts_along(row):
            force += law.along(law.theta(structure.parameters, values), motion, step)
    return force


def own_force(structure: Structure, values: Array, motion: Motion, step: float) -> Array:
    """Force (n, n_dof) that the nominal model's own forces take from the structure along a motion of such a step [s]."""
    force = np.zeros_like(motion.position)
    for friction in structure.frictions:
        force += np.outer(friction.along(friction.level(structure.parameters, values), motion), friction.row)
    for spring in structure.springs:
        force += np.outer(spring.along(spring.coefficients(values), motion.position), spring.row)
    for law in structure.elements:
        force += np.outer(law.along(law.theta(structure.parameters, values), motion, step), law.row)
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
            force += np.outer(law.change(structure.parameters, values, parameter, motion, step), law.row)
    return force
