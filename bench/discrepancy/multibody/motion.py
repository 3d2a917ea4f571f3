"""Measured motion of all joints, smoothed from their encoders, and what the equations of the joints are along it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.motion.kalman_smoother import Smoother, resting, smoother_of
from bench.discrepancy.multibody.encoders import TRUE, Encoder, encoders_of
from bench.discrepancy.multibody.model import ArticulatedModel, Dynamics
from bench.discrepancy.numerics.uniform_spline import uniform_spline
from bench.discrepancy.settings import ArticulatedSettings, MotionSettings


class JointMotion(NamedTuple):
    """Measured motion of all joints, smoothed: positions, velocities, accelerations (n, n_moving) and the smoothers behind them."""

    position: Array
    velocity: Array
    acceleration: Array
    samples: tuple[Array, ...]
    smoothers: tuple[Smoother | None, ...]
    noise: tuple[Array, ...]


def motion_of(
    case: Case,
    model: ArticulatedModel,
    record: CaseRecord,
    encoders: Mapping[str, Encoder],
    like: JointMotion | None = None,
    *,
    settings: MotionSettings,
) -> JointMotion:
    """Smooth the motion of a record; `encoders` says what is wrong with which joint, `like` has smoothers to be used again.

    A delay shifts the smoothed motion. The samples keep theirs: interpolated, they would have less noise than was logged.
    """
    clock = np.arange(len(record)) * record.step
    out = np.zeros((3, len(record), len(model.moving)))
    samples, smoothers, noises = [], [], []
    for j, joint in enumerate(model.moving):
        measured = encoders_of(case, joint)
        wrong = encoders.get(joint.name, TRUE)
        raw = np.column_stack([record.values[c.name] for c in measured.channels])
        true = wrong.corrected(raw, measured.orders)
        noise = wrong.scaled(measured.noise, measured.orders)
        still = resting(true, measured.orders, noise, settings=settings)
        smoother = like.smoothers[j] if like else None
        if still is None and smoother is None:
            smoother = smoother_of(true, measured.orders, noise, record.step, settings=settings)
        if like is not None and wrong == TRUE:
            out[:, :, j] = np.stack([like.position[:, j], like.velocity[:, j], like.acceleration[:, j]])
        elif still is not None or smoother is None:
            out[:, :, j] = (still if still is not None else np.zeros((len(record), 3))).T
        else:
            smooth = smoother.smooth(true)
            if wrong.delay:
                smooth = uniform_spline(smooth, record.step, np.minimum(clock + wrong.delay, clock[-1])).T
            out[:, :, j] = smooth.T
        samples.append(true)
        smoothers.append(smoother)
        noises.append(noise)
    return JointMotion(out[0], out[1], out[2], tuple(samples), tuple(smoothers), tuple(noises))


Moving = tuple[CaseRecord, JointMotion]
"""A record and its motion."""


class JointClock(NamedTuple):
    """Samples of a record, `step` apart, and the middles of the integration steps between them."""

    samples: Array
    middles: Array
    n_sub: int
    step: float

    def later(self, delay: float) -> JointClock:
        """The middles of steps that lie `delay` [s] earlier, from the first sample on."""
        return self._replace(middles=np.maximum(self.middles - delay, 0.0))

    def between(self, samples: Array) -> Array:
        """Values (n, n_joints) at the samples, at the middles (n_joints, n_steps)."""
        return uniform_spline(samples, self.step, self.middles)


def clock_of(record: CaseRecord, *, settings: ArticulatedSettings) -> JointClock:
    """Samples and integration steps of a record."""
    n_sub = max(1, int(np.ceil(record.step / settings.longest_step - 1e-9)))
    middles = (np.arange((len(record) - 1) * n_sub) + 0.5) * (record.step / n_sub)
    samples = np.arange(len(record)) * record.step
    return JointClock(
        np.asarray(samples, dtype=np.float64), np.asarray(middles, dtype=np.float64), n_sub, record.step
    )


class Coefficients(NamedTuple):
    """Coefficients of the equations of all joints (n_joints, n_steps)."""

    bias: Array
    inertia: Array
    reference: Array
    acceleration: Array

    @classmethod
    def of(
        cls, dynamics: Dynamics, motion: JointMotion, clock: JointClock, pushed: Array | float = 0.0
    ) -> Coefficients:
        """Coefficients along a motion; the bias is the torque besides that of the joint's own acceleration.

        Args:
            dynamics: Inverse dynamics along it.
            motion: The motion.
            clock: Its samples and steps.
            pushed: (n_joints, n_steps) torque of the loads on the joints besides their drives.
        """
        bias = clock.between(dynamics.torque - dynamics.inertia * motion.acceleration) - pushed
        return cls(
            bias,
            clock.between(dynamics.inertia),
            clock.between(motion.position),
            clock.between(motion.acceleration),
        )

    @property
    def stacked(self) -> Array:
        """Bias and inertia (n_joints, 2, n_steps)."""
        return np.stack([self.bias, self.inertia], axis=1)
