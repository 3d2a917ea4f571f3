"""Drawing one sealed case of an arm, a leg or a servo arm: robot, references, withheld faults, and what is handed over.

A drawn fault has to act in the judging record: on the angles or, where a loop hides it from them, on the torques. A draw that does not, or
that throws the robot about, is thrown away. Nothing is thrown away for being hard to tell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_truth.faults import (
    FAULTS,
    Fault,
    Withheld,
    place_of,
    sizes_of,
    with_faults,
)
from bench.discrepancy.articulated_truth.robots import (
    REFERENCES,
    SETTINGS,
    Robot,
    draw_robot,
    reference_of,
    robot_log,
)
from bench.discrepancy.articulated_truth.time_stepping import ArmMotion
from bench.discrepancy.case.case import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.truth.rigs import BlindOptions
from bench.errors import ParameterError
from bench.mjcf import model_path


@dataclass(frozen=True)
class RobotCasesSettings:
    """Numbers of `bench.discrepancy.blind.robot_cases`."""

    attempts: int = 60
    """Draws before the maker gives up; two or three are usual."""
    strength: tuple[float, float] = (0.08, 0.5)
    """Strengths, over the magnitudes of the joint: from what a data sheet leaves open to what ruins a model."""
    shows: float = 4.0
    """RMS change of an angle over the noise of its encoder from which a fault shows."""
    shows_torque: float = 0.05
    """The same of a torque over its RMS: half of what the armature's stated uncertainty does."""
    tame: float = 3.0
    """Largest angle over the largest of the references up to which a robot has not been thrown about."""


ROBOT_CASES_SETTINGS = RobotCasesSettings()
NAMES = ("identification", "identification_2", "validation")
UNITS = {"mass": "kg", "damping": "N m s/rad", "armature": "kg m^2", "kp": "N m/rad"}
KINDS = ("none", "single", "double", "foreign")


def draw_robot_case(
    name: str, rng: np.random.Generator, options: BlindOptions
) -> tuple[Case, dict[str, Any]]:
    """Draw one case and its answer.

    Raises:
        ParameterError: None of many draws showed, or the options allow no fault.
    """
    for attempt in range(ROBOT_CASES_SETTINGS.attempts):
        robot = draw_robot(options.robots, rng)
        kind = str(rng.choice(KINDS, p=options.shares))
        references = [reference_of(robot, one, options.duration, rng) for one in REFERENCES]
        sound = [robot.run(reference) for reference in references]
        withheld = _withheld(robot, kind, sound, rng, options)
        noise = float(rng.uniform(*SETTINGS.noise))
        faulty = with_faults(robot, withheld)
        moved = [robot.run(reference, bodies=faulty.bodies, table=faulty.table) for reference in references]
        if not all(
            np.isfinite(m.position).all()
            and np.abs(m.position).max() < ROBOT_CASES_SETTINGS.tame * np.abs(r).max()
            for m, r in zip(moved, references, strict=True)
        ):
            continue
        if all(_shows(robot, withheld, i, references[-1], noise) for i in range(len(withheld))):
            logs = [robot_log(robot, motion, faulty.encoding) for motion in moved]
            case = _handed_over(name, robot, moved, logs, noise, rng)
            return case, _answer(robot, kind, withheld, noise, attempt + 1)
    raise ParameterError(
        f"case '{name}': none of {ROBOT_CASES_SETTINGS.attempts} draws shows in the judging record"
    )


def _withheld(
    robot: Robot, kind: str, sound: list[ArmMotion], rng: np.random.Generator, options: BlindOptions
) -> tuple[Withheld, ...]:
    pool = [
        fault
        for fault in FAULTS
        if fault.foreign == (kind == "foreign")
        and fault.servo in (None, robot.servo)
        and len(robot.nominal.joints) >= fault.joints
        and (not options.effects or fault.name in options.effects)
    ]
    count = {"none": 0, "single": 1, "double": 2, "foreign": 1}[kind]
    if len(pool) < count:
        raise ParameterError(f"none of the effects {', '.join(options.effects)} can be withheld from a robot")
    picked = rng.choice(len(pool), size=count, replace=False)
    return tuple(_drawn(robot, pool[int(i)], sound, rng) for i in picked)


def _drawn(robot: Robot, fault: Fault, sound: list[ArmMotion], rng: np.random.Generator) -> Withheld:
    j = int(rng.integers(len(robot.nominal.joints)))
    strength = float(np.exp(rng.uniform(*np.log(ROBOT_CASES_SETTINGS.strength))))
    values = fault.draw(sizes_of(robot, j, sound), strength, rng)
    return Withheld(fault, j, place_of(robot, fault, j), {k: float(v) for k, v in values.items()})


def _shows(robot: Robot, withheld: tuple[Withheld, ...], i: int, reference: Array, noise: float) -> bool:
    """Whether a fault adds something to the others in a record."""
    runs = []
    for some in (withheld, withheld[:i] + withheld[i + 1 :]):
        faulty = with_faults(robot, some)
        motion = robot.run(reference, bodies=faulty.bodies, table=faulty.table)
        runs.append((robot_log(robot, motion, faulty.encoding), motion.command))
    ((q, v), u), ((q_without, v_without), u_without) = runs

    def change(a: Array, b: Array) -> float:
        return float(np.sqrt(np.mean((a - b) ** 2, axis=0)).max())

    least = ROBOT_CASES_SETTINGS.shows
    if change(q, q_without) > least * max(noise, SETTINGS.steps.get(robot.kind, 0.0) / np.sqrt(12.0)):
        return True
    if robot.servo:
        return False
    if change(v, v_without) > least * SETTINGS.speed_noise * float(np.sqrt(np.mean(v**2))):
        return True
    size = np.sqrt(np.mean(u_without**2, axis=0))
    return (
        float((np.sqrt(np.mean((u - u_without) ** 2, axis=0)) / size).max())
        > ROBOT_CASES_SETTINGS.shows_torque
    )


def _handed_over(
    name: str,
    robot: Robot,
    moved: list[ArmMotion],
    logs: list[tuple[Array, Array]],
    noise: float,
    rng: np.random.Generator,
) -> Case:
    """The case as a laboratory hands it over: the model of the file, what is uncertain in it, and noisy records."""
    parameters = []
    for entry in robot.values:
        kind, _, target = entry.partition(":")
        value = _stated(robot, kind, target)
        parameters.append(NominalParameter(entry, value, SETTINGS.spreads[kind] * value, UNITS[kind]))
    step = SETTINGS.steps.get(robot.kind, 0.0)
    channels: list[CaseChannel] = []
    columns: list[dict[str, Array]] = [{} for _ in moved]
    for j, joint in enumerate(robot.nominal.joints):
        drive = joint.drive
        assert drive is not None
        label = f"{joint.name}_{'target' if robot.servo else 'torque'}"
        channels.append(
            CaseChannel(
                label, "rad" if robot.servo else "N m", "command", 0.0, target=f"actuator:{drive.name}"
            )
        )
        stated = float(np.hypot(noise, step / np.sqrt(12.0)))
        speed = SETTINGS.speed_noise * float(
            np.sqrt(np.mean(np.concatenate([v[:, j] for _, v in logs]) ** 2))
        )
        channels.append(
            CaseChannel(
                f"{joint.name}_position", "rad", "response", stated, target=f"joint:{joint.name}", quantity="position",
                side=robot.side, resolution=step,
            )
        )  # fmt: skip
        if not robot.servo:
            channels.append(
                CaseChannel(
                    f"{joint.name}_velocity", "rad/s", "response", speed, target=f"joint:{joint.name}", quantity="velocity",
                    side=robot.side,
                )
            )  # fmt: skip
        for table, motion, (q, v) in zip(columns, moved, logs, strict=True):
            reading = q[:, j] + noise * rng.standard_normal(len(q))
            table[label] = motion.command[:, j]
            table[f"{joint.name}_position"] = np.round(reading / step) * step if step else reading
            if not robot.servo:
                table[f"{joint.name}_velocity"] = v[:, j] + speed * rng.standard_normal(len(v))
    records = tuple(
        record_from_arrays(label, np.arange(len(motion.command)) / robot.rate, table)
        for label, motion, table in zip(NAMES, moved, columns, strict=True)
    )
    path = model_path(f"arms/{robot.name}")
    return Case(
        name, path.name, tuple(parameters), tuple(channels), records[:-1], records[-1:], path.parent,
        {"load_interpolation": "zero_order_hold"},
    )  # fmt: skip


def _stated(robot: Robot, kind: str, target: str) -> float:
    if kind == "mass":
        return robot.nominal.mass(target)
    for joint in robot.nominal.joints:
        if kind == "kp" and joint.drive is not None and joint.drive.name == target:
            return joint.drive.kp
        if joint.name == target:
            return joint.damping if kind == "damping" else joint.armature
    raise AssertionError(target)


def _answer(
    robot: Robot, kind: str, withheld: tuple[Withheld, ...], noise: float, attempts: int
) -> dict[str, Any]:
    return {
        "class": kind,
        "rig": robot.name,
        "effects": [
            {"name": w.fault.name, "where": w.where, "parameters": list(w.values.values()), "names": list(w.values)}
            for w in withheld
        ],
        "noise": noise,
        "sensors": robot.side,
        "commanded": True,
        "signals": list(REFERENCES),
        "true": dict(robot.values),
        "attempts": attempts,
    }  # fmt: skip
