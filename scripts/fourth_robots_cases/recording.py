"""The records of a case: what the log of a robot shows of a run.

Every logged quantity but goals carries noise, of which a part is first-order autoregressive and a little is hum. Positions may be rounded
to encoder counts, and the log may be in degrees.
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
from fourth_robots_cases.cases import RobotCase
from fourth_robots_cases.robots import Robot
from fourth_robots_cases.stepping import Trace

HUM = 49.97
"""Frequency of the hum [Hz]."""
IN_POSITION, IN_TORQUE = 0.15, 0.25
"""Amplitude of the hum over the standard deviation of the noise."""
SETTLED = 400
"""Samples after which the autoregressive part is taken to be stationary."""


class Colour(NamedTuple):
    """Of the noise of a case."""

    share: float
    """Standard deviation of the autoregressive part over that of the whole."""
    correlation: float
    """Its time constant [s]."""


COLOURS = Colour(0.6, 0.012), Colour(0.45, 0.03), Colour(0.7, 0.02)
"""Colours of the noise; a case has the one of its seed's remainder by their number."""


def headings(case: RobotCase) -> list[str]:
    """Columns of a record in their order: time, goals, currents or torques, and positions."""
    return ["time", *command_headings(case.robot), *case.robot.joints]


def command_headings(robot: Robot) -> list[str]:
    """Columns of goals, currents or torques; a joint that nothing drives has one of its torque, which is zero."""
    ending = {"position": "goal", "velocity": "rate_goal", "current": "current", "torque": "torque"}
    return [f"{link.joint}_{ending[robot.drive] if link.driven else 'torque'}" for link in robot.links]


def noise(rng: np.random.Generator, std: float, samples: int, rate: int, colour: Colour, hum: float) -> Array:
    """Noise of one channel (n_samples).

    Args:
        rng: Source of the noise.
        std: Its standard deviation.
        samples: How many.
        rate: Samples a second [Hz].
        colour: Of the noise.
        hum: Amplitude of the hum over the standard deviation.
    """
    share, decay = colour.share, np.exp(-1 / (rate * colour.correlation))
    driving = rng.standard_normal(samples + SETTLED)
    slow = np.asarray(lfilter([np.sqrt(1 - decay * decay)], [1, -decay], driving))[SETTLED:]
    t = np.arange(samples) / rate
    white = np.sqrt(1 - share**2 - hum**2 / 2) * rng.standard_normal(samples)
    return std * (white + share * slow + hum * np.sin(2 * np.pi * HUM * t + rng.uniform(0, 6)))


def logged(
    rng: np.random.Generator, case: RobotCase, seed: int, ticks: Array, gear: Array, torque_std: Array, trace: Trace
) -> Array:  # fmt: skip
    """Table (n_samples, n_columns) of what `headings` names.

    Args:
        rng: Source of the noise.
        case: The case.
        seed: Of the case.
        ticks: When goals were set [s] (n_samples).
        gear: Torque per unit of what is read [N m/A or 1] (n).
        torque_std: Standard deviation of the noise of currents or torques [A or N m] (n).
        trace: What is logged.
    """
    samples, colour = len(ticks), COLOURS[seed % len(COLOURS)]
    unit = 180 / np.pi if case.degrees else 1.0
    read = trace.motor if case.side == "motor" else trace.position
    table = [np.round(ticks, 5)]
    for j, link in enumerate(case.robot.links):
        if not link.driven:
            table.append(np.zeros(samples))
        elif case.robot.has_servos:
            table.append(unit * trace.goal[:, j])
        else:
            error = noise(rng, torque_std[j], samples, case.rate, colour, IN_TORQUE)
            table.append(trace.torque[:, j] / gear[j] + error)
    for j, (std, count) in enumerate(zip(case.position_noise, case.encoder_counts, strict=True)):
        position = read[:, j] + noise(rng, std, samples, case.rate, colour, IN_POSITION)
        if count is not None:
            position = np.round(position / count) * count
        table.append(unit * position)
    return np.stack(table, 1)


def write_record(path: Path, case: RobotCase, table: Array) -> None:
    """Write a table as CSV, compressed without a time stamp, so that the same table gives the same file."""
    text, packed = io.StringIO(), io.BytesIO()
    formats = ["%.5f"] + ["%.8g"] * (table.shape[1] - 1)
    np.savetxt(text, table, delimiter=",", fmt=formats, header=",".join(headings(case)), comments="")
    with gzip.GzipFile(path.name, "wb", fileobj=packed, mtime=0) as file:
        file.write(text.getvalue().encode())
    write_bytes(path, packed.getvalue())
