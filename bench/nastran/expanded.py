"""The equations of a structure with its reduced-order joint written out as virtual degrees of freedom.

A network joint with n1 coordinates and l tanh units turns the n equations of a structure into ``n + n1 + l + l + n1`` (72 for
the eight-degree chain, two coordinates and 30 units) of the form ``M4 u'' + C4 u' + K4 u = F5`` for

    u = (x, x_p, S1, S2, S3)

structure, relative states, tanh inputs, tanh outputs, restoring forces. Everything nonlinear stands on the right:
``tanh`` on the rows of S2 and the joint's forces, by S3, on the rows of x.

Two forms of the virtual rows exist and both can be assembled:

- "deck": what the cards of appendix B.3 say. Relative states and tanh inputs have stiffness terms only, and damping only
  for the weights of the velocities: algebraic relations.
- "printed": eqs. 5.41 and 5.63, which also put identities into the damping of x_p and S1 and write ``S1 + S1'`` where the
  input of tanh is meant. Read as differential equations (which they are to a solver), x_p follows its relation with a
  time constant of 1 s that is never seen, since the relation holds from the start, and S1 does lag by 1 s, but
  ``S1 + S1'`` is again exactly the input. Both forms therefore have the same solution; the printed one has n1 + l more
  states, and a solver that reads tanh's input off S1 alone, as NOLIN1 does, needs the deck's.

Signs follow the deck: ``x_p`` is the second body less the first, S3 opposes it. Eqs. 5.45 and 5.65 print the forces the other
way round, which would make the joint's stiffness negative.

References:
    Tasbihgoo 2006, eqs. 5.14-5.46 and 5.56-5.65.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.laws.network import NetworkWeights
from bench.nastran.network_deck import network_weights
from bench.rig import Element, Rig

EquationForm = Literal["deck", "printed"]


@dataclass(frozen=True, eq=False)
class ExpandedSystem:
    """``M u'' + C u' + K u = B a + constant + N(u)`` for u = (x, x_p, S1, S2, S3), a the actuators' commands.

    Attributes:
        mass: M ``(s, s)``.
        damping: C ``(s, s)``.
        stiffness: K ``(s, s)``.
        inputs: B ``(s, n_actuators)``.
        constant: Biases of the network ``(s,)``.
        relation: ``x_p = relation @ x`` ``(n1, n)``.
        weights: The network, SI.
        form: "deck" or "printed"; see the module.
        timestep: Step of the rig it was assembled from [s].
        freedoms: Names of the structure's joints (n,).
        actuators: Names of the actuators (n_actuators,).
    """

    mass: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    inputs: NDArray[np.float64]
    constant: NDArray[np.float64]
    relation: NDArray[np.float64]
    weights: NetworkWeights
    form: EquationForm
    timestep: float
    freedoms: tuple[str, ...]
    actuators: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("mass", "damping", "stiffness", "inputs", "constant", "relation"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def order(self) -> int:
        """Number of equations s."""
        return len(self.mass)

    @property
    def parts(self) -> tuple[slice, slice, slice, slice, slice]:
        """Where x, x_p, S1, S2 and S3 stand in u."""
        k, n = self.relation.shape
        width = self.weights.b1.size
        inputs, hidden, forces = n + k, n + k + width, n + k + 2 * width
        return (
            slice(0, n),
            slice(n, inputs),
            slice(inputs, hidden),
            slice(hidden, forces),
            slice(forces, forces + k),
        )

    def nonlinear_load(self, u: NDArray[np.float64], rate: NDArray[np.float64]) -> NDArray[np.float64]:
        """N(u, u'): tanh on the rows of S2, the joint's forces on the rows of x ``(s,)``."""
        x, _, inputs, hidden, forces = self.parts
        load = np.zeros(self.order)
        load[x] = -self.relation.T @ u[forces]
        argument = u[inputs] + rate[inputs] if self.form == "printed" else u[inputs]
        load[hidden] = np.tanh(argument)
        return load


def expanded_system(
    rig: Rig, element: str | Element = "joint", *, form: EquationForm = "deck"
) -> ExpandedSystem:
    """Assemble the expanded equations of a rig whose only element is a network joint.

    Mass, damping, stiffness and input matrices are read off the MuJoCo model, which must be linear without its joint.

    Args:
        rig: The rig, with or without the element.
        element: Name of the rig's network element, or the element itself for a rig without it.
        form: "deck" or "printed"; see the module.

    Raises:
        UnknownNameError: Unknown `form`, element or joint.
        ParameterError: The element is no network.
        ModelError: The rig holds other elements, or its structure is not linear (rotations about different axes, limits,
            friction, contact, springs with a preload).
    """
    if form not in get_args(EquationForm):
        raise UnknownNameError("form of the expanded system", form, get_args(EquationForm))
    joint = rig.element(element) if isinstance(element, str) else element
    others = [present.name for present in rig.elements if present.name != joint.name]
    if others:
        raise ModelError(
            f"rig '{rig.name}' also holds the elements {others}; the expanded system knows one network "
            "joint in a linear structure"
        )
    weights = network_weights(joint)
    bare = rig.with_(elements=())
    mass, damping, stiffness, inputs = _structure(bare)
    relation = _relation(bare, joint)
    k, n = relation.shape
    width = weights.b1.size
    zero = np.zeros((n + 2 * k + 2 * width, n + 2 * k + 2 * width))
    system = ExpandedSystem(
        zero,
        zero,
        zero,
        np.concatenate([inputs, np.zeros((2 * k + 2 * width, inputs.shape[1]))]),
        np.concatenate([np.zeros(n + k), weights.b1, np.zeros(width), weights.b2]),
        relation,
        weights,
        form,
        rig.timestep,
        tuple(bare.model.joint(i).name for i in range(n)),
        bare.actuators,
    )
    x, p, s1, s2, s3 = system.parts
    big_mass, big_damping, big_stiffness = zero.copy(), zero.copy(), zero.copy()
    big_mass[x, x], big_damping[x, x], big_stiffness[x, x] = mass, damping, stiffness
    big_stiffness[p, x], big_stiffness[p, p] = -relation, np.eye(k)
    big_stiffness[s1, p], big_stiffness[s1, s1] = -weights.W1[:, :k], np.eye(width)
    big_stiffness[s2, s2] = np.eye(width)
    big_stiffness[s3, s2], big_stiffness[s3, s3] = -weights.W2, np.eye(k)
    big_damping[s1, p] = -weights.W1[:, k:]
    if form == "printed":
        big_damping[p, x], big_damping[p, p], big_damping[s1, s1] = -relation, np.eye(k), np.eye(width)
    return ExpandedSystem(
        big_mass,
        big_damping,
        big_stiffness,
        system.inputs,
        system.constant,
        relation,
        weights,
        form,
        rig.timestep,
        system.freedoms,
        system.actuators,
    )


def _relation(rig: Rig, joint: Element) -> NDArray[np.float64]:
    """Coefficients of the joint's coordinates in the structure's ``(n1, n)`` (the transpose of minus eq. 5.20's e)."""
    relation = np.zeros((len(joint.joints), rig.model.nv))
    for row, name in enumerate(joint.joints):
        for _, dof, coefficient in native.coordinate(rig.model, name).terms:
            relation[row, dof] += coefficient
    return relation


def _structure(rig: Rig) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """M, C, K and B of a model that is linear, found by unit displacements, velocities and commands."""
    model = rig.model
    n, n_inputs = model.nv, len(rig.actuators)
    if model.nq != n or model.na or n_inputs != model.nu:
        raise ModelError(
            f"rig '{rig.name}' has {model.nq} positions for {n} velocities and {model.na} actuator states; only "
            "slide and hinge joints and actuators without states can be written as matrices"
        )
    data = mujoco.MjData(model)

    def forces(q: NDArray, v: NDArray, command: NDArray) -> NDArray[np.float64]:
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, command
        with native.running(model):
            mujoco.mj_forward(model, data)
        return data.qfrc_passive + data.qfrc_actuator + data.qfrc_constraint - data.qfrc_bias

    none, unit = np.zeros(n), np.eye(n)
    offset = forces(none, none, np.zeros(n_inputs))
    stiffness = np.stack([offset - forces(row, none, np.zeros(n_inputs)) for row in unit], axis=1)
    damping = np.stack([offset - forces(none, row, np.zeros(n_inputs)) for row in unit], axis=1)
    inputs = np.zeros((n, n_inputs))
    for i, row in enumerate(np.eye(n_inputs)):
        inputs[:, i] = forces(none, none, row) - offset
    mass = np.zeros((n, n))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    rng = np.random.default_rng(0)
    q, v, command = (rng.uniform(-0.5, 0.5, size) for size in (n, n, n_inputs))
    total = forces(q, v, command)
    expected = -stiffness @ q - damping @ v + inputs @ command
    moved = np.zeros((n, n))
    mujoco.mj_fullM(model, data, moved)
    scale = np.max(np.abs(stiffness @ q)) + np.max(np.abs(inputs @ command)) + np.finfo(float).tiny
    # rounding leaves some 1e-15 of the largest force; 1e-9 is far below any nonlinearity that matters
    if np.max(np.abs(total - expected)) > 1e-9 * scale or np.max(np.abs(moved - mass)) > 1e-9 * np.max(
        np.abs(mass)
    ):
        raise ModelError(
            f"the structure of rig '{rig.name}' is not linear (its forces or its inertia change with the position); the "
            "expanded system needs a linear structure around the joint"
        )
    return mass, damping, stiffness, inputs


def controls_matrix(system: ExpandedSystem, controls: NDArray[np.float64]) -> NDArray[np.float64]:
    """Check commands ``(n, n_actuators)`` and return them as a contiguous array.

    Raises:
        ParameterError: Wrong number of columns, or not finite.
    """
    array = np.ascontiguousarray(controls, dtype=float)
    if (
        array.ndim != 2
        or array.shape[1] != len(system.actuators)
        or len(array) < 1
        or not np.all(np.isfinite(array))
    ):
        raise ParameterError(
            f"commands of shape {array.shape} came; finite numbers, one column each for {system.actuators}, are expected"
        )
    return array
