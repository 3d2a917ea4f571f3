"""Effects of what drives a joint: elastic trains, play, cogging, and the actuator itself."""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.articulated_effects.slot_setters import (
    added,
    cogging,
    saturated,
    scaled,
    train,
    written,
)
from bench.discrepancy.effects.effect import FreeParameter, log_grid
from bench.discrepancy.multibody.joint_forces import Slot

TEETH = tuple(float(n) for n in range(2, 121))
"""Periods of cogging in a turn that are tried: slots, poles and teeth are whole numbers."""
PITCHES = log_grid(*(2.0 / n for n in np.arange(1.5, 60.5, 0.5)))
"""Pitches of cogging along a slide that are tried, over its largest excursion: half a period more in the travel each."""
PLAYS = log_grid(*np.geomspace(0.003, 0.3, 34))
"""Half clearances that are tried, a factor of 1.15 apart: the misfit of a link that bounces falls to the true one only from near by."""
MOTOR_SHARE = FreeParameter(
    "motor_share", mean=0.0, std=0.5, bounds=(-4.0, -1e-3), grid=(-1e-2, math.log(0.4)), unit="1"
)
"""Part of the armature that sits on the motor's side of an elastic train; what is left of it moves with the link."""
ON_LINK = FreeParameter("encoder_on_link", fixed=True, signed=True, grid=(0.0, 1.0), unit="1")
"""Side of the encoder; tried where the channel does not state its ``"side"``."""
RELATIVE = FreeParameter("relative_error", signed=True, mean=0.0, std=0.3, bounds=(-0.95, 20.0), unit="1")


_SINE_AND_COSINE = tuple(
    FreeParameter(name, "force", signed=True, mean=0.0, std=0.3, bounds=(-10.0, 10.0))
    for name in ("sine", "cosine")
)


def _time(name: str, middle: float, highest: float) -> FreeParameter:
    """A delay or time constant [s]: a middle within a factor of seven with 95 %, up to a highest logarithm."""
    return FreeParameter(
        name,
        "1",
        mean=math.log(middle),
        std=1.0,
        bounds=(-9.0, highest),
        grid=log_grid(0.3 * middle, middle, 3.0 * middle),
        unit="s",
    )


DRIVE_EFFECTS: tuple[ArticulatedEffect, ...] = (
    ArticulatedEffect(
        "joint_compliance",
        "drive",
        "joint",
        (
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(10.0),
                std=1.5,
                bounds=(-2.0, 9.0),
                grid=log_grid(1.0, 3.0, 10.0, 30.0, 100.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.1),
                std=1.5,
                bounds=(-9.0, 3.0),
                grid=log_grid(0.05),
            ),
            MOTOR_SHARE,
            ON_LINK,
        ),
        "T = k (q_motor - q_link) + c (v_motor - v_link)",
        train,
    ),
    ArticulatedEffect(
        "backlash",
        "drive",
        "joint",
        (
            FreeParameter(
                "half_clearance",
                "position",
                mean=math.log(0.02),
                std=1.3,
                bounds=(-9.0, 0.0),
                grid=PLAYS,
            ),
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(300.0),
                std=1.5,
                bounds=(2.0, 11.0),
                grid=log_grid(300.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.3),
                std=1.5,
                bounds=(-9.0, 5.0),
                grid=log_grid(0.3, 2.0),
            ),
            MOTOR_SHARE,
            ON_LINK,
        ),
        "T = k dz(q_motor - q_link, b) + c (v_motor - v_link) in contact",
        train,
    ),
    ArticulatedEffect(
        "cogging",
        "drive",
        "joint",
        (
            *_SINE_AND_COSINE,
            FreeParameter(
                "periods_per_turn", fixed=True, signed=True, grid=TEETH, unit="1", bounds=(1.0, 400.0)
            ),
        ),
        "f = A sin(n q + phase)",
        cogging,
        hinge=True,
    ),
    ArticulatedEffect(
        "cogging",
        "drive",
        "joint",
        (
            *_SINE_AND_COSINE,
            FreeParameter(
                "pitch",
                "position",
                mean=math.log(0.2),
                std=1.5,
                bounds=(math.log(0.01), math.log(2.0)),
                grid=PITCHES,
            ),
        ),
        "f = A sin(2 pi q / pitch + phase)",
        cogging,
        hinge=False,
    ),
    ArticulatedEffect(
        "actuator_delay",
        "actuator",
        "actuator",
        (_time("delay_s", 0.01, -1.5),),
        "input acts later by a delay",
        added(DELAY="delay_s"),
    ),
    ArticulatedEffect(
        "actuator_lag",
        "actuator",
        "actuator",
        (_time("time_constant_s", 0.01, -1.0),),
        "T f' + f = force of the actuator",
        written(LAG="time_constant_s"),
    ),
    ArticulatedEffect(
        "target_lag",
        "actuator",
        "actuator",
        (_time("time_constant_s", 0.03, -0.5),),
        "T u' + u = target of the servo",
        added(INPUT_LAG="time_constant_s"),
        servo=True,
    ),
    ArticulatedEffect(
        "force_gain_error", "actuator", "actuator", (RELATIVE,), "tau = (1 + e) nominal", scaled(Slot.GEAR)
    ),
    ArticulatedEffect(
        "servo_gain_error",
        "actuator",
        "actuator",
        (RELATIVE,),
        "kp = (1 + e) nominal",
        scaled(Slot.KP),
        servo=True,
    ),
    ArticulatedEffect(
        "actuator_saturation",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "limit",
                "peak",
                mean=math.log(0.5),
                std=0.7,
                bounds=(-4.0, 0.5),
                grid=log_grid(0.2, 0.4, 0.6, 0.8),
            ),
        ),
        "|force| <= limit",
        saturated,
    ),
    ArticulatedEffect(
        "actuator_deadband",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "half_width",
                "input",
                mean=math.log(0.2),
                std=1.5,
                bounds=(-9.0, 2.0),
                grid=log_grid(0.03, 0.1, 0.3),
            ),
        ),
        "no force within a band of the input (of the position error of a servo)",
        written(DEADBAND="half_width"),
    ),
)
"""Effects of drives."""
