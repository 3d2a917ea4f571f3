"""Filters of a sensor that nobody stated: an anti-alias filter, and a coupling that lets no constant through."""

from __future__ import annotations

import math

from bench.discrepancy.effects import channel_operators as signals
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    log_grid,
)
from bench.discrepancy.effects.sensor_actuator import POSITION_AND_ACCELERATION, SETTINGS


def _corner(name: str, usual: float, *grid: float) -> FreeParameter:
    """A corner frequency of a filter [Hz]: the usual one within a factor of seven with 95 %."""
    bounds = (math.log(1e-3), math.log(1e5))
    return FreeParameter(name, mean=math.log(usual), std=1.0, bounds=bounds, grid=log_grid(*grid), unit="Hz")


def _sensor_filter(channel: str, quantity: str, symbol: str) -> Effect:
    return Effect(
        f"{channel}_filter",
        "sensor",
        "sensor",
        (_corner("cutoff", 30.0, 10.0, 30.0, 100.0),),
        f"y'' + sqrt(2) w y' + w^2 y = w^2 {symbol}, y what is read, w = 2 pi cutoff",
        signal=signals.second_order_low_pass,
        # it delays what is slow by sqrt(2) / w
        tells=lambda values, scales: (
            values[0] * SETTINGS.jitter * scales.step <= math.sqrt(2.0) / (2.0 * math.pi)
        ),
        quantity=quantity,
        log_prior=EFFECT_SETTINGS.rare,
    )


def _sensor_high_pass(channel: str, quantity: str, symbol: str) -> Effect:
    return Effect(
        f"{channel}_high_pass",
        "sensor",
        "sensor",
        (_corner("corner", 0.5, 0.1, 0.5, 2.0),),
        f"y' + w y = {symbol}', y what is read, w = 2 pi corner",
        signal=signals.high_pass,
        quantity=quantity,
        log_prior=EFFECT_SETTINGS.rare,
    )


SENSOR_FILTERS: tuple[Effect, ...] = tuple(
    made(channel, quantity, symbol)
    for made in (_sensor_filter, _sensor_high_pass)
    for channel, quantity, symbol in (*POSITION_AND_ACCELERATION, ("velocity", "velocity", "v"))
)
"""They are rarer than the delay, lag and gain of a sensor."""
