"""Writing a case folder from the tables of a robot."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
import pyarrow.parquet as pq

from bench.arrays import Array
from bench.rig.actuators import drive_value
from bench.rig.bodies import BODIES, body_value


@dataclass(frozen=True)
class Axis:
    """A joint of a robot and its columns.

    Attributes:
        joint: Name in the model; of its actuator, too, where that has none of its own.
        position: Column of its angle.
        command: Column of its target or torque.
        noise: One-sigma noise of the angle [rad].
        resolution: Step of its encoder [rad].
        velocity: Column of its velocity, if that is used.
        velocity_noise: Its noise [rad/s].
        torque_noise: Noise of the torque over its RMS, where the command is a torque.
        actuator: Name of its actuator.
    """

    joint: str
    position: str
    command: str
    noise: float
    resolution: float = 0.0
    velocity: str = ""
    velocity_noise: float = 0.0
    torque_noise: float = 0.0
    actuator: str = ""


SPREADS = {"mass": 0.05, "damping": 0.25, "armature": 0.2, "kp": 0.05}
"""Relative one-sigma uncertainty of a model that was drawn or measured; of a guessed one more is stated."""


@dataclass(frozen=True)
class Load:
    """A motor of the model that stands for a load on a joint, and its column.

    Attributes:
        actuator: Its name.
        column: Column of its torque.
        noise: One-sigma noise of it [N m].
    """

    actuator: str
    column: str
    noise: float


@dataclass(frozen=True)
class Records:
    """A robot with its records.

    Attributes:
        model: Its MJCF as a text.
        axes: Its joints.
        identification: Tables for finding: column to samples, "time" among them.
        validation: For judging.
        rate: Samples a second, on which the tables are put.
        servo: Whether the commands are position targets.
        spreads: Relative one-sigma uncertainty of masses, damping, armature; where stated of inertias, centres of mass and drives too.
        held: Joints that are held, see ``"joints"`` of nominal.json.
        known: What is published or was seen of the robot, a sentence.
        most: Most effects named together.
        loads: Loads besides the drives.
        further: Tables that do not find, on which the model is run as stated and with what was named.
        servos: Type of all the drives, where they are of one.
        scatter: Relative one-sigma scatter of drives of one type about what they have in common.
    """

    model: str
    axes: Sequence[Axis]
    identification: Sequence[Mapping[str, Array]]
    validation: Sequence[Mapping[str, Array]]
    rate: float
    servo: bool
    known: str
    spreads: Mapping[str, float] = field(default_factory=lambda: SPREADS)
    held: Mapping[str, float | str] = field(default_factory=dict)
    most: int = 3
    loads: Sequence[Load] = ()
    further: Sequence[Mapping[str, Array]] = ()
    servos: str = ""
    scatter: float = 0.0


def table(path: Path) -> dict[str, Array]:
    """Columns of a Parquet file."""
    read = pq.read_table(path)
    return {name: np.asarray(read[name], dtype=np.float64) for name in read.column_names}


def cut(columns: Mapping[str, Array], begin: float, end: float, clock: str = "time") -> dict[str, Array]:
    """The part of a table between two parts of its length (0 to 1)."""
    t = columns[clock]
    low, high = t[0] + begin * (t[-1] - t[0]), t[0] + end * (t[-1] - t[0])
    inside = (t >= low) & (t <= high)
    return {name: samples[inside] for name, samples in columns.items()}


def write_folder(records: Records, folder: Path) -> None:
    """Write model, nominal.json and tables, the tables on a uniform clock."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.xml").write_text(records.model)
    channels: dict[str, dict[str, object]] = {"time": {"unit": "s"}}
    tables = [*records.identification, *records.validation]
    for axis in records.axes:
        size = max(float(np.sqrt(np.mean(one[axis.command] ** 2))) for one in tables)
        channels[axis.command] = {
            "unit": "rad" if records.servo else "N m", "role": "command" if records.servo else "measured",
            "actuator": axis.actuator or axis.joint, "noise_std": axis.torque_noise * size,
        }  # fmt: skip
        channels[axis.position] = {
            "unit": "rad", "joint": axis.joint, "quantity": "position", "noise_std": axis.noise,
            **({"resolution": axis.resolution} if axis.resolution else {}),
        }  # fmt: skip
        if axis.velocity:
            channels[axis.velocity] = {
                "unit": "rad/s", "joint": axis.joint, "quantity": "velocity", "noise_std": axis.velocity_noise,
            }  # fmt: skip
    for load in records.loads:
        channels[load.column] = {
            "unit": "N m", "role": "measured", "actuator": load.actuator, "noise_std": load.noise,
        }  # fmt: skip
    document = {
        "rig": "model.xml", "sample_rate_hz": records.rate, "starts_in_motion": True,
        "load_interpolation": "zero_order_hold" if records.servo and not records.loads else "linear",
        "parameters": _parameters(records), "channels": channels,
    } | ({"joints": dict(records.held)} if records.held else {})  # fmt: skip
    (folder / "nominal.json").write_text(json.dumps(document, indent=1))
    for name, several in (("identification", records.identification), ("validation", records.validation)):
        for i, one in enumerate(several):
            t = one["time"] - one["time"][0]
            clock = np.arange(0.0, t[-1] - 1e-9, 1.0 / records.rate)
            columns = [clock]
            for label in list(channels)[1:]:
                columns.append(np.interp(clock, t, one[label]))
            path = folder / f"{name}{f'_{i + 1}' if i else ''}.csv"
            header = ",".join(channels)
            np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")


def _parameters(records: Records) -> dict[str, dict[str, object]]:
    model = mujoco.MjModel.from_xml_string(records.model)
    names = [axis.joint for axis in records.axes]
    out: dict[str, dict[str, object]] = {}
    for i in range(1, model.nbody):
        joints = [model.joint(k).name for k in range(model.njnt) if int(model.jnt_bodyid[k]) == i]
        if joints and joints[0] in names:
            value = float(model.body_mass[i])
            out[f"mass:{model.body(i).name}"] = {
                "value": value,
                "std": records.spreads["mass"] * value,
                "unit": "kg",
            }
    for name in names:
        dof = int(model.joint(name).dofadr[0])
        for kind, values, unit in (
            ("damping", model.dof_damping, "N m s/rad"), ("armature", model.dof_armature, "kg m^2"),
        ):  # fmt: skip
            value = float(np.ravel(values[dof])[0])
            if value > 0.0:
                out[f"{kind}:{name}"] = {"value": value, "std": records.spreads[kind] * value, "unit": unit}
    bodies = [parameter.partition(":")[2] for parameter in out if parameter.startswith("mass:")]
    for kind in [kind for kind in BODIES[1:] if kind in records.spreads]:
        for name in bodies:
            value = body_value(model, model.body(name).id, kind)
            if value != 0.0:
                out[f"{kind}:{name}"] = {
                    "value": value, "std": records.spreads[kind] * abs(value), "unit": "kg m^2" if kind == "inertia" else "m",
                }  # fmt: skip
    units = {"kp": "N m/rad", "kv": "N m s/rad", "forcerange": "N m"}
    for axis in records.axes if records.servo else ():
        u = model.actuator(axis.actuator or axis.joint).id
        for kind in (kind for kind in units if kind in records.spreads):
            value = drive_value(model, u, kind)
            out[f"{kind}:{model.actuator(u).name}"] = {
                "value": value, "std": records.spreads[kind] * value, "unit": units[kind],
            }  # fmt: skip
    for name, entry in out.items() if records.servos else ():
        if name.partition(":")[0] not in BODIES:
            entry |= {"alike": records.servos, "each": records.scatter * float(str(entry["value"]))}
    return out
