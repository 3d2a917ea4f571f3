"""Effects of parameters, actuators and sensors: what is wrong with a number or a channel rather than with a force."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bench.discrepancy.effects import channel_operators as signals
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    log_grid,
)

POSITION_AND_ACCELERATION = (("displacement", "position", "x"), ("acceleration", "acceleration", "a"))
"""Name of the channel in effects, its quantity, its symbol."""
REVERSAL = FreeParameter("reversal", grid=(0.0,), fixed=True)


@dataclass(frozen=True)
class SensorActuatorSettings:
    """Numbers of `bench.discrepancy.effects.sensor_actuator`."""

    reversed: float = -1.5
    """Log prior odds of a reversed channel; not so rare that a gain of minus one would be tried first."""


SETTINGS = SensorActuatorSettings()

CHANNELS: tuple[Effect, ...] = (
    Effect(
        "mass_error",
        "inertia",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-0.9, 5.0)),),
        "m = m_nominal (1 + e)",
        quantity="mass",
        exact=True,
    ),
    Effect(
        "stiffness_error",
        "stiffness",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-0.95, 5.0)),),
        "k = k_nominal (1 + e)",
        quantity="stiffness",
        exact=True,
        log_prior=-2.0,
    ),
    Effect(
        "damping_error",
        "damping",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=1.0, bounds=(-0.95, 20.0)),),
        "c = c_nominal (1 + e)",
        quantity="damping",
        exact=True,
        log_prior=-2.0,
    ),
    Effect(
        "actuator_delay",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "delay",
                mean=math.log(0.008),
                std=1.0,
                bounds=(math.log(1e-4), math.log(1.0)),
                grid=log_grid(0.003, 0.01, 0.03),
            ),
        ),
        "F(t - tau)",
        signal=signals.delay,
        between_samples=True,
    ),
    Effect(
        "actuator_lag",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "time_constant",
                mean=math.log(0.008),
                std=1.0,
                bounds=(math.log(1e-4), math.log(1.0)),
                grid=log_grid(0.003, 0.01, 0.03),
            ),
        ),
        "tau F' + F = command",
        signal=signals.lag,
    ),
    Effect(
        "force_gain_error",
        "actuator",
        "actuator",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0), grid=(0.0,)),),
        "F = (1 + e) command",
        signal=signals.gain,
        exact=True,
    ),
    Effect(
        "actuator_saturation",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "level", "force", mean=math.log(1.5), std=0.5, bounds=(-2.0, 2.0), grid=log_grid(1.0, 1.7)
            ),
        ),
        "F = command, clipped at a level",
        signal=signals.clip,
        log_prior=-1.0,
    ),
    Effect(
        "displacement_drift",
        "sensor",
        "sensor",
        (FreeParameter("drift", "position", signed=True, std=0.5),),
        "x + d t / T",
        signal=signals.drift,
        exact=True,
        quantity="position",
    ),
    Effect(
        "displacement_delay",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "delay",
                mean=math.log(0.008),
                std=1.0,
                bounds=(math.log(1e-4), math.log(1.0)),
                grid=log_grid(0.003, 0.01, 0.03),
            ),
        ),
        "x(t - tau)",
        signal=signals.sensor_delay,
        quantity="position",
    ),
    Effect(
        "displacement_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0)),),
        "(1 + e) x",
        signal=signals.gain,
        exact=True,
        quantity="position",
    ),
    Effect(
        "displacement_bias",
        "sensor",
        "sensor",
        (FreeParameter("bias", "position", signed=True, std=0.5),),
        "x + b",
        signal=signals.offset,
        exact=True,
        quantity="position",
        log_prior=-1.0,
    ),
    Effect(
        "displacement_clipping",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "level",
                "position",
                mean=math.log(0.9),
                std=0.3,
                bounds=(-2.0, 0.3),
                grid=log_grid(0.75, 0.97),
            ),
        ),
        "x clipped at a level",
        signal=signals.clip,
        quantity="position",
        log_prior=-1.0,
    ),
    Effect(
        "acceleration_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0)),),
        "(1 + e) a",
        signal=signals.gain,
        exact=True,
        quantity="acceleration",
        log_prior=-1.0,
    ),
    Effect(
        "acceleration_delay",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "delay",
                mean=math.log(0.008),
                std=1.0,
                bounds=(math.log(1e-4), math.log(1.0)),
                grid=log_grid(0.003, 0.01),
            ),
        ),
        "a(t - tau)",
        signal=signals.sensor_delay,
        quantity="acceleration",
        log_prior=-1.0,
    ),
    Effect(
        "acceleration_bias",
        "sensor",
        "sensor",
        (FreeParameter("bias", "acceleration", signed=True, std=0.5),),
        "a + b",
        signal=signals.offset,
        exact=True,
        quantity="acceleration",
        log_prior=-1.0,
    ),
    Effect(
        "acceleration_clipping",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "level",
                "acceleration",
                mean=math.log(0.9),
                std=0.3,
                bounds=(-2.0, 0.3),
                grid=log_grid(0.75, 0.97),
            ),
        ),
        "a clipped at a level",
        signal=signals.clip,
        quantity="acceleration",
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "velocity_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0)),),
        "(1 + e) v",
        signal=signals.gain,
        exact=True,
        quantity="velocity",
        log_prior=-1.0,
    ),
    Effect(
        "velocity_delay",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "delay",
                mean=math.log(0.008),
                std=1.0,
                bounds=(math.log(1e-4), math.log(1.0)),
                grid=log_grid(0.003, 0.01),
            ),
        ),
        "v(t - tau)",
        signal=signals.sensor_delay,
        quantity="velocity",
        log_prior=-1.0,
    ),
    Effect(
        "velocity_bias",
        "sensor",
        "sensor",
        (FreeParameter("bias", "velocity", signed=True, std=0.5),),
        "v + b",
        signal=signals.offset,
        exact=True,
        quantity="velocity",
        log_prior=-1.0,
    ),
    *(
        Effect(
            f"{channel}_crosstalk",
            "sensor",
            "sensor",
            (FreeParameter("share", f"{quantity}/source", signed=True, std=0.2, bounds=(-5.0, 5.0)),),
            f"{symbol} + e s, s another measured channel: a load, or the other axis",
            quantity=quantity,
            pickup=True,
            exact=True,
            log_prior=EFFECT_SETTINGS.rare,
        )
        for channel, quantity, symbol in POSITION_AND_ACCELERATION
    ),
    *(
        Effect(
            f"{channel}_polarity",
            "sensor",
            "sensor",
            (REVERSAL,),
            f"-{symbol}",
            signal=signals.reverse,
            exact=True,
            quantity=quantity,
            log_prior=SETTINGS.reversed,
        )
        for channel, quantity, symbol in POSITION_AND_ACCELERATION
    ),
    Effect(
        "force_polarity",
        "actuator",
        "actuator",
        (REVERSAL,),
        "F = -command",
        signal=signals.reverse,
        exact=True,
        log_prior=SETTINGS.reversed,
    ),
    *(
        Effect(
            f"{channel}_quantisation",
            "sensor",
            "record",
            (FreeParameter("step", quantity),),
            f"{symbol} rounded to a multiple of q",
            signal=signals.quantise,
            quantity=quantity,
            log_prior=EFFECT_SETTINGS.rare,
        )
        for channel, quantity, symbol in POSITION_AND_ACCELERATION
    ),
)
"""Inertia, actuator and sensor effects."""
