"""Responses of a rig to measured commands for many parameter vectors at once: what output-error fits ask for.

Two engines give the same numbers: `LinearRig`, the compiled loop for rigs of linear structure, and `mujoco.batch` for
all others. Neither's results depend on the number of threads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Literal, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch

from bench import native
from bench.arrays import Array
from bench.errors import IdentificationError, ModelError, UnknownNameError
from bench.identification.linear_rig import LinearRig, address
from bench.identification.linear_rig_elements import channel_columns
from bench.recording import Recording
from bench.rig import Rig, controls_of
from bench.rig.drives import Initial

EngineName = Literal["auto", "linear", "mujoco"]

_COMMAND_SENSORS = (int(mujoco.mjtSensor.mjSENS_ACTUATORFRC), int(mujoco.mjtSensor.mjSENS_JOINTACTFRC))


class RigRecord(NamedTuple):
    """A record prepared for simulation."""

    controls: Array  # (n_steps, n_actuators)
    measured: Array  # (n_samples, n_channels)
    scored: slice
    initial: Initial
    stride: int
    start_time: float


class LinearEngine:
    """Simulations by the compiled loop."""

    name = "linear"

    def __init__(self, rig: Rig, channels: Sequence[str], free: Sequence[str], pool: Executor) -> None:
        self.rig = LinearRig.of(rig, channels, free)
        self.pool = pool

    def simulate(self, record: RigRecord, vectors: Array) -> Array:
        """Channels ``(n_vectors, n_samples, n_channels)``, not finite where a simulation diverged."""

        def one(vector: Array) -> Array:
            return self.rig.simulate(
                record.controls,
                vector,
                initial=record.initial,
                stride=record.stride,
                start_time=record.start_time,
            )

        return np.stack(list(self.pool.map(one, vectors)))


class MujocoEngine:
    """Simulations by `mujoco.batch`, each with its own numbers in the fields concerned."""

    name = "mujoco"

    def __init__(self, rig: Rig, channels: Sequence[str], free: Sequence[str], threads: int) -> None:
        self.rig = rig
        self.columns = channel_columns(rig, channels)
        self.addresses = [address(rig, name) for name in free]
        self.threads = threads

    def simulate(self, record: RigRecord, vectors: Array) -> Array:
        """As `LinearEngine.simulate`."""
        model = self.rig.model
        batch = Batch(model, len(vectors), self.threads)
        for entry, values in zip(self.addresses, vectors.T, strict=True):
            entry.write_each(batch.expand(entry.field), values)
        if any(entry.field != "numeric_data" for entry in self.addresses):
            batch.set_const()
        batch.bind("time")[:] = record.start_time
        for joint, (position, velocity) in record.initial.items():
            place = model.joint(joint)
            batch.bind("qpos")[:, int(place.qposadr[0])] = position
            batch.bind("qvel")[:, int(place.dofadr[0])] = velocity
        for item in self.rig.built.placed:
            if item.act >= 0:
                start = item.element.law.start()
                batch.bind("act")[:, item.act : item.act + len(start)] = start
        steps, own = record.controls.shape
        padded = np.zeros((len(vectors), steps, model.nu))
        padded[:, :, :own] = record.controls
        clock = mujoco.mjtState.mjSTATE_TIME
        with native.running(model):
            result = batch.rollout(steps, padded, mujoco.mjtState.mjSTATE_CTRL, [clock, "sensordata"])
        found = result["sensordata"][:, :: record.stride][:, :, self.columns]
        stopped = np.diff(result[clock][:, :, 0], axis=1, prepend=record.start_time) <= 0.0
        found[stopped[:, :: record.stride]] = np.nan
        return found


def moving_sensors(rig: Rig, record: Recording) -> tuple[str, ...]:
    """Sensors of the rig that the record has and that answer its motion: not constant, not the command again."""
    model = rig.model
    columns = np.repeat(model.sensor_type, model.sensor_dim)
    first = len(rig.actuators)
    sensors = rig.channels[first : first + model.nsensordata]
    return tuple(
        channel.name
        for channel, kind in zip(sensors, columns, strict=True)
        if channel.name in record
        and int(kind) not in _COMMAND_SENSORS
        and np.ptp(record[channel.name][record.scored]) > 0.0
    )


def with_initial(
    records: Sequence[Recording], initial: Initial | Sequence[Initial] | None
) -> list[tuple[Recording, Initial]]:
    """Each record with its initial state; one for all, at rest, or one each.

    Raises:
        IdentificationError: Another number of initial states than of records.
    """
    if initial is None or isinstance(initial, Mapping):
        return [(record, initial or {}) for record in records]
    if len(initial) != len(records):
        raise IdentificationError(
            f"{len(records)} records and {len(initial)} initial states came; one each is expected"
        )
    return list(zip(records, initial, strict=True))


def prepare_response(
    rig: Rig, record: Recording, channels: tuple[str, ...], inputs: Mapping[str, str], initial: Initial
) -> RigRecord:
    """Commands, measured channels and clock of a record, as the engines take them.

    Raises:
        IdentificationError: No channels.
        UnknownNameError: An actuator, channel or joint is unknown, or the record drives nothing.
        ParameterError: The sample rate does not divide the rig's step rate.
    """
    if not channels:
        raise IdentificationError(
            f"the record has none of the sensors of rig '{rig.name}' in motion; it has {', '.join(record.names)}"
        )
    for name in inputs:
        if name not in rig.actuators:
            raise UnknownNameError(f"actuator of rig '{rig.name}'", name, rig.actuators)
    arrays = {actuator: record[channel] for actuator, channel in inputs.items()}
    arrays |= {name: record[name] for name in rig.actuators if name in record and name not in inputs}
    if not arrays:
        raise UnknownNameError(
            f"channel for the actuators of rig '{rig.name}' in the record", rig.actuators[0], record.names
        )
    driven = Recording.from_arrays(
        None, arrays, units=dict.fromkeys(arrays, "1"), sample_rate=record.sample_rate
    )
    for joint in initial:
        if mujoco.mj_name2id(rig.model, mujoco.mjtObj.mjOBJ_JOINT, joint) < 0:
            raise UnknownNameError("joint", joint, [rig.model.joint(i).name for i in range(rig.model.njnt)])
    controls = controls_of(rig, driven)
    measured = np.stack([record[name] for name in channels], axis=1)
    return RigRecord(
        controls, measured, record.scored, initial, len(controls) // len(record), float(record.time[0])
    )


def engine_for(
    engine: EngineName,
    rig: Rig,
    channels: tuple[str, ...],
    free: tuple[str, ...],
    workers: tuple[Executor, int],
) -> LinearEngine | MujocoEngine:
    """The engine asked for; where "auto", the compiled loop if the rig allows it.

    Raises:
        UnknownNameError: Unknown engine, channel or parameter.
        ModelError: The compiled loop was asked for and the rig is not of linear structure.
    """
    if engine not in ("auto", "linear", "mujoco"):
        raise UnknownNameError("engine", engine, ("auto", "linear", "mujoco"))
    if engine != "mujoco":
        try:
            return LinearEngine(rig, channels, free, workers[0])
        except ModelError:
            if engine == "linear":
                raise
    return MujocoEngine(rig, channels, free, workers[1])
