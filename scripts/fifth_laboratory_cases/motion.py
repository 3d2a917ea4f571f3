"""What most rigs are, and the signals of all of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from fifth_laboratory_cases.stepping import Motion


class Oscillator(NamedTuple):
    """An oscillator as a nominal model has it."""

    mass: float
    """Mass [kg]."""
    stiffness: float
    """Stiffness [N/m]."""
    damping: float
    """Viscous damping [N s/m]."""


class Signal(NamedTuple):
    """A signal of a rig, in SI units.

    Attributes:
        values: At each step (n_steps + 1,).
        rate: Its time derivative, shaped alike, with which it is interpolated by cubics; linearly where None.
        late: Time [s] by which its sensor is late.
        of_samples: Whether the values are those of the samples (n,): a command, which no sensor measures.
    """

    values: Array
    rate: Array | None = None
    late: float = 0.0
    of_samples: bool = False

    def sampled(self, t: Array, h: float) -> Array:
        """Its values at some times [s] (n,), from its step [s]."""
        if self.of_samples:
            return self.values
        t = np.maximum(t - self.late, 0.0)
        if self.rate is None:
            return np.interp(t, np.arange(len(self.values)) * h, self.values)
        i = np.clip((t / h).astype(int), 0, len(self.values) - 2)
        w = t / h - i
        x, dx = self.values, self.rate
        first = (1 + 2 * w) * (1 - w) ** 2 * x[i] + w * (1 - w) ** 2 * h * dx[i]
        return first + w**2 * (3 - 2 * w) * x[i + 1] + w**2 * (w - 1) * h * dx[i + 1]


Signals = Mapping[str, Signal]
"""Signals of a rig, by name."""


def of_oscillator(load: Array, motion: Motion) -> dict[str, Signal]:
    """Signals of a rig whose state begins with a displacement and a velocity, under a load at each half step (2 n_steps + 1,)."""
    displacement, velocity, acceleration = motion.state[:, 0], motion.state[:, 1], motion.rate[:, 1]
    return {
        "load": Signal(load[::2]),
        "displacement": Signal(displacement, velocity),
        "velocity": Signal(velocity, acceleration),
        "acceleration": Signal(acceleration),
    }
