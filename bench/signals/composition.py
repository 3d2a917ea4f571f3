"""Signals made of signals: concatenation, scaling to a size, fading in and out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.base import Scaled, Signal, check_signal, check_signals, streams_of


@dataclass(frozen=True)
class Concatenation(Signal, name="concatenation"):
    """Signals one after the other, each beginning at its own time zero.

    Attributes:
        signals: The signals.
        durations: Time each lasts [s]; the last may be left out and then lasts to the end of the record.
            Zero follows the end of the last one.
    """

    signals: tuple[Signal, ...]
    durations: tuple[float, ...]

    def __post_init__(self) -> None:
        check_signals(self, self.signals)
        if len(self.signals) > 1 or len(tuple(self.durations)) > 0:
            self._reals("durations", "s", above=0.0)
        if len(self.signals) - len(self.durations) not in (0, 1):
            raise self._fail(
                "durations",
                f"one duration [s] for each of the {len(self.signals)} signals, or all but the last",
            )

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        streams = streams_of(rng, len(self.signals))
        edges = [0, *(round(end * sample_rate) for end in np.cumsum(self.durations))]
        if len(self.durations) < len(self.signals):
            edges.append(max(n, edges[-1]))
        x = np.zeros(n)
        for signal, stream, begin, end in zip(self.signals, streams, edges[:-1], edges[1:], strict=True):
            kept = min(n, end) - begin
            if kept > 0:  # sampled whole, then cut: the waveform does not depend on where the record ends
                x[begin : begin + kept] = signal.sample(end - begin, sample_rate, stream)[:kept]
        return x


@dataclass(frozen=True)
class Tapered(Signal, name="tapered"):
    """A signal faded in and out along half a cosine; the first and last sample are zero where there is a
    fade.

    Attributes:
        signal: The signal.
        fade_in: Time the signal takes to reach its full size [s].
        fade_out: Time over which it goes back to zero, at the end of the record [s].
    """

    signal: Signal
    fade_in: float = 0.0
    fade_out: float = 0.0

    def __post_init__(self) -> None:
        check_signal(self, self.signal)
        self._real("fade_in", "s", at_least=0.0)
        self._real("fade_out", "s", at_least=0.0)

    def _values(self, n: int, sample_rate: float, rng: np.random.Generator | None) -> NDArray[np.float64]:
        duration = (n - 1) / sample_rate
        if self.fade_in + self.fade_out > duration * (1.0 + 1e-9):
            raise ParameterError(
                f"fading in over {self.fade_in:g} s and out over {self.fade_out:g} s does not fit "
                f"into a record of {duration:g} s"
            )
        window = np.ones(n)
        t = np.arange(n) / sample_rate
        for fade, since in ((self.fade_in, t), (self.fade_out, t[::-1])):
            if fade > 0.0:
                window *= 0.5 - 0.5 * np.cos(np.pi * np.minimum(since / fade, 1.0))
        return window * self.signal.sample(n, sample_rate, rng)


def scaled(
    signal: Signal,
    *,
    gain: float | None = None,
    peak: float | None = None,
    rms: float | None = None,
    energy: float | None = None,
) -> Scaled:
    """A signal scaled by a factor, or to a peak, a root mean square or an energy.

    Args:
        signal: The signal.
        gain: Factor.
        peak: Largest magnitude of the record.
        rms: Root mean square of the record.
        energy: Energy ``dt sum(x^2)`` of the record, in the unit of the channel squared times s.

    Raises:
        ParameterError: Not exactly one of the four is given, or it is not positive (`gain` may be).
    """
    return Scaled(signal, gain=gain, peak=peak, rms=rms, energy=energy)
