"""What the noise of a log makes of the equations of an articulated model: draws of it, sent the whole way that the log goes.

The noise of every encoder passes through the smoother and the inverse dynamics; what comes out on the side of the torque is no white noise
and differs from joint to joint. A few draws tell how far a run along a noisy motion, begun at a noisy state, ends from one without.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from bench.arrays import Array
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import JointClock, JointMotion


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the draws.

    Attributes:
        seed: Of the draws, so that a diagnosis repeats exactly.
        draws: Their number where a level is asked for: a record of forty windows then tells it to within a tenth.
        band: Frequencies [Hz] between which the torque that the motion's noise makes is averaged: those that a joint follows.
    """

    seed: int = 0
    draws: int = 3
    band: tuple[float, float] = (0.2, 10.0)


class NoiseDraw(NamedTuple):
    """Changes by one draw of the noise.

    Attributes:
        motion: (2, n, n_joints) of the smoothed positions and velocities.
        acceleration: (n, n_joints) of the smoothed accelerations.
        torque: (n, n_joints) of the torque of the inverse dynamics besides that of the joints' own accelerations.
        bias: (n_joints, n_steps) the same at the middles of the steps.
        reference: (n_joints, n_steps) of the positions there.
    """

    motion: Array
    acceleration: Array
    torque: Array
    bias: Array
    reference: Array


def draw(
    model: ArticulatedModel, motion: JointMotion, clock: JointClock, rng: np.random.Generator
) -> NoiseDraw:
    """One draw of the noise of all encoders."""
    n, nj = motion.position.shape
    noise = np.zeros((3, n, nj))
    for j, (smoother, level) in enumerate(zip(motion.smoothers, motion.noise, strict=True)):
        if smoother is not None:
            noise[:, :, j] = smoother.smooth(rng.standard_normal((n, len(level))) * level).T
    q, v, a = motion.position, motion.velocity, motion.acceleration
    base = model.dynamics(q, v, a)
    other = model.dynamics(q + noise[0], v + noise[1], a + noise[2])
    torque = (other.torque - other.inertia * (a + noise[2])) - (base.torque - base.inertia * a)
    return NoiseDraw(noise[:2], noise[2], torque, clock.between(torque), clock.between(noise[0]))


def torque_noise(
    model: ArticulatedModel,
    motion: JointMotion,
    clock: JointClock,
    step: float,
    settings: NoiseSettings | None = None,
) -> Array:
    """White torque noise (n_joints,), one-sigma a sample, as strong as what the noise of the measured motion makes of the bias."""
    settings = settings or NoiseSettings()
    made = draw(model, motion, clock, np.random.default_rng(settings.seed)).torque
    frequency, power = welch(made, 1.0 / step, nperseg=min(1024, len(made)), axis=0)
    band = (frequency > settings.band[0]) & (frequency < settings.band[1])
    return np.asarray(np.sqrt(power[band].mean(axis=0) / (2.0 * step)), dtype=np.float64)
