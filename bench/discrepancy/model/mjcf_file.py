"""The user's MJCF as the rig of a case."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.free_decay import NO_LOAD
from bench.discrepancy.model.mjcf_prescribed import prescribed_channels, with_prescribed_joints
from bench.errors import ModelError, UnknownNameError
from bench.rig import Rig
from bench.rig.building import parse
from bench.rig.held_joints import followed, held, with_held_joints


@dataclass(frozen=True)
class MjcfFileSettings:
    """Numbers of `bench.discrepancy.model.mjcf_file`."""

    largest: float = 1e30
    """Largest number of a model [SI units]: the mass of the sun; squares of products of such still are numbers."""


SETTINGS = MjcfFileSettings()
SIZES = (
    "body_mass", "body_inertia", "body_ipos", "body_pos", "jnt_pos", "jnt_stiffness", "dof_damping", "dof_armature",
    "dof_frictionloss", "actuator_gear", "actuator_gainprm", "actuator_biasprm",
)  # fmt: skip
"""What a model's forces are made of."""


def rig_of(case: Case) -> Rig:
    """The user's model, held joints welded; with an actuator that exerts nothing for a case without load, and motors for motions, those
    of joints that are followed among them.

    Raises:
        ModelError: The file cannot be read, holds a number that no force can be computed with, or a joint that cannot be held.
        UnknownNameError: A prescribed motion, or a joint that was held or is followed, is that of nothing in the model.
        FileFormatError: A prescribed motion is not that of one joint.
    """
    rig = Rig.from_file(Path(case.folder or ".") / case.rig)
    _refuse_beyond_numbers(rig)
    rig = with_held_joints(rig, case.options.get("joints", {}))
    rig = with_prescribed_joints(
        rig, {entry.joint for entry in prescribed_channels(case, rig)} | _followed(case, rig)
    )
    if not case.has(NO_LOAD) or NO_LOAD in rig.actuators:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    joint = _measured_joint(case, rig)
    if joint:
        actuator = spec.add_actuator(name=NO_LOAD, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def idle_parts(case: Case) -> dict[str, str]:
    """Joints that were held or are followed, and their actuators, by name: which of the two the joint did."""
    joints = case.options.get("joints")
    how = dict.fromkeys(held(joints), "held") | dict.fromkeys(followed(joints), "followed")
    if not how:
        return {}
    model = Rig.from_file(Path(case.folder or ".") / case.rig).model
    of_joint = int(mujoco.mjtTrn.mjTRN_JOINT)
    driven = {
        model.actuator(u).name: model.joint(int(model.actuator_trnid[u, 0])).name
        for u in range(model.nu)
        if int(model.actuator_trntype[u]) == of_joint
    }
    return how | {actuator: how[joint] for actuator, joint in driven.items() if joint in how}


def _followed(case: Case, rig: Rig) -> set[str]:
    """Joints that a case has follow what was measured of them."""
    wanted = followed(case.options.get("joints"))
    known = [rig.model.joint(i).name for i in range(rig.model.njnt)]
    for name in sorted(wanted.difference(known)):
        raise UnknownNameError("joint that is followed", name, known)
    return wanted


def _refuse_beyond_numbers(rig: Rig) -> None:
    for name in SIZES:
        largest = float(np.abs(getattr(rig.model, name)).max(initial=0.0))
        if largest > SETTINGS.largest:
            raise ModelError(
                f"the MJCF '{rig.name}' holds {largest:.3g} (MuJoCo's {name}); "
                f"numbers up to {SETTINGS.largest:g} are expected: correct the model"
            )


def _measured_joint(case: Case, rig: Rig) -> str:
    """A joint that a channel measures, else the first one of the model."""
    model = rig.model
    for channel in case.channels:
        kind, _, name = channel.target.rpartition(":")
        if kind == "joint":
            return name
        sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name or channel.name)
        if sensor >= 0 and int(model.sensor_objtype[sensor]) == int(mujoco.mjtObj.mjOBJ_JOINT):
            return model.joint(int(model.sensor_objid[sensor])).name
    return model.joint(0).name if model.njnt else ""
