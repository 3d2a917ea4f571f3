"""Where effects may sit in the user's own MJCF: its joints and fixed tendons, with what the nominal model has there."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.case import Case
from bench.discrepancy.model.mjcf_couplings import LINK
from bench.discrepancy.model.mjcf_friction import nominal_frictions
from bench.discrepancy.model.mjcf_prescribed import prescribed_channels
from bench.discrepancy.model.nominal_forces import NominalFriction
from bench.discrepancy.model.structure import Place
from bench.discrepancy.settings import ModelSettings, SimulationSettings
from bench.errors import BenchError, FileFormatError, UnknownNameError
from bench.identification.linear_rig import LinearRig
from bench.rig import Rig


def _row(model: mujoco.MjModel, name: str, dofs: NDArray[np.int64]) -> Array:
    """A joint or fixed tendon as a row over the kept degrees of freedom; zeros where it moves others, too."""
    row = np.zeros(model.nv)
    for _, dof, coefficient in native.coordinate(model, name).terms:
        row[dof] += coefficient
    return row[dofs] if np.count_nonzero(row) == np.count_nonzero(row[dofs]) else np.zeros(len(dofs))


def frictions_of(
    own: Rig, linear: LinearRig, names: Sequence[str], step: float, *, settings: SimulationSettings
) -> tuple[NominalFriction, ...]:
    """Dry friction of the model itself."""
    model = own.model
    joints = [model.joint(int(model.dof_jntid[dof])).name for dof in linear.dofs]
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    frictional = [
        name
        for name in tendons
        if f"frictionloss:{name}" in names or model.tendon_frictionloss[model.tendon(name).id] > 0.0
    ]
    rows = [(name, _row(model, name, linear.dofs)) for name in (*joints, *frictional)]
    return nominal_frictions(model, rows, names, step, settings=settings)


def places_of(
    case: Case,
    rig: Rig,
    linear: LinearRig,
    names: Sequence[str],
    stacks: tuple[Array, Array, Array],
    *,
    settings: ModelSettings,
) -> tuple[Place, ...]:
    """Joints and fixed tendons where effects may sit; of `"places"` in nominal.json where it names some.

    Args:
        case: The case.
        rig: Its model.
        linear: The matrices of the model.
        names: Names of the nominal parameters.
        stacks: What they contribute to mass, damping and stiffness.
        settings: `ModelSettings` of the diagnosis.

    Raises:
        FileFormatError: ``"places"`` is no list.
        UnknownNameError: It names nothing that moves, or a joint whose motion is prescribed.
    """
    model = rig.model
    joints = [model.joint(int(model.dof_jntid[dof])).name for dof in linear.dofs]
    tendons = [name for i in range(model.ntendon) if not (name := model.tendon(i).name).startswith(LINK)]
    prescribed = {entry.joint for entry in prescribed_channels(case, rig)}
    known = [
        name
        for name in (*joints, *tendons)
        if name and name not in prescribed and (name in joints or _is_fixed(model, name))
    ]
    wanted = case.options.get("places", known)
    if not isinstance(wanted, (list, tuple)) or not wanted:
        raise FileFormatError(
            f"places is {wanted!r}; a list of joints and fixed tendons is expected: {', '.join(known)}"
        )
    out = []
    for name in wanted:
        if name not in known:
            raise UnknownNameError(
                f"place (joint or fixed tendon that moves) of '{rig.name}'", str(name), known
            )
        row = _row(model, name, linear.dofs)
        if not np.any(row):
            continue
        hinge = _hinges(model, name)
        own = [_carries(stack, row, k == 0, settings=settings) for k, stack in enumerate(stacks)]
        out.append(
            Place(
                "" if len(wanted) == 1 else name, row[None, :], "rad" if hinge else "m", "N m" if hinge else "N",
                tuple(names[i] for i in own[0]),
                next((names[i] for i in own[2]), ""), next((names[i] for i in own[1]), ""), name,
            )
        )  # fmt: skip
    return tuple(out)


def _is_fixed(model: mujoco.MjModel, name: str) -> bool:
    try:
        native.coordinate(model, name)
    except BenchError:
        return False
    return True


def _hinges(model: mujoco.MjModel, name: str) -> bool:
    _, dof, _ = native.coordinate(model, name).terms[0]
    return int(model.jnt_type[model.dof_jntid[dof]]) == int(mujoco.mjtJoint.mjJNT_HINGE)


def _carries(stack: Array, row: Array, any_motion: bool, *, settings: ModelSettings) -> list[int]:
    """Parameters that act on a coordinate: inertias that it moves, or springs and dampers of just this coordinate."""
    out = []
    for i, matrix in enumerate(stack):
        largest = float(np.abs(matrix).max())
        if largest == 0.0:
            continue
        if any_motion:
            acts = float(row @ matrix @ row) > settings.negligible * largest
        else:
            outer = np.outer(row, row)
            acts = bool(np.allclose(matrix, outer * largest / np.abs(outer).max(), atol=1e-9 * largest))
        if acts:
            out.append(i)
    return out
