"""The answer to a case: what is there, how much of the records it makes, and the true parameters.

How much an effect makes is the difference between two simulations along the same reference and with the same noise in the feedback,
one with the fault and one without it; of a robot that is torque-controlled in the torques or currents, of others in the positions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from bench.arrays import Array
from second_robots_cases.cases import RobotCase
from second_robots_cases.plant import Plant
from second_robots_cases.recording import position_noise
from second_robots_cases.robots import Robot
from second_robots_cases.running import Run

FELT = 1e-6
"""Gap above which a joint feels the main effect at all."""
METRIC = "largest over joints: rms change that the main effect makes, of the "


class Sizes(NamedTuple):
    """Sizes of the effects in one record, by joint."""

    gap: list[float]
    """Root mean square of what the main effect changes, over that of the tracking error or over the deviation of the torque."""
    over_noise: list[float]
    """The same change over the noise of its channel."""
    background: list[float | None] | None
    """What the background friction changes over what the main effect does; None where that is not felt, or not simulated."""


def sizes(robot: Robot, faulty: Run, sound: Run, bare: Run | None) -> Sizes:
    """Sizes of the effects.

    Args:
        robot: The robot.
        faulty: With fault and background friction.
        sound: With background friction only.
        bare: With neither; None where the background is not asked for.
    """
    if robot.torque is None:
        own, reference = position_noise(robot), _rms(faulty.command - faulty.position)
    else:
        own, reference = np.array(robot.torque.noise), faulty.command.std(0)
    main = _change(robot, faulty, sound)
    gap = [float(x) for x in main / reference]
    beside: list[float | None] | None = None
    if bare is not None:
        ratio = _change(robot, sound, bare) / np.maximum(main, 1e-9)
        beside = [float(x) if felt > FELT else None for x, felt in zip(ratio, gap, strict=True)]
    return Sizes(gap, [float(x) for x in main / own], beside)


def _change(robot: Robot, one: Run, other: Run) -> Array:
    """Root mean square by joint of the difference of two runs (n_joints)."""
    return _rms(one.position - other.position if robot.torque is None else one.command - other.command)


def _rms(x: Array) -> Array:
    """Root mean square of each column (n_joints)."""
    return np.array([np.sqrt(np.mean(np.square(column))) for column in x.T])


def answer_document(case: RobotCase, plant: Plant, records: Mapping[str, Sizes | None]) -> dict[str, Any]:
    """The answer; sizes are given for every record, None where nothing is wrong."""
    robot, torque = case.robot, case.robot.torque
    known = {name: size for name, size in records.items() if size is not None}
    background = {n: size.background for n, size in known.items() if size.background is not None}
    measure = (
        "encoder positions / tracking error" if torque is None else "closed-loop torque or current / its std"
    )
    return {
        "class": case.kind,
        "model": robot.name,
        "effects": [asdict(effect) for effect in case.effects],
        "gaps": {name: max(size.gap) if size else 0.0 for name, size in records.items()},
        "gap_metric": METRIC + measure,
        "gaps_by_joint": {name: size.gap for name, size in known.items()},
        "background_over_main_by_joint": background,
        "main_over_noise_by_joint": {name: size.over_noise for name, size in known.items()},
        "role": "command" if torque is None else "measured",
        "side": "motor" if case.motor_side else None,
        "records": case.plans,
        "noise": {
            "stated": case.noise_stated,
            "position": robot.noise,
            "resolution": robot.resolution,
            "torque": torque and torque.noise,
            "coloured": "40 % of the variance AR(1), 60 ms",
        },
        "equivalent": case.equivalent,
        "background": {
            "coulomb_friction": {
                link.joint: limit for link, limit in zip(robot.links, case.coulomb, strict=True)
            }
        },
        "true": _true(plant),
    }


def _true(plant: Plant) -> dict[str, list[float]]:
    drives = plant.drives
    return {
        "mass": plant.chain.mass.tolist(),
        "armature": drives.armature.tolist(),
        "damping": drives.damping.tolist(),
        "gain": drives.gain.tolist(),
        "forcerange": drives.limit.tolist(),
        "delay": drives.delay.tolist(),
    }
