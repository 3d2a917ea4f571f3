"""Channels of a case in the user's own MJCF: which actuator exerts a load, which sensor or joint a response reads, and how both act."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import ORDERS, Case, CaseChannel
from bench.discrepancy.case.free_decay import NO_LOAD
from bench.discrepancy.model.mjcf_prescribed import MOTION, loads_of_motion, prescribed_channels
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.settings import ModelSettings
from bench.errors import FileFormatError, ModelError, UnknownNameError
from bench.identification.linear_rig import LinearRig
from bench.rig import Rig

PROBE = "position of "
"""Beginning of the names of sensors added for channels that refer to joints."""


def loads_and_responses(
    case: Case, rig: Rig, *, settings: ModelSettings
) -> tuple[list[tuple[CaseChannel, str]], list[tuple[CaseChannel, str, int | None]]]:
    """Loads with their actuator or its force sensor; responses with their sensor, and the order where a joint is meant."""
    columns = [c.name for c in rig.channels[len(rig.actuators) :]]
    force_sensors = _force_sensors(rig.model)
    loads, responses = [], []
    for channel in case.channels:
        if channel.role in {"scheduling", "prescribed"}:
            continue
        if channel.name == NO_LOAD:
            loads.append((channel, ""))
            continue
        kind, _, name = channel.target.rpartition(":")
        name = name or channel.name
        load = channel.role != "response" or kind == "actuator" or name in force_sensors
        if kind == "joint":
            responses.append((channel, PROBE + name, _order(channel)))
        elif load or (not kind and name in rig.actuators and name not in columns):
            known = (*rig.actuators, *force_sensors)
            if name not in known:
                raise UnknownNameError(f"actuator (or actuatorfrc sensor) of '{rig.name}'", name, known)
            loads.append((channel, force_sensors.get(name, name)))
        else:
            axes = [
                c for c in columns if c == name or (c[: -len("_x")] == name and c[-2:] in {"_x", "_y", "_z"})
            ]
            if not axes:
                raise UnknownNameError(f"sensor of '{rig.name}'", name, [*columns, *rig.actuators])
            responses.append((channel, _axis(rig, channel, axes, settings=settings), None))
    moved = loads_of_motion(prescribed_channels(case, rig))
    loads += [(case.channel(entry.channel), MOTION + joint) for joint, entry in moved.items()]
    if not loads:
        raise FileFormatError(
            f"case '{case.name}' has no load; name a channel after an actuator of the model ({', '.join(rig.actuators) or 'none'}) "
            'or give it an entry "actuator"; for a free decay say that it "starts_in_motion"'
        )
    if not responses:
        raise FileFormatError(
            f"case '{case.name}' has no response; name a channel after a sensor of the model ({', '.join(columns) or 'none'}) "
            'or give it "joint" and "quantity"'
        )
    return loads, responses


def _force_sensors(model: mujoco.MjModel) -> dict[str, str]:
    """Sensors that read the force of an actuator, by name."""
    kind = int(mujoco.mjtSensor.mjSENS_ACTUATORFRC)
    return {
        model.sensor(i).name: model.actuator(int(model.sensor_objid[i])).name
        for i in range(model.nsensor)
        if int(model.sensor_type[i]) == kind
    }


def cells(loads: Sequence[tuple[CaseChannel, str]]) -> list[str]:
    """Force sensors whose reading is the load itself rather than the command behind it."""
    return [name for name in dict.fromkeys(_sensor_of(channel) for channel, _ in loads) if name]


def _sensor_of(channel: CaseChannel) -> str:
    """The sensor that reads a load; none of a prescribed motion, whose sensor reads no force."""
    sensed = channel.target.startswith("sensor:") and channel.role != "prescribed"
    return channel.target.removeprefix("sensor:") if sensed else ""


def _order(channel: CaseChannel) -> int:
    if channel.quantity not in ORDERS:
        raise UnknownNameError(f"quantity of channel '{channel.name}'", channel.quantity, ORDERS)
    return ORDERS.index(channel.quantity)


def _axis(rig: Rig, channel: CaseChannel, axes: list[str], *, settings: ModelSettings) -> str:
    """The one component of a sensor that the motion reaches."""
    if len(axes) == 1:
        return axes[0]
    moving = []
    for axis in axes:
        linear = LinearRig.of(rig, [axis])
        if len(linear.dofs) and np.any(
            np.abs(linear.observation[:, : 3 * len(linear.dofs)]) > settings.negligible
        ):
            moving.append(axis)
    if len(moving) != 1:
        raise FileFormatError(
            f"channel '{channel.name}' may be any of {', '.join(moving or axes)}; name the component: "
            f'"sensor": "{(moving or axes)[0]}"'
        )
    return moving[0]


def inputs_of(
    loads: Sequence[tuple[CaseChannel, str]], rig: Rig, linear: LinearRig, n_responses: int
) -> Array:
    """How the loads act (n_dof, n_loads), in the units of their channels."""
    matrix = linear.matrices[3]
    sensed = cells(loads)
    out = np.zeros((len(linear.dofs), len(loads)))
    for j, (channel, actuator) in enumerate(loads):
        if not actuator:
            out[:, j] = 1.0
            continue
        u = rig.actuators.index(actuator)
        out[:, j] = matrix[:, u]
        if cell := _sensor_of(channel):
            reading = linear.observation[n_responses + sensed.index(cell), 3 * len(linear.dofs) + u]
            out[:, j] /= reading
        if not np.any(out[:, j]):
            raise ModelError(
                f"the load '{channel.name}' (actuator '{actuator}') moves nothing that a channel measures"
            )
    return out


def observer_of(
    channel: CaseChannel, row: Array, order: int | None, n_dof: int, rig: Rig, *, settings: ModelSettings
) -> Observer:
    """A response as a row of the motion, in the unit of its channel."""
    blocks = row[: 3 * n_dof].reshape(3, n_dof)
    if order is not None:
        return Observer(channel.name, order, blocks[0])
    largest = np.abs(blocks).max(axis=1)
    present = np.flatnonzero(largest > settings.negligible * max(float(largest.max()), 1e-300))
    if len(present) != 1:
        what = " and ".join(ORDERS[i] for i in present) or "nothing of the motion"
        raise ModelError(
            f"channel '{channel.name}' of '{rig.name}' reads {what}; one of position, velocity, acceleration is expected"
        )
    scaled = blocks[present[0]].copy()
    scaled[np.abs(scaled) <= settings.negligible * largest.max()] = 0.0
    return Observer(channel.name, int(present[0]), scaled)
