"""The records of a case: what the log of a robot shows of a run.

Every logged quantity but targets carries noise, of which 56 % of the variance is white and 44 % first-order autoregressive, and positions
and torques a little hum besides. Positions may be rounded to encoder counts.
"""

from __future__ import annotations

import gzip
import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from bench.arrays import Array
from bench.files import write_bytes
from third_robots_cases.cases import RobotCase
from third_robots_cases.plant import Plant
from third_robots_cases.running import Run

WHITE, COLOURED = 0.75, 0.66
"""Standard deviations of the parts of the noise, over that of the whole."""
CORRELATION, OF_VELOCITY = 0.02, 0.005
"""Time constant of the autoregressive part [s], and that of velocities."""
HUM = 50.03
"""Frequency of the hum [Hz]."""
IN_POSITION, IN_TORQUE = 0.25, 0.5
"""Amplitude of the hum over the standard deviation of the noise."""
SETTLED = 500
"""Samples after which the autoregressive part is taken to be stationary."""
VELOCITY_NOISE = 0.01
"""Standard deviation of the noise of velocities, over their root mean square."""
COUNT_OF_SLIDE, COUNT_OF_HINGE = 2e-5, 2 * np.pi / 2**17
"""One count of the encoders [m] and [rad]."""


class Noise(NamedTuple):
    """Standard deviation of the noise of each quantity; each (n)."""

    position: Array
    """[rad or m]."""
    torque: Array
    """[N m or N], of currents too."""
    velocity: Array
    """[rad/s or m/s]."""


def columns(case: RobotCase) -> list[str]:
    """Columns of a record in their order: time, commands, positions, and velocities where they are logged."""
    joints = [link.joint for link in case.robot.links]
    velocities = [f"{joint}_velocity" for joint in joints] if case.velocities else []
    positions = [f"{joint}_position" for joint in joints]
    return ["time", *command_columns(case), *positions, *velocities]


def command_columns(case: RobotCase) -> list[str]:
    """Columns of targets, torques and forces, or currents."""
    if case.drive != "torque":
        return [
            f"{link.joint}_{'target' if case.drive == 'servo' else 'current'}" for link in case.robot.links
        ]
    return [f"{link.joint}_{'force' if link.kind == 'slide' else 'torque'}" for link in case.robot.links]


def counts(case: RobotCase) -> list[float | None]:
    """One count of each encoder [rad or m]; None where positions are not rounded (n)."""
    hinge, slide = float(COUNT_OF_HINGE), COUNT_OF_SLIDE
    return [
        (slide if link.kind == "slide" else hinge) if case.quantised else None for link in case.robot.links
    ]


def coloured(rng: np.random.Generator, std: Array, samples: int, rate: float, correlation: float) -> Array:
    """White and autoregressive noise (n_samples, n).

    Args:
        rng: Source of the noise.
        std: Standard deviation of each column (n).
        samples: How many.
        rate: Samples a second [Hz].
        correlation: Time constant of the autoregressive part [s].
    """
    a = np.exp(-1 / (rate * correlation))
    out = []
    for one in std:
        driving = rng.standard_normal(samples + SETTLED)
        slow = np.asarray(lfilter([np.sqrt(1 - a * a)], [1, -a], driving))
        white = rng.standard_normal(samples)
        out.append(one * (WHITE * white + COLOURED * slow[SETTLED:]))
    return np.stack(out, 1)


def logged(rng: np.random.Generator, case: RobotCase, plant: Plant, noise: Noise, run: Run) -> Array:
    """Table (n_samples, n_columns) of what `columns` names.

    Args:
        rng: Source of the noise.
        case: The case.
        plant: What was run, of which torques per current are taken.
        noise: Standard deviations of the noise.
        run: What is logged.
    """
    samples, rate = len(run.time), float(case.rate)
    hum = np.sin(2 * np.pi * HUM * run.time + 1.0)[:, None]
    position = run.position + coloured(rng, noise.position, samples, rate, CORRELATION)
    position = position + IN_POSITION * noise.position * hum
    for i, count in enumerate(counts(case)):
        if count is not None:
            position[:, i] = np.round(position[:, i] / count) * count
    torque = run.torque + coloured(rng, noise.torque, samples, rate, CORRELATION)
    torque = (torque + IN_TORQUE * noise.torque * hum) / plant.ratio
    table = [run.time[:, None], run.target if case.drive == "servo" else torque, position]
    if case.velocities:
        table.append(run.velocity + coloured(rng, noise.velocity, samples, rate, OF_VELOCITY))
    return np.concatenate(table, 1)


def write_record(path: Path, case: RobotCase, table: Array) -> None:
    """Write a table as CSV, compressed without a time stamp, so that the same table gives the same file."""
    packed = io.BytesIO()
    with gzip.GzipFile(path.name, "wb", fileobj=packed, mtime=0) as file:
        np.savetxt(file, table, delimiter=",", fmt="%.8g", header=",".join(columns(case)), comments="")
    write_bytes(path, packed.getvalue())
