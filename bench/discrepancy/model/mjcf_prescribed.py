"""Prescribed motion in the user's own MJCF: a table that shakes what stands on it, a turntable, a carriage that a machine moves.

A channel of the role "prescribed" measures the motion of one joint, by the joint's name and a quantity or by a sensor that reads this joint
alone. What the model itself has move that joint (a spring, friction, a drive, a weld to a mocap body) is taken out. In the structure it
stays a degree of freedom, with a mass so large that nothing it carries moves it back, and the load is that mass times its
acceleration: the large-mass method.

References:
    P. Léger, I. M. Idé, P. Paultre, Computers & Structures 36 (1990) 1153-1158.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.case import ORDERS, Case, CaseChannel
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.motion.observer import ACCELERATION, Observer
from bench.discrepancy.settings import ModelSettings
from bench.errors import FileFormatError, UnknownNameError
from bench.rig import Rig
from bench.rig.building import parse
from bench.rig.held_joints import MOTION

SCALAR = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
AXES = ("_x", "_y", "_z")


class PrescribedChannel(NamedTuple):
    """A channel that measures a prescribed motion.

    Attributes:
        channel: Its name.
        joint: Joint whose motion it is.
        order: 0 position, 1 velocity, 2 acceleration.
        gain: Reading for a unit of the joint's motion.
        bias: Reading at rest: gravity, of an accelerometer.
    """

    channel: str
    joint: str
    order: int
    gain: float
    bias: float


def prescribed_channels(case: Case, rig: Rig) -> tuple[PrescribedChannel, ...]:
    """The channels of a case that measure prescribed motions.

    Args:
        case: The case.
        rig: The user's model.

    Raises:
        UnknownNameError: A channel names no joint and no sensor of the model.
        FileFormatError: A sensor reads more than one joint, or none.
    """
    wanted = [channel for channel in case.channels if channel.role == "prescribed"]
    return tuple(_of_channel(channel, rig) for channel in wanted)


def acceleration_name(joint: str) -> str:
    """Name of the load that is made of a measured position or velocity of a joint."""
    return f"acceleration of {joint}"


def loads_of_motion(channels: Sequence[PrescribedChannel]) -> dict[str, PrescribedChannel]:
    """Joint to the channel whose acceleration drives it: the one made of all that is measured of it, else the one measured.

    Raises:
        FileFormatError: The motion of a joint has no acceleration yet (`checks.prescribed_loads` makes one).
    """
    out: dict[str, PrescribedChannel] = {}
    for entry in sorted(channels, key=lambda c: c.channel != acceleration_name(c.joint)):
        if entry.order == ACCELERATION:
            out.setdefault(entry.joint, entry)
    for entry in channels:
        if entry.joint not in out:
            raise FileFormatError(
                f"'{entry.channel}' prescribes joint '{entry.joint}' by its {ORDERS[entry.order]}, of which no acceleration was made: "
                "admit the case first"
            )
    return out


def with_large_masses(case: Case, rig: Rig, structure: Structure, *, settings: ModelSettings) -> Structure:
    """A structure whose prescribed joints follow their loads whatever they carry, and whose motion tells what is measured of them.

    Args:
        case: The case.
        rig: Its model, with the motors of `with_prescribed_joints`.
        structure: The structure, a unit force at a joint for a unit of the load that moves it.
        settings: `ModelSettings` of the diagnosis.
    """
    channels = [c for c in prescribed_channels(case, rig) if c.joint in structure.dofs]
    if not channels or structure.fixed is None:
        return structure
    values = {p.name: p.value for p in case.parameters}
    mass = structure.at(np.array([values[name] for name in structure.parameters])).mass
    fixed, inputs = structure.fixed.copy(), structure.inputs.copy()
    for joint, load in loads_of_motion(channels).items():
        i = structure.dofs.index(joint)
        large = settings.large_mass * mass[i, i]
        fixed[0][i, i] += large
        inputs[:, structure.loads.index(load.channel)] *= large / load.gain
    eye = np.eye(len(structure.dofs))
    told = tuple(Observer(c.channel, c.order, c.gain * eye[structure.dofs.index(c.joint)]) for c in channels)
    return replace(structure, fixed=fixed, inputs=inputs, prescribed=told)


def with_prescribed_joints(rig: Rig, joints: Collection[str]) -> Rig:
    """A rig whose joints are moved by a motor each, ``MOTION`` before its name, and by nothing else.

    Args:
        rig: The user's model.
        joints: Names.
    """
    if not joints:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    bodies = {joint.parent.name for joint in spec.joints if joint.name in joints}
    mocap = {body.name for body in spec.bodies if body.mocap}
    drives = {
        actuator.name
        for actuator in spec.actuators
        if actuator.target in joints
        and actuator.trntype in {mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT}
    }
    for sensor in list(spec.sensors):
        if sensor.objtype == mujoco.mjtObj.mjOBJ_ACTUATOR and sensor.objname in drives:
            spec.delete(sensor)
    for actuator in list(spec.actuators):
        if actuator.name in drives:
            spec.delete(actuator)
    for equality in list(spec.equalities):
        tied = {equality.name1, equality.name2}
        if (
            equality.type in {mujoco.mjtEq.mjEQ_WELD, mujoco.mjtEq.mjEQ_CONNECT}
            and tied & bodies
            and tied & mocap
        ):
            spec.delete(equality)
    for joint in spec.joints:
        if joint.name in joints:
            joint.stiffness, joint.damping = np.zeros_like(joint.stiffness), np.zeros_like(joint.damping)
            joint.frictionloss = 0.0
            joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
            motor = spec.add_actuator(
                name=MOTION + joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
            )
            motor.set_to_motor()
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def _of_channel(channel: CaseChannel, rig: Rig) -> PrescribedChannel:
    model = rig.model
    if channel.target.startswith("joint:"):
        name = channel.target.removeprefix("joint:")
        known = [model.joint(j).name for j in range(model.njnt) if int(model.jnt_type[j]) in SCALAR]
        if name not in known:
            raise UnknownNameError(f"joint (slide or hinge) of '{rig.name}'", name, known)
        if channel.quantity not in ORDERS:
            raise UnknownNameError(f"quantity of channel '{channel.name}'", channel.quantity, ORDERS)
        return PrescribedChannel(channel.name, name, ORDERS.index(channel.quantity), 1.0, 0.0)
    sensor = channel.target.removeprefix("sensor:") or channel.name
    order, gains, bias = _readings(sensor, channel, rig)
    moving = np.argwhere(np.abs(gains) > 1e-9 * np.abs(gains).max(initial=0.0))
    if len(moving) != 1:
        joints = [model.joint(int(model.dof_jntid[dof])).name for dof in np.unique(moving[:, 1])]
        read = f"sensor '{sensor}' reads {'joints ' + ', '.join(joints) if joints else 'nothing that moves'}"
        if len(joints) == 1:
            read = f"several components of sensor '{sensor}' read joint '{joints[0]}'"
        raise FileFormatError(
            f"channel '{channel.name}' is prescribed, and {read}; the motion of one joint is expected: give the channel "
            '"joint" and "quantity", or name the component of the sensor'
        )
    component, dof = (int(i) for i in moving[0])
    joint = model.joint(int(model.dof_jntid[dof])).name
    return PrescribedChannel(channel.name, joint, order, float(gains[component, dof]), float(bias[component]))


def _readings(name: str, channel: CaseChannel, rig: Rig) -> tuple[int, Array, Array]:
    """Order of a sensor, its components' readings for a unit motion of every joint (n_components, n_v), and at rest (n_components,)."""
    model = copy.copy(rig.model)
    plain = name if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name) >= 0 else name[:-2]
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, plain)
    if index < 0:
        known = [model.sensor(i).name for i in range(model.nsensor)]
        raise UnknownNameError(f"sensor of '{rig.name}' (channel '{channel.name}', prescribed)", name, known)
    if any(int(kind) not in SCALAR for kind in model.jnt_type):
        raise FileFormatError(
            f"'{rig.name}' has a free or ball joint beside the prescribed motion '{channel.name}'; slides and hinges are expected"
        )
    model.sensor_cutoff[:] = 0.0
    order = int(model.sensor_needstage[index]) - int(mujoco.mjtStage.mjSTAGE_POS)
    address, size = int(model.sensor_adr[index]), int(model.sensor_dim[index])
    still = _reading(model, order, np.zeros(model.nv))[address : address + size]
    # a position by a small step: a sensor may bend
    unit = 1e-6 if order == 0 else 1.0
    moved = [_reading(model, order, unit * row)[address : address + size] - still for row in np.eye(model.nv)]
    gains = np.stack(moved, axis=1) / unit
    if name != plain:
        only = AXES.index(name[-2:])
        gains, still = gains[[only]], still[[only]]
    return order, gains, still if order == ACCELERATION else np.zeros_like(still)


@native.quiet()
def _reading(model: mujoco.MjModel, order: int, motion: Array) -> Array:
    """All sensors at the reference position, displaced, in motion or accelerated by `motion` (n_v,)."""
    data = mujoco.MjData(model)
    if order == 0:
        data.qpos += motion
    elif order == 1:
        data.qvel[:] = motion
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    if order == ACCELERATION:
        data.qacc[:] = motion
    mujoco.mj_sensorPos(model, data)
    mujoco.mj_sensorVel(model, data)
    mujoco.mj_sensorAcc(model, data)
    return data.sensordata.copy()
