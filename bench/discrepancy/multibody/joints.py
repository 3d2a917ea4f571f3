"""Joints of an articulated model: what is theirs besides the bodies, and those that others move by a linear equality."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from bench.errors import ModelError
from bench.rig.actuators import JointDrive, drive_of, is_driven

MOVING = {int(mujoco.mjtJoint.mjJNT_HINGE): "rad", int(mujoco.mjtJoint.mjJNT_SLIDE): "m"}
"""Types of joint that a model may have, with the unit of their coordinate."""


class Joint(NamedTuple):
    """A joint.

    Attributes:
        name: Its name.
        dof: Its degree of freedom.
        body: Body that it moves.
        unit: Unit of its coordinate.
        damping, friction, armature, stiffness, reference: Passive parameters of the model.
        range: Its stops; infinite where it has none.
        drive: Its actuator; None where it has none.
        loads: Motors besides, each for a load whose force was logged: a band, a brake, a hand on a load cell.
    """

    name: str
    dof: int
    body: str
    unit: str
    damping: float
    friction: float
    armature: float
    stiffness: float
    reference: float
    range: tuple[float, float]
    drive: JointDrive | None
    loads: tuple[JointDrive, ...] = ()

    @property
    def torque_driven(self) -> bool:
        """Whether its drive takes a torque, not a target."""
        return self.drive is not None and not self.drive.servo

    @property
    def held(self) -> bool:
        """Whether a servo holds it."""
        return self.drive is not None and self.drive.servo


class Tie(NamedTuple):
    """A joint that another one moves by an equality of the model.

    Attributes:
        name: Its name.
        dof: Its degree of freedom.
        to: The other joint.
        to_dof: That joint's degree of freedom.
        ratio: Its position over that of the other.
        offset: Its position where the other's is zero.
    """

    name: str
    dof: int
    to: str
    to_dof: int
    ratio: float
    offset: float


def joint_of(model: mujoco.MjModel, i: int) -> Joint:
    """Joint `i` of a compiled model, with its actuator.

    Raises:
        ModelError: It has several, or one that the equation of a joint does not hold.
    """
    dof = int(model.jnt_dofadr[i])
    limited = bool(model.jnt_limited[i])
    drives = [drive_of(model, u) for u in range(model.nu) if is_driven(model, u, i)]
    others = [d for d in drives if not d.motor]
    if len(others) > 1:
        raise ModelError(
            f"joint '{model.joint(i).name}' has the actuators {', '.join(repr(d.name) for d in others)}, none of them a plain motor; one "
            "drive a joint is expected, and motors besides it for loads that were logged: keep the one whose command was recorded"
        )
    # of several motors the first is the drive, whose gain and delay are in question
    drive = others[0] if others else drives[0] if drives else None
    # what actuators themselves weigh and damp, behind their gears
    own = [(d.gear**2, model.actuator(d.name).id) for d in drives]
    armature = sum(behind * float(model.actuator_armature[u]) for behind, u in own)
    damping = sum(behind * float(np.ravel(model.actuator_damping[u])[0]) for behind, u in own)
    return Joint(
        model.joint(i).name,
        dof,
        body_name(model, int(model.jnt_bodyid[i])),
        MOVING[int(model.jnt_type[i])],
        float(np.ravel(model.dof_damping[dof])[0]) + damping,
        float(model.dof_frictionloss[dof]),
        float(model.dof_armature[dof]) + armature,
        float(np.ravel(model.jnt_stiffness[i])[0]),
        float(model.qpos_spring[model.jnt_qposadr[i]]),
        (float(model.jnt_range[i, 0]), float(model.jnt_range[i, 1])) if limited else (-np.inf, np.inf),
        drive,
        tuple(d for d in drives if d is not drive),
    )


def ties_of(model: mujoco.MjModel) -> tuple[Tie, ...]:
    """Joints that others move by the linear equalities of a model, none of them by a joint that is moved itself.

    Raises:
        ModelError: An equality between joints is not linear, or a joint has two.
    """
    direct: dict[int, Tie] = {}
    for e in range(model.neq):
        if int(model.eq_type[e]) != int(mujoco.mjtEq.mjEQ_JOINT) or not model.eq_active0[e]:
            continue
        first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        name, curve = model.joint(first).name, model.eq_data[e, :5]
        if second < 0:
            raise ModelError(
                f'an equality holds joint \'{name}\' where it is; weld it, or say so by "joints": {{"{name}": "hold"}}'
            )
        if np.any(curve[2:]):
            raise ModelError(
                f"the equality of joints '{name}' and '{model.joint(second).name}' is not linear (polycoef {curve.tolist()}); zeros after "
                "the second coefficient are expected"
            )
        if first in direct:
            raise ModelError(f"two equalities move joint '{name}'; one is expected")
        start, other = (float(model.qpos0[model.jnt_qposadr[i]]) for i in (first, second))
        offset = start + float(curve[0]) - float(curve[1]) * other
        direct[first] = Tie(
            name,
            int(model.jnt_dofadr[first]),
            model.joint(second).name,
            int(model.jnt_dofadr[second]),
            float(curve[1]),
            offset,
        )
    return tuple(_resolved(tie, direct, model) for tie in direct.values())


def _resolved(tie: Tie, direct: Mapping[int, Tie], model: mujoco.MjModel) -> Tie:
    """A tie to a joint that nothing moves."""
    for _ in direct:
        beyond = direct.get(int(model.joint(tie.to).id))
        if beyond is None:
            return tie
        tie = tie._replace(
            to=beyond.to,
            to_dof=beyond.to_dof,
            ratio=tie.ratio * beyond.ratio,
            offset=tie.offset + tie.ratio * beyond.offset,
        )
    raise ModelError(f"the equalities of joint '{tie.name}' go in a circle")


def with_moved(joint: Joint, moved: Joint, tie: Tie) -> Joint:
    """A joint with what acts on another one that it moves.

    Raises:
        ModelError: Both have an actuator, or a position servo counts from elsewhere.
    """
    ratio, offset = tie.ratio, tie.offset
    stiffness = joint.stiffness + ratio**2 * moved.stiffness
    pull = joint.stiffness * joint.reference + ratio * moved.stiffness * (moved.reference - offset)
    drive = joint.drive
    if moved.drive is not None:
        if drive is not None:
            raise ModelError(
                f"an equality moves joints '{joint.name}' and '{moved.name}' together, and they have an actuator each ('{drive.name}', "
                f"'{moved.drive.name}'); keep the one whose command or torque was recorded"
            )
        if moved.drive.servo and abs(offset) > 1e-9:
            raise ModelError(
                f"actuator '{moved.drive.name}' is a position servo on joint '{moved.name}', which an equality moves with an offset of "
                f"{offset:g}; put it on joint '{joint.name}'"
            )
        drive = replace(moved.drive, gear=moved.drive.gear * ratio)
    loads = tuple(replace(load, gear=load.gear * ratio) for load in moved.loads)
    ends = sorted((end - offset) / ratio for end in moved.range) if ratio else (-np.inf, np.inf)
    return joint._replace(
        damping=joint.damping + ratio**2 * moved.damping,
        friction=joint.friction + abs(ratio) * moved.friction,
        armature=joint.armature + ratio**2 * moved.armature,
        stiffness=stiffness,
        reference=pull / stiffness if stiffness else joint.reference,
        range=(max(joint.range[0], ends[0]), min(joint.range[1], ends[1])),
        drive=drive,
        loads=(*joint.loads, *loads),
    )


def body_name(model: mujoco.MjModel, i: int) -> str:
    """Name of body `i`; of one without a name, that of what moves it."""
    first = int(model.body_jntadr[i])
    return model.body(i).name or (f"body of {model.joint(first).name}" if first >= 0 else f"body {i}")
