"""Prescribed motions of the user's own MJCF as the accelerations that drive it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import ORDERS, Case, CaseChannel, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.model.mjcf_prescribed import PrescribedChannel, acceleration_name, prescribed_channels
from bench.discrepancy.motion.observer import ACCELERATION
from bench.discrepancy.motion.tracked import TrackedAcceleration, tracked_acceleration
from bench.discrepancy.settings import MotionSettings
from bench.rig import Rig


def with_accelerations(case: Case, rig: Rig, *, settings: MotionSettings) -> tuple[Case, tuple[str, ...]]:
    """A case whose prescribed motions are accelerations counted from rest, and what was made of their channels, in words.

    Args:
        case: In the units of its model.
        rig: The user's model.
        settings: `MotionSettings` of the diagnosis.
    """
    channels = prescribed_channels(case, rig)
    case, said = _without_gravity(case, channels)
    for joint in dict.fromkeys(entry.joint for entry in channels):
        own = [entry for entry in channels if entry.joint == joint]
        if all(entry.order == ACCELERATION for entry in own):
            continue
        case = _derived(case, joint, own, settings=settings)
        listed = " and ".join(f"its {ORDERS[entry.order]} '{entry.channel}'" for entry in own)
        said = (*said, f"joint '{joint}' is driven by its acceleration, made of {listed}")
    return case, said


def _without_gravity(case: Case, channels: Sequence[PrescribedChannel]) -> tuple[Case, tuple[str, ...]]:
    """Accelerometers that show gravity, without it."""
    records = (*case.identification, *case.validation)
    shifts = {}
    for entry in channels:
        mean = float(np.mean([np.mean(record.values[entry.channel]) for record in records]))
        if entry.bias and abs(mean - entry.bias) < abs(mean):
            shifts[entry.channel] = entry.bias
    if not shifts:
        return case, ()

    def shifted(record: CaseRecord) -> CaseRecord:
        values = {name: record.values[name] - shift for name, shift in shifts.items()}
        return _with(record, values)

    said = tuple(
        f"'{name}' shows gravity as the model's sensor does: {shift:.4g} {case.channel(name).unit} are taken off"
        for name, shift in shifts.items()
    )
    return _over_records(case, shifted), said


def _derived(case: Case, joint: str, own: Sequence[PrescribedChannel], *, settings: MotionSettings) -> Case:
    """A case with the acceleration of a joint among its channels."""
    found: dict[str, TrackedAcceleration] = {}
    orders = tuple(entry.order for entry in own)

    def driven(record: CaseRecord) -> CaseRecord:
        samples = np.column_stack([record.values[entry.channel] / entry.gain for entry in own])
        noise = np.array(
            [
                (case.channel(entry.channel).noise_std or noise_floor(record.values[entry.channel]))
                / abs(entry.gain)
                for entry in own
            ]
        )
        tracked = tracked_acceleration(
            samples, orders, noise, record.step, at_rest=record.at_rest, settings=settings
        )
        found[record.name] = tracked
        values = {acceleration_name(joint): tracked.samples}
        if record.at_rest:
            values |= {
                entry.channel: record.values[entry.channel] - entry.gain * tracked.start
                for entry in own
                if entry.order == 0
            }
        return _with(record, values)

    out = _over_records(case, driven)
    turns = "rad" in case.channel(own[0].channel).unit
    stated = all((case.channel(entry.channel).noise_std or 0.0) > 0.0 for entry in own)
    channel = CaseChannel(
        acceleration_name(joint), "rad/s^2" if turns else "m/s^2", "prescribed",
        max(tracked.noise for tracked in found.values()) if stated else None,
        target=f"joint:{joint}", quantity=ORDERS[ACCELERATION],
    )  # fmt: skip
    return replace(out, channels=(*out.channels, channel))


def _over_records(case: Case, change: Callable[[CaseRecord], CaseRecord]) -> Case:
    return replace(
        case,
        identification=tuple(change(record) for record in case.identification),
        validation=tuple(change(record) for record in case.validation),
    )


def _with(record: CaseRecord, values: dict[str, NDArray[np.float64]]) -> CaseRecord:
    for samples in values.values():
        samples.setflags(write=False)
    return replace(record, values={**record.values, **values})
