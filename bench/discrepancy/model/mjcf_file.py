"""The user's MJCF as the rig of a case."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.free_decay import NO_LOAD
from bench.errors import ModelError, UnknownNameError
from bench.rig import Rig
from bench.rig.building import parse


def rig_of(case: Case) -> Rig:
    """The user's model, joints that were held welded; where a case has no load, with an actuator that exerts none.

    Raises:
        ModelError: The file cannot be read, or a joint cannot be held.
        UnknownNameError: A joint that was held is none of the model.
    """
    rig = _held(Rig.from_file(Path(case.folder or ".") / case.rig), case.options.get("joints", {}))
    if not case.has(NO_LOAD) or NO_LOAD in rig.actuators:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    joint = _measured_joint(case, rig)
    if joint:
        actuator = spec.add_actuator(name=NO_LOAD, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def _held(rig: Rig, joints: object) -> Rig:
    """A rig whose joints of the given names are welded: "hold" at their zero, a number at that coordinate [rad or m]."""
    if not isinstance(joints, Mapping) or not joints:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    known = [joint.name for joint in spec.joints]
    for name, at in joints.items():
        if name not in known:
            raise UnknownNameError("joint that was held", name, known)
        joint = spec.joint(name)
        for item in (*spec.actuators, *spec.sensors):
            if (item.target if isinstance(item, mujoco.MjsActuator) else item.objname) == name:
                spec.delete(item)
        body = joint.parent
        _turned(body, joint, 0.0 if at == "hold" else float(at))
        spec.delete(joint)
        # a body that something refers to is not made a part of the one before it, whose stated mass would then be that of both
        spec.add_sensor(
            name=f"held_{name}",
            type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=body.name,
        )
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def _turned(body: mujoco.MjsBody, joint: mujoco.MjsJoint, at: float) -> None:
    """Move a body as its joint does at a coordinate."""
    if joint.type not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        raise ModelError(
            f"joint '{joint.name}' is no hinge and no slide; one of those is expected where a joint was held"
        )
    if at == 0.0:
        return
    turn, moved, own = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.array(body.quat)
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
        moved = at * axis
    else:
        mujoco.mju_axisAngle2Quat(turn, axis, at)
        mujoco.mju_rotVecQuat(moved, np.array(joint.pos), turn)
        moved = np.array(joint.pos) - moved
    shift, quaternion = np.zeros(3), np.zeros(4)
    mujoco.mju_rotVecQuat(shift, moved, own)
    mujoco.mju_mulQuat(quaternion, own, turn)
    body.pos, body.quat = np.array(body.pos) + shift, quaternion


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
