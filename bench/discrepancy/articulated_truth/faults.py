"""What is withheld from the model of a robot: effects at a joint, body, drive or encoder, and such as no catalogue holds.

Strengths are drawn against what the sound robot does along its references: the torque its drives give, how far and how fast it moves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_truth.robots import Encoding, Robot
from bench.discrepancy.articulated_truth.time_stepping import ArmMotion, Cell
from bench.discrepancy.multibody.model import ArticulatedModel


class Sizes(NamedTuple):
    """Magnitudes of a joint along the references of the sound robot.

    Attributes:
        torque: RMS torque that bodies and armature ask of the drive.
        peak: Largest.
        reach: Largest excursion from the mean angle.
        middle: Mean angle.
        speed: Largest velocity.
        input: RMS of what the actuator makes a force of.
        inertia: Mean inertia.
    """

    torque: float
    peak: float
    reach: float
    middle: float
    speed: float
    input: float
    inertia: float


def sizes_of(robot: Robot, j: int, motions: list[ArmMotion]) -> Sizes:
    """Sizes of joint `j`."""
    q = np.concatenate([m.position[:, j] for m in motions])
    v = np.concatenate([m.velocity[:, j] for m in motions])
    command = np.concatenate([m.command[:, j] for m in motions])
    force = command
    inputs = command
    if robot.servo:
        inputs = command - q
        force = robot.table[j, Cell.KP] * inputs - robot.table[j, Cell.KV] * v
    at = np.zeros((1, len(robot.nominal.joints)))
    inertia = float(robot.nominal.dynamics(at, at, at).inertia[0, j]) + float(robot.table[j, Cell.ARMATURE])
    rms = float(np.sqrt(np.mean(force**2)))
    middle = 0.5 * float(q.max() + q.min())
    return Sizes(
        rms, float(np.abs(force).max()), 0.5 * float(np.ptp(q)), middle, float(np.abs(v).max()),
        float(np.sqrt(np.mean(inputs**2))), inertia,
    )  # fmt: skip


@dataclass(frozen=True)
class Fault:
    """A kind of fault.

    Attributes:
        name: Name in the catalogue, or of what no catalogue holds.
        site: "joint", "actuator", "sensor", "body" or "base".
        draw: Sizes, strength and generator to the numbers drawn, by name.
        cells: Number drawn to the cell of the table that it is put into (added), where it goes there.
        foreign: Whether no catalogue holds it.
        servo: Only with servos (True), only without (False), with both (None).
        joints: Fewest joints of the robot.
    """

    name: str
    site: str
    draw: Callable[[Sizes, float, np.random.Generator], dict[str, float]]
    cells: Mapping[str, Cell]
    foreign: bool = False
    servo: bool | None = None
    joints: int = 1


@dataclass(frozen=True)
class Withheld:
    """A fault drawn at its place.

    Attributes:
        fault: Its kind.
        joint: Index of the joint.
        where: Name of the joint, body or actuator.
        values: Numbers drawn.
    """

    fault: Fault
    joint: int
    where: str
    values: Mapping[str, float]


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _tilt(s: float, rng: np.random.Generator) -> dict[str, float]:
    angle, way = 0.05 + 0.3 * s, rng.uniform(0.0, 2.0 * np.pi)
    return {"tilt_x": angle * float(np.cos(way)), "tilt_y": angle * float(np.sin(way))}


def _stop(z: Sizes, s: float, rng: np.random.Generator) -> dict[str, float]:
    side = _sign(rng)
    return {
        "stiffness": (0.5 + 10.0 * s) * z.peak / z.reach,
        "position": z.middle + side * 0.6 * z.reach,
        "side": side,
    }


def _friction(z: Sizes, s: float, rng: np.random.Generator) -> dict[str, float]:
    return {"limit": s * z.torque, "stiffness": s * z.torque / (rng.uniform(0.02, 0.06) * z.reach)}


FRICTION, BRISTLES = (
    {"limit": Cell.FRICTION},
    {"limit": Cell.BRISTLE_LIMIT, "stiffness": Cell.BRISTLE_STIFFNESS},
)
FAULTS = (
    Fault("coulomb_friction", "joint", lambda z, s, rng: {"limit": s * z.torque}, FRICTION),
    Fault(
        "stribeck_friction", "joint",
        lambda z, s, rng: {"limit": s * z.torque, "rise": rng.uniform(0.5, 1.2), "velocity": 0.1 * z.speed},
        {**FRICTION, "rise": Cell.RISE, "velocity": Cell.STRIBECK},
    ),
    Fault("presliding_friction", "joint", _friction, BRISTLES),
    Fault(
        "load_dependent_friction", "joint", lambda z, s, rng: {"limit_0": 0.1 * s * z.torque, "mu": s},
        {"limit_0": Cell.FRICTION, "mu": Cell.CARRIED},
    ),
    Fault("force_offset", "joint", lambda z, s, rng: {"force": _sign(rng) * s * z.torque}, {"force": Cell.OFFSET}),
    Fault("damping_error", "joint", lambda z, s, rng: {"added": 2.0 * s * z.torque / z.speed}, {"added": Cell.DAMPING}),
    Fault(
        "quadratic_damping", "joint", lambda z, s, rng: {"c2": 3.0 * s * z.torque / z.speed**2}, {"c2": Cell.QUADRATIC},
    ),
    Fault(
        "one_sided_stop", "joint", _stop,
        {"stiffness": Cell.STOP, "position": Cell.STOP_AT, "side": Cell.STOP_SIDE},
    ),
    Fault("armature_error", "joint", lambda z, s, rng: {"added": 2.0 * s * z.inertia}, {"added": Cell.ARMATURE}),
    Fault(
        "backlash", "joint",
        lambda z, s, rng: {
            "half_clearance": 0.05 * s * z.reach + 0.004, "stiffness": 30.0 * z.peak, "damping": 0.1 * z.torque / z.speed,
            "motor_share": -rng.uniform(0.05, 0.2),
        },
        {"half_clearance": Cell.PLAY, "stiffness": Cell.TRAIN, "damping": Cell.TRAIN_DAMPING, "motor_share": Cell.SHARE},
    ),
    Fault(
        "joint_compliance", "joint",
        lambda z, s, rng: {
            "stiffness": z.peak / (0.2 * s * z.reach), "damping": 0.1 * z.torque / z.speed, "motor_share": -rng.uniform(0.05, 0.2),
        },
        {"stiffness": Cell.TRAIN, "damping": Cell.TRAIN_DAMPING, "motor_share": Cell.SHARE},
    ),
    Fault(
        "cogging", "joint",
        lambda z, s, rng: {"amplitude": s * z.torque, "periods_per_turn": float(rng.integers(6, 41)), "phase": 6.28 * rng.random()},
        {"amplitude": Cell.COGGING, "periods_per_turn": Cell.PERIODS, "phase": Cell.PHASE},
    ),
    Fault("mass_error", "body", lambda z, s, rng: {"part": 2.0 * s}, {}),
    Fault(
        "com_error", "body",
        lambda z, s, rng: dict(zip(("x", "y", "z"), s * rng.standard_normal(3), strict=True)), {},
    ),
    Fault("actuator_delay", "actuator", lambda z, s, rng: {"delay_s": 0.004 + 0.05 * s}, {"delay_s": Cell.DELAY}),
    Fault("actuator_lag", "actuator", lambda z, s, rng: {"time_constant_s": 0.004 + 0.05 * s}, {"time_constant_s": Cell.LAG}),
    Fault("force_gain_error", "actuator", lambda z, s, rng: {"relative_error": _sign(rng) * (0.15 + s)}, {"relative_error": Cell.GEAR}),
    Fault(
        "servo_gain_error", "actuator", lambda z, s, rng: {"relative_error": _sign(rng) * (0.2 + s)},
        {"relative_error": Cell.KP}, servo=True,
    ),
    Fault("actuator_saturation", "actuator", lambda z, s, rng: {"limit": rng.uniform(0.4, 0.75) * z.peak}, {"limit": Cell.LIMIT}),
    Fault("actuator_deadband", "actuator", lambda z, s, rng: {"half_width": s * z.input}, {"half_width": Cell.DEADBAND}),
    Fault("position_offset", "sensor", lambda z, s, rng: {"offset": _sign(rng) * (0.02 + 0.3 * s)}, {}),
    Fault("position_gain_error", "sensor", lambda z, s, rng: {"gain": _sign(rng) * (0.03 + 0.3 * s)}, {}),
    Fault("velocity_gain_error", "sensor", lambda z, s, rng: {"speed": _sign(rng) * (0.05 + s)}, {}, servo=False),
    Fault("position_delay", "sensor", lambda z, s, rng: {"delay": 0.004 + 0.05 * s}, {}),
    Fault(
        "angle_dependent_friction", "joint",
        lambda z, s, rng: {"limit": 2.0 * s * z.torque, "part": 0.9, "periods": float(rng.integers(3, 7))},
        {"limit": Cell.FRICTION, "part": Cell.WAVINESS, "periods": Cell.WAVES}, foreign=True,
    ),
    Fault("base_tilt", "base", lambda z, s, rng: _tilt(s, rng), {}, joints=3),
    Fault(
        "coupling_spring", "joint", lambda z, s, rng: {"stiffness": 3.0 * s * z.torque / z.reach},
        {"stiffness": Cell.TIE}, foreign=True, joints=3,
    ),
    Fault(
        "creeping_cable", "joint",
        lambda z, s, rng: {"stiffness": 4.0 * s * z.torque / z.reach, "relaxation_s": rng.uniform(0.4, 1.5)},
        {"stiffness": Cell.MAXWELL, "relaxation_s": Cell.RELAXATION}, foreign=True,
    ),
)  # fmt: skip
"""All faults."""
SET = {Cell.STRIBECK, Cell.STOP_AT, Cell.STOP_SIDE, Cell.RELAXATION}
"""Cells that a fault writes; to the others it adds."""
SCALED = {Cell.GEAR, Cell.KP}
"""Cells that it scales."""


def place_of(robot: Robot, fault: Fault, j: int) -> str:
    """Name of the place of a fault at joint `j`."""
    joint = robot.nominal.joints[j]
    assert joint.drive is not None
    return {
        "joint": joint.name,
        "sensor": joint.name,
        "actuator": joint.drive.name,
        "body": joint.body,
        "base": "base",
    }[fault.site]


class Faulty(NamedTuple):
    """A robot with faults: bodies, table and what is wrong with its encoders by joint."""

    bodies: ArticulatedModel
    table: Array
    encoding: dict[int, Encoding]


def with_faults(robot: Robot, withheld: tuple[Withheld, ...]) -> Faulty:
    """The robot with faults."""
    bodies, table, encoding = robot.bodies, robot.table.copy(), {}
    for one in withheld:
        j, values = one.joint, one.values
        for name, cell in one.fault.cells.items():
            if cell in SET:
                table[j, cell] = values[name]
            elif cell in SCALED:
                table[j, cell] *= 1.0 + values[name]
            else:
                table[j, cell] += values[name]
        if one.fault.name == "coupling_spring":
            table[j, Cell.TIED_TO] = (j + 2) % len(table)
        elif one.fault.name == "base_tilt":
            bodies = bodies.with_tilt(values["tilt_x"], values["tilt_y"])
        elif one.fault.name == "mass_error":
            bodies = bodies.with_payload(one.where, values["part"] * robot.nominal.mass(one.where))
        elif one.fault.name == "com_error":
            reach = float(np.linalg.norm(robot.nominal.tips[one.where]))
            bodies = bodies.with_centre(one.where, 0.3 * reach * np.array([values[axis] for axis in "xyz"]))
        elif one.fault.site == "sensor":
            encoding[j] = encoding.get(j, Encoding())._replace(**values)
    return Faulty(bodies, table, encoding)
