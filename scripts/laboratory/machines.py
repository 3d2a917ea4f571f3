"""Machines as a laboratory has them, each in an MJCF of its own, integrated apart from MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.arrays import Array
from bench.discrepancy import CaseChannel
from bench.files import write_text
from laboratory.made import STEP, Made, Signals, case_of, march, multisines

COUNT = 2.0 * np.pi / 4096.0
"""Step of an encoder of 12 bits [rad]."""


@dataclass(frozen=True)
class Channel:
    """A channel of a machine.

    Attributes:
        unit: Its unit.
        role: "command", "measured" or "response".
        noise: Standard deviation of its noise; of an encoder's steps what is stated of it.
        target: What of the model it stands for, ``joint:NAME`` or ``actuator:NAME``.
        count: Step of its values, which are rounded to it instead; none where zero.
    """

    unit: str
    role: str
    noise: float
    target: str
    count: float = 0.0

    def logged(self, rng: np.random.Generator, x: Array) -> Array:
        """Samples (n,) as they are logged."""
        if self.count:
            return np.asarray(self.count * np.round(x / self.count))
        return x + self.noise * rng.standard_normal(len(x))


def machine(
    rng: np.random.Generator,
    folder: Path,
    name: str,
    model: str,
    parameters: Mapping[str, tuple[float, float, str]],
    channels: Mapping[str, Channel],
    signals: Mapping[str, Array],
    right: Sequence[Sequence[str]],
    also: Sequence[str],
    why: str,
) -> Made:
    """A case of signals (n_samples, 3) in a model of its own, which is written to a folder."""
    write_text(folder / f"{name}.xml", model)
    records: list[Signals] = [
        {key: channel.logged(rng, signals[key][:, i]) for key, channel in channels.items()} for i in range(3)
    ]
    told = {key: (channel.unit, channel.role, channel.noise) for key, channel in channels.items()}
    case = case_of(name, f"{name}.xml", parameters, told, records)
    bound = tuple(_bound(c, channels[c.name]) for c in case.channels)
    return Made(f"lab_{name}", replace(case, channels=bound, folder=folder), right, also, why)


def _bound(told: CaseChannel, channel: Channel) -> CaseChannel:
    quantity = "position" if channel.target.startswith("joint") else ""
    return replace(told, target=channel.target, quantity=quantity)


def mjcf(bodies: str, actuator: str = "", gravity: float = 0.0) -> str:
    """An MJCF of bodies and an actuator."""
    driven = f"<actuator>{actuator}</actuator>" if actuator else ""
    return f'<mujoco><option gravity="0 0 {gravity}" timestep="0.001"/><worldbody>{bodies}</worldbody>{driven}</mujoco>'


def body(name: str, joint: str, inertial: str, child: str = "") -> str:
    """A body of an MJCF, of the attributes of its joint and of what it weighs."""
    return f'<body name="{name}"><joint {joint}/><inertial {inertial}/>{child}</body>'


def two_storeys(rng: np.random.Generator, folder: Path) -> Made:
    """A frame of two storeys, the upper of which has a bolted joint that slips."""
    loads = multisines(rng, 20.0, 0.5, 20.0, (40.0, 80.0, 60.0))

    def rate(s: Array, u: Array) -> Array:
        x, v, r, w, z = s
        pulled = 2e4 * r + 12.0 * w + 8e3 * z
        first = (u[0] - 3e4 * x - 15.0 * v + pulled) / 10.0
        slipping = np.minimum(np.abs(z) / 1.5e-3, 1.0) ** 4
        return np.array([v, first, w, -pulled / 8.0 - first, w - np.where(w * z > 0.0, w, 0.0) * slipping])

    states = march(rate, np.zeros((5, 3)), loads[:, None, :])
    slide, inertial = 'type="slide" axis="1 0 0"', 'pos="0 0 0" mass="{}" diaginertia="1 1 1"'
    upper = body("f2", f'name="s2" {slide} stiffness="20000" damping="12"', inertial.format(8))
    lower = body("f1", f'name="s1" {slide} stiffness="30000" damping="15"', inertial.format(10), upper)
    model = mjcf(lower, '<motor name="shaker" joint="s1"/>')
    stated = {
        "mass:f1": (10.0, 0.2, "kg"), "mass:f2": (8.0, 0.2, "kg"), "stiffness:s1": (3e4, 1e3, "N/m"),
        "stiffness:s2": (2e4, 1e3, "N/m"), "damping:s1": (15.0, 5.0, "N s/m"), "damping:s2": (12.0, 4.0, "N s/m"),
    }  # fmt: skip
    channels = {
        "shaker": Channel("N", "measured", 0.05, "actuator:shaker"),
        "lower": Channel("m", "response", 2e-6, "joint:s1"),
        "upper": Channel("m", "response", 2e-6, "joint:s2"),
    }
    return machine(
        rng, folder, "two_storeys", model, stated, channels, {"shaker": loads, "lower": states[:, 0], "upper": states[:, 2]},
        (["bouc_wen_hysteresis"], ["presliding_friction"], ["backlash_friction"]), ("stiffness_error", "damping_error"),
        "a bolted joint in the upper storey that slips",
    )  # fmt: skip


def belt(rng: np.random.Generator, folder: Path) -> Made:
    """A rotor whose inertia is mostly behind a belt."""
    loads = multisines(rng, 20.0, 0.3, 30.0, (0.6, 1.2, 0.9))

    def rate(s: Array, u: Array) -> Array:
        q, v, p, w = s
        pull = 60.0 * (q - p) + 0.02 * (v - w)
        return np.array([v, (u[0] - 0.03 * v - 2.0 * q - pull) / 0.004, w, pull / 0.006])

    states = march(rate, np.zeros((4, 3)), loads[:, None, :])
    model = mjcf(
        body(
            "rotor",
            'name="axle" type="hinge" axis="0 0 1" damping="0.03" stiffness="2"',
            'pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"',
        ),
        '<motor name="torque" joint="axle"/>',
    )
    stated = {
        "inertia:rotor": (0.01, 3e-4, "kg m^2"), "damping:axle": (0.03, 0.01, "N m s/rad"), "stiffness:axle": (2.0, 0.1, "N m/rad"),
    }  # fmt: skip
    channels = {
        "torque": Channel("N m", "measured", 1e-3, "actuator:torque"),
        "angle": Channel("rad", "response", 1e-4, "joint:axle"),
    }
    return machine(
        rng, folder, "belt", model, stated, channels, {"torque": loads, "angle": states[:, 0]}, (["carried_mass"],), (),
        "six tenths of the inertia are behind a belt",
    )  # fmt: skip


def gantry(rng: np.random.Generator, folder: Path) -> Made:
    """A cart whose payload, a part of the stated mass, swings."""
    loads = multisines(rng, 30.0, 0.2, 5.0, (3.0, 6.0, 4.5))
    cart, payload, rope, g = 5.0, 2.0, 0.5, 9.81

    def rate(s: Array, u: Array) -> Array:
        x, v, t, w = s
        sine, cosine = np.sin(t), np.cos(t)
        force = u[0] - 6.0 * v - 60.0 * x
        moved = cart + payload * sine**2
        a = (force + payload * sine * (rope * w**2 + g * cosine)) / moved
        turned = -(cosine * (force + payload * rope * w**2 * sine) + (cart + payload) * g * sine) / (
            rope * moved
        )
        return np.array([v, a, w, turned - 0.02 * w])

    states = march(rate, np.zeros((4, 3)), loads[:, None, :])
    model = mjcf(
        body(
            "cart",
            'name="rail" type="slide" axis="1 0 0" damping="6" stiffness="60"',
            'pos="0 0 0" mass="7" diaginertia="1 1 1"',
        ),
        '<motor name="drive" joint="rail"/>',
    )
    stated = {
        "mass:cart": (7.0, 0.1, "kg"),
        "damping:rail": (6.0, 1.0, "N s/m"),
        "stiffness:rail": (60.0, 2.0, "N/m"),
    }
    channels = {
        "drive": Channel("N", "command", 0.0, "actuator:drive"),
        "position": Channel("m", "response", 1e-4, "joint:rail"),
    }
    return machine(
        rng, folder, "gantry", model, stated, channels, {"drive": loads, "position": states[:, 0]}, (["carried_mass"],),
        ("mass_error", "damping_error"), "a payload that swings, two sevenths of the mass",
    )  # fmt: skip


def servo(rng: np.random.Generator, folder: Path) -> Made:
    """A position servo with bristle friction that falls with the speed, and an encoder of 12 bits."""
    targets = multisines(rng, 20.0, 0.1, 3.0, (0.3, 0.6, 0.45))

    def rate(s: Array, u: Array) -> Array:
        q, v, z = s
        bristles = v - np.abs(v) * z * 300.0 / (0.35 + 0.15 * np.exp(-((v / 0.05) ** 2)))
        friction = 300.0 * z + 0.3 * bristles + 0.1 * v
        return np.array([v, (20.0 * (u[0] - q) - 0.8 * v - friction) / 0.02, bristles])

    states = march(rate, np.zeros((3, 3)), targets[:, None, :])
    model = mjcf(
        body(
            "arm",
            'name="hinge" type="hinge" axis="0 0 1" damping="0.1"',
            'pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"',
        ),
        '<position name="servo" joint="hinge" kp="20" kv="0.8"/>',
    )
    stated = {
        "inertia:arm": (0.02, 2e-3, "kg m^2"), "damping:hinge": (0.1, 0.03, "N m s/rad"), "kp:servo": (20.0, 2.0, "N m/rad"),
    }  # fmt: skip
    channels = {
        "target": Channel("rad", "command", 0.0, "actuator:servo"),
        "angle": Channel("rad", "response", COUNT / np.sqrt(12.0), "joint:hinge", COUNT),
    }
    return machine(
        rng, folder, "servo", model, stated, channels, {"target": targets, "angle": states[:, 0]},
        (["presliding_friction"], ["stribeck_friction"], ["coulomb_friction"]), ("damping_error",), "friction of a servo's gear",
    )  # fmt: skip


def pendulum(rng: np.random.Generator, folder: Path) -> Made:
    """The free decay of a pendulum with dry friction in its pivot and drag of the air."""
    length, mass, n = 0.6, 1.0, round(30.0 / STEP)

    def rate(s: Array, u: Array) -> Array:
        q, v = s
        own = mass * length**2
        lost = 0.018 * v * np.abs(v) + 0.0108 * np.tanh(v / 1e-3) + 0.0036 * v
        return np.array([v, -9.81 / length * np.sin(q) - lost / own])

    states = march(rate, np.array([[0.5, 0.8, 0.65], [0.0, 0.0, 0.0]]), np.zeros((n, 1, 3)))
    bob = body(
        "bob",
        'name="pivot" type="hinge" axis="0 1 0" damping="0.0036"',
        f'pos="0 0 {-length}" mass="{mass}" diaginertia="1e-12 1e-12 1e-12"',
    )
    model = mjcf(bob, gravity=-9.81)
    channels = {"angle": Channel("rad", "response", 3e-4, "joint:pivot")}
    return machine(
        rng, folder, "pendulum", model, {"damping:pivot": (0.0036, 0.001, "N m s/rad")}, channels, {"angle": states[:, 0]},
        (["quadratic_damping", "coulomb_friction"],), (), "drag of the air and dry friction in the pivot",
    )  # fmt: skip


def machines(rng: np.random.Generator, folder: Path) -> list[Made]:
    """All of them, their models in a folder."""
    return [make(rng, folder) for make in (two_storeys, belt, gantry, servo, pendulum)]
