"""The answer to a case: what is there, how much of the records it makes, and the true parameters.

How much an effect makes of a robot with servos is the difference of the positions of two simulations along the same reference, with it
and without. Where torques or currents are measured, it is what the torque of the rigid model with the true parameters misses along the
motion that is logged, up to 20 Hz.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bench.arrays import Array
from third_robots_cases.cases import RobotCase
from third_robots_cases.plant import Plant
from third_robots_cases.recording import Noise
from third_robots_cases.running import Run

HIGHEST = 20.0
"""Frequency up to which missing torques are measured [Hz]."""
RESTING = 1e-9
"""Speed below which a joint rests [rad/s or m/s]."""
METRICS = {
    True: "rms of the change of positions, over the standard deviation of the motion",
    False: "rms of the torque that the rigid model with true parameters misses up to 20 Hz, over the rms of the torque",
}
"""What is measured, by whether the drives are servos."""


class Runs(NamedTuple):
    """Simulations along the reference of a record."""

    bare: Run
    """Of the robot as it was drawn."""
    background: Run
    """With background friction and jitter besides."""
    faulty: Run | None
    """With the faults and without background; None where nothing is wrong."""
    each: tuple[Run, ...]
    """With each of several faults alone."""
    full: Run
    """With all of it, as it is logged."""


class Sizes(NamedTuple):
    """Sizes of the effects in one record, by joint; relative ones by `METRICS`."""

    main: list[float] | None
    """What the faults make; None where nothing is wrong."""
    main_over_noise: list[float] | None
    """The same over the noise of its channel."""
    main_over_tracking_error: list[float] | None
    """The same over the rms of the tracking error; None where the drives are no servos."""
    background: list[float]
    """What background friction and jitter make."""
    background_over_main: float | None
    """Root of the sum of squares of `background` over that of `main`."""
    each: list[list[float]]
    """What each of several faults makes alone."""
    resting: list[float]
    """Share of the time for which the joint rests."""
    at_limit: list[float]
    """Share of the time for which its drive is at its limit."""


def sizes(case: RobotCase, true: Plant, limit: Array, noise: Noise, runs: Runs) -> Sizes:
    """Sizes of the effects in a record.

    Args:
        case: The case.
        true: The robot as it was drawn, without faults.
        limit: Limits of its drives, with faults [N m or N] (n).
        noise: Standard deviations of the noise.
        runs: Simulations of the record.
    """
    servo, bare = case.drive == "servo", runs.bare
    whole, own = (
        (bare.position.std(0), noise.position) if servo else (root_mean_square(bare.torque), noise.torque)
    )

    def made(one: Run) -> Array:
        if servo:
            return root_mean_square(one.position - bare.position)
        rigid = true.rigid_torque(one.position, one.velocity, one.acceleration)
        return root_mean_square(_low_pass(one.torque - rigid, case.rate))

    background, main, tracking, ratio = made(runs.background) / whole, None, None, None
    if runs.faulty is not None:
        main = made(runs.faulty)
        ratio = _rounded([np.sqrt(np.sum(background**2) / np.sum((main / whole) ** 2))])[0]
        if servo:
            tracking = _rounded(main / root_mean_square(bare.target - bare.position))
    return Sizes(
        main=None if main is None else _rounded(main / whole),
        main_over_noise=None if main is None else _rounded(main / own),
        main_over_tracking_error=tracking,
        background=_rounded(background),
        background_over_main=ratio,
        each=[_rounded(made(one) / whole) for one in runs.each],
        resting=_rounded(np.mean(np.abs(runs.full.velocity) < RESTING, 0)),
        at_limit=_rounded(np.mean(np.abs(runs.full.torque) >= limit - RESTING, 0)),
    )


def root_mean_square(x: Array) -> Array:
    """Root mean square of each column (n)."""
    return np.sqrt(np.mean(np.square(x), 0))


def _low_pass(x: Array, rate: float) -> Array:
    """Columns without what lies above `HIGHEST`, forwards and backwards (n_samples, n)."""
    return sosfiltfilt(butter(4, HIGHEST / (rate / 2), output="sos"), x, axis=0)


def _rounded(values: Array | list[float]) -> list[float]:
    return [float(f"{x:.5g}") for x in values]


def answer_document(
    case: RobotCase, true: Plant, friction: Array, noise: Noise, records: Mapping[str, Sizes]
) -> dict[str, Any]:
    """The answer.

    Args:
        case: The case.
        true: The robot as it was drawn, without faults.
        friction: Dry friction of the background [N m or N] (n).
        noise: Standard deviations of the noise.
        records: Sizes of the effects by record.
    """
    torque = None if case.drive == "servo" else _rounded(noise.torque / true.ratio)
    document: dict[str, Any] = {
        "class": case.kind,
        "model": case.robot.name,
        "effects": [
            {"name": fault.name, "where": fault.where, "parameters": fault.parameters}
            for fault in case.faults
            if fault.named
        ],
        "equivalent": [],
        "joints": [link.joint for link in case.robot.links],
        "records": dict(zip(records, case.plans, strict=True)),
        "role": "command" if case.drive == "servo" else "measured",
        "side": case.side,
        "noise": {
            "stated": case.noise_stated,
            "position": _rounded(noise.position),
            "torque": torque,
            "velocity": _rounded(noise.velocity) if case.velocities else None,
        },
        "background": {"coulomb_friction": _rounded(friction)},
        "metric": METRICS[case.drive == "servo"],
        "sizes": {name: size._asdict() for name, size in records.items()},
        "true": _true(case, true),
    }
    foreign = [{"name": f.name, "parameters": f.parameters} for f in case.faults if not f.named]
    return document | ({"foreign": foreign} if foreign else {})


def _true(case: RobotCase, true: Plant) -> dict[str, list[float]]:
    """Parameters as they were drawn, without faults."""
    found = {"mass": true.chain.mass, "armature": true.drives.armature, "damping": true.drives.damping}
    if case.drive == "servo":
        found["kp"] = true.drives.gain
    if case.drive == "current":
        found["gear"] = true.ratio
    return {name: _rounded(values) for name, values in found.items()}
