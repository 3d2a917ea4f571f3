"""The linear structure around the elements of a rig, read off its MuJoCo model.

On the rigs of the bench everything but the elements is linear: accelerations and sensors are affine functions of positions,
velocities, commands and the elements' forces. Their coefficients are found by probing the compiled model, whatever the MJCF
says, and checked against the model with its elements at random states; a rig that is not of this kind is refused, and is
simulated in MuJoCo instead. The compiled ensembles of `bench.excitation.ensemble` integrate this structure with the elements'
own kernels, some fifty times as fast as the model it was read from.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.errors import ModelError, UnknownNameError
from bench.laws.along import force_along
from bench.rig import Rig


@dataclass(frozen=True)
class LinearStructureSettings:
    """Numbers of `bench.excitation.linear_structure`."""

    tolerance: float = 1e-9
    """Largest error of the affine map at random states, relative to the largest value there; what is linear passes at 1e-13."""
    states: int = 6
    amplitude: float = 0.3


SETTINGS = LinearStructureSettings()


class AffineStructure(NamedTuple):
    """Accelerations and sensors of a rig as affine functions.

    Columns of both maps: constant, positions (nv), velocities (nv), commands (n_actuators), generalised forces of the
    elements (nv).
    """

    acceleration: NDArray[np.float64]  # (nv, 1 + 3 nv + n_actuators)
    sensors: NDArray[np.float64]  # (n_channels, 1 + 3 nv + n_actuators)


def measured_channels(rig: Rig) -> tuple[str, ...]:
    """Names of the rig's measured channels, in the order of MuJoCo's `sensordata`."""
    return tuple(channel.name for channel in rig.channels if channel.role == "measured")


def sensor_columns(rig: Rig, channels: tuple[str, ...]) -> NDArray[np.int64]:
    """Places of channels in MuJoCo's `sensordata`.

    Raises:
        UnknownNameError: The rig does not measure a channel of that name.
    """
    known = measured_channels(rig)
    for name in channels:
        if name not in known:
            raise UnknownNameError(f"measured channel of rig '{rig.name}'", name, known)
    return np.array([known.index(name) for name in channels], dtype=np.int64)


def linear_structure(rig: Rig, channels: tuple[str, ...]) -> AffineStructure:
    """Read the linear structure of a rig.

    Args:
        rig: The rig.
        channels: Names of the measured channels wanted.

    Raises:
        ModelError: Accelerations or a wanted channel are not affine (rotations that couple, contacts, limits, dry friction of
            MuJoCo's own, actuators with dynamics, delays), so that the rig must be simulated in MuJoCo.
        UnknownNameError: The rig does not measure a channel of that name.
    """
    columns = sensor_columns(rig, channels)
    model = rig.model
    states = sum(len(item.element.law.states) for item in rig.built.placed if item.act >= 0)
    if (
        model.nq != model.nv
        or model.na != states
        or rig.integrator != "RK4"
        or any(element.exact for element in rig.elements)
        or mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_HISTORY) > 0
    ):
        raise ModelError(
            f"rig '{rig.name}' has free bodies, actuator dynamics, delays, exact friction or another integrator than RK4; "
            "only MuJoCo simulates it (engine='mujoco')"
        )
    bare = copy.copy(model)
    for item in rig.built.placed:
        bare.numeric_data[item.theta - _offset(bare, item.theta)] = (
            0.0  # without its mark an element is passed over
        )
    data = mujoco.MjData(bare)
    n = 3 * model.nv + len(rig.actuators)
    with native.running(bare):
        constant = _respond(bare, data, np.zeros(n), len(rig.actuators))
        rows = [_respond(bare, data, unit, len(rig.actuators)) - constant for unit in np.eye(n)]
    table = np.column_stack([constant, *rows])
    structure = AffineStructure(table[: model.nv].copy(), table[model.nv :][columns].copy())
    _check(rig, structure, columns)
    return structure


def _offset(model: mujoco.MjModel, theta: int) -> int:
    """Distance of theta from the start of the numeric it stands in."""
    starts = np.asarray(model.numeric_adr)
    return int(theta - starts[starts <= theta].max())


@native.quiet()
def _respond(model: mujoco.MjModel, data: mujoco.MjData, inputs: NDArray, n_actuators: int) -> NDArray:
    """Accelerations and sensors ``(nv + nsensordata,)`` for positions, velocities, commands and generalised forces."""
    nv = model.nv
    mujoco.mj_resetData(model, data)
    data.qpos[:] = inputs[:nv]
    data.qvel[:] = inputs[nv : 2 * nv]
    data.ctrl[:n_actuators] = inputs[2 * nv : 2 * nv + n_actuators]
    data.qfrc_applied[:] = inputs[2 * nv + n_actuators :]
    mujoco.mj_forward(model, data)
    return np.concatenate([data.qacc, data.sensordata])


def element_forces(rig: Rig, q: NDArray, v: NDArray, u: NDArray, z: NDArray) -> NDArray[np.float64]:
    """Generalised forces of a rig's elements ``(nv,)`` at a state, opposing the motion where the laws do."""
    total = np.zeros(rig.model.nv)
    for item in rig.built.placed:
        pairs = [coordinate.values(q[None], v[None], u[None]) for coordinate in item.coordinates]
        own = z[item.act : item.act + len(item.element.law.states)] if item.act >= 0 else z[:0]
        force = force_along(
            item.element.law,
            item.element.theta,
            np.zeros(1),
            np.array([[pair[0][0] for pair in pairs]]),
            np.array([[pair[1][0] for pair in pairs]]),
            own[None],
        )[0]
        for coordinate, value in zip(item.coordinates, force, strict=True):
            if not coordinate.is_input:
                for _, dof, coefficient in coordinate.terms:
                    total[dof] -= coefficient * value
    return total


def _check(rig: Rig, structure: AffineStructure, columns: NDArray) -> None:
    """Compare the affine maps with the model, elements in place, at random states."""
    model, n_actuators = rig.model, len(rig.actuators)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)  # the states of a check: nothing of a result depends on them
    for _ in range(SETTINGS.states):
        inputs = rng.uniform(-SETTINGS.amplitude, SETTINGS.amplitude, 3 * model.nv + n_actuators)
        inputs[2 * model.nv + n_actuators :] = 0.0
        with native.running(model):
            truth = _respond(model, data, inputs, n_actuators)
        inputs[2 * model.nv + n_actuators :] = element_forces(
            rig, data.qpos, data.qvel, data.ctrl, np.zeros(model.na)
        )
        for what, table, expected in (
            ("accelerations", structure.acceleration, truth[: model.nv]),
            ("sensors", structure.sensors, truth[model.nv :][columns]),
        ):
            error = np.abs(table[:, 0] + table[:, 1:] @ inputs - expected)
            scale = np.max(np.abs(table[:, 1:]) @ np.abs(inputs), initial=1e-12)
            if np.any(error > SETTINGS.tolerance * scale):
                raise ModelError(
                    f"the {what} of rig '{rig.name}' are not linear around its elements (off by {error.max():.3g} at a random "
                    "state); only MuJoCo simulates it (engine='mujoco')"
                )
