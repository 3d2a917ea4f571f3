"""Pictures of effects that no curve of a law shows: the same motion of a small example with and without them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.arrays import Array
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joint_run import predict
from bench.figures.look import COLOURS, REFERENCE_COLOUR, save, style

STEP = 1e-3


INERTIA, MOTOR, WEIGHT, LENGTH = 0.07, 0.02, 2.0, 0.3
"""Of the servo's joint: all inertia, the motor's part of it [kg m^2], the gravity torque of the level link [N m], and its length [m]."""

SERVO = {
    Slot.GEAR: 1.0,
    Slot.SERVO: 1.0,
    Slot.KP: 12.0,
    Slot.DAMPING: 0.35,
    Slot.RATIO: 1.0,
    Slot.LOW: -50.0,
    Slot.HIGH: 50.0,
}
"""The servo's joint: a link behind a position servo, under gravity."""

TRAIN = {Slot.TRAIN: 1.0, Slot.MOTOR: MOTOR, Slot.TRAIN_DAMPING: 0.05}
SERVOS: dict[str, dict[Slot, float]] = {
    "actuator_deadband": {Slot.DEADBAND: 0.1},
    "armature_error": {Slot.INERTIA: 0.06},
    "base_tilt": {
        Slot.OFFSET: -0.6,
        Slot.STIFFNESS: 0.4,
    },  # gravity pulls another way, and another with the posture
    "backlash": {**TRAIN, Slot.TRAIN_STIFFNESS: 200.0, Slot.CLEARANCE: 0.1},
    "com_error": {Slot.STIFFNESS: 1.5},  # a centre of mass aside turns its torque with the posture
    "gravity_compensation": {Slot.OFFSET: 1.4},
    "joint_compliance": {**TRAIN, Slot.TRAIN_STIFFNESS: 12.0},
    "servo_gain_error": {Slot.KP: 6.0},
    "surface_contact": {Slot.SURFACE: 2000.0, Slot.SURFACE_AT: -0.12, Slot.SURFACE_DAMPING: 20.0},
    "target_lag": {Slot.INPUT_LAG: 0.15},
}
"""What an effect changes of the servo's joint, by its name."""


def follow(target: Array, change: dict[Slot, float], weight: float) -> Array:
    """Angle of the link (n,) as the simulator of the fits has it, from rest."""
    n = len(target)
    p = np.zeros(SLOTS)
    for slot, value in (SERVO | change).items():
        p[slot] = value
    none = np.zeros(n)
    arrays = np.full(n, INERTIA), np.full(n, weight), none, none, none
    tip = np.stack([none, np.full(n, LENGTH), none])
    measured, still = (none, np.zeros(0)), np.zeros((2, 2))
    _, states = predict(p, arrays, target, STEP, 1, measured, still, np.zeros((1, 2)), touch=tip)
    return states[:, 2]


RESPONSES: dict[str, tuple[float, float, float]] = {
    "damping_error": (1.0, 1.8, 1.0),
    "mass_error": (1.3, 1.0, 1.0),
    "stiffness_error": (1.0, 1.0, 1.3),
}
"""Factors of mass, damping and stiffness, by the name of the effect."""


def _crosstalk(time: Array, x: Array) -> Array:
    return x + 0.25 * np.sin(2 * np.pi * 6.0 * time)


CHANNELS: dict[str, Callable[[Array, Array], Array]] = {
    "acceleration_crosstalk": _crosstalk,
    "displacement_crosstalk": _crosstalk,
    "position_delay": lambda time, x: np.interp(time - 0.06, time, x),
    "position_gain_error": lambda time, x: 1.35 * x,
    "position_offset": lambda time, x: x + 0.3,
}
"""What an effect makes of a channel, by its name."""

PICTURED = (*SERVOS, *RESPONSES, *CHANNELS, "record_dependent_friction", "timed_force", "harmonic_force")


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
        weight = 0.0 if name == "backlash" else WEIGHT  # it would hold the link on one flank
        without, changed = (follow(target, change, weight) for change in ({}, SERVOS[name]))
        return ("time [s]", "angle of the link [rad]"), time, without, changed
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
    if name == "harmonic_force":
        frequency, power = np.linspace(1.0, 8.0, 400), np.full(400, 1.0)
        line = 30.0 / (1.0 + ((frequency - 5.3) / 0.02) ** 2)
        return ("frequency [Hz]", "spectrum of the missing force"), frequency, power, power + line
    # two records, one after the other
    sign = np.sign(np.cos(2 * np.pi * 1.5 * time))
    return (
        ("time [s], a record up to 1.5, another after it", "missing force"),
        time,
        sign,
        np.where(time < 1.5, sign, 1.8 * sign),
    )
