"""The user's MJCF as MuJoCo runs it, with the nominal values of a case in place: what a nominal simulation is held against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel
from bench.discrepancy.model.mjcf import plain_rig
from bench.discrepancy.model.mjcf_channels import loads_and_responses
from bench.discrepancy.model.mjcf_prescribed import (
    MOTION,
    PrescribedChannel,
    loads_of_motion,
    prescribed_channels,
)
from bench.discrepancy.settings import ModelSettings
from bench.rig import Rig
from bench.rig.building import parse

PROBES = {"position": mujoco.mjtSensor.mjSENS_JOINTPOS, "velocity": mujoco.mjtSensor.mjSENS_JOINTVEL}
"""Sensors for channels that refer to a joint; MuJoCo has none that reads its acceleration."""


@dataclass(frozen=True)
class MujocoReference:
    """A model in MuJoCo, and where the channels of a case are in it.

    Attributes:
        model: The model at the nominal values.
        loads: Load channel to (index in ctrl, command for a unit of the channel).
        responses: Response channel to its place in sensordata; those that refer to a joint are left out.
        control: (n_u,) commands at rest: what holds joints whose motion is prescribed, and zeros.
        rest: (n_q,) positions at rest.
        offsets: (n_responses,) readings there.
        unsteady: Whether there is no state of rest.
        fastest: Rate of the fastest motion about rest [1/s], which a step of integration has to follow.
    """

    model: mujoco.MjModel
    loads: dict[str, tuple[int, float]]
    responses: dict[str, int]
    control: Array
    rest: Array
    offsets: Array
    unsteady: bool
    fastest: float


def actuators_of(case: Case, rig: Rig, *, settings: ModelSettings) -> dict[str, str]:
    """Load channel to the actuator that exerts it.

    Raises:
        FileFormatError: A channel is none of the model's.
        UnknownNameError: A channel names nothing in the model.
    """
    loads, _ = loads_and_responses(case, plain_rig(case, rig)[0], settings=settings)
    return {channel.name: actuator for channel, actuator in loads if actuator}


@native.quiet()
def reference_of(case: Case, rig: Rig, *, settings: ModelSettings) -> MujocoReference:
    """The reference of a case.

    Args:
        case: For the nominal values.
        rig: The user's model.
        settings: `ModelSettings` of the diagnosis.
    """
    probed = _probed(case, rig)
    values: dict[str, dict[str, float]] = {}
    for parameter in case.parameters:
        kind, colon, name = parameter.name.partition(":")
        if colon:  # others are of laws beside the model
            values.setdefault(kind, {})[name] = parameter.value
    model = probed.with_structure(**values).model
    moved = loads_of_motion(prescribed_channels(case, rig))
    held = np.array([int(model.joint(joint).dofadr[0]) for joint in moved], dtype=np.intp)
    rest, unsteady, fastest = _at_rest(model, held, settings=settings)
    control, large = _prescribed(model, rest, moved, settings=settings)
    loads, responses = loads_and_responses(case, plain_rig(case, rig)[0], settings=settings)
    columns = [channel.name for channel in probed.channels[len(probed.actuators) :]]
    places = {
        channel.name: columns.index(sensor if order is None else _probe(channel))
        for channel, sensor, order in responses
        if order is None or order < len(PROBES)
    }
    inputs = {}
    for channel, name in loads:
        if not name:
            continue
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        # a force sensor reads what the actuator's gain makes of a command
        gain = float(model.actuator_gainprm[index, 0]) if channel.target.startswith("sensor:") else 1.0
        command = large.get(channel.name, 1.0 / gain if gain else 1.0)
        inputs[channel.name] = (int(model.actuator_ctrladr[index]), command)
    data = mujoco.MjData(model)
    data.qpos[:] = rest
    mujoco.mj_forward(model, data)
    offsets = data.sensordata[list(places.values())].copy()
    return MujocoReference(model, inputs, places, control, rest, offsets, unsteady, fastest)


def _prescribed(
    model: mujoco.MjModel, rest: Array, moved: dict[str, PrescribedChannel], *, settings: ModelSettings
) -> tuple[Array, dict[str, float]]:
    """Puts large masses at joints whose motion is prescribed; commands (n_u,) that hold them at rest, and by load channel the command for
    a unit of it."""
    control, commands, state = np.zeros(model.nu), {}, _at(model, rest)
    for joint, load in moved.items():
        dof = int(model.joint(joint).dofadr[0])
        large = settings.large_mass * state.mass[dof, dof]
        model.dof_armature[dof] += large
        control[model.actuator(MOTION + joint).id] = -state.force[dof]
        commands[load.channel] = large / load.gain
    return control, commands


def _probe(channel: CaseChannel) -> str:
    return f"{channel.quantity} of {channel.target.removeprefix('joint:')}"


def _probed(case: Case, rig: Rig) -> Rig:
    """The rig with sensors for the channels that refer to joints."""
    wanted = {
        _probe(c): c
        for c in case.channels
        if c.target.startswith("joint:") and c.quantity in (*PROBES, "acceleration")
    }
    if not wanted:
        return rig
    spec = parse(rig.mjcf, rig.folder, rig.name)
    for name, channel in wanted.items():
        kind = PROBES.get(channel.quantity, mujoco.mjtSensor.mjSENS_JOINTPOS)
        joint = channel.target.removeprefix("joint:")
        if any(joint == own.name for own in spec.joints):
            spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder)


class _State(NamedTuple):
    """Forces (n_v,) without commands, and the mass matrix (n_v, n_v)."""

    force: Array
    mass: Array


@native.quiet()
def _at(model: mujoco.MjModel, position: Array, velocity: Array | float = 0.0) -> _State:
    """What springs, gravity and drives exert on the joints of a state."""
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[:], data.qvel[:] = position, velocity
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_fwdActuation(model, data)
    mujoco.mj_fullM(model, data, mass)
    return _State(data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator, mass)


def _at_rest(
    model: mujoco.MjModel, held: NDArray[np.intp], *, settings: ModelSettings
) -> tuple[Array, bool, float]:
    """Positions at which springs and gravity balance, by Newton steps from the reference positions; whether there are none; and the
    rate of the fastest motion there [1/s]. Degrees of freedom that are `held` stay where they are."""
    q = model.qpos0.copy()
    if model.nq != model.nv:
        return q, True, 0.0
    free = np.setdiff1d(np.arange(model.nv), held)
    eye = np.eye(model.nv)[free]

    def force(position: Array, velocity: Array | float = 0.0) -> Array:
        return _at(model, position, velocity).force[free]

    scale = max(float(np.abs(force(q)).max(initial=0.0)), 1e-300)
    for _ in range(settings.newton_steps):
        here = force(q)
        if np.abs(here).max(initial=0.0) <= 1e-9 * scale:
            break
        jacobian = np.column_stack([(force(q + 1e-6 * row) - here) / 1e-6 for row in eye])
        q[free] -= np.linalg.pinv(jacobian, rcond=1e-9) @ here
    here, still = force(q), np.eye(len(free))
    slopes = np.column_stack(
        [(force(q + 1e-6 * row) - here) / 1e-6 for row in eye]
        + [(force(q, 1e-6 * row) - here) / 1e-6 for row in eye]
    )
    mass = _at(model, q).mass[np.ix_(free, free)]
    state = np.vstack([np.hstack([np.zeros_like(still), still]), np.linalg.solve(mass, slopes)])
    left = float(np.abs(here).max(initial=0.0))
    return q, left > 1e-6 * scale and left > 1e-12, float(np.abs(np.linalg.eigvals(state)).max(initial=0.0))
