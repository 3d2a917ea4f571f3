"""Limits of what an actuator of the user's MJCF exerts, applied to the loads of the records.

``forcerange`` of an actuator and ``actuatorfrcrange`` of its joint clip a force whatever the motion, so that the nominal model with
them is the nominal model without them under clipped loads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.settings import DEFAULT, ModelSettings
from bench.rig import Rig


def within_limits(
    case: Case, rig: Rig, actuators: dict[str, str], *, settings: ModelSettings
) -> tuple[Case, tuple[str, ...]]:
    """A case whose loads are those that the actuators of the model exert, and where that made a difference, in words.

    Args:
        case: The case.
        rig: The user's model, with its limits.
        actuators: Load channel to actuator.
        settings: `ModelSettings` of the diagnosis.
    """
    limits = {}
    for channel, name in actuators.items():
        found = _limit(rig.model, name)
        if found is not None:
            read = case.channel(channel).target.startswith("sensor:")
            low, high, what = found
            ends = sorted(end * (_gain(rig.model, name) if read else 1.0) for end in (low, high))
            limits[channel] = (ends[0], ends[1], what)
    straight = case.load_interpolation == "linear"
    return clipped_case(
        case,
        limits,
        lambda samples, low, high: clipped_load(samples, low, high, straight=straight, settings=settings),
    )


def clipped_case(
    case: Case,
    limits: Mapping[str, tuple[float, float, str]],
    clip: Callable[[Array, float, float], Array] = np.clip,
) -> tuple[Case, tuple[str, ...]]:
    """A case whose loads stay within limits, and where that made a difference, in words.

    Args:
        case: The case.
        limits: Load channel to least value, largest value, and what in the model says so.
        clip: From samples (n,) and the two values to samples within them.
    """
    said: list[str] = []

    def clipped(record: CaseRecord) -> CaseRecord:
        values = dict(record.values)
        for channel, (low, high, what) in limits.items():
            samples = record.values[channel]
            if samples.min() >= low and samples.max() <= high:
                continue
            values[channel] = clip(samples, low, high)
            values[channel].setflags(write=False)
            said.append(
                f"'{channel}' runs from {samples.min():.4g} to {samples.max():.4g} in '{record.name}'; the model limits it to {low:.4g} … "
                f"{high:.4g} ({what}), and so does the nominal model here"
            )
        return replace(record, values=values)

    out = replace(
        case,
        identification=tuple(clipped(record) for record in case.identification),
        validation=tuple(clipped(record) for record in case.validation),
    )
    return (out, tuple(said)) if said else (case, ())


def clipped_load(
    samples: Array, low: float, high: float, *, straight: bool, settings: ModelSettings = DEFAULT.model
) -> Array:
    """Samples (n,) of a load that an actuator clips.

    A load that runs straight between two samples is clipped on its way, and the straight line between the clipped samples cuts the
    corner off. What it cuts off is given back to the two samples, its size and its centre kept, so that the motion is right to third
    order in the step.

    Args:
        samples: (n,) as commanded.
        low: Least load.
        high: Largest load.
        straight: Whether the load runs straight between its samples; else it is held or smooth, and clipped as it is.
        settings: `ModelSettings` of the diagnosis.
    """
    out = np.clip(samples, low, high)
    if not straight:
        return out
    crossing = np.flatnonzero(np.abs(np.diff(out)) < np.abs(np.diff(samples)) * (1.0 - 1e-12))
    way = (np.arange(settings.clipped_parts) + 0.5) / settings.clipped_parts
    start, end = samples[crossing, None], samples[crossing + 1, None]
    first, last = out[crossing, None], out[crossing + 1, None]
    cut = np.clip(start + (end - start) * way, low, high) - (first + (last - first) * way)
    size, moment = cut.mean(axis=1), (cut * way).mean(axis=1)
    np.add.at(out, crossing, size - moment)
    np.add.at(out, crossing + 1, moment)
    return out


def _limit(model: mujoco.MjModel, name: str) -> tuple[float, float, str] | None:
    """Least and largest command that an actuator passes on, and what says so; None where nothing does, or where its force depends on
    the motion as well."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    plain = (
        int(model.actuator_gaintype[index]) == int(mujoco.mjtGain.mjGAIN_FIXED)
        and int(model.actuator_biastype[index]) == int(mujoco.mjtBias.mjBIAS_NONE)
        and int(model.actuator_dyntype[index]) == int(mujoco.mjtDyn.mjDYN_NONE)
    )
    gain = float(model.actuator_gainprm[index, 0])
    if not plain or gain == 0.0:
        return None
    low, high, reasons = -np.inf, np.inf, []
    if model.actuator_forcelimited[index]:
        ends = model.actuator_forcerange[index] / gain
        low, high = float(ends.min()), float(ends.max())
        reasons.append(f"forcerange of actuator '{name}'")
    joint = _only_joint(model, index)
    gear = float(model.actuator_gear[index, 0])
    if joint >= 0 and gear != 0.0 and model.jnt_actfrclimited[joint]:
        ends = model.jnt_actfrcrange[joint] / (gain * gear)
        low, high = max(low, float(ends.min())), min(high, float(ends.max()))
        reasons.append(f"actuatorfrcrange of joint '{model.joint(joint).name}'")
    return (low, high, ", ".join(reasons)) if reasons else None


def _gain(model: mujoco.MjModel, name: str) -> float:
    return float(model.actuator_gainprm[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name), 0])


def _only_joint(model: mujoco.MjModel, actuator: int) -> int:
    """The joint that an actuator alone acts on; -1 where there is none such."""
    joints = {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
    if int(model.actuator_trntype[actuator]) not in joints:
        return -1
    joint = int(model.actuator_trnid[actuator, 0])
    others = [
        i
        for i in range(model.nactuator)
        if i != actuator
        and int(model.actuator_trntype[i]) in joints
        and int(model.actuator_trnid[i, 0]) == joint
    ]
    return -1 if others else joint
