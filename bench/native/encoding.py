"""How an element is written into a model: one `<numeric>` row, read by the callbacks.

Row of float64 (all integers are exact):

| entry | meaning |
|---|---|
| 0 | `MAGIC`: this numeric is an element |
| 1 | number of the law in the table of this process (`table.slot`); −1 until bound |
| 2, 3, 4 | coordinates, hidden states, address of the first state in `act` (−1: none) |
| 5 | position of theta within the row |
| 6 … | for each coordinate: kind (0 motion, 1 input), number of terms, then (qpos, dof, coefficient) or (ctrl, 0, 1) a term |
| … | theta |

A coordinate is a joint, a fixed tendon (a linear combination of joints), or an input (a control that the law reads).
The law numbers hold within one process; `bind` writes them anew, so that a model that was pickled or saved as MJCF
works in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench.errors import ModelError, UnknownNameError
from bench.laws.base import MAX_COORDINATES, ForceLaw
from bench.native.table import slot

MAGIC = 7_305_512.0
PREFIX = "element/"
HEADER = 6
MAX_TERMS = 16


@dataclass(frozen=True)
class Coordinate:
    """What an element's coordinate is in a compiled model.

    Attributes:
        name: Name of the joint, tendon or actuator.
        is_input: True for a control that the law reads.
        terms: (address in qpos or ctrl, address in qvel, coefficient), one a joint of the combination.
    """

    name: str
    is_input: bool
    terms: tuple[tuple[int, int, float], ...]

    def values(self, qpos: NDArray, qvel: NDArray, ctrl: NDArray) -> tuple[NDArray, NDArray]:
        """Position and velocity ``(n,)`` from records ``(n, nq)``, ``(n, nv)``, ``(n, nu)``."""
        if self.is_input:
            return ctrl[:, self.terms[0][0]].copy(), np.zeros(len(ctrl))
        q = sum(coefficient * qpos[:, at] for at, _, coefficient in self.terms)
        v = sum(coefficient * qvel[:, at] for _, at, coefficient in self.terms)
        return np.asarray(q), np.asarray(v)


def row_size(law: ForceLaw) -> int:
    """Upper bound of the numbers that an element with this law needs."""
    return HEADER + law.n_coordinates * (2 + 3 * MAX_TERMS) + len(law.header) + len(law.parameters)


def _names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    return [mujoco.mj_id2name(model, kind, i) or "" for i in range(count)]


def coordinate(model: mujoco.MjModel, name: str, *, is_input: bool = False) -> Coordinate:
    """Find the joint, fixed tendon or (for an input) actuator called `name`.

    Raises:
        UnknownNameError: The model has none of that name.
        ModelError: The joint is not a slide or hinge, or the tendon is not a fixed one.
    """
    if is_input:
        actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if actuator < 0:
            raise UnknownNameError(
                "actuator", name, _names(model, mujoco.mjtObj.mjOBJ_ACTUATOR, model.nactuator)
            )
        return Coordinate(name, True, ((int(model.actuator_ctrladr[actuator]), 0, 1.0),))
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint >= 0:
        return Coordinate(name, False, (_joint_term(model, joint, 1.0),))
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
    if tendon < 0:
        known = _names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt)
        raise UnknownNameError(
            "joint or tendon", name, known + _names(model, mujoco.mjtObj.mjOBJ_TENDON, model.ntendon)
        )
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    wraps = range(first, first + count)
    if any(int(model.wrap_type[w]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for w in wraps):
        raise ModelError(
            f"tendon '{name}' is spatial; an element acts on joints or on fixed tendons (linear combinations of joints): "
            "replace it by a <fixed> tendon"
        )
    if count > MAX_TERMS:
        raise ModelError(f"tendon '{name}' combines {count} joints; at most {MAX_TERMS} are possible")
    return Coordinate(
        name,
        False,
        tuple(_joint_term(model, int(model.wrap_objid[w]), float(model.wrap_prm[w])) for w in wraps),
    )


def _joint_term(model: mujoco.MjModel, joint: int, coefficient: float) -> tuple[int, int, float]:
    kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
    if kind not in (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        raise ModelError(
            f"joint '{name}' is a {kind.name[6:].lower()} joint; an element acts on slide and hinge "
            "joints: model a free or ball joint as three slides and three hinges"
        )
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), coefficient


def write_row(
    model: mujoco.MjModel,
    name: str,
    law: ForceLaw,
    coordinates: Sequence[Coordinate],
    theta: NDArray,
    act: int,
) -> int:
    """Write an element into the numeric ``element/<name>`` of a compiled model; return the position of its theta.

    Args:
        model: The model; its numeric must have been reserved with `row_size`.
        name: Name of the element.
        law: The law; registered in the process table.
        coordinates: One a coordinate of the law, inputs last.
        theta: Header and parameters (n_theta,).
        act: Address of the first hidden state in `act`, −1 for none.

    Returns:
        Index of theta[0] in `model.numeric_data`.
    """
    numeric = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, PREFIX + name)
    start, size = int(model.numeric_adr[numeric]), int(model.numeric_size[numeric])
    row: list[float] = [MAGIC, slot(law), law.n_coordinates, len(law.states), act, 0.0]
    for item in coordinates[:MAX_COORDINATES]:
        row += [float(item.is_input), float(len(item.terms))]
        row += [number for term in item.terms for number in term]
    row[5] = float(len(row))
    model.numeric_data[start : start + size] = 0.0
    model.numeric_data[start : start + len(row)] = row
    model.numeric_data[start + len(row) : start + len(row) + len(theta)] = theta
    return start + len(row)


def claim_states(model: mujoco.MjModel, name: str) -> int:
    """Tie the state actuator ``element/<name>`` to the numeric of that name; return the address of its first state."""
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + name)
    numeric = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, PREFIX + name)
    model.actuator_dynprm[actuator, :2] = (MAGIC, numeric)
    return int(model.actuator_actadr[actuator])
