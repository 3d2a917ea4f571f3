"""Gravity on joints that turn: the torque of a pendulum, read off the user's MJCF.

Gravity on a slide moves the rest position and nothing else. On a hinge its torque is a spring, and one that bends with the angle. As
long as the torque of each joint depends on the angle of this joint alone, and inertias on none, the model stays what the
diagnosis can handle: a linear structure, whose stiffness is the tangent at rest, and a known force on top.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.discrepancy.model.nominal_forces import (
    NOMINAL_FORCES_LIMITS,
    NominalSpring,
)
from bench.discrepancy.numerics.cubic_spline import spline_through
from bench.discrepancy.settings import ModelSettings
from bench.errors import ModelError
from bench.identification.linear_rig import LinearRig, current
from bench.identification.parameter_address import address
from bench.rig import Rig
from bench.rig.building import parse

REACH = 2.0 * np.pi
"""Angle either way up to which the torque is tabulated [rad]: a whole turn."""
MASS = "structure/mass/"
"""Beginning of the names of the parameters that gravity depends on."""


def has_gravity(rig: Rig) -> bool:
    """Whether gravity acts in a model at all."""
    off = rig.model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    return bool(np.any(rig.model.opt.gravity)) and not off


def without_gravity(rig: Rig) -> Rig:
    """The same rig in free fall."""
    spec = parse(rig.mjcf, rig.folder, rig.name)
    spec.option.gravity = [0.0, 0.0, 0.0]
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def gravity_springs(
    rig: Rig, weightless: LinearRig, parameters: Sequence[str], *, settings: ModelSettings
) -> tuple[tuple[NominalSpring, ...], Array, Array]:
    """Springs that gravity makes, beyond their tangents, and these.

    Args:
        rig: The model, with gravity.
        weightless: Its matrices without gravity.
        parameters: Names of the nominal parameters, as `address` takes them; others than masses change nothing.
        settings: `ModelSettings` of the diagnosis.

    Returns:
        The springs; the tangent stiffness (n_dof,) that no parameter changes, on the diagonal; and its change (n_parameters, n_dof)
        with a unit of each.

    Raises:
        ModelError: The torque at a joint depends on the position of another one, or the reference position is not that of rest.
    """
    model, dofs = rig.model, weightless.dofs
    others = weightless.matrices[3][:, -1]  # what springs push at the reference position
    torque = _torque_of(model)
    _check_separate(rig, torque, dofs, settings=settings)
    heavier = {
        k: _torque_of(_with_more(rig, name)) for k, name in enumerate(parameters) if name.startswith(MASS)
    }
    values = np.array([current(rig, name) if k in heavier else 0.0 for k, name in enumerate(parameters)])
    x = np.linspace(-1.0, 1.0, 4 * NOMINAL_FORCES_LIMITS.pieces + 1)
    angles = np.concatenate([REACH * x, [-settings.gravity_step, settings.gravity_step]])
    springs: list[NominalSpring] = []
    tangents, changes = np.zeros(len(dofs)), np.zeros((len(parameters), len(dofs)))
    for i, dof in enumerate(dofs):
        own = _along(torque, model, int(dof), angles)
        largest = float(np.abs(own).max())
        if np.ptp(own) <= settings.gravity_agreement * largest:
            continue  # a weight on a slide: the position is counted from where that has moved it to
        if abs(own[2 * NOMINAL_FORCES_LIMITS.pieces] - others[i]) > settings.gravity_at_rest * largest:
            name = model.joint(int(model.dof_jntid[dof])).name
            raise ModelError(
                f"gravity turns joint '{name}' of '{rig.name}' out of its reference position; draw the bodies in the model as they "
                "hang at rest, and count the angle from there"
            )
        table = np.zeros((len(angles), len(parameters)))
        for k, changed in heavier.items():
            table[:, k] = _along(changed, model, int(dof), angles) - own
        changes[:, i] = (table[-1] - table[-2]) / (2.0 * settings.gravity_step)
        tangents[i] = (own[-1] - own[-2]) / (2.0 * settings.gravity_step) - values @ changes[:, i]
        bent = np.column_stack([own - table @ values, table])[:-2]
        # springs bear what gravity pulls at rest
        bent -= bent[2 * NOMINAL_FORCES_LIMITS.pieces] + np.outer(
            REACH * x, np.append(tangents[i], changes[:, i])
        )
        coefficients = spline_through(x, bent, NOMINAL_FORCES_LIMITS.pieces)
        row = np.eye(len(dofs))[i]
        springs.append(NominalSpring(row, REACH, coefficients[:, 0], coefficients[:, 1:].T.copy()))
    return tuple(springs), tangents, changes


def _torque_of(model: mujoco.MjModel) -> Callable[[Array], Array]:
    """What gravity takes from the motion (n_v,) at positions (n_q,), at rest."""
    data = mujoco.MjData(model)

    def torque(q: Array) -> Array:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = q
        with native.running(model):
            mujoco.mj_forward(model, data)
        return data.qfrc_bias - data.qfrc_gravcomp

    return torque


def _with_more(rig: Rig, name: str) -> mujoco.MjModel:
    """The model with a unit more of a parameter."""
    entry = address(rig, name)
    model = copy.copy(rig.model)
    entry.write(model, entry.value(model) + 1.0)
    return model


def _along(torque: Callable[[Array], Array], model: mujoco.MjModel, dof: int, positions: Array) -> Array:
    """Torque (n,) of a joint as it alone is moved from the reference position."""
    at = int(model.jnt_qposadr[model.dof_jntid[dof]])
    out = np.zeros(len(positions))
    for i, position in enumerate(positions):
        q = model.qpos0.copy()
        q[at] += position
        out[i] = torque(q)[dof]
    return out


def _check_separate(
    rig: Rig, torque: Callable[[Array], Array], dofs: NDArray[np.int64], *, settings: ModelSettings
) -> None:
    """Raise where the torque of one joint depends on the position of another."""
    model, rng = rig.model, np.random.default_rng(0)
    for _ in range(4):
        q = model.qpos0 + rng.uniform(-np.pi, np.pi, model.nq)
        whole = torque(q)
        for dof in dofs:
            at = int(model.jnt_qposadr[model.dof_jntid[dof]])
            alone = model.qpos0.copy()
            alone[at] = q[at]
            if abs(torque(alone)[dof] - whole[dof]) > settings.gravity_agreement * max(
                float(np.abs(whole).max()), 1e-300
            ):
                name = model.joint(int(model.dof_jntid[dof])).name
                raise ModelError(
                    f"gravity at joint '{name}' of '{rig.name}' depends on the position of other joints, which that of a nominal "
                    "model may not: take joints that were locked in the test out of the model"
                )
