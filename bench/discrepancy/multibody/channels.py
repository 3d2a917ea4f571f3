"""Channels of a case bound to joints and actuators of an articulated model, whatever they were named by."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from bench.discrepancy.case.case import Case, CaseChannel
from bench.discrepancy.case.channel_noise import noise_of_logs
from bench.errors import FileFormatError, UnknownNameError

SENSORS = {
    int(mujoco.mjtSensor.mjSENS_JOINTPOS): "position",
    int(mujoco.mjtSensor.mjSENS_JOINTVEL): "velocity",
}
"""Sensors that read a joint."""


def bound(case: Case, model: mujoco.MjModel) -> Case:
    """The case with every channel's target a joint or an actuator, and the noise of what was measured read off where it is not stated.

    A channel may name its joint or actuator itself, or a sensor of the model (jointpos, jointvel, actuatorfrc), by an entry or by its
    own name.

    Raises:
        UnknownNameError: A channel names nothing in the model.
        FileFormatError: A sensor reads something else.
    """
    return replace(case, channels=tuple(_bound(case, channel, model) for channel in case.channels))


def _bound(case: Case, channel: CaseChannel, model: mujoco.MjModel) -> CaseChannel:
    kind, _, name = channel.target.rpartition(":")
    name = name or channel.name
    joints = [model.joint(i).name for i in range(model.njnt)]
    actuators = [model.actuator(i).name for i in range(model.nu)]
    sensors = {model.sensor(i).name: i for i in range(model.nsensor)}
    if kind in ("", "sensor") and name in sensors:
        kind, name, quantity = _read(model, sensors[name], channel)
        channel = replace(channel, quantity=channel.quantity or quantity)
    elif not kind:
        kind = "actuator" if name in actuators else "joint"
    known = {"joint": joints, "actuator": actuators, "sensor": list(sensors)}[kind]
    if name not in known:
        raise UnknownNameError(f"{kind} that channel '{channel.name}' stands for", name, known)
    noise, measured = channel.noise_std, kind == "joint" or channel.role == "measured"
    if noise is None and measured:
        logged = (np.asarray(r.values[channel.name]) for r in (*case.identification, *case.validation))
        noise = noise_of_logs(logged, jumps=kind == "actuator")
    return replace(channel, target=f"{kind}:{name}", noise_std=noise)


def _read(model: mujoco.MjModel, i: int, channel: CaseChannel) -> tuple[str, str, str]:
    """Kind and name of what a sensor reads, and the quantity."""
    sort, target = int(model.sensor_type[i]), int(model.sensor_objid[i])
    if sort in SENSORS:
        return "joint", model.joint(target).name, SENSORS[sort]
    if sort == int(mujoco.mjtSensor.mjSENS_ACTUATORFRC):
        return "actuator", model.actuator(target).name, ""
    what = mujoco.mjtSensor(sort).name.removeprefix("mjSENS_").lower()
    raise FileFormatError(
        f"channel '{channel.name}' reads the sensor '{model.sensor(i).name}' ({what}); "
        "on an articulated model a joint's position or velocity (jointpos, jointvel) or an actuator's force is expected"
    )
