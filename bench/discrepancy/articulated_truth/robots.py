"""The robots of sealed cases: models of `models/arms`, what they really weigh, the loop that drives them, and their references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_truth.time_stepping import CELLS, ArmMotion, Cell, march_bodies
from bench.discrepancy.multibody.model import ArticulatedModel, compiled_model
from bench.mjcf import model_path

RobotKind = Literal["arm", "leg", "servo"]
"""Kinds of robots: torque-driven arms, a leg with servos, a desk arm with servos and coarse encoders."""
MODELS: Mapping[str, tuple[str, ...]] = {"arm": ("two_link", "six_axis"), "leg": ("leg",), "servo": ("desk",)}
REFERENCES = ("multisine", "chirp", "point_to_point")


@dataclass(frozen=True)
class RobotsSettings:
    """Numbers of `bench.discrepancy.articulated_truth.robots`."""

    spreads: Mapping[str, float] = field(
        default_factory=lambda: {"mass": 0.03, "damping": 0.25, "armature": 0.1, "kp": 0.05}
    )
    """Relative one-sigma uncertainties of the nominal parameters: scales weigh to less, catalogues of motors state no better."""
    rates: Mapping[str, tuple[float, ...]] = field(
        default_factory=lambda: {"arm": (250.0, 500.0), "leg": (200.0, 400.0), "servo": (50.0, 100.0)}
    )
    """Sample rates [Hz] of torque loops, of legs, and of servos on a bus."""
    noise: tuple[float, float] = (2e-4, 5e-4)
    """Noise of an encoder [rad]."""
    speed_noise: float = 0.01
    """Noise of a velocity over the RMS velocity of the joint."""
    steps: Mapping[str, float] = field(default_factory=lambda: {"servo": 2.0 * np.pi / 4096.0})
    """Steps of encoders [rad]: twelve bits a turn on a servo."""
    bandwidth: float = 1.5
    """Frequency of the torque loop [Hz]: above the references, so that joints follow, and below what the encoder's noise allows."""
    loop_damping: float = 0.8
    """Its damping ratio."""
    amplitude: float = 0.5
    """Amplitude of references [rad], at most 80 % of what the range of the joint leaves."""
    band: tuple[float, float] = (0.1, 1.5)
    """Frequencies [Hz] of references."""
    ramp: float = 0.8
    """Seconds over which a reference begins."""


SETTINGS = RobotsSettings()


class Encoding(NamedTuple):
    """What is wrong with the log of one joint; the delay in seconds."""

    offset: float = 0.0
    gain: float = 0.0
    speed: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot as it is.

    Attributes:
        kind: Its kind.
        name: Name of its model, a file of `models/arms`.
        nominal: The model as it is handed over.
        bodies: Its bodies as they really are.
        table: (n_joints, CELLS) of everything else that is real.
        values: True parameters by their nominal names.
        rate: Samples a second.
        side: Where its encoders sit.
    """

    kind: RobotKind
    name: str
    nominal: ArticulatedModel
    bodies: ArticulatedModel
    table: Array
    values: Mapping[str, float]
    rate: float
    side: Literal["motor", "link"]

    @property
    def servo(self) -> bool:
        """Whether position servos drive it."""
        return self.kind != "arm"

    def run(
        self, reference: Array, *, bodies: ArticulatedModel | None = None, table: Array | None = None
    ) -> ArmMotion:
        """Its motion along a reference (n, n_joints), with other bodies or another table where given."""
        speed = np.gradient(reference, 1.0 / self.rate, axis=0)
        forward = np.zeros_like(reference)
        if not self.servo:  # the loop's own idea of the arm: the model that is handed over
            acceleration = np.gradient(speed, 1.0 / self.rate, axis=0)
            forward = self.nominal.dynamics(reference, speed, acceleration).torque
        return march_bodies(
            (bodies or self.bodies).model, self.table if table is None else table, servo=self.servo, reference=reference,
            speed=speed, forward=forward, sample=1.0 / self.rate,
        )  # fmt: skip


def draw_robot(kinds: Sequence[RobotKind], rng: np.random.Generator) -> Robot:
    """Draw a robot of one of some kinds, its parameters about those of its model."""
    kind = kinds[int(rng.integers(len(kinds)))]
    name = str(rng.choice(MODELS[kind]))
    nominal = ArticulatedModel.of(compiled_model(model_path(f"arms/{name}")), name)

    def real(what: str, value: float) -> float:
        return value * (1.0 + SETTINGS.spreads[what] * float(rng.standard_normal()))

    values, bodies = {}, nominal
    for body in nominal.bodies:
        values[f"mass:{body}"] = real("mass", nominal.mass(body))
        bodies = bodies.with_mass(body, values[f"mass:{body}"])
    table = np.zeros((len(nominal.joints), CELLS))
    at = np.zeros((1, len(nominal.joints)))
    inertia = nominal.dynamics(at, at, at).inertia[0]
    for j, joint in enumerate(nominal.joints):
        drive = joint.drive
        assert drive is not None
        values[f"damping:{joint.name}"] = real("damping", joint.damping)
        values[f"armature:{joint.name}"] = real("armature", joint.armature)
        kp, kv = drive.kp, drive.kv
        if drive.servo:
            kp = values[f"kp:{drive.name}"] = real("kp", drive.kp)
        else:
            omega = 2.0 * np.pi * SETTINGS.bandwidth
            whole = inertia[j] + joint.armature
            kp, kv = omega**2 * whole, 2.0 * SETTINGS.loop_damping * omega * whole
        for cell, value in (
            (Cell.DAMPING, values[f"damping:{joint.name}"]), (Cell.ARMATURE, values[f"armature:{joint.name}"]),
            (Cell.GEAR, 1.0), (Cell.KP, kp), (Cell.KV, kv), (Cell.STRIBECK, 1.0), (Cell.RELAXATION, 1.0), (Cell.SHARE, 1.0),
        ):  # fmt: skip
            table[j, cell] = value
    side: Literal["motor", "link"] = "motor" if rng.random() < 0.5 else "link"
    return Robot(kind, name, nominal, bodies, table, values, float(rng.choice(SETTINGS.rates[kind])), side)


def reference_of(robot: Robot, kind: str, duration: float, rng: np.random.Generator) -> Array:
    """A reference (n, n_joints) [rad] that begins at rest: a multisine of all joints, one joint after the other, or point to point."""
    t = np.arange(int(duration * robot.rate)) / robot.rate
    joints = robot.nominal.joints
    low = np.maximum([joint.range[0] for joint in joints], -10.0 * SETTINGS.amplitude)
    high = np.minimum([joint.range[1] for joint in joints], 10.0 * SETTINGS.amplitude)
    amplitude = np.minimum(SETTINGS.amplitude, 0.4 * (high - low))
    middle = np.clip(0.0, low + amplitude / 0.8, high - amplitude / 0.8)
    out = np.zeros((len(t), len(joints)))
    for j in range(len(joints)):
        if kind == "multisine":
            for f in rng.uniform(*SETTINGS.band, 4):
                out[:, j] += 0.5 * np.sin(2.0 * np.pi * (f * t + rng.random()))
            out[:, j] *= np.sin(0.5 * np.pi * np.minimum(t / SETTINGS.ramp, 1.0)) ** 2
        elif kind == "chirp":
            length = duration / len(joints)
            own = np.clip(t - j * length, 0.0, length)
            sweep = own * (SETTINGS.band[0] + 0.5 * np.ptp(SETTINGS.band) * own / length)
            fade = np.minimum(own, length - own) / (0.2 * length)
            out[:, j] = np.sin(2.0 * np.pi * sweep) * np.sin(0.5 * np.pi * np.minimum(fade, 1.0)) ** 2
        else:
            knots = np.arange(0.4, duration, 1.3)
            goals = rng.uniform(-1.0, 1.0, len(knots))
            before = 0.0
            for begin, goal in zip(knots, goals, strict=True):
                s = np.clip((t - begin) / 0.8, 0.0, 1.0)
                out[:, j] += (goal - before) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
                before = goal
    return middle + amplitude * np.clip(out, -1.0, 1.0)


def robot_log(robot: Robot, motion: ArmMotion, encoding: Mapping[int, Encoding]) -> tuple[Array, Array]:
    """Positions and velocities (n, n_joints) as the encoders log them, before noise."""
    on_link = robot.side == "link"
    position = np.array(motion.position if on_link else motion.motor_position)
    velocity = np.array(motion.velocity if on_link else motion.motor_velocity)
    t = np.arange(len(position)) / robot.rate
    for j, wrong in encoding.items():
        if wrong.delay:
            late = np.maximum(t - wrong.delay, 0.0)
            position[:, j] = np.interp(late, t, position[:, j])
            velocity[:, j] = np.interp(late, t, velocity[:, j])
        position[:, j] = (1.0 + wrong.gain) * position[:, j] + wrong.offset
        velocity[:, j] *= 1.0 + wrong.speed
    return position, velocity
