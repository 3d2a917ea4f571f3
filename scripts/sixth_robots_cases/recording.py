"""What a laboratory writes down: noise, steps of encoders and units of a record."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np

from bench.arrays import Array
from bench.files import write_text
from sixth_robots_cases.cases import RobotCase
from sixth_robots_cases.robots import Part
from sixth_robots_cases.running import Run

SLOW = 0.03
"""Time over which coloured noise remembers [s]."""
SCALES = {"rad": 1.0, "m": 1.0, "deg": 180.0 / math.pi, "mm": 1000.0}
"""Units of a log in one of the SI."""
LOADS = {"torque": "torque", "position": "goal", "velocity": "speed_goal"}
"""What columns of loads are called, by the kind of the drive."""


def unit_of(case: RobotCase, part: Part) -> str:
    """Unit of the positions of a joint in the log."""
    return case.laboratory.length if part.slide else case.laboratory.angle


def load_heading(part: Part) -> str:
    """Name of the column of a joint's load."""
    forced = part.slide and part.drive.kind == "torque"
    return f"{part.joint}_{'force' if forced else LOADS[part.drive.kind]}"


def position_heading(part: Part) -> str:
    """Name of the column of a joint's position."""
    return f"{part.joint}_position"


def noise(rng: np.random.Generator, count: int, std: float, colour: float, rate: float) -> Array:
    """White noise and slow noise that together have a standard deviation.

    Args:
        rng: Random numbers.
        count: Number of samples.
        std: Standard deviation.
        colour: Part of the variance that is slow.
        rate: Samples a second [Hz].

    Returns:
        The noise (count).
    """
    keep = math.exp(-1.0 / (SLOW * rate))
    drive = rng.normal(0.0, math.sqrt(1.0 - keep * keep), count)
    slow = np.empty(count)
    last = rng.normal()
    for k in range(count):
        last = keep * last + drive[k]
        slow[k] = last
    return std * (math.sqrt(colour) * slow + math.sqrt(1.0 - colour) * rng.normal(0.0, 1.0, count))


def read(case: RobotCase, record: str, ran: Run) -> tuple[Array, Array]:
    """Positions and loads as they were logged, in SI units; each (n_samples, n)."""
    lab, rng = case.laboratory, case.rng(f"noise/{record}")
    positions, loads = ran.states[:, : len(case.robot.parts)].copy(), ran.commands.copy()
    for i, part in enumerate(case.robot.parts):
        positions[:, i] += noise(rng, len(positions), lab.noise[i], lab.colour, lab.rate)
        if lab.steps[i]:
            positions[:, i] = np.round(positions[:, i] / lab.steps[i]) * lab.steps[i]
        if lab.role == "measured":
            loads[:, i] = ran.torques[:, i]
            loads[:, i] += noise(rng, len(loads), lab.load_noise * part.rated, lab.colour, lab.rate)
    return positions, loads


def write_record(path: Path, case: RobotCase, time: Array, positions: Array, loads: Array) -> None:
    """Write a record as CSV.

    Args:
        path: The file.
        case: The case.
        time: Stamps [s] (n_samples).
        positions, loads: In SI units (n_samples, n).
    """
    parts = case.robot.parts
    scales = np.array([SCALES[unit_of(case, part)] for part in parts])
    goals = np.where([part.drive.kind == "position" for part in parts], scales, 1.0)
    headings = ["time", *map(load_heading, parts), *map(position_heading, parts)]
    table = np.column_stack([time, loads * goals, positions * scales])
    text, formats = io.StringIO(), ["%.6f"] + ["%.9g"] * (table.shape[1] - 1)
    np.savetxt(text, table, delimiter=",", fmt=formats, header=",".join(headings), comments="")
    write_text(path, text.getvalue())
