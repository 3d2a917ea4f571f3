"""Initial states of records in motion, as parameters of a fit.

A record that starts at rest is simulated from rest. One that starts in motion has an unknown initial state: position and
velocity of every degree of freedom become parameters of the fit, one set a record, with a prior as broad as the motion
itself around what the smoothed measurement shows. On a validation record, which no fit sees, they are estimated from the
record itself, for every model alike (`fitting.initial_state_fit`). Hidden states of hysteretic laws start at zero: a law forgets its
start within a reversal or two, and a record that tells neither the start nor the law could not tell them together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.simulation.stick_slip import Motion

START = "start "
"""Beginning of the names of initial states among the parameters."""


def in_motion(record: CaseRecord) -> bool:
    """Whether a free run of a record needs an initial state; a periodic one runs in from rest instead."""
    return not record.at_rest and not record.periodic


def start_name(quantity: str, dof: str, record: str) -> str:
    """Name of an initial state as a parameter."""
    return f"{START}{quantity} of {dof} in {record}"


def with_starts(structure: Structure, records: tuple[CaseRecord, ...]) -> Structure:
    """Return a structure that has the initial states of records in motion among its parameters; they move no matrix."""
    names = tuple(
        start_name(quantity, dof, record.name)
        for record in records
        if in_motion(record)
        for quantity in ("position", "velocity")
        for dof in structure.dofs
    )
    if not names:
        return structure
    n_dof = len(structure.dofs)
    zeros = np.zeros((len(names), n_dof, n_dof))
    return replace(
        structure,
        parameters=structure.parameters + names,
        mass=np.concatenate([structure.mass, zeros]),
        damping=np.concatenate([structure.damping, zeros]),
        stiffness=np.concatenate([structure.stiffness, zeros]),
    )


def without_starts(structure: Structure) -> Structure:
    """Return a structure as it was before `with_starts`."""
    kept = [i for i, name in enumerate(structure.parameters) if not name.startswith(START)]
    if len(kept) == len(structure.parameters):
        return structure
    return replace(
        structure,
        parameters=tuple(structure.parameters[i] for i in kept),
        mass=structure.mass[kept],
        damping=structure.damping[kept],
        stiffness=structure.stiffness[kept],
    )


def start_priors(motions: list[Motion]) -> tuple[Array, Array]:
    """Mean and standard deviation of the initial states of records in motion, in the order of `with_starts`."""
    mean, std = [], []
    for motion in motions:
        for samples in (motion.position, motion.velocity):
            mean.append(samples[0])
            spread = np.std(samples, axis=0)
            # a degree of freedom that nothing measures moves as widely as the others, for all one knows
            std.append(np.where(spread > 0.0, spread, np.max(spread, initial=0.0) or 1.0))
    if not mean:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(mean), np.concatenate(std)
