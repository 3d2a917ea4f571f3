"""The records of a case: what the log of a robot shows of a run.

Positions carry noise, of which 60 % of the variance is white and 40 % first-order autoregressive, and are then rounded to encoder
counts. Torques and currents carry white noise. Targets of servos are logged as they were given.
"""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import numpy as np

from bench.arrays import Array
from bench.files import write_bytes
from second_robots_cases.robots import UNITS, Robot
from second_robots_cases.running import Run

WHITE, COLOURED = 0.6, 0.4
"""Shares of the variance of the noise of positions."""
CORRELATION = 0.06
"""Time constant of its coloured part [s]."""


def command_columns(robot: Robot) -> list[str]:
    """Columns of the commands."""
    quantity = "goal" if robot.torque is None else robot.torque.quantity
    return [f"{link.joint}_{quantity}" for link in robot.links]


def position_columns(robot: Robot) -> list[str]:
    """Columns of the positions."""
    return [f"{link.joint}_{'angle' if link.kind == 'hinge' else 'travel'}" for link in robot.links]


def factors(robot: Robot) -> Array:
    """How many logged units make one radian or metre (n_joints)."""
    return np.array([UNITS[unit] for unit in robot.units])


def position_noise(robot: Robot) -> Array:
    """Standard deviation of the logged positions [rad or m] (n_joints): that of the noise and that of the rounding."""
    return np.hypot(robot.noise, np.array(robot.resolution) / 12**0.5)


def autoregressive(rng: np.random.Generator, shape: tuple[int, ...], rate: float) -> Array:
    """First-order autoregressive noise of unit variance, (n_samples, n_joints)."""
    white = rng.standard_normal(shape)
    a = np.exp(-1 / rate / CORRELATION)
    x = np.zeros(shape)
    x[0] = white[0]
    for k in range(1, shape[0]):
        x[k] = a * x[k - 1] + np.sqrt(1 - a * a) * white[k]
    return x


def logged(rng: np.random.Generator, robot: Robot, run: Run) -> Array:
    """Table (n_samples, 1 + 2 n_joints) of time, commands and positions, in the units of the log."""
    noise, resolution = np.array(robot.noise), np.array(robot.resolution)
    shape = run.position.shape
    white = np.sqrt(WHITE) * noise * rng.standard_normal(shape)
    coloured = np.sqrt(COLOURED) * (autoregressive(rng, shape, robot.rate) * noise)
    position = np.round((run.position + white + coloured) / resolution) * resolution
    if robot.torque is None:
        command = run.command * factors(robot)
    else:
        command = run.command + np.array(robot.torque.noise) * rng.standard_normal(shape)
    time = np.arange(len(command)) / robot.rate
    return np.column_stack([time, command, position * factors(robot)])


def write_record(path: Path, robot: Robot, table: Array) -> None:
    """Write a table as CSV, compressed without a time stamp, so that the same table gives the same file."""
    head = ",".join(["time", *command_columns(robot), *position_columns(robot)])
    packed = io.BytesIO()
    with gzip.GzipFile(path.name, "wb", fileobj=packed, mtime=0) as file:
        np.savetxt(file, table, delimiter=",", fmt="%.7g", header=head, comments="")
    write_bytes(path, packed.getvalue())
