"""The answer to a case: what is there, how large it stands out, and the true parameters.

How large an effect is, is what the stated model misses where its records are replayed: the logged loads are played on it, anew from the
true state every half second where torques drive, every second where speeds do, and never where all drives follow goals.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from robot_case_sets import shown

from bench.arrays import Array
from sixth_robots_cases.cases import RobotCase
from sixth_robots_cases.effects import listed, with_effects
from sixth_robots_cases.machine import Command, Machine
from sixth_robots_cases.plant import machine_of
from sixth_robots_cases.recording import read
from sixth_robots_cases.running import Run, background, played, true_values
from sixth_robots_cases.stepping import simulate

WINDOW = {"torque": 0.5, "velocity": 1.0, "position": 1e6}
"""Time after which a replay begins anew, by the kind of the drives [s]."""
SAID = {"right": "true", "half": "understated by 2", "none": "not stated"}
"""What is told of the noise that is stated."""


class Sizes(NamedTuple):
    """Root mean squares of what replays of all records leave at a joint [rad or m]."""

    moved: float
    """Standard deviation of its position."""
    nominal: float
    """Of the stated model."""
    background: float
    """Of the stated model where the effects are not there."""
    oracle: float
    """Of the true model with the effects, with clock and loads as logged."""
    noise: float
    """Of the log, with the steps of the encoder."""

    @property
    def ratio(self) -> float:
        """What the stated model leaves, over what background and noise do."""
        return self.nominal / float(np.hypot(self.background, self.noise))


def replay(case: RobotCase, own: Machine, ran: Run, loads: Array) -> Array:
    """Positions [rad or m] (n_samples, n) of a model under logged loads (n_samples, n), which begins anew from the states of a run."""
    rate, count, n = case.laboratory.rate, len(loads), len(case.robot.parts)
    length = max(1, round(min(WINDOW[part.drive.kind] for part in case.robot.parts) * rate))
    states = ran.states.copy()
    for i in range(n):
        if own.train[i, 0] == 0.0:
            states[:, 2 * n + i], states[:, 3 * n + i] = states[:, i], states[:, n + i]
    zero = np.zeros_like(loads)
    command = Command(
        times=np.arange(count + 1) / rate,
        position=zero,
        speed=zero,
        torque=zero,
        gains=np.zeros((n, 2)),
        commands=loads,
        closed=False,
        restart=np.arange(count) % length == 0,
        states=states,
        step=case.longest_step,
    )
    return simulate(own, command)[0][:, :n]


def sizes(case: RobotCase, runs: Mapping[str, Run]) -> dict[str, Sizes]:
    """Sizes by joint.

    Args:
        case: The case.
        runs: What the true robot did, by record.
    """
    nominal, plain = machine_of(case.robot, {}), background(case)
    real = with_effects(plain, case.robot, case.effects)
    n = len(case.robot.parts)
    squares, moved = np.zeros((4, n)), np.zeros(n)
    for record, ran in runs.items():
        without = played(case, record, plain)
        positions, loads = read(case, record, ran)
        true = ran.states[:, :n]
        errors = (
            replay(case, nominal, ran, loads) - true,
            replay(case, nominal, without, read(case, record, without)[1]) - without.states[:, :n],
            replay(case, real, ran, loads) - true,
            positions - true,
        )
        squares += np.stack([np.mean(error**2, axis=0) for error in errors]) / len(runs)
        moved += true.var(axis=0) / len(runs)
    rows = np.sqrt(np.vstack([moved, squares])).T
    return {joint: Sizes(*map(_digits, row)) for joint, row in zip(case.robot.joints, rows, strict=True)}


def in_lines(found: Mapping[str, Sizes]) -> str:
    """Sizes of the effects, a line for each joint."""
    return "".join(
        f"    {joint}: nominal, background, noise, oracle "
        f"{shown((size.nominal, size.background, size.noise, size.oracle))}, ratio {size.ratio:.2f}\n"
        for joint, size in found.items()
    )


def answer_document(case: RobotCase, found: Mapping[str, Sizes]) -> dict[str, Any]:
    """The answer, with the sizes of the effects by joint."""
    lab, robot = case.laboratory, case.robot
    return {
        "case": case.name,
        "class": case.kind,
        "truth": case.truth,
        "robot": robot.name,
        "drives": [part.drive.kind for part in robot.parts],
        "side": "link",
        "joints": robot.joints,
        "effects": listed(case.effects, robot),
        "background_coulomb": [_digits(friction) for friction in background(case).friction],
        "noise": {
            "stated": SAID[lab.said],
            "position": list(lab.noise),
            "torque": [lab.load_noise * part.rated for part in robot.parts]
            if lab.role == "measured"
            else None,
        },
        "clock": "jitters",
        "true": {name: _digits(value) for name, value in true_values(case).items()},
        "sizes": {joint: {**size._asdict(), "ratio": _digits(size.ratio)} for joint, size in found.items()},
    }


def _digits(value: float) -> float:
    return float(f"{value:.4g}")
