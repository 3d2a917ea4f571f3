"""Uncertain numbers of a body: its mass, its moment of inertia and where its centre of mass lies."""

from __future__ import annotations

import mujoco
import numpy as np

from bench.arrays import Array
from bench.errors import ModelError

AXES = ("com_x", "com_y", "com_z")
"""Coordinates of the centre of mass in the frame of the body."""
BODIES = ("mass", "inertia", *AXES)
"""Kinds of parameters ``KIND:BODY``."""


def moment(model: mujoco.MjModel, i: int) -> float:
    """Moment of inertia [kg m^2] of body `i` about the axis of its hinge through its centre of mass; its largest without a hinge."""
    first, count = int(model.body_jntadr[i]), int(model.body_jntnum[i])
    for k in range(first, first + count):
        if int(model.jnt_type[k]) == int(mujoco.mjtJoint.mjJNT_HINGE):
            return _moment_about(model, i, k)
    return float(np.max(model.body_inertia[i]))


def _moment_about(model: mujoco.MjModel, i: int, k: int) -> float:
    """Moment of inertia [kg m^2] of body `i` about an axis through its centre of mass that is parallel to that of joint `k` of it."""
    turned, quaternion = np.zeros(3), np.zeros(4)
    mujoco.mju_negQuat(quaternion, model.body_iquat[i])
    mujoco.mju_rotVecQuat(turned, np.array(model.jnt_axis[k]), quaternion)
    return float(turned**2 @ model.body_inertia[i])


def moved_by(model: mujoco.MjModel, joint: str) -> float:
    """Inertia [kg or kg m^2] that a slide or a hinge moves of its own body, without those that this carries."""
    k = model.joint(joint).id
    i = int(model.jnt_bodyid[k])
    if int(model.jnt_type[k]) == int(mujoco.mjtJoint.mjJNT_SLIDE):
        return float(model.body_mass[i])
    arm = np.cross(model.jnt_axis[k], model.body_ipos[i] - model.jnt_pos[k])
    return _moment_about(model, i, k) + float(model.body_mass[i] * (arm @ arm))


def scaled_inertia(model: mujoco.MjModel, i: int, value: float) -> Array:
    """Principal moments (3,) of body `i` with a moment of `value` [kg m^2], see `moment`: all keep their ratios.

    Raises:
        ModelError: The body has none yet.
    """
    now = moment(model, i)
    if now <= 0.0:
        raise ModelError(
            f"body '{model.body(i).name}' has no moment of inertia about its joint, so that nothing can be scaled to {value:g} kg m^2; "
            "give it one in the MJCF (<inertial … diaginertia>)"
        )
    return np.array(model.body_inertia[i]) * (value / now)


def body_value(model: mujoco.MjModel, i: int, kind: str) -> float:
    """A number of body `i`: mass [kg], moment of inertia [kg m^2] (see `moment`), or a coordinate of its centre of mass [m]."""
    if kind == "mass":
        return float(model.body_mass[i])
    return moment(model, i) if kind == "inertia" else float(model.body_ipos[i, AXES.index(kind)])


def set_body(model: mujoco.MjModel, i: int, kind: str, value: float) -> None:
    """Set a number of body `i`, see `body_value`; the others stay, inertia about the centre of mass too.

    Raises:
        ModelError: The body has no moment of inertia that could be scaled.
    """
    if kind == "mass":
        model.body_mass[i] = value
    elif kind == "inertia":
        model.body_inertia[i] = scaled_inertia(model, i, value)
    else:
        without_shortcuts(model)
        model.body_ipos[i, AXES.index(kind)] = value


def without_shortcuts(model: mujoco.MjModel) -> None:
    """Make MuJoCo count anew what it takes for constant.

    Of a body whose inertia is diagonal in its joints it keeps the row of the mass matrix from when the model was compiled, armature
    included, and of one whose centre of mass is its origin that it is.
    """
    model.body_simple[:] = 0
    model.dof_simplenum[:] = 0
    model.body_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
