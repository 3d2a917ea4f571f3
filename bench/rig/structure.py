"""Numbers of the structure itself: where a mass, an inertia or a stiffness stands in a compiled model."""

from __future__ import annotations

from typing import NamedTuple, get_args

import mujoco
import numpy as np

from bench.arrays import Array
from bench.errors import UnknownNameError
from bench.mjcf import StructureName
from bench.rig.bodies import moment

STRUCTURE: tuple[str, ...] = get_args(StructureName)
"""Structural quantities that `Rig.with_structure` changes."""


class Address(NamedTuple):
    """Where a number stands in a compiled model, or in the copies of it that a batch holds.

    Attributes:
        field: Field of the model.
        index: Of the entry in it.
        ratios: Of the entries of a row to the number, where a row is that number: the principal moments of a body to its moment of
            inertia.
    """

    field: str
    index: int
    ratios: tuple[float, ...] = ()

    def value(self, model: mujoco.MjModel) -> float:
        """The number in a model."""
        row = np.ravel(getattr(model, self.field)[self.index])
        largest = int(np.argmax(self.ratios)) if self.ratios else 0
        return float(row[largest]) / (self.ratios[largest] if self.ratios else 1.0)

    def write(self, model: mujoco.MjModel, value: float) -> None:
        """Write the number to a model, whose constants are then to be computed anew (`mj_setConst`)."""
        getattr(model, self.field)[self.index] = np.multiply(value, self.ratios) if self.ratios else value

    def write_each(self, rows: Array, values: Array) -> None:
        """Write a number (m,) to each of the copies (m, n, …) of the field."""
        target = rows[:, self.index]
        target[:] = (
            np.multiply.outer(values, self.ratios)
            if self.ratios
            else np.reshape(values, (-1,) + (1,) * (target.ndim - 1))
        )


def structure_address(model: mujoco.MjModel, kind: str, name: str) -> Address:
    """Where a structural quantity stands.

    A body's moment of inertia is that about the axis of its hinge through its centre of mass, or its largest without a hinge
    (`bench.rig.bodies.moment`); its principal moments keep their ratios.

    Args:
        model: The model.
        kind: One of `STRUCTURE`.
        name: Body, joint or tendon.

    Raises:
        UnknownNameError: No such quantity, body, joint or tendon.
    """
    if kind not in STRUCTURE:
        raise UnknownNameError("structural quantity", kind, STRUCTURE)
    kinds = mujoco.mjtObj
    if kind in {"mass", "inertia"}:
        body = mujoco.mj_name2id(model, kinds.mjOBJ_BODY, name)
        if body < 0:
            raise UnknownNameError("body", name, [model.body(i).name for i in range(1, model.nbody)])
        return Address("body_mass", body) if kind == "mass" else _inertia(model, body)
    joint = mujoco.mj_name2id(model, kinds.mjOBJ_JOINT, name)
    if joint >= 0:
        if kind == "stiffness":
            return Address("jnt_stiffness", joint)
        return Address(f"dof_{kind}", int(model.jnt_dofadr[joint]))
    tendon = mujoco.mj_name2id(model, kinds.mjOBJ_TENDON, name)
    if tendon < 0:
        joints = [model.joint(i).name for i in range(model.njnt)]
        raise UnknownNameError(
            "joint or tendon", name, joints + [model.tendon(i).name for i in range(model.ntendon)]
        )
    return Address(f"tendon_{kind}", tendon)


def _inertia(model: mujoco.MjModel, body: int) -> Address:
    now = moment(model, body)
    ratios = model.body_inertia[body] / now if now > 0.0 else np.ones(3)
    return Address("body_inertia", body, tuple(ratios.tolist()))
