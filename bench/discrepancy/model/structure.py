"""The rigs a diagnosis knows: how nominal parameters make matrices, and channels read the motion.

Mass, damping and stiffness matrices are linear in the nominal parameters, so a rig is three stacks of constant matrices.
That linearity is used throughout: by the fits, which ask for many parameter vectors, and by the screening, where
the deviation of each nominal parameter becomes one column of a linear least-squares problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.schema import PRESCRIBED
from bench.discrepancy.model.nominal_elements import NominalElement, with_elements
from bench.discrepancy.model.nominal_forces import NominalFriction, NominalSpring
from bench.discrepancy.simulation.stick_slip import LinearStructure
from bench.errors import FileFormatError

ANSWERS = ("force", "torque")
"""What a component takes from a prescribed motion, linear and rotary."""
ACCELERATION = 2
"""Order of an observer that reads accelerations."""


@dataclass(frozen=True)
class Observer:
    """A response channel as a row of the motion.

    Attributes:
        channel: Channel name.
        order: 0 position, 1 velocity, 2 acceleration.
        row: (n_dof,).
    """

    channel: str
    order: int
    row: NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """Where an effect can sit.

    Attributes:
        name: "" on a rig with one joint; "axial", "torsional", "joint" on the joint rig; a joint name otherwise.
        rows: (n_coordinates, n_dof) relative coordinates.
        position_unit: Unit of the coordinate.
        force_unit: Unit of the force on it.
        mass: Names of the nominal parameters that are inertias moved along this coordinate.
        stiffness: Name of the nominal stiffness that acts on this coordinate; empty where there is none.
        damping: Likewise for the damping.
    """

    name: str
    rows: NDArray[np.float64]
    position_unit: str
    force_unit: str
    mass: tuple[str, ...] = ()
    stiffness: str = ""
    damping: str = ""


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

    @property
    def has_own_forces(self) -> bool:
        """Whether the nominal model has forces that no matrix holds."""
        return bool(self.frictions or self.springs or self.elements)

    def at(self, values: NDArray[np.float64]) -> LinearStructure:
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
        return LinearStructure(mass, damping, stiffness, self.inputs)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Response channels in the order of the observers."""
        return tuple(observer.channel for observer in self.observers)

    def transfer(
        self, linear: LinearStructure, omega: NDArray[np.float64], inputs: NDArray[np.float64] | None = None
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
                Place(p.name, p.rows[:, keep], p.position_unit, p.force_unit, p.mass, p.stiffness, p.damping)
                for p in self.places
                if np.abs(p.rows[:, keep]).sum() == np.abs(p.rows).sum()
            ),
            None if self.fixed is None else self.fixed[np.ix_(range(3), keep, keep)],
            tuple(f.restricted(keep) for f in self.frictions if np.any(f.row[keep])),
            tuple(s.restricted(keep, active) for s in self.springs if np.any(s.row[keep])),
            tuple(e.restricted(keep) for e in self.elements if np.any(e.row[keep])),
        )


def structure_of(case: Case) -> Structure:
    """Build the structure that a case names.

    Raises:
        FileFormatError: The rig is unknown, or a parameter or channel is missing.
    """
    bench = {"sdof": _sdof, "joint": _joint, "damper": _damper}
    if case.rig in bench:
        return with_elements(bench[case.rig](case), case)
    if case.rig.endswith(".xml"):
        from bench.discrepancy.model.mjcf import mjcf_structure  # noqa: PLC0415  (imports this module)

        return with_elements(mjcf_structure(case), case)
    raise FileFormatError(
        f"rig '{case.rig}' is unknown; known: sdof, joint, damper, or the path of an MJCF file (ending in .xml)"
    )


def _require(case: Case, parameters: Sequence[str], loads: Sequence[str]) -> None:
    have = {p.name for p in case.parameters}
    missing = [name for name in parameters if name not in have]
    if missing:
        raise FileFormatError(
            f"case '{case.name}' (rig {case.rig}) lacks the nominal parameter(s) {', '.join(missing)}; "
            f"it has {', '.join(sorted(have)) or 'none'}"
        )
    absent = [name for name in loads if not case.has(name)]
    if absent:
        raise FileFormatError(f"case '{case.name}' (rig {case.rig}) lacks the channel(s) {', '.join(absent)}")


def _observers(case: Case, table: Sequence[tuple[str, int, NDArray[np.float64]]]) -> tuple[Observer, ...]:
    found = tuple(Observer(name, order, row) for name, order, row in table if case.has(name))
    if not found:
        raise FileFormatError(
            f"case '{case.name}' has no response channel; expected one of {', '.join(name for name, _, _ in table)}"
        )
    return found


def _sdof(case: Case) -> Structure:
    names = ("mass", "damping", "stiffness", "coulomb")
    if not case.has("force") and all(c.role == "response" for c in case.channels):
        raise FileFormatError(
            f"case '{case.name}' has responses alone ({', '.join(c.name for c in case.channels)}): without what drove them nothing can be "
            'said of the model. Record the force; or, for a free decay, say that it "starts_in_motion"'
        )
    _require(case, ("mass",), ("force",))
    have = tuple(name for name in names if any(p.name == name for p in case.parameters))
    frictions = (NominalFriction(np.ones(1), "coulomb"),) if "coulomb" in have else ()
    stacks = [np.array([[[1.0 if name == kind else 0.0]] for name in have]) for kind in names[:3]]
    one = np.ones(1)
    length = next((c.unit for c in case.channels if c.name == "displacement"), "m") or "m"
    observers = _observers(case, (("displacement", 0, one), ("velocity", 1, one), ("acceleration", 2, one)))
    place = Place(
        "", np.ones((1, 1)), length, case.channel("force").unit or "N", ("mass",),
        "stiffness" if "stiffness" in have else "", "damping" if "damping" in have else "",
    )  # fmt: skip
    return Structure(
        ("x",),
        have,
        stacks[0],
        stacks[1],
        stacks[2],
        np.ones((1, 1)),
        ("force",),
        observers,
        (place,),
        frictions=frictions,
    )


def _damper(case: Case) -> Structure:
    """A massless component under prescribed motion; the mass only carries the bookkeeping of the coordinate."""
    moved = next((c for c in case.channels if c.name in PRESCRIBED[0]), None)
    answer = next((c for c in case.channels if c.name in ANSWERS), None)
    if moved is None or answer is None:
        have = ", ".join(c.name for c in case.channels)
        raise FileFormatError(
            f"case '{case.name}' (rig damper) needs a motion ({', '.join(PRESCRIBED[0])}) and what it takes ({', '.join(ANSWERS)}); "
            f"it has {have}"
        )
    rotary = answer.name == "torque"
    names = tuple(p.name for p in case.parameters if p.name in {"stiffness", "damping", "coulomb"})
    stacks = [
        np.zeros((len(names), 1, 1)),
        *(
            np.array([float(name == kind) for name in names]).reshape(-1, 1, 1)
            for kind in ("damping", "stiffness")
        ),
    ]
    place = Place(
        "", np.ones((1, 1)), moved.unit or ("rad" if rotary else "m"), answer.unit or ("N m" if rotary else "N"), (),
        "stiffness" if "stiffness" in names else "", "damping" if "damping" in names else "",
    )  # fmt: skip
    return Structure(
        ("x",),
        names,
        stacks[0],
        stacks[1],
        stacks[2],
        np.ones((1, 1)),
        (moved.name,),
        (Observer(answer.name, 0, np.ones(1)),),
        (place,),
        frictions=(NominalFriction(np.ones(1), "coulomb"),) if "coulomb" in names else (),
    )


def _joint(case: Case) -> Structure:
    axes = (("axial", "mass", "m", "N"), ("torsional", "inertia", "rad", "N m"))
    names = [p.name for p in case.parameters]
    stacks = {kind: np.zeros((len(names), 4, 4)) for kind in ("mass", "damping", "stiffness")}
    places = []
    for a, (axis, inertia, position, force) in enumerate(axes):
        ground = [f"mount_{kind}_{axis}_{body}" for kind in ("stiffness", "damping") for body in (1, 2)]
        _require(
            case,
            [f"{inertia}_1", f"{inertia}_2", *ground, f"joint_stiffness_{axis}", f"joint_damping_{axis}"],
            (),
        )
        relative = np.zeros(4)
        relative[2 * a : 2 * a + 2] = (-1.0, 1.0)
        for body in (1, 2):
            i = 2 * a + body - 1
            stacks["mass"][names.index(f"{inertia}_{body}"), i, i] = 1.0
            for kind in ("stiffness", "damping"):
                stacks[kind][names.index(f"mount_{kind}_{axis}_{body}"), i, i] = 1.0
        for kind in ("stiffness", "damping"):
            stacks[kind][names.index(f"joint_{kind}_{axis}")] = np.outer(relative, relative)
        places.append(
            Place(
                axis,
                relative[None, :],
                position,
                force,
                (f"{inertia}_1", f"{inertia}_2"),
                f"joint_stiffness_{axis}",
                f"joint_damping_{axis}",
            )
        )
    places.append(Place("joint", np.vstack([p.rows for p in places]), "m", "N"))
    eye = np.eye(4)
    table = []
    for a, (linear, angular) in enumerate(
        (
            ("displacement", "rotation"),
            ("velocity", "angular_velocity"),
            ("acceleration", "angular_acceleration"),
        )
    ):
        for body in (1, 2):
            table += [(f"{linear}_{body}", a, eye[body - 1]), (f"{angular}_{body}", a, eye[body + 1])]
    loads = tuple(name for name in ("force", "torque") if case.has(name))
    if not loads:
        raise FileFormatError(f"case '{case.name}' has neither a force nor a torque channel")
    inputs = np.zeros((4, len(loads)))
    for j, name in enumerate(loads):
        inputs[0 if name == "force" else 2, j] = 1.0
    return Structure(
        ("x1", "x2", "theta1", "theta2"), tuple(names), stacks["mass"], stacks["damping"], stacks["stiffness"],
        inputs, loads, _observers(case, table), tuple(places),
    )  # fmt: skip
