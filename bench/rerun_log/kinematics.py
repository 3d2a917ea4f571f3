"""Where the bodies of a rig were: joint positions recovered from a record, body poses from joint positions."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench import native
from bench.errors import RecordingError
from bench.recording import Recording
from bench.rig import Rig


class BodyPoses(NamedTuple):
    """Poses of all bodies of a model over some frames."""

    position: NDArray[np.float64]  # (n_frames, n_bodies, 3) [m], in the world
    quaternion: NDArray[np.float64]  # (n_frames, n_bodies, 4), scalar first, body to world


def _observations(rig: Rig, recording: Recording) -> dict[tuple[int, str], str]:
    """The channel that holds each joint's or fixed tendon's position, by (kind, name)."""
    model = rig.model
    joint, tendon = int(mujoco.mjtObj.mjOBJ_JOINT), int(mujoco.mjtObj.mjOBJ_TENDON)
    found: dict[tuple[int, str], str] = {}
    for item in rig.built.placed:
        moving = [coordinate.name for coordinate in item.coordinates if not coordinate.is_input]
        for i, name in enumerate(moving):
            channel = f"{item.element.name}/displacement" + (f"_{i + 1}" if len(moving) > 1 else "")
            kind = joint if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0 else tendon
            found[kind, name] = channel
    readers = {int(mujoco.mjtSensor.mjSENS_JOINTPOS): joint, int(mujoco.mjtSensor.mjSENS_TENDONPOS): tendon}
    for sensor in range(model.nsensor):
        kind = readers.get(int(model.sensor_type[sensor]))
        if kind is not None:
            name = mujoco.mj_id2name(model, kind, int(model.sensor_objid[sensor])) or ""
            # A sensor wins over an element's channel: a measured record holds sensors only.
            if model.sensor(sensor).name in recording.names:
                found[kind, name] = model.sensor(sensor).name
    return {key: channel for key, channel in found.items() if channel in recording.names}


def joint_positions(rig: Rig, recording: Recording) -> NDArray[np.float64]:
    """Joint positions ``(n, nq)`` [m, rad] of a rig at the samples of a record.

    Every position sensor of a joint or fixed tendon, and every displacement channel of an element, is one linear
    equation in the positions of the slide and hinge joints; all of them are solved together in the least-squares
    sense. A joint that no channel tells of stays at its reference position.

    Args:
        rig: The rig the record was taken on.
        recording: Its record, or a laboratory record with channels of the same names.

    Raises:
        RecordingError: The record holds no joint position at all.
    """
    model = rig.model
    reference = np.array(model.qpos0)
    rows, values = [], []
    for (_, name), channel in _observations(rig, recording).items():
        row = np.zeros(model.nq)
        for at_q, _, coefficient in native.coordinate(model, name).terms:
            row[at_q] += coefficient
        rows.append(row)
        values.append(recording[channel] - row @ reference)
    if not rows:
        raise RecordingError(
            f"the record holds no joint position of rig '{rig.name}': add a jointpos sensor to the MJCF, or give `poses`. "
            f"Its channels are {', '.join(recording.names)}"
        )
    solver = np.linalg.pinv(np.array(rows))
    return reference + np.array(values).T @ solver.T


def body_poses(model: mujoco.MjModel, qpos: ArrayLike) -> BodyPoses:
    """Poses of all bodies at given joint positions.

    Args:
        model: The compiled model.
        qpos: Joint positions (n_frames, nq).

    Raises:
        RecordingError: The positions have the wrong width, or are not finite.
    """
    positions = np.asarray(qpos, dtype=float)
    if positions.ndim != 2 or positions.shape[1] != model.nq or not np.all(np.isfinite(positions)):
        raise RecordingError(
            f"joint positions of shape {positions.shape} came; finite numbers of shape (n, {model.nq}) are expected"
        )
    data = mujoco.MjData(model)
    place = np.empty((len(positions), model.nbody, 3))
    turn = np.empty((len(positions), model.nbody, 4))
    # 3 µs a frame for these rigs: a batch over threads would cost more to set up.
    for i, row in enumerate(positions):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        place[i], turn[i] = data.xpos, data.xquat
    return BodyPoses(place, turn)
