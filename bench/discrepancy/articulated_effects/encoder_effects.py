"""Effects of the encoder of a joint: its log is wrong, and a servo may act on it."""

from __future__ import annotations

import math

from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.effects.effect import FreeParameter, log_grid
from bench.discrepancy.multibody.encoders import Encoder

IN_LOOP = FreeParameter("in_loop", fixed=True, signed=True, grid=(0.0, 1.0), unit="1")

ENCODER_EFFECTS: tuple[ArticulatedEffect, ...] = (
    ArticulatedEffect(
        "position_offset",
        "sensor",
        "sensor",
        (FreeParameter("offset", "position", signed=True, mean=0.0, std=0.3, bounds=(-3.0, 3.0)), IN_LOOP),
        "logged = true + offset",
        encoder=lambda v: Encoder(offset=v["offset"], in_loop=v["in_loop"]),
    ),
    ArticulatedEffect(
        "position_gain_error",
        "sensor",
        "sensor",
        (
            FreeParameter("relative_error", signed=True, mean=0.0, std=0.1, bounds=(-0.7, 2.0), unit="1"),
            IN_LOOP,
        ),
        "logged = (1 + e) true",
        encoder=lambda v: Encoder(gain=v["relative_error"], in_loop=v["in_loop"]),
    ),
    ArticulatedEffect(
        "velocity_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, mean=0.0, std=0.1, bounds=(-0.7, 2.0), unit="1"),),
        "logged velocity = (1 + e) true",
        encoder=lambda v: Encoder(speed=v["relative_error"]),
        needs="velocity",
    ),
    ArticulatedEffect(
        "position_delay",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "delay_s",
                "1",
                mean=math.log(0.01),
                std=1.0,
                bounds=(-9.0, -1.5),
                grid=log_grid(0.01),
                unit="s",
            ),
        ),
        "logged later by a delay",
        encoder=lambda v: Encoder(delay=v["delay_s"]),
    ),
)
"""Effects of encoders."""
