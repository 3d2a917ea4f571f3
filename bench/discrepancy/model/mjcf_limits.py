"""Stops, contacts and control ranges of a user's MJCF: left out of the nominal model where the records never reach them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.motion.measured import measured_motion
from bench.discrepancy.settings import DiagnosisSettings, MotionSettings
from bench.errors import ModelError, UnknownNameError
from bench.rig import Rig
from bench.rig.building import parse

DISABLED = 0


def free_of_constraints(rig: Rig, joints: Sequence[str], *, prefix: str) -> Rig:
    """Return a rig without ranges, contacts and dry friction, and with position sensors at some joints.

    Args:
        rig: The user's own.
        joints: Joints that need a sensor.
        prefix: Beginning of the names of these sensors; the joint's name follows.

    Raises:
        UnknownNameError: No such joint.
    """
    spec = parse(rig.mjcf, rig.folder, rig.name)
    known = [joint.name for joint in spec.joints]
    for name in joints:
        if name not in known:
            raise UnknownNameError(f"joint of '{rig.name}'", name, known)
        spec.add_sensor(
            name=prefix + name, type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name
        )  # fmt: skip
    for joint in spec.joints:
        joint.limited = joint.actfrclimited = DISABLED
        joint.frictionloss = 0.0
    for tendon in spec.tendons:
        tendon.limited = tendon.actfrclimited = DISABLED
        tendon.frictionloss = 0.0
    for actuator in spec.actuators:
        actuator.ctrllimited = actuator.forcelimited = DISABLED
    for sensor in spec.sensors:
        sensor.cutoff = 0.0
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    try:
        spec.compile()
    except ValueError as error:
        raise ModelError(f"the MJCF '{rig.name}' does not compile: {error}") from None
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


def check_reach(
    case: Case,
    structure: Structure,
    rig: Rig,
    actuators: Mapping[str, str],
    dofs: NDArray[np.int64],
    *,
    settings: DiagnosisSettings,
) -> None:
    """Refuse records whose motion reaches a stop or a contact of the model, or whose load is beyond a control range.

    Args:
        case: For the records.
        structure: Structure without stops.
        rig: The user's model, with them.
        actuators: Load channel to actuator.
        dofs: Degrees of freedom of the model that the structure has.
        settings: Thresholds of the diagnosis.
    """
    model = rig.model
    for record in (*case.identification, *case.validation):
        for channel, name in actuators.items():
            actuator = model.actuator(name)
            low, high = actuator.ctrlrange
            reached = record.values[channel]
            if case.channel(channel).target.startswith("sensor:") or not actuator.ctrllimited[0]:
                continue
            if reached.min() < low or reached.max() > high:
                raise ModelError(
                    f"'{channel}' in '{record.name}' runs from {reached.min():.4g} to {reached.max():.4g}, but the model clips "
                    f"actuator '{name}' to {low:g} … {high:g}; widen its ctrlrange, or check the unit of the channel"
                )
        position = _positions(case, structure, record, settings=settings.motion)
        _check_stops(record, position, model, dofs)
        _check_turns(record, position, structure)
    _check_contacts(case, structure, rig, dofs, settings=settings)


def _positions(case: Case, structure: Structure, record: CaseRecord, *, settings: MotionSettings) -> Array:
    """Measured positions (n, n_dof); NaN for degrees of freedom that no position channel tells."""
    samples = np.column_stack([record.values[name] for name in structure.channels])
    noise = np.array(
        [case.channel(name).noise_std or noise_floor(record.values[name]) for name in structure.channels]
    )
    position = measured_motion(
        structure.observers, samples, noise, record.step, settings=settings
    ).position.copy()
    rows = np.array([o.row for o in structure.observers if o.order == 0]).reshape(-1, position.shape[1])
    known = np.linalg.pinv(rows) @ rows if len(rows) else np.zeros((position.shape[1],) * 2)
    position[:, np.abs(np.diag(known) - 1.0) > 1e-9] = np.nan
    return position


def _check_stops(record: CaseRecord, position: Array, model: mujoco.MjModel, dofs: NDArray[np.int64]) -> None:
    for i, dof in enumerate(dofs):
        joint = int(model.dof_jntid[dof])
        if not model.jnt_limited[joint] or np.isnan(position[0, i]):
            continue
        low, high = model.jnt_range[joint]
        reached = position[:, i] + model.qpos0[model.jnt_qposadr[joint]]
        if reached.min() < low or reached.max() > high:
            raise ModelError(
                f"joint '{model.joint(joint).name}' moves from {reached.min():.4g} to {reached.max():.4g} in '{record.name}', into "
                f"the stops of the model at {low:g} … {high:g}; take the range out of the model and let the diagnosis look "
                "for 'one_sided_stop' and 'gap', or check the unit of the channel"
            )


def _check_turns(record: CaseRecord, position: Array, structure: Structure) -> None:
    for spring in structure.springs:
        reached = float(np.nanmax(np.abs(position @ spring.row), initial=0.0))
        if reached > spring.reach:
            raise ModelError(
                f"joint '{structure.dofs[int(np.argmax(np.abs(spring.row)))]}' turns by {reached:.4g} rad in '{record.name}', where "
                f"gravity is followed up to {spring.reach:.4g}: a pendulum that goes over the top runs away from every model; "
                "swing it less, or check the unit of the channel"
            )


def _check_contacts(
    case: Case, structure: Structure, rig: Rig, dofs: NDArray[np.int64], *, settings: DiagnosisSettings
) -> None:
    model = parse(rig.mjcf, rig.folder, rig.name).compile()
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT):
        return
    data = mujoco.MjData(model)
    addresses = [int(model.jnt_qposadr[model.dof_jntid[dof]]) for dof in dofs]
    for record in (*case.identification, *case.validation):
        position = np.nan_to_num(_positions(case, structure, record, settings=settings.motion))
        for sample in np.unique(np.linspace(0, len(position) - 1, settings.model.poses).astype(int)):
            data.qpos[:] = model.qpos0
            data.qpos[addresses] += position[sample]
            with native.quiet():
                mujoco.mj_fwdPosition(model, data)
            touching = [c for c in data.contact[: data.ncon] if c.dist < 0.0]
            if touching:
                first, second = (model.geom(int(g)).name or f"geom {int(g)}" for g in touching[0].geom)
                raise ModelError(
                    f"'{first}' and '{second}' of the model touch at t = {record.time[sample]:.4g} s of '{record.name}'; a nominal "
                    'model is linear: switch contacts off (<option><flag contact="disable"/></option>) if they are only '
                    "drawings, or take the parts that collide out of the model"
                )
