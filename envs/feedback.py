"""Where training starts: a push along the velocity, or an open-loop schedule with a brake before the limit of the stroke.

An oscillation that feeds itself finds each rig's own resonance, which no open-loop signal can. An open-loop excitation must keep
the stroke on every rig that may be there, and so leaves most of it unused on the rig that is; with a brake it can be made larger.
Reinforcement learning goes on from there. Searching schedule and gains together by CMA-ES, in closed loop on 48 rigs a generation, gained
nothing in 50 generations and was given up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.excitation.methods import controls_from, design
from bench.excitation.station import Station

from .setups import Setup


@dataclass(frozen=True)
class FeedbackSettings:
    """Numbers of `envs.feedback`."""

    gain: float = 1.6
    """Of a D-optimal design behind a brake: it is made for rigs that move most, and most rigs move by 0.6 of what is allowed."""
    evaluations: int = 480
    """Signals that its search weighs."""
    first_push: float = 0.7
    first_windows: int = 4
    brake: float = 12.0
    lead: float = 0.4
    """The force comes half a window late and takes a window to get there [rad at resonance]."""


SETTINGS = FeedbackSettings()


@dataclass(frozen=True)
class Feedback:
    """A schedule with a push and a brake.

    Attributes:
        station: Where it acts; one knot a window.
        schedule: Actions of each question and window ``(n_questions, n_windows, width)``.
        push: Largest action along the velocity of each actuator while the stroke is below `hold` ``(width,)``.
        hold: Stroke from which it brakes, as a fraction of the limit.
    """

    station: Station
    schedule: NDArray[np.float32]
    push: NDArray[np.float64]
    hold: float

    def correction(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """What is added to the schedule ``(m, width)`` for observations ``(m, n_observations)``."""
        names, limits = self.station.channels, self.station.limits
        last = len(names) * (self.station.n_steps - 1)
        actions = []
        for push, stroke, velocity in zip(self.push, limits.stroke, limits.velocity, strict=True):
            x = observation[:, last + names.index(stroke)].astype(float)
            v = observation[:, last + names.index(velocity)].astype(float)
            ahead = (
                math.cos(SETTINGS.lead) * v - 0.8 * math.sin(SETTINGS.lead) * x
            )  # of limits that belong to one resonance
            excess = np.hypot(x, v) - self.hold
            size = np.where(excess < 0.0, push * np.minimum(1.0, -8.0 * excess), -SETTINGS.brake * excess)
            actions.append(size * np.tanh(16.0 * ahead))
        return np.clip(np.stack(actions, axis=1), -1.0, 1.0)


def pump(station: Station) -> Feedback:
    """A push along the velocity, as strong as the energy allows for the whole test."""
    limits = station.limits
    push = [
        min(1.0, math.sqrt(1.5 * limits.energy.get(name, np.inf) / station.duration) / limits.force[name])
        for name in station.actuators
    ]
    schedule = np.zeros((max(1, len(station.questions)), station.n_windows, station.width), dtype=np.float32)
    schedule[:, : SETTINGS.first_windows] = SETTINGS.first_push
    return Feedback(station, schedule, np.array(push), 0.75)


def braked_design(setup: Setup, rng: np.random.Generator) -> Feedback:
    """The D-optimal multisine of each question, made larger, behind a brake."""
    station = setup.station()
    ends = np.arange(1, station.n_windows + 1) * station.n_steps - 1
    force = np.array([setup.limits.force[name] for name in station.actuators])
    plans = [
        design("d_optimal", experiment, duration=setup.duration, band=setup.band, rng=rng, evaluations=SETTINGS.evaluations)
        for experiment in setup.experiments
    ]  # fmt: skip
    schedule = np.stack([SETTINGS.gain * controls_from(plan)[ends] / force for plan in plans])
    return Feedback(station, np.clip(schedule, -1.0, 1.0).astype(np.float32), np.zeros(station.width), 0.8)
