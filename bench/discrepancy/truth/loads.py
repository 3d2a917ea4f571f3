"""Loads and prescribed motions of the rigs of sealed cases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import bessel, chirp, fftconvolve, sosfilt

from bench.arrays import Array

SIGNALS = ("random", "sweep", "multisine", "stepped", "decaying")


@dataclass(frozen=True)
class RigsSettings:
    """Numbers of `bench.discrepancy.truth.rigs`."""

    machine: float = 6.0
    """Bandwidth of the machine that prescribes a motion, as a multiple of the signal's central frequency."""
    ramp: float = 0.3
    """Seconds over which loads and motions set in [s]."""
    background_shares: tuple[float, ...] = (0.2, 0.6, 0.0, 0.2)
    """Probabilities of none, single, double and foreign cases that have a background."""


RIGS_SETTINGS = RigsSettings()


def machine_motion(signal: Array, frequency: float, rate: float) -> Array:
    """Motion (n,) of a machine that is asked for a signal: no actuator jumps, nor does it turn a corner."""
    return np.asarray(
        sosfilt(bessel(4, RIGS_SETTINGS.machine * frequency, fs=rate, output="sos"), signal), dtype=np.float64
    )


def load(kind: str, frequency: float, n: int, rate: float, rng: np.random.Generator) -> Array:
    """Unit-RMS signal (n,) around a resonance at `frequency` [Hz], starting smoothly from zero."""
    t = np.arange(n) / rate
    duration = n / rate
    if kind == "sweep":
        out = chirp(t, 0.3 * frequency, duration, 2.5 * frequency, phi=int(rng.integers(360)))
    elif kind == "stepped":
        steps = np.array_split(np.arange(n), 6)
        cycles = np.zeros(n)
        level = np.zeros(n)
        for own, f in zip(steps, rng.permutation(np.linspace(0.5, 1.7, 6)) * frequency, strict=True):
            cycles[own] = f / rate
            level[own] = rng.uniform(0.4, 1.0)
        # levels pass into one another over some periods, so that no step of the amplitude rings
        width = max(round(rate / frequency), 1)
        level = fftconvolve(np.pad(level, width, mode="edge"), np.hanning(2 * width + 1), mode="valid")
        out = level * np.sin(2.0 * np.pi * np.cumsum(cycles))
    else:
        f = np.fft.rfftfreq(n, 1.0 / rate)
        inside = (f > 0.2 * frequency) & (f < 2.7 * frequency)
        amplitude = np.ones(len(f)) if kind == "multisine" else np.abs(rng.standard_normal(len(f)))
        # the phases of the bins outside the band are not drawn: the signal does not depend on the rate then
        phase = np.zeros(len(f))
        phase[inside] = 2.0 * np.pi * rng.random(int(inside.sum()))
        out = np.fft.irfft(np.where(inside, amplitude * np.exp(1j * phase), 0.0), n)
        if kind == "decaying":
            out = out * np.exp(-3.0 * (t % (duration / 3.0)) / (duration / 3.0))
    out = out * np.sin(0.5 * np.pi * np.minimum(t / RIGS_SETTINGS.ramp, 1.0)) ** 2
    return np.asarray(out / np.sqrt(np.mean(out**2)), dtype=np.float64)
