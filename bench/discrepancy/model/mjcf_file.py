"""The user's MJCF as the rig of a case."""

from __future__ import annotations

from pathlib import Path

import mujoco

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.free_decay import NO_LOAD
from bench.rig import Rig
from bench.rig.building import parse


def rig_of(case: Case) -> Rig:
    """The user's model; where a case has no load, with an actuator that exerts none.

    Raises:
        ModelError: The file cannot be read.
    """
    rig = Rig.from_file(Path(case.folder or ".") / case.rig)
    if not case.has(NO_LOAD) or NO_LOAD in rig.actuators:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    joint = _measured_joint(case, rig)
    if joint:
        actuator = spec.add_actuator(name=NO_LOAD, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


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
