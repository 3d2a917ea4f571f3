"""How finely a free run is integrated: Runge-Kutta steps a sample, sample by sample.

The hidden state of a bristle follows the motion at a rate that grows with the speed. Steps for the fastest moment of a record would
be several times too many for the rest of it, so each sample has its own number, from the speed that was measured there. A free run of
other parameters is not as fast at the same moments: what is slow counts as `slowest` of the fastest, at which a step at full speed is
still stable. Numbers of steps depend on parameters in jumps; the rates they are taken from are rounded up so that these are rare.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.effects.effect import Effect, Scales, Values
from bench.discrepancy.settings import SimulationSettings


def speeds(velocity: Array, *, prescribed: bool, settings: SimulationSettings) -> Array:
    """Speed (n,) to reckon with between each sample and the next.

    Args:
        velocity: (n,) measured along a coordinate.
        prescribed: Whether the motion is as measured whatever the parameters.
        settings: `SimulationSettings` of the diagnosis.
    """
    speed = np.abs(velocity)
    after = np.append(speed[1:], speed[-1:])
    between = np.maximum(speed, after)
    if prescribed:
        return between
    around = np.maximum(between, np.append(speed[:1], speed[:-1]))
    return np.maximum(settings.margin * around, settings.slowest * speed.max(initial=0.0))


def rates(
    effect: Effect, values: Values, scales: Scales, speed: Array, *, settings: SimulationSettings
) -> Array:
    """Fastest rate of a law [1/s], at every speed (n,); (1,) where it does not depend on the speed.

    Args:
        effect: The effect.
        values: Its parameters.
        scales: Magnitudes, the largest velocity among them.
        speed: (n,) as `speeds` returns them.
        settings: `SimulationSettings` of the diagnosis.
    """
    top = effect.fastest(values, scales)
    if not 0.0 < top < math.inf:
        return np.array([top])
    rounded = 2.0 ** (math.ceil(settings.per_octave * math.log2(top)) / settings.per_octave)
    return np.atleast_1d(effect.fastest(values, scales._replace(velocity=speed)) * (rounded / top))  # pyrefly: ignore[bad-argument-type]


def steps(
    phase: Array, *, fewest: int = 1, multiple: int = 1, halving: bool = False, settings: SimulationSettings
) -> NDArray[np.int64]:
    """Runge-Kutta steps of samples in which the fastest law changes by a phase.

    Args:
        phase: (n,).
        fewest: Least number.
        multiple: How many times as many as needed, as far as `max_substeps` allows.
        halving: Powers of two only, so that the steps of one sample fall on those of another.
        settings: `SimulationSettings` of the diagnosis.
    """
    count = np.minimum(multiple * np.maximum(np.ceil(phase / settings.phase), fewest), settings.max_substeps)
    if halving:
        count = 2.0 ** np.ceil(np.log2(count))
    return np.asarray(count, dtype=np.int64)
