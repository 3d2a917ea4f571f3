"""Filters of a sensor that nobody stated: an anti-alias filter, and a coupling that lets no constant through."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from bench.discrepancy.effects import channel_operators as signals
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    Scales,
    Values,
    log_grid,
)
from bench.discrepancy.effects.sensor_actuator import POSITION_AND_ACCELERATION
from bench.discrepancy.effects.sensor_actuator import SETTINGS as CLOCKS


@dataclass(frozen=True)
class SensorFiltersSettings:
    """Numbers of `bench.discrepancy.effects.sensor_filters`."""

    cutoffs: tuple[float, ...] = (10.0, 30.0, 100.0)
    """Cutoffs of a low-pass that are screened [Hz], the usual one in the middle: a fifth of 50 to 500 samples a second."""
    corners: tuple[float, ...] = (0.1, 0.5, 2.0)
    """Corners of a high-pass that are screened [Hz], the usual one in the middle: time constants of 0.08 to 1.6 s, as of supplies of
    piezoelectric accelerometers."""
    spread: float = 1.0
    """Prior standard deviation of their logarithms: the usual one within a factor of seven with 95 %, as for delays."""


SETTINGS = SensorFiltersSettings()


def _filter(
    name: str,
    parameter: str,
    frequencies: tuple[float, ...],
    quantity: str,
    equation: str,
    signal: Callable[[Values, Values, float], Values],
    tells: Callable[[Values, Scales], bool] | None = None,
) -> Effect:
    usual = frequencies[len(frequencies) // 2]
    bounds = (math.log(1e-3), math.log(1e5))
    return Effect(
        name,
        "sensor",
        "sensor",
        (
            FreeParameter(
                parameter,
                mean=math.log(usual),
                std=SETTINGS.spread,
                bounds=bounds,
                grid=log_grid(*frequencies),
                unit="Hz",
            ),
        ),
        f"{equation}, y what is read, w = 2 pi {parameter}",
        signal=signal,
        tells=tells,
        quantity=quantity,
        log_prior=EFFECT_SETTINGS.rare,
    )


def _delays_beyond_jitter(values: Values, scales: Scales) -> bool:
    """Whether a low-pass, which delays what is slow by sqrt(2) / w, does so by more than the times of any log are uncertain by."""
    return math.sqrt(2.0) / (2.0 * math.pi * values[0]) >= CLOCKS.jitter * scales.step


SENSOR_FILTERS: tuple[Effect, ...] = tuple(
    made
    for channel, quantity, x in (*POSITION_AND_ACCELERATION, ("velocity", "velocity", "v"))
    for made in (
        _filter(
            f"{channel}_filter",
            "cutoff",
            SETTINGS.cutoffs,
            quantity,
            f"y'' + sqrt(2) w y' + w^2 y = w^2 {x}",
            signals.second_order_low_pass,
            _delays_beyond_jitter,
        ),
        _filter(
            f"{channel}_high_pass",
            "corner",
            SETTINGS.corners,
            quantity,
            f"y' + w y = {x}'",
            signals.high_pass,
        ),
    )
)
"""They are rarer than the delay, lag and gain of a sensor."""
