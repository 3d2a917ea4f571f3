"""Sines whose frequency moves: steadily (sweep) or in steps (stepped sine)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError
from bench.signals.base import Signal


@dataclass(frozen=True)
class Sweep(Signal, name="sweep"):
    """A sine sweep with its exact phase, the integral of the instantaneous frequency.

    Logarithmic: ``f(t) = f0 k^(t/T)`` with ``k = f1/f0``, phase ``2 pi f0 T (k^(t/T) - 1) / ln k``: the
    same time for each octave. Linear: ``f(t) = f0 + (f1 - f0) t/T``, phase ``2 pi (f0 t + (f1 - f0) t^2 /
    (2 T))``: the same time for each hertz. Downwards where ``stop < start``. Zero once the sweep is over.

    Attributes:
        start: First frequency [Hz].
        stop: Last frequency [Hz].
        amplitude: Amplitude, in the unit of the channel.
        duration: Time the sweep takes [s]; None: the whole record.
        spacing: "logarithmic" or "linear".
        phase: Phase at the start [rad].

    References:
        Farina 2000, "Simultaneous measurement of impulse response and distortion with a swept-sine
        technique", eq. 5.
    """

    start: float
    stop: float
    amplitude: float = 1.0
    duration: float | None = None
    spacing: Literal["logarithmic", "linear"] = "logarithmic"
    phase: float = 0.0

    def __post_init__(self) -> None:
        self._real("start", "Hz", above=0.0)
        self._real("stop", "Hz", above=0.0)
        self._real("amplitude")
        self._real("duration", "s", above=0.0, optional=True)
        self._choice("spacing", ("logarithmic", "linear"))
        self._real("phase", "rad")

    def frequency(self, time: ArrayLike, *, duration: float | None = None) -> NDArray[np.float64]:
        """Instantaneous frequency [Hz] at `time` [s].

        Args:
            time: Times ``(n,)`` [s] within the sweep.
            duration: Time the sweep takes [s] where the signal itself leaves it to the record.

        Raises:
            ParameterError: Neither the signal nor the argument gives a duration.
        """
        whole = self.duration or duration
        if whole is None:
            raise ParameterError("this sweep takes its duration from the record: pass duration=… [s]")
        part = np.asarray(time, dtype=float) / whole
        if self.spacing == "linear":
            return self.start + (self.stop - self.start) * part
        return self.start * (self.stop / self.start) ** part

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        self._below_nyquist(max(self.start, self.stop), sample_rate)
        duration = n / sample_rate if self.duration is None else self.duration
        t = np.arange(n) / sample_rate
        octaves = math.log(self.stop / self.start)
        if self.spacing == "linear" or octaves == 0.0:
            cycles = t * (self.start + 0.5 * (self.stop - self.start) * t / duration)
        else:
            inside = np.minimum(t / duration, 1.0)
            cycles = self.start * duration / octaves * np.expm1(octaves * inside)
        return np.where(t < duration, self.amplitude * np.sin(2.0 * np.pi * cycles + self.phase), 0.0)


class Step(NamedTuple):
    """One step of a stepped sine.

    Attributes:
        frequency: Frequency [Hz].
        amplitude: Amplitude, in the unit of the channel.
        begin: Start of the step [s].
        end: End of the step [s].
    """

    frequency: float
    amplitude: float
    begin: float
    end: float


@dataclass(frozen=True)
class SteppedSine(Signal, name="stepped_sine"):
    """A sine held at one frequency after the other, without a jump of phase; zero after the last.

    With a whole number of cycles a step, amplitudes change at zero crossings as well.

    Attributes:
        frequencies: Frequencies in order [Hz].
        amplitude: One amplitude for all steps, or one a step, in the unit of the channel.
        cycles: Cycles a step; give this or `dwell` (10 where both are None).
        dwell: Time a step [s].
    """

    frequencies: tuple[float, ...]
    amplitude: float | tuple[float, ...] = 1.0
    cycles: float | None = None
    dwell: float | None = None

    def __post_init__(self) -> None:
        self._reals("frequencies", "Hz", above=0.0)
        if isinstance(self.amplitude, int | float):
            self._real("amplitude")
        else:
            self._reals("amplitude", length=len(self.frequencies))
        self._real("cycles", above=0.0, optional=True)
        self._real("dwell", "s", above=0.0, optional=True)
        if self.cycles is not None and self.dwell is not None:
            raise ParameterError("a stepped sine takes either cycles or dwell [s], not both")

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps with their times, for averaging over the settled part of each."""
        single = isinstance(self.amplitude, float)
        amplitudes = (self.amplitude,) * len(self.frequencies) if single else self.amplitude
        cycles = 10.0 if self.cycles is None else self.cycles
        steps, begin = [], 0.0
        for frequency, amplitude in zip(self.frequencies, amplitudes, strict=True):  # pyrefly: ignore[bad-argument-type]
            end = begin + (cycles / frequency if self.dwell is None else self.dwell)
            steps.append(Step(frequency, amplitude, begin, end))
            begin = end
        return tuple(steps)

    @property
    def duration(self) -> float:
        """Time of all steps together [s]."""
        return self.steps[-1].end

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        self._below_nyquist(max(self.frequencies), sample_rate)
        x = np.zeros(n)
        cycles = 0.0
        for step in self.steps:
            first, last = (min(n, math.ceil(edge * sample_rate - 1e-9)) for edge in (step.begin, step.end))
            t = np.arange(first, last) / sample_rate - step.begin
            x[first:last] = step.amplitude * np.sin(2.0 * np.pi * (cycles + step.frequency * t))
            cycles = (cycles + step.frequency * (step.end - step.begin)) % 1.0
        return x
