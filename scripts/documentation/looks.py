"""Pictures of effects that no curve of a law shows: the same motion of a small example with and without them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.arrays import Array
from bench.figures.look import COLOURS, REFERENCE_COLOUR, save, style

STEP = 1e-3


@dataclass(frozen=True)
class ServoJoint:
    """A link behind a servo, under gravity; SI units.

    Attributes:
        inertia, motor: Of link and motor, about the joint.
        weight, aside: Gravity torque of the link when level, and of a centre of mass beside its axis.
        kp, damping: Of the servo and the bearing.
        deadband: Torque below which the drive does nothing.
        lag: Time constant of a filter of the target; 0 for none.
        train, clearance: Stiffness between motor and link and half of the play there; stiff where 0.
    """

    inertia: float = 0.05
    motor: float = 0.02
    weight: float = 2.0
    aside: float = 0.0
    kp: float = 12.0
    damping: float = 0.35
    deadband: float = 0.0
    lag: float = 0.0
    train: float = 0.0
    clearance: float = 0.0

    def follow(self, target: Array) -> Array:
        """Angle of the link (n,), by semi-implicit Euler steps from rest at the first target."""
        wanted = q = link = float(target[0])
        v = w = 0.0
        out = np.zeros(len(target))
        for k, goal in enumerate(target):
            wanted += (goal - wanted) * (1.0 if self.lag == 0.0 else STEP / self.lag)
            torque = self.kp * (wanted - q)
            torque = np.sign(torque) * max(abs(torque) - self.deadband, 0.0) - self.damping * v
            load = -self.weight * np.cos(link) + self.aside * np.sin(link)
            if self.train == 0.0:
                v += STEP * (torque + load) / (self.inertia + self.motor)
                q += STEP * v
                link = q
            else:
                apart = q - link
                beyond = np.sign(apart) * max(abs(apart) - self.clearance, 0.0)
                through = self.train * beyond + (0.05 * (v - w) if beyond else 0.0)
                v += STEP * (torque - through) / self.motor
                w += STEP * (load + through) / self.inertia
                q, link = q + STEP * v, link + STEP * w
            out[k] = link
        return out


SERVOS: dict[str, Callable[[ServoJoint], ServoJoint]] = {
    "actuator_deadband": lambda joint: replace(joint, deadband=1.2),
    "armature_error": lambda joint: replace(joint, motor=0.08),
    "backlash": lambda joint: replace(joint, train=200.0, clearance=0.1),
    "com_error": lambda joint: replace(joint, aside=1.5),
    "gravity_compensation": lambda joint: replace(joint, weight=0.6),
    "joint_compliance": lambda joint: replace(joint, train=12.0),
    "servo_gain_error": lambda joint: replace(joint, kp=6.0),
    "target_lag": lambda joint: replace(joint, lag=0.15),
}
"""The servo's joint with an effect, by its name."""

RESPONSES: dict[str, tuple[float, float, float]] = {
    "damping_error": (1.0, 1.8, 1.0),
    "mass_error": (1.3, 1.0, 1.0),
    "stiffness_error": (1.0, 1.0, 1.3),
}
"""Factors of mass, damping and stiffness, by the name of the effect."""

CHANNELS: dict[str, Callable[[Array, Array], Array]] = {
    "acceleration_crosstalk": lambda time, x: x + 0.25 * np.sin(2 * np.pi * 6.0 * time),
    "displacement_crosstalk": lambda time, x: x + 0.25 * np.sin(2 * np.pi * 6.0 * time),
    "position_delay": lambda time, x: np.interp(time - 0.06, time, x),
    "position_gain_error": lambda time, x: 1.35 * x,
    "position_offset": lambda time, x: x + 0.3,
}
"""What an effect makes of a channel, by its name."""

PICTURED = (*SERVOS, *RESPONSES, *CHANNELS, "record_dependent_friction", "timed_force")


def draw(name: str, path: Path) -> None:
    """Draw the picture of an effect of `PICTURED`."""
    with style():
        figure = Figure(figsize=(6.6, 2.4), layout="constrained")
        axes = figure.subplots()
        labels, x, before, after = _curves(name)
        axes.plot(x, before, color=REFERENCE_COLOUR, linewidth=2.0, alpha=0.6, label="without")
        axes.plot(x, after, color=COLOURS[0], linewidth=1.2, label=name)
        axes.set_xlabel(labels[0])
        axes.set_ylabel(labels[1])
        if name in RESPONSES:
            axes.set_yscale("log")
        axes.legend(loc="upper right", ncols=2)
        axes.margins(y=0.25)
        save(figure, path, dpi=90)


def _curves(name: str) -> tuple[tuple[str, str], Array, Array, Array]:
    """Labels of the axes, abscissa, and the curves without and with an effect."""
    time = np.arange(0.0, 3.0, STEP)
    if name in SERVOS:
        target = 0.5 * np.sin(2 * np.pi * 0.5 * time) + 0.2 * (time > 1.5)
        joint = (
            ServoJoint() if name != "backlash" else ServoJoint(weight=0.0)
        )  # a weight holds a link on one flank
        return (
            ("time [s]", "angle of the link [rad]"),
            time,
            joint.follow(target),
            SERVOS[name](joint).follow(target),
        )
    if name in RESPONSES:
        frequency = np.linspace(1.0, 8.0, 400)
        s = 2j * np.pi * frequency
        mass, damping, stiffness = RESPONSES[name]
        nominal = np.abs(1.0 / (s**2 + 3.0 * s + (2 * np.pi * 4.0) ** 2))
        changed = np.abs(1.0 / (mass * s**2 + damping * 3.0 * s + stiffness * (2 * np.pi * 4.0) ** 2))
        return ("frequency [Hz]", "response to a unit force"), frequency, nominal, changed
    if name in CHANNELS:
        x = (0.3 + 0.2 * time) * np.sin(2 * np.pi * (1.0 + 0.3 * time) * time)
        return ("time [s]", "channel"), time, x, CHANNELS[name](time, x)
    if name == "timed_force":
        pushed = np.where((time > 1.0) & (time < 1.6), 1.0, 0.0)
        return ("time [s]", "missing force"), time, np.zeros_like(time), pushed
    # two records, one after the other
    sign = np.sign(np.cos(2 * np.pi * 1.5 * time))
    return (
        ("time [s], a record up to 1.5, another after it", "missing force"),
        time,
        sign,
        np.where(time < 1.5, sign, 1.8 * sign),
    )
