"""The structure of a nominal model: how its parameters make matrices, and channels read the motion.

Mass, damping and stiffness matrices are linear in the nominal parameters, so a rig is three stacks of constant matrices.
That linearity is used throughout: by the fits, which ask for many parameter vectors, and by the screening, where
the deviation of each nominal parameter becomes one column of a linear least-squares problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.model.nominal_forces import NominalFriction, NominalSpring
from bench.discrepancy.model.nominal_laws import NominalElement
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.simulation.stick_slip import StructureMatrices


@dataclass(frozen=True)
class Place:
    """Where an effect can sit.

    Attributes:
        name: "" where there is one place only; "axial", "torsional", "joint" on the joint rig; a joint name otherwise.
        rows: (n_coordinates, n_dof) relative coordinates.
        position_unit: Unit of the coordinate.
        force_unit: Unit of the force on it.
        mass: Names of the nominal parameters that are inertias moved along this coordinate.
        stiffness: Name of the nominal stiffness that acts on this coordinate; empty where there is none.
        damping: Likewise for the damping.
        label: What to call it where `name` is empty.
    """

    name: str
    rows: NDArray[np.float64]
    position_unit: str
    force_unit: str
    mass: tuple[str, ...] = ()
    stiffness: str = ""
    damping: str = ""
    label: str = ""

    @property
    def site(self) -> str:
        """Its name in words: never empty on a rig that is known."""
        return self.name or self.label


@dataclass(frozen=True)
class Structure:
    """A rig with constant mass matrix, linear in its nominal parameters.

    Attributes:
        dofs: Names of the degrees of freedom.
        parameters: Names of the nominal parameters.
        mass: (n_parameters, n_dof, n_dof) contributions.
        damping: Likewise.
        stiffness: Likewise.
        inputs: (n_dof, n_loads).
        loads: Load channels.
        observers: Response channels.
        places: Where effects can sit.
        fixed: Mass, damping and stiffness (3, n_dof, n_dof) that no parameter changes; None for none.
        frictions: Dry friction of the nominal model.
        springs: What its restoring forces are beyond their tangents.
        elements: Laws of the bench that it holds besides.
        prescribed: Channels that measure prescribed motions: they tell the motion, and are held against nothing.
    """

    dofs: tuple[str, ...]
    parameters: tuple[str, ...]
    mass: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    inputs: NDArray[np.float64]
    loads: tuple[str, ...]
    observers: tuple[Observer, ...]
    places: tuple[Place, ...]
    fixed: NDArray[np.float64] | None = None
    frictions: tuple[NominalFriction, ...] = ()
    springs: tuple[NominalSpring, ...] = ()
    elements: tuple[NominalElement, ...] = ()
    prescribed: tuple[Observer, ...] = ()

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Degrees of freedom that no prescribed motion moves."""
        moved = np.sum([np.abs(o.row) for o in self.prescribed], axis=0) if self.prescribed else 0.0
        return np.flatnonzero(np.zeros(len(self.dofs)) + moved == 0.0)

    @property
    def has_own_forces(self) -> bool:
        """Whether the nominal model has forces that no matrix holds."""
        return bool(self.frictions or self.springs or self.elements)

    def at(self, values: NDArray[np.float64]) -> StructureMatrices:
        """Return the matrices at parameter values (n_parameters,)."""
        mass, damping, stiffness = (
            np.tensordot(values, stack, 1) for stack in (self.mass, self.damping, self.stiffness)
        )
        if self.fixed is not None:
            mass, damping, stiffness = (
                mass + self.fixed[0],
                damping + self.fixed[1],
                stiffness + self.fixed[2],
            )
        return StructureMatrices(mass, damping, stiffness, self.inputs)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Response channels in the order of the observers."""
        return tuple(observer.channel for observer in self.observers)

    def transfer(
        self, linear: StructureMatrices, omega: NDArray[np.float64], inputs: NDArray[np.float64] | None = None
    ) -> NDArray[np.complex128]:
        """Frequency responses (n_frequencies, n_channels, n_inputs) from forces on the structure to its channels."""
        b = linear.inputs if inputs is None else inputs
        dynamic = (
            linear.stiffness[None]
            + 1j * omega[:, None, None] * linear.damping[None]
            - (omega**2)[:, None, None] * linear.mass[None]
        )
        # A free body has no static response; its response at zero frequency is not asked for.
        dynamic[omega == 0] += 1e-9 * np.abs(linear.mass).max() * np.eye(len(linear.mass))
        position = np.linalg.solve(dynamic, np.broadcast_to(b, (len(omega), *b.shape)).astype(complex))
        rows = np.array([o.row for o in self.observers])
        orders = np.array([o.order for o in self.observers])
        return (1j * omega[:, None, None]) ** orders[None, :, None] * (rows @ position)

    def groups(self) -> list[tuple[int, ...]]:
        """Return the sets of degrees of freedom that the linear structure couples with one another."""
        linked = (np.abs(self.mass).sum(0) + np.abs(self.damping).sum(0) + np.abs(self.stiffness).sum(0)) > 0
        if self.fixed is not None:
            linked |= np.abs(self.fixed).sum(0) > 0
        for force in (*self.frictions, *self.springs, *self.elements):
            linked |= np.outer(force.row, force.row) != 0
        linked |= np.eye(len(self.dofs), dtype=bool)
        for _ in self.dofs:
            linked = (linked.astype(int) @ linked.astype(int)) > 0
        groups = {tuple(int(j) for j in np.flatnonzero(linked[i])) for i in range(len(self.dofs))}
        return sorted(groups)

    def restricted(self, dofs: Sequence[int]) -> Structure:
        """Return the part of the structure on some degrees of freedom (a union of `groups`)."""
        keep = list(dofs)
        if len(keep) == len(self.dofs):
            return self
        block = np.ix_(keep, keep)
        active = [
            i
            for i in range(len(self.parameters))
            if any(np.abs(stack[i][block]).sum() > 0 for stack in (self.mass, self.damping, self.stiffness))
        ]
        active += [
            self.parameters.index(f.parameter) for f in self.frictions if f.parameter and np.any(f.row[keep])
        ]
        active += [
            self.parameters.index(name)
            for e in self.elements
            if np.any(e.row[keep])
            for name in e.parameters
            if name
        ]
        active = sorted(set(active))
        loads = [i for i in range(len(self.loads)) if np.abs(self.inputs[keep, i]).sum() > 0]
        return Structure(
            tuple(self.dofs[i] for i in keep),
            tuple(self.parameters[i] for i in active),
            self.mass[np.ix_(active, keep, keep)],
            self.damping[np.ix_(active, keep, keep)],
            self.stiffness[np.ix_(active, keep, keep)],
            self.inputs[np.ix_(keep, loads)],
            tuple(self.loads[i] for i in loads),
            tuple(
                Observer(o.channel, o.order, o.row[keep])
                for o in self.observers
                if np.abs(o.row[keep]).sum() > 0
            ),
            tuple(
                replace(p, rows=p.rows[:, keep])
                for p in self.places
                if np.abs(p.rows[:, keep]).sum() == np.abs(p.rows).sum()
            ),
            None if self.fixed is None else self.fixed[np.ix_(range(3), keep, keep)],
            tuple(f.restricted(keep) for f in self.frictions if np.any(f.row[keep])),
            tuple(s.restricted(keep, active) for s in self.springs if np.any(s.row[keep])),
            tuple(e.restricted(keep) for e in self.elements if np.any(e.row[keep])),
            tuple(Observer(o.channel, o.order, o.row[keep]) for o in self.prescribed if np.any(o.row[keep])),
        )
