"""What acts on a joint and was logged: the input of its drive, and loads besides."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.multibody.joints import Joint
from bench.errors import FileFormatError


def input_of(case: Case, joint: Joint) -> CaseChannel:
    """The channel that drives a joint.

    Raises:
        FileFormatError: There is none.
    """
    for channel in case.channels:
        if joint.drive is not None and channel.target == f"actuator:{joint.drive.name}":
            return channel
    raise FileFormatError(
        f"no channel drives joint '{joint.name}'; name its command or torque by \"actuator\", or say by "
        f'"joints": {{"{joint.name}": "follow"}} that it moves as measured, or "hold" that it was held'
    )


def loads_of(case: Case, joint: Joint) -> tuple[CaseChannel, ...]:
    """The channels of the loads on a joint besides its drive, in the order of `Joint.loads`.

    Raises:
        FileFormatError: A motor has none.
    """
    channels = {channel.target: channel for channel in case.channels}
    for load in joint.loads:
        if f"actuator:{load.name}" not in channels:
            raise FileFormatError(
                f"no channel says what motor '{load.name}' did on joint '{joint.name}', which has the drive "
                f'\'{joint.drive.name if joint.drive else ""}\' besides; name its force by "actuator": "{load.name}", or take it out of '
                "the model"
            )
    return tuple(channels[f"actuator:{load.name}"] for load in joint.loads)


def inputs_of(case: Case, joint: Joint, record: CaseRecord) -> dict[str, Array]:
    """Actuators of a joint, its drive first, to their logged inputs (n,); raises as `input_of` and `loads_of`."""
    assert joint.drive is not None
    channels = (input_of(case, joint), *loads_of(case, joint))
    names = (joint.drive.name, *(load.name for load in joint.loads))
    return {name: record.values[channel.name] for name, channel in zip(names, channels, strict=True)}


def load_on(case: Case, joint: Joint, record: CaseRecord) -> Array:
    """Torque (n,) of the loads on a joint besides its drive; raises as `loads_of`."""
    out = np.zeros(len(record))
    for load, channel in zip(joint.loads, loads_of(case, joint), strict=True):
        out += load.torque(record.values[channel.name], out, out)
    return out


def noise_of_loads(case: Case, joint: Joint) -> float:
    """Stated noise of that torque, one-sigma a sample."""
    levels = [
        (channel.noise_std or 0.0) * load.gear * load.kp
        for load, channel in zip(joint.loads, loads_of(case, joint), strict=True)
    ]
    return float(np.hypot.reduce(levels or [0.0]))
