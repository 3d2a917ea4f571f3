"""The equations of the joints held against MuJoCo's along the measured motion: what of the model they leave out, and where it acts."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.discrepancy.articulated.against_model import needed
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.checks.like_mujoco import ITEMS
from bench.discrepancy.multibody.inputs import input_of, inputs_of, load_on
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import JointMotion, Moving
from bench.discrepancy.settings import LikenessSettings


@dataclass(frozen=True)
class ComparisonSettings:
    """How the equations of the joints are held against MuJoCo's.

    Attributes:
        poses: Samples of a record at which they are.
        like: When a difference counts; `LikenessSettings.share` of the torque, here of what acts on the joint.
    """

    poses: int = 200
    like: LikenessSettings = field(default_factory=LikenessSettings)


class _Apart(NamedTuple):
    share: float
    joint: str
    time: float
    moving: int
    index: int


def left_out(
    case: Case,
    model: ArticulatedModel,
    compiled: mujoco.MjModel,
    moving: list[Moving],
    settings: ComparisonSettings,
) -> str:
    """What MuJoCo has act on a joint along the measured motion and the joint's equation has not, in words; empty where nothing is.

    Dry friction is left out of both, which is whatever holds the joint at rest, and so are delays: a balance of forces has no past.
    """
    plain = copy.copy(compiled)
    plain.dof_frictionloss[:] = 0.0
    plain.actuator_delay[:] = 0.0
    worst: _Apart | None = None
    for r, (record, motion) in enumerate(moving):
        picked = np.unique(np.linspace(0, len(record) - 1, settings.poses).astype(int))
        ours = _balance(case, model, record, motion)[picked]
        theirs, size = _balance_of_mujoco(case, plain, model, record, motion, picked)
        apart = np.abs(theirs - ours)
        for j, joint in enumerate(model.joints):
            share = float(np.sqrt(np.mean(apart[:, j] ** 2)) / max(float(size[j]), 1e-300))
            if share > settings.like.share and (worst is None or share > worst.share):
                first = int(picked[int(np.argmax(apart[:, j] > settings.like.share * size[j]))])
                worst = _Apart(share, joint.name, float(record.time[first]), r, j)
    if worst is None:
        return ""
    record, motion = moving[worst.moving]
    culprit = _culprit(case, model, plain, record, motion, worst.index, settings)
    return (
        f"along the motion of '{record.name}' MuJoCo has other torques on joint '{worst.joint}' than the nominal equation that a diagnosis "
        f"of an articulated model works with, by {100.0 * worst.share:.3g} % of what acts there, from t = {worst.time:.4g} s on: "
        f"{culprit or 'something in the model beyond inertia, damping, springs, gravity and drives'} comes into play; take it out of the "
        "model and let the diagnosis look for it, or stay where it does not act"
    )


def _balance(case: Case, model: ArticulatedModel, record: CaseRecord, motion: JointMotion) -> Array:
    """Torque asked for less torque of the drive (n, n_joints), by the equations of the joints."""
    out = np.empty((len(motion.position), len(model.joints)))
    for j, joint in enumerate(model.joints):
        drive = joint.drive
        assert drive is not None
        command = record.values[input_of(case, joint).name]
        torque = drive.torque(command, motion.position[:, j], motion.velocity[:, j])
        out[:, j] = needed(model, joint, j, motion) - torque - load_on(case, joint, record)
    return out


def _balance_of_mujoco(
    case: Case,
    compiled: mujoco.MjModel,
    model: ArticulatedModel,
    record: CaseRecord,
    motion: JointMotion,
    picked: NDArray[np.intp],
) -> tuple[Array, Array]:
    """The same at some samples (n_picked, n_joints) as MuJoCo has it, and the RMS (n_joints,) of what acts on each joint.

    What acts on a joint that another one moves, acts on that by the ratio of the two.
    """
    data, out = mujoco.MjData(compiled), np.empty((len(picked), len(model.joints)))
    acting = np.zeros(len(model.joints))
    inputs = {
        compiled.actuator(name).id: samples
        for joint in model.joints
        for name, samples in inputs_of(case, joint, record).items()
    }
    q, v, a = (model.whole(part, order) for order, part in enumerate(motion[:3]))
    with native.quiet():
        for k, sample in enumerate(picked):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[sample], v[sample], a[sample]
            for u, samples in inputs.items():
                data.ctrl[u] = samples[sample]
            mujoco.mj_inverse(compiled, data)
            asked = model.on_joints(data.qfrc_inverse)
            mujoco.mj_fwdPosition(compiled, data)
            mujoco.mj_fwdVelocity(compiled, data)
            _settle(compiled, data)
            mujoco.mj_fwdActuation(compiled, data)
            given = model.on_joints(data.qfrc_actuator)
            out[k] = asked - given
            acting += asked**2 + given**2
    return out, np.sqrt(acting / len(picked))


def _settle(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Filters of actuators at what is commanded: their lag is no matter of a balance of forces."""
    for u in range(model.nu):
        if int(model.actuator_actnum[u]) == 1:
            data.act[int(model.actuator_actadr[u])] = data.ctrl[u]


def _culprit(
    case: Case,
    model: ArticulatedModel,
    compiled: mujoco.MjModel,
    record: CaseRecord,
    motion: JointMotion,
    j: int,
    settings: ComparisonSettings,
) -> str:
    """The item without which MuJoCo comes nearest to the equation of joint `j`; empty where none halves the difference."""
    picked = np.unique(np.linspace(0, len(record) - 1, settings.poses).astype(int))
    ours = _balance(case, model, record, motion)[picked, j]

    def distance(variant: mujoco.MjModel) -> float:
        theirs, _ = _balance_of_mujoco(case, variant, model, record, motion, picked)
        return float(np.sum((theirs[:, j] - ours) ** 2))

    whole, left = distance(compiled), {}
    for name, take in ITEMS.items():
        variant = copy.copy(compiled)
        take(variant)
        left[name] = distance(variant)
    best = min(left, key=lambda name: left[name])
    return best if left[best] < 0.5 * whole else ""
