"""Actuators of an articulated model as the equations of its joints hold them."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from bench.errors import ModelError


class JointDrive(NamedTuple):
    """The actuator of a joint.

    Attributes:
        name: Its name in the model.
        servo: Whether its input is a position target; otherwise a force.
        gear: Joint torque over actuator force.
        kp: Position gain of a servo, or gain of the input.
        kv: Velocity gain of a servo.
        low, high: Limits of the actuator's force.
        lowest, highest: Limits of its input.
        lag: Time constant of a first-order filter before it [s]; zero where there is none.
    """

    name: str
    servo: bool
    gear: float
    kp: float
    kv: float
    low: float
    high: float
    lowest: float
    highest: float
    lag: float


def is_driven(model: mujoco.MjModel, u: int, joint: int) -> bool:
    """Whether actuator `u` acts on a joint alone."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trntype[u]) in kinds and int(model.actuator_trnid[u, 0]) == joint


def drive_of(model: mujoco.MjModel, u: int) -> JointDrive:
    """Actuator `u`.

    Raises:
        ModelError: Its gain, bias or activation is none that the equation of a joint has.
    """
    name = model.actuator(u).name
    gain, bias = model.actuator_gainprm[u], model.actuator_biasprm[u]
    affine = int(model.actuator_biastype[u]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    if int(model.actuator_gaintype[u]) != int(mujoco.mjtGain.mjGAIN_FIXED) or (
        not affine and int(model.actuator_biastype[u]) != int(mujoco.mjtBias.mjBIAS_NONE)
    ):
        raise ModelError(
            f"actuator '{name}' has a gain or bias that is neither fixed nor affine; a motor, position or velocity actuator is expected"
        )
    servo = affine and bias[1] != 0.0
    lag = 0.0
    if int(model.actuator_dyntype[u]) in (
        int(mujoco.mjtDyn.mjDYN_FILTER),
        int(mujoco.mjtDyn.mjDYN_FILTEREXACT),
    ):
        lag = float(model.actuator_dynprm[u, 0])
    elif int(model.actuator_dyntype[u]) != int(mujoco.mjtDyn.mjDYN_NONE):
        raise ModelError(
            f"actuator '{name}' has an activation that is no first-order filter; none or 'filter' is expected"
        )
    forces = model.actuator_forcerange[u] if model.actuator_forcelimited[u] else (-np.inf, np.inf)
    inputs = model.actuator_ctrlrange[u] if model.actuator_ctrllimited[u] else (-np.inf, np.inf)
    joint = int(model.actuator_trnid[u, 0])
    if model.jnt_actfrclimited[joint]:
        gear = float(model.actuator_gear[u, 0])
        own = np.sort(np.array(model.jnt_actfrcrange[joint]) / gear)
        forces = (max(forces[0], own[0]), min(forces[1], own[1]))
    return JointDrive(
        name, servo, float(model.actuator_gear[u, 0]), float(gain[0]), float(-bias[2]) if affine else 0.0,
        float(forces[0]), float(forces[1]), float(inputs[0]), float(inputs[1]), lag,
    )  # fmt: skip
