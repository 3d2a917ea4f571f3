"""The robot as it really is, and what it does in a record: numbers off by their uncertainty, faint friction, and a clock that jitters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from robot_case_sets import UnstableRobotError

from bench.arrays import Array
from sixth_robots_cases.cases import RobotCase
from sixth_robots_cases.dynamics import rigid_torques
from sixth_robots_cases.machine import Command, Machine
from sixth_robots_cases.plant import machine_of, stated
from sixth_robots_cases.references import reference
from sixth_robots_cases.stepping import simulate

CLIP = 1.5
"""Standard uncertainties beyond which no stated number is off."""
FAINT = (0.01, 0.02)
"""Smallest and largest dry friction of a joint, over what its drive is rated for."""
JITTER = 0.01
"""Standard deviation of the instants of samples, over a period."""
SETTLE = 3.0
"""Time for which a robot holds its posture before a record begins [s]."""
APART = 1e-3
"""Time between the references of which rates are taken [s]."""


@dataclass(frozen=True)
class Run:
    """What a robot did in a record, at its samples.

    Attributes:
        time: As logged [s] (n_samples).
        states: Positions, speeds, motor positions and motor speeds (n_samples, 4 n).
        commands: Of the drives (n_samples, n).
        torques: Of the drives [N m or N] (n_samples, n).
    """

    time: Array
    states: Array
    commands: Array
    torques: Array


def true_values(case: RobotCase) -> dict[str, float]:
    """Stated parameters as they really are."""
    rng = case.rng("values")
    common: dict[str, float] = {}
    out = {}
    for key, entry in stated(case.robot).items():
        off = float(np.clip(rng.normal(), -CLIP, CLIP))
        if entry.alike:
            shared = common.setdefault(entry.alike, entry.std * off)
            each = float(np.clip(rng.normal(), -CLIP, CLIP)) * entry.each
            out[key] = entry.value + shared + each
        else:
            out[key] = entry.value + entry.std * off
    return out


def background(case: RobotCase) -> Machine:
    """The true robot without what is missing: numbers that are off, and faint friction."""
    own = machine_of(case.robot, true_values(case))
    rated = np.array([part.rated for part in case.robot.parts])
    return own._replace(friction=rated * case.rng("friction").uniform(*FAINT, len(rated)))


def played(case: RobotCase, record: str, own: Machine) -> Run:
    """Play a record on a robot, from where it holds its posture.

    Raises:
        UnstableRobotError: The simulation left the finite numbers.
    """
    rate, parts = case.laboratory.rate, case.robot.parts
    before = round(SETTLE * rate)
    count = before + round(case.records[record].seconds * rate)
    nominal = (np.arange(count + 1) - before) / rate
    motion = reference(case.records[record], case.posture, case.rng(f"signal/{record}"))
    here = np.maximum(nominal[:-1], 0.0)
    earlier, q, later = motion(np.maximum(here - APART, 0.0)), motion(here), motion(here + APART)
    dq, ddq = (later - earlier) / (2.0 * APART), (later - 2.0 * q + earlier) / APART**2
    dq[: before + 1], ddq[: before + 1] = 0.0, 0.0
    jitter = case.rng(f"clock/{record}").normal(0.0, JITTER / rate, count + 1)
    start = np.concatenate([q[0], np.zeros_like(q[0]), q[0], np.zeros_like(q[0])])
    command = Command(
        times=nominal + jitter,
        position=q,
        speed=dq,
        torque=rigid_torques(machine_of(case.robot, {}), q, dq, ddq),
        gains=np.array([part.drive.gains for part in parts]),
        commands=np.zeros_like(q),
        closed=True,
        restart=np.arange(count) == 0,
        states=start[None, :],
        step=case.longest_step,
    )
    states, commands, torques = simulate(own, command)
    if not np.isfinite(states).all():
        raise UnstableRobotError(f"{case.name}/{record}: the simulation diverged; choose a shorter step")
    return Run(nominal[before:-1], states[before:], commands[before:], torques[before:])
