"""Joints of the user's MJCF that were held, welded where they were, or that followed a motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from bench.errors import ModelError, UnknownNameError
from bench.rig.building import parse
from bench.rig.description import Rig

MOTION = "motion of "
"""Beginning of the names of the actuators that stand for what prescribes a motion; the joint's name follows."""


def with_held_joints(rig: Rig, joints: object) -> Rig:
    """A rig whose joints of the given names are welded.

    Args:
        rig: The user's model.
        joints: Name to "hold", at the zero of the joint, or to the coordinate at which it was held [rad or m]; one to "follow" stays.

    Raises:
        ModelError: A joint is no hinge and no slide.
        UnknownNameError: A joint is none of the model.
    """
    if not held(joints):
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    weld(spec, joints)
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def weld(spec: mujoco.MjSpec, joints: object) -> None:
    """Weld joints of a model in place; arguments and errors as of `with_held_joints`."""
    known = [joint.name for joint in spec.joints]
    for name, at in held(joints).items():
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


def held(joints: object) -> dict[str, Any]:
    """Joints of `with_held_joints` that were held, with where."""
    return {n: at for n, at in joints.items() if at != "follow"} if isinstance(joints, Mapping) else {}


def followed(joints: object) -> set[str]:
    """Joints of `with_held_joints` that move as measured, whatever moves them."""
    return {n for n, how in joints.items() if how == "follow"} if isinstance(joints, Mapping) else set()


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
