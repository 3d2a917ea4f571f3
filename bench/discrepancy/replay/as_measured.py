"""Joints of the user's own model that follow the measured motion, in plain MuJoCo.

They get an armature so large that nothing moves them but a servo of their own, which is fed position, velocity and acceleration.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from bench.arrays import Array
from bench.discrepancy.application.applying import Applied
from bench.discrepancy.application.target import PREFIX, as_mujoco
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.motion import JointMotion


@dataclass(frozen=True)
class AsMeasuredSettings:
    """Numbers of `bench.discrepancy.replay.as_measured`."""

    heavy: float = 1e6
    """Armature of a joint that follows the measured motion, over its inertia: what it still feels of the others."""
    servo_rate: float = 0.2
    """Its servo's frequency [rad] a step: far below the limit of two of an explicit step."""


SETTINGS = AsMeasuredSettings()


def holder(joint: str) -> str:
    """Name of the actuator that lets a joint follow."""
    return f"{PREFIX}{joint}_as_measured"


def held(
    applied: Applied, free: Collection[str], reference: mujoco.MjModel, moved: Sequence[str]
) -> mujoco.MjModel:
    """The model with all joints but some, what was added to these, and those that others move, following the measured motion."""
    spec = applied.spec.copy()
    step = float(spec.option.timestep)
    data = mujoco.MjData(reference)
    mujoco.mj_forward(reference, data)
    full = np.zeros((reference.nv, reference.nv))
    mujoco.mj_fullM(reference, data, full)
    rate = SETTINGS.servo_rate / step
    followed = {j.name for j in spec.joints if not j.name.startswith(PREFIX)} - {*free, *moved}
    followed |= {
        f"{PREFIX}{name}_train" for name in applied.outputs if name not in free
    }  # its link is what was measured
    for joint in [j for j in spec.joints if j.name in followed]:
        inertia = SETTINGS.heavy * float(
            full[reference.joint(joint.name).dofadr[0], reference.joint(joint.name).dofadr[0]]
        )
        joint.armature = inertia
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator: Any = spec.add_actuator(
            name=holder(joint.name), target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        as_mujoco(actuator)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = inertia * rate**2
        actuator.biasprm[:3] = (0.0, -inertia * rate**2, -2.0 * inertia * rate)
    model = replace(applied, spec=spec).compiled()
    _reweigh(model, reference)
    return model


def _reweigh(model: mujoco.MjModel, reference: mujoco.MjModel) -> None:
    """Give constraints the inertia that they have in the model as it is."""
    for i in range(reference.njnt):
        at = int(model.joint(reference.joint(i).name).dofadr[0])
        model.dof_invweight0[at] = reference.dof_invweight0[reference.jnt_dofadr[i]]
    for i in range(reference.ntendon):
        model.tendon_invweight0[model.tendon(reference.tendon(i).name).id] = reference.tendon_invweight0[i]


@dataclass(frozen=True, eq=False)
class Followed:
    """Positions, velocities (steps, n_joints) at the steps, and the commands of the servos that follow them."""

    position: Array
    velocity: Array
    command: Array


def followed(
    joints: Sequence[Joint],
    motion: JointMotion,
    record: CaseRecord,
    model: mujoco.MjModel,
    steps: int,
    late: float,
) -> Followed:
    """The measured motion as a servo of `held` takes it; of a joint whose log is late, the others as late."""
    step = float(model.opt.timestep)
    clock = np.arange(len(record)) * record.step
    times = np.clip(np.arange(steps) * step - late, 0.0, clock[-1])
    q, v, a = (
        CubicSpline(clock, part)(times) for part in (motion.position, motion.velocity, motion.acceleration)
    )
    rate = SETTINGS.servo_rate / step
    return Followed(q, v, q + 2.0 * v / rate + a / rate**2)
