"""The records of a case: what the log of a robot shows of a run.

Half of the variance of the noise has a memory of five samples. Samples are taken early or late by what the stamps do not tell. Positions
are rounded to encoder counts, and currents may be rounded.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from fourth_robots_cases.recording import command_headings
from fourth_robots_cases.stepping import motor_coordinates
from numpy.typing import NDArray
from scipy.signal import lfilter

from bench.arrays import Array
from bench.files import write_text
from fifth_robots_cases.cases import RobotCase
from fifth_robots_cases.machine import Machine
from fifth_robots_cases.running import Run
from fifth_robots_cases.stepping import Steps

JITTER, MOST_JITTER = 0.01, 0.4
"""Standard deviation of a sample from its time, over the period, and its bound likewise."""
MEMORY, SETTLED = 5, 200
"""Memory of the noise, and samples of it that are thrown away before."""


def position_headings(case: RobotCase) -> list[str]:
    """Columns of positions."""
    return [f"{link.joint}_{'position' if link.slide else 'angle'}" for link in case.robot.links]


def headings(case: RobotCase) -> list[str]:
    """Columns of a record in their order: time, goals, currents or torques, and each position with its speed, where that is logged."""
    measured = []
    for joint, position in zip(case.robot.joints, position_headings(case), strict=True):
        measured += [position, f"{joint}_speed"] if case.speed_noise else [position]
    return ["time", *command_headings(case.robot), *measured]


def noise(rng: np.random.Generator, samples: int, std: float) -> Array:
    """Noise of one channel of a standard deviation (n_samples)."""
    decay = np.exp(-1 / MEMORY)
    driving = rng.standard_normal(samples + SETTLED)
    slow, _ = lfilter([np.sqrt(1 - decay * decay)], [1, -decay], driving[1:], zi=[decay * driving[0]])
    return std * np.sqrt(0.5) * (rng.standard_normal(samples) + slow[SETTLED - 1 :])


def read_at(steps: Steps, step: float, t: Array) -> tuple[Array, Array]:
    """Positions, by cubics, and velocities at times [s] (n_samples) within a run of steps [s]; each (n_samples, n_coordinates)."""
    i = np.clip((t / step).astype(int), 0, len(steps.q) - 2)
    s = (t / step - i)[:, None]
    q0, q1, v0, v1 = steps.q[i], steps.q[i + 1], step * steps.v[i], step * steps.v[i + 1]
    first = (1 + 2 * s) * (1 - s) ** 2 * q0 + s * (1 - s) ** 2 * v0
    q = first + s * s * (3 - 2 * s) * q1 + s * s * (s - 1) * v1
    return q, steps.v[i] * (1 - s) + steps.v[i + 1] * s


def sampled(case: RobotCase, values: Array) -> Array:
    """Values at the ticks of the controller (n_ticks, n) at the samples (n_samples, n)."""
    return values[:: case.ticks][: len(values) // case.ticks]


def side_of(case: RobotCase, machine: Machine) -> NDArray[np.int64]:
    """Coordinate that each encoder reads (n)."""
    motor = motor_coordinates(machine.transmission.present)
    return motor if case.side == "motor" else np.arange(len(motor), dtype=np.int64)


def logged(rng: np.random.Generator, case: RobotCase, machine: Machine, ran: Run) -> Array:
    """Table (n_samples, n_columns) of what `headings` names, of a run of a machine, with random numbers for clock and noise."""
    given, read = sampled(case, ran.trace.goal), side_of(case, machine)
    samples, sample = len(given), 1.0 / case.rate
    t = np.arange(samples, dtype=np.float64) * sample
    most = MOST_JITTER * sample
    jitter = np.clip(JITTER * sample * rng.standard_normal(samples), -most, most)
    table: list[Array] = [t]
    for j in range(len(read)):
        load = given[:, j] + (0.0 if case.load_noise is None else noise(rng, samples, case.load_noise[j]))
        if case.load_step is not None:
            load = np.round(load / case.load_step) * case.load_step
        table.append(load)
    for j, (std, count) in enumerate(zip(case.position_noise, case.counts, strict=True)):
        q, v = read_at(ran.steps, ran.step, np.clip(t + jitter - machine.late[j], 0, t[-1]))
        position = q[:, read[j]] + noise(rng, samples, std)
        table.append(np.round(position / count) * count)
        if case.speed_noise is not None:
            table.append(v[:, read[j]] + noise(rng, samples, case.speed_noise[j]))
    return np.stack(table, 1)


def write_record(path: Path, case: RobotCase, table: Array) -> None:
    """Write a table as CSV."""
    text, formats = io.StringIO(), ["%.6f"] + ["%.7g"] * (table.shape[1] - 1)
    np.savetxt(text, table, delimiter=",", fmt=formats, header=",".join(headings(case)), comments="")
    write_text(path, text.getvalue())
