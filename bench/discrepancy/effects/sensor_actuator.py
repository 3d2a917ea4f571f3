"""Effects of parameters, actuators and sensors: what is wrong with a number or a channel rather than with a force."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from bench.discrepancy.effects import channel_operators as signals
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    Scales,
    Values,
    log_grid,
)

POSITION_AND_ACCELERATION = (("displacement", "position", "x"), ("acceleration", "acceleration", "a"))
"""Name of the channel in effects, its quantity, its symbol."""
REVERSAL = FreeParameter("reversal", grid=(0.0,), fixed=True)


@dataclass(frozen=True)
class SensorActuatorSettings:
    """Numbers of `bench.discrepancy.effects.sensor_actuator`."""

    jitter: float = 0.1
    """Part of a sample by which logs are uncertain of their times: a tenth by convention; the channels of one logger are often read one
    after the other within each sample."""
    reversed: float = -1.5
    """Log prior odds of a reversed channel; not so rare that a gain of minus one would be tried first."""


SETTINGS = SensorActuatorSettings()


def _time(name: str, *grid: float) -> FreeParameter:
    """A delay or time constant: eight milliseconds within a factor of seven with 95 %."""
    bounds = (math.log(1e-4), math.log(1.0))
    return FreeParameter(name, mean=math.log(0.008), std=1.0, bounds=bounds, grid=log_grid(*grid), unit="s")


def _beyond_jitter(values: Values, scales: Scales) -> bool:
    """Whether a delay, or a lag, which delays what is slow by its time constant, is more than the times of any log are uncertain by."""
    return bool(values[0] >= SETTINGS.jitter * scales.step)


def _sensor_delay(
    channel: str, quantity: str, symbol: str, grid: tuple[float, ...], log_prior: float = 0.0
) -> Effect:
    return Effect(
        f"{channel}_delay",
        "sensor",
        "sensor",
        (_time("delay", *grid),),
        f"{symbol}(t - tau)",
        signal=signals.sensor_delay,
        tells=_beyond_jitter,
        quantity=quantity,
        log_prior=log_prior,
    )


def _sensor_lag(channel: str, quantity: str, symbol: str) -> Effect:
    return Effect(
        f"{channel}_lag",
        "sensor",
        "sensor",
        (_time("time_constant", 0.003, 0.01),),
        f"tau y' + y = {symbol}, y what is read",
        signal=signals.low_pass,
        tells=_beyond_jitter,
        quantity=quantity,
        log_prior=-1.0,
    )


def _sensor_gain_error(channel: str, quantity: str, symbol: str, log_prior: float = 0.0) -> Effect:
    return Effect(
        f"{channel}_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0)),),
        f"(1 + e) {symbol}",
        signal=signals.gain,
        exact=True,
        factor=True,
        quantity=quantity,
        log_prior=log_prior,
    )


def _sensor_bias(channel: str, quantity: str, symbol: str, log_prior: float = 0.0) -> Effect:
    return Effect(
        f"{channel}_bias",
        "sensor",
        "sensor",
        (FreeParameter("bias", quantity, signed=True, std=0.5),),
        f"{symbol} + b",
        signal=signals.offset,
        exact=True,
        quantity=quantity,
        log_prior=log_prior,
    )


def _sensor_clipping(channel: str, quantity: str, symbol: str, log_prior: float = 0.0) -> Effect:
    level = FreeParameter(
        "level", quantity, mean=math.log(0.9), std=0.3, bounds=(-2.0, 0.3), grid=log_grid(0.75, 0.97)
    )
    return Effect(
        f"{channel}_clipping",
        "sensor",
        "sensor",
        (level,),
        f"{symbol} clipped at a level",
        signal=signals.clip,
        quantity=quantity,
        log_prior=log_prior,
    )


ANALOGUE_LAG = Effect(
    "actuator_lag",
    "actuator",
    "actuator",
    (_time("time_constant", 0.003, 0.01, 0.03),),
    "tau F' + F = command",
    signal=signals.analogue_lag,
    tells=_beyond_jitter,
    variant="analogue",
)
"""The lag of an amplifier, or of MuJoCo's activation: that of a digital drive moves on once a sample, half a sample earlier."""
CHANNELS: tuple[Effect, ...] = (
    Effect(
        "mass_error",
        "inertia",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-0.9, 5.0)),),
        "m = m_nominal (1 + e)",
        quantity="mass",
        exact=True,
        factor=True,
    ),
    Effect(
        "stiffness_error",
        "stiffness",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-0.95, 5.0)),),
        "k = k_nominal (1 + e)",
        quantity="stiffness",
        exact=True,
    ),
    Effect(
        "damping_error",
        "damping",
        "inertia",
        (FreeParameter("relative_error", signed=True, std=1.0, bounds=(-0.95, 20.0)),),
        "c = c_nominal (1 + e)",
        quantity="damping",
        exact=True,
    ),
    Effect(
        "actuator_delay",
        "actuator",
        "actuator",
        (_time("delay", 0.003, 0.01, 0.03),),
        "F(t - tau)",
        signal=signals.delay,
        between_samples=True,
        tells=_beyond_jitter,
    ),
    Effect(
        "force_delay",
        "sensor",
        "actuator",
        (_time("delay", 0.001, 0.003, 0.01),),
        "F(t + tau), the load logged late",
        signal=signals.advance,
        between_samples=True,
        logged=True,
        tells=_beyond_jitter,
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "clock_skew",
        "actuator",
        "actuator",
        # another clock is off by some samples at the end of a record: some ten parts in a million between two quartzes, more by software
        (
            FreeParameter(
                "rate_error",
                "step/duration",
                signed=True,
                std=3.0,
                bounds=(-100.0, 100.0),
                grid=(0.0,),
                unit="1",
            ),
        ),
        "F(t (1 + s)), the load logged by a clock of its own",
        signal=signals.skew,
        between_samples=True,
        logged=True,
        tells=lambda values, scales: abs(values[0]) * scales.duration >= SETTINGS.jitter * scales.step,
        log_prior=EFFECT_SETTINGS.rare,
    ),
    replace(
        ANALOGUE_LAG,
        equation="tau F' + F = command, moved on once a sample",
        signal=signals.lag,
        variant="",
        held_as=replace(ANALOGUE_LAG, signal=signals.held_lag),
    ),
    Effect(
        "force_gain_error",
        "actuator",
        "actuator",
        (FreeParameter("relative_error", signed=True, std=0.3, bounds=(-3.0, 5.0), grid=(0.0,)),),
        "F = (1 + e) command",
        signal=signals.gain,
        exact=True,
        factor=True,
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
    _sensor_delay("displacement", "position", "x", (0.003, 0.01, 0.03)),
    _sensor_lag("displacement", "position", "x"),
    _sensor_gain_error("displacement", "position", "x"),
    _sensor_bias("displacement", "position", "x", log_prior=-1.0),
    _sensor_clipping("displacement", "position", "x", log_prior=-1.0),
    _sensor_gain_error("acceleration", "acceleration", "a", log_prior=-1.0),
    _sensor_delay("acceleration", "acceleration", "a", (0.003, 0.01), log_prior=-1.0),
    _sensor_lag("acceleration", "acceleration", "a"),
    _sensor_bias("acceleration", "acceleration", "a", log_prior=-1.0),
    _sensor_clipping("acceleration", "acceleration", "a", log_prior=EFFECT_SETTINGS.rare),
    _sensor_gain_error("velocity", "velocity", "v", log_prior=-1.0),
    _sensor_delay("velocity", "velocity", "v", (0.003, 0.01), log_prior=-1.0),
    _sensor_lag("velocity", "velocity", "v"),
    _sensor_bias("velocity", "velocity", "v", log_prior=-1.0),
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
