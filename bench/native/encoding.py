"""How an element is written into a model: one `<numeric>` row, read by the callbacks.

Row of float64 (all integers are exact):

| entry | meaning |
|---|---|
| 0 | `MAGIC`: this numeric is an element |
| 1, 2 | number of the law in the table of this process, and its token (`table.slot`); −1 and 0 until bound |
| 3, 4, 5 | coordinates, hidden states, address of the first state in `act` (−1: none) |
| 6 | position of theta within the row |
| 7 | checksum of the law's identity and of all counts and addresses of the row |
| 8 … | for each coordinate: kind (0 motion, 1 input), number of terms, then (qpos, dof, coefficient) or (ctrl, 0, 1) a term |
| … | theta |

A coordinate is a joint, a fixed tendon (a linear combination of joints), or an input (a control that the law reads).
Entries 1 and 2 hold within one process; `bind` writes them anew, after it has checked the others against the law and the
model, so that a model that was pickled or saved as MJCF works in another.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench.errors import ModelError, NativeError, UnknownNameError
from bench.laws.base import MAX_COORDINATES, ForceLaw
from bench.native.table import registered, slot

MAGIC = 7_305_512.0
"""First number of every row that holds an element: by it the callback tells these rows from those of others."""
PREFIX = "element/"
"""How the names of the numeric fields begin that hold elements."""
HEADER = 8
MAX_TERMS = 16
OWN = slice(1, 3)
"""Entries of a row that hold within one process: law number and token."""
UNBOUND = (-1.0, 0.0)
"""What stands there in a file."""
_DIGITS = 10**6
"""Checksums are smaller: MuJoCo writes six digits of a number into MJCF."""


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
    row: list[float] = [MAGIC, *slot(law), law.n_coordinates, len(law.states), act, 0.0, 0.0]
    for item in coordinates[:MAX_COORDINATES]:
        row += [float(item.is_input), float(len(item.terms))]
        row += [number for term in item.terms for number in term]
    row[6] = float(len(row))
    row[7] = _checksum(law, row)
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


def _checksum(law: ForceLaw, row: Sequence[float]) -> float:
    """Checksum of what the law is and of the counts and addresses of a row up to theta, its coefficients left out.

    Raises:
        ValueError: A count or address is not finite.
        IndexError: The row ends before its coordinates do.
    """
    counts = [int(row[i]) for i in (3, 4, 5, 6)]
    at = HEADER
    for _ in range(min(counts[0], MAX_COORDINATES)):
        terms = int(row[at + 1])
        counts += [int(row[at]), terms]
        for term in range(at + 2, at + 2 + 3 * min(terms, MAX_TERMS), 3):
            counts += [int(row[term]), int(row[term + 1])]
        at += 2 + 3 * terms
    identity = (law.name, law.parameter_names, law.states, tuple(map(float, law.header)), at, counts)
    return float(zlib.crc32(repr(identity).encode()) % _DIGITS)


def element_rows(model: mujoco.MjModel) -> list[int]:
    """The numerics of a model that are marked as elements."""
    data, at = model.numeric_data, model.numeric_adr
    return [i for i in range(model.nnumeric) if model.numeric_size[i] and data[at[i]] == MAGIC]


def check_registered(model: mujoco.MjModel) -> None:
    """Refuse a model with elements whose laws were not registered by this process.

    Raises:
        NativeError: Such an element; the model comes from another process, or from a file.
    """
    data = model.numeric_data
    for numeric in element_rows(model):
        start, size = int(model.numeric_adr[numeric]), int(model.numeric_size[numeric])
        if size <= HEADER or not registered(float(data[start + 1]), float(data[start + 2])):
            raise NativeError(
                f"'{model.numeric(numeric).name}' of the model is an element of another process or of a file: its law is not known "
                "here. Build the model from its Rig in this process (a pickled Rig does so by itself), or give its laws to "
                "bench.native.bind"
            )


def bind_row(model: mujoco.MjModel, numeric: int, law: ForceLaw) -> None:
    """Check a row against its law and the model, and write this process's law number and token into it.

    Raises:
        NativeError: It is not what `write_row` wrote for this law and this model.
    """
    name = model.numeric(numeric).name
    start, size = int(model.numeric_adr[numeric]), int(model.numeric_size[numeric])
    row = model.numeric_data[start : start + size]
    fault = _fault(model, name, row, law)
    if fault:
        raise NativeError(
            f"'{name}' of the model is no element with the law '{law.name}' as the bench writes it: {fault}. Export the model anew "
            "with Rig.to_xml, or build it from its Rig"
        )
    if law.states:
        claim_states(model, name.removeprefix(PREFIX))
    row[OWN] = slot(law)


def _fault(model: mujoco.MjModel, name: str, row: NDArray, law: ForceLaw) -> str:
    """What is wrong with a row of a file; empty where nothing is."""
    if not name.startswith(PREFIX):
        return f"its name does not begin with '{PREFIX}'"
    if len(row) <= HEADER or not np.isfinite(row).all():
        return f"it has {len(row)} numbers, or not finite ones"
    try:
        own = _checksum(law, row.tolist())
    except (IndexError, OverflowError):
        return "its coordinates do not fit into it"
    if own != row[7]:
        return "its checksum belongs to another law, or its counts or addresses were changed"
    if (int(row[3]), int(row[4])) != (law.n_coordinates, len(law.states)):
        return f"it has {row[3]:g} coordinates and {row[4]:g} hidden states"
    first = int(row[6])
    theta = row[first : first + len(law.header) + len(law.parameters)]
    if len(theta) < len(law.header) + len(law.parameters) or tuple(theta[: len(law.header)]) != law.header:
        return "its parameters do not fit the law"
    if not _within(model, row):
        return "an address lies outside the model"
    return _fault_of_states(model, name, row) if law.states else ""


def _within(model: mujoco.MjModel, row: NDArray) -> bool:
    """Whether the coordinates of a row refer to joints and controls that the model has."""
    at = HEADER
    for _ in range(int(row[3])):
        terms = int(row[at + 1])
        if not 1 <= terms <= MAX_TERMS:
            return False
        for term in range(at + 2, at + 2 + 3 * terms, 3):
            bounds = (model.nu, 1) if row[at] else (model.nq, model.nv)
            if not all(0 <= row[term + i] < bound for i, bound in enumerate(bounds)):
                return False
        at += 2 + 3 * terms
    return at == int(row[6])


def _fault_of_states(model: mujoco.MjModel, name: str, row: NDArray) -> str:
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    if actuator < 0 or model.actuator_dyntype[actuator] != mujoco.mjtDyn.mjDYN_USER:
        return f"the model has no actuator '{name}' that carries its hidden states"
    held = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
    if held != (int(row[5]), int(row[4])):
        return f"the actuator '{name}' carries {held[1]} states from {held[0]}"
    return ""
