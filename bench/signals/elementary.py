"""Deterministic signals of one formula: constant, harmonic, ramp, impulse train."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import Signal


@dataclass(frozen=True)
class Constant(Signal, name="constant"):
    """A constant.

    Attributes:
        value: The value, in the unit of the channel.
    """

    value: float = 0.0

    def __post_init__(self) -> None:
        self._real("value")

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        return np.full(n, self.value)


@dataclass(frozen=True)
class Harmonic(Signal, name="harmonic"):
    """A sine ``amplitude sin(2 pi frequency t + phase)``.

    Attributes:
        frequency: Frequency [Hz].
        amplitude: Amplitude, in the unit of the channel.
        phase: Phase at the start [rad].
    """

    frequency: float
    amplitude: float = 1.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        self._real("frequency", "Hz", above=0.0)
        self._real("amplitude")
        self._real("phase", "rad")

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        self._below_nyquist(self.frequency, sample_rate)
        return self.amplitude * np.sin(
            2.0 * np.pi * self.frequency * (np.arange(n) / sample_rate) + self.phase
        )


@dataclass(frozen=True)
class Ramp(Signal, name="ramp"):
    """A passage from one value to another, constant before and after.

    Attributes:
        begin: Value up to `delay`, in the unit of the channel.
        end: Value from ``delay + duration`` on.
        duration: Time the passage takes [s]; None: to the end of the record.
        delay: Time before the passage [s].
        shape: "linear", or "cosine" (half a cosine: no jump of slope at either end).
    """

    begin: float = 0.0
    end: float = 1.0
    duration: float | None = None
    delay: float = 0.0
    shape: Literal["linear", "cosine"] = "linear"

    def __post_init__(self) -> None:
        self._real("begin")
        self._real("end")
        self._real("duration", "s", above=0.0, optional=True)
        self._real("delay", "s", at_least=0.0)
        self._choice("shape", ("linear", "cosine"))

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        duration = n / sample_rate - self.delay if self.duration is None else self.duration
        if duration <= 0.0:
            raise ParameterError(
                f"the ramp begins after {self.delay:g} s, but the record ends at {n / sample_rate:g} s"
            )
        part = np.clip((np.arange(n) / sample_rate - self.delay) / duration, 0.0, 1.0)
        if self.shape == "cosine":
            part = 0.5 - 0.5 * np.cos(np.pi * part)
        return self.begin + (self.end - self.begin) * part


@dataclass(frozen=True)
class ImpulseTrain(Signal, name="impulse_train"):
    """Equal impulses at equal intervals, zero between.

    The momentum of one impulse is ``2/pi amplitude width`` (half-sine) or ``amplitude width`` (rectangular).

    Attributes:
        amplitude: Peak of an impulse, in the unit of the channel.
        width: Duration of an impulse [s]; at least two samples at the rate it is sampled at.
        interval: Time from the start of one impulse to the start of the next [s].
        delay: Start of the first impulse [s].
        count: Number of impulses; None: to the end of the record.
        shape: "half_sine" or "rectangular".
        alternate: Whether every second impulse is negative.
    """

    amplitude: float = 1.0
    width: float = 0.01
    interval: float = 1.0
    delay: float = 0.0
    count: int | None = None
    shape: Literal["half_sine", "rectangular"] = "half_sine"
    alternate: bool = False

    def __post_init__(self) -> None:
        self._real("amplitude")
        self._real("width", "s", above=0.0)
        self._real("interval", "s", at_least=self.width)
        self._real("delay", "s", at_least=0.0)
        self._integer("count", at_least=1, optional=True)
        self._choice("shape", ("half_sine", "rectangular"))
        self._flag("alternate")

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        slack = 1e-9  # samples; k / rate is rounded, and 0.3 s at 1 kHz must be sample 300, not 301
        if self.width * sample_rate < 2.0 - slack:
            raise ParameterError(
                f"impulses of {self.width:g} s last {self.width * sample_rate:.2g} samples at "
                f"{sample_rate:g} Hz; a width of at least {2.0 / sample_rate:g} s is expected"
            )
        since = np.arange(n) - self.delay * sample_rate + slack
        number = np.floor(since / (self.interval * sample_rate))
        inside = (since - number * self.interval * sample_rate) / (self.width * sample_rate)
        active = (
            (number >= 0.0) & (inside < 1.0) & (number < (math.inf if self.count is None else self.count))
        )
        shape = np.sin(np.pi * np.clip(inside, 0.0, 1.0)) if self.shape == "half_sine" else np.ones(n)
        sign = np.where(self.alternate & (number % 2.0 == 1.0), -1.0, 1.0)
        return np.where(active, self.amplitude * sign * shape, 0.0)
