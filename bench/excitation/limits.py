"""What an experiment may not exceed, and how large a signal may be so that it does not.

Force and energy are properties of the commands alone. Stroke and velocity depend on the rig, which is not known: a signal is
feasible when every rig of a set of prior draws stays within them. Comparisons between excitations are fair when each is made as
large as these same limits allow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.ensemble import Ensemble


@dataclass(frozen=True)
class LimitsSettings:
    """Numbers of `bench.excitation.limits`."""

    bisections: int = 12
    """Halvings of the interval in which the largest feasible scale lies; it is then met within 0.02 %."""
    smallest: float = 1e-9
    """Share of the largest command below which a rig that still leaves its limits is taken for unstable."""


SETTINGS = LimitsSettings()


@dataclass(frozen=True)
class Limits:
    """Limits of an experiment.

    Attributes:
        force: Largest magnitude of the command, by actuator [N or N m].
        energy: Largest ``dt sum(u^2)`` of the command, by actuator [N^2 s or (N m)^2 s].
        stroke: Largest magnitude by measured channel of displacement [m or rad].
        velocity: Largest magnitude by measured channel of velocity [m/s or rad/s].
    """

    force: Mapping[str, float]
    energy: Mapping[str, float] = field(default_factory=dict)
    stroke: Mapping[str, float] = field(default_factory=dict)
    velocity: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("force", "energy", "stroke", "velocity"):
            table = {key: float(value) for key, value in getattr(self, name).items()}
            for key, value in table.items():
                if not value > 0.0:  # infinity stands for no limit
                    raise ParameterError(
                        f"the {name} limit of '{key}' is {value}; a positive number is expected"
                    )
            object.__setattr__(self, name, MappingProxyType(table))
        if not self.force:
            raise ParameterError("limits need a largest force for at least one actuator")

    def __reduce__(self) -> tuple:
        return (Limits, (dict(self.force), dict(self.energy), dict(self.stroke), dict(self.velocity)))

    @property
    def actuators(self) -> tuple[str, ...]:
        """Actuators that are driven: those with a force limit."""
        return tuple(self.force)

    @property
    def watched(self) -> dict[str, float]:
        """Stroke and velocity limits by channel."""
        return {**self.stroke, **self.velocity}

    def within_actuator(
        self, controls: NDArray[np.float64], *, timestep: float, fill: bool = True
    ) -> NDArray[np.float64]:
        """Scale commands to the actuators' limits.

        Args:
            controls: Commands ``(…, n, n_actuators)`` in the order of `actuators`.
            timestep: Their interval [s].
            fill: Also scale up, to whichever of force and energy binds first; else only down.

        Returns:
            The scaled commands; a channel of zeros stays.
        """
        peak = np.max(np.abs(controls), axis=-2)
        energy = timestep * np.sum(controls**2, axis=-2)
        force = np.array([self.force[name] for name in self.actuators])
        budget = np.array([self.energy.get(name, np.inf) for name in self.actuators])
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.minimum(force / peak, np.sqrt(budget / energy))
        scale = np.where(peak > 0.0, scale, 0.0)
        return controls * (scale if fill else np.minimum(scale, 1.0))[..., None, :]


class Instrumented:
    """What is measured and driven, by the names that the noise and the limits are given for; a base of dataclasses.

    Attributes:
        noise: Standard deviation of each measured channel's noise, in the channel's unit.
        limits: The limits; the actuators with a force limit are driven.
    """

    noise: Mapping[str, float]
    limits: Limits

    @property
    def channels(self) -> tuple[str, ...]:
        """The measured channels."""
        return tuple(self.noise)

    @property
    def actuators(self) -> tuple[str, ...]:
        """The driven actuators."""
        return self.limits.actuators


class Peaks(NamedTuple):
    """What a feasible excitation reaches, as fractions of the limits (1 where a limit binds)."""

    force: dict[str, float]
    energy: dict[str, float]
    stroke: dict[str, float]  # over the rigs it was made for
    velocity: dict[str, float]


def motion_ratio(ensemble: Ensemble, limits: Limits, controls: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest magnitude over limit, over channels of stroke and velocity and over the members ``(n_cases,)``.

    Args:
        ensemble: The rigs; its channels are those of `limits.watched`, in this order.
        limits: The limits.
        controls: Commands ``(n_cases, n, n_actuators)``.
    """
    if not limits.watched:
        return np.zeros(len(controls))
    bounds = np.array([limits.watched[name] for name in ensemble.channels])
    ratio = np.max(np.abs(ensemble.record(controls)) / bounds, axis=(1, 2, 3))
    return np.where(np.isnan(ratio), np.inf, ratio)  # a rig that diverged


def feasible(
    ensemble: Ensemble, limits: Limits, controls: NDArray[np.float64], *, exact: bool = True
) -> NDArray[np.float64]:
    """Commands made as large as force and energy allow, then as small as stroke and velocity demand on every rig.

    Args:
        ensemble: As for `motion_ratio`.
        limits: The limits.
        controls: Commands of any size ``(n_cases, n, n_actuators)``; all actuators of a case are scaled down together.
        exact: Bisect for the largest feasible scale; else take the first found, some percent below it.

    Returns:
        Scaled commands in which every rig of the ensemble keeps the limits.

    Raises:
        ParameterError: A rig leaves the limits however small the commands are (it is unstable).
    """
    full = limits.within_actuator(np.asarray(controls, dtype=float), timestep=ensemble.timestep)
    held, missed = np.ones(len(full)), np.ones(len(full))
    ratio = motion_ratio(ensemble, limits, full)
    while (over := ratio > 1.0).any():
        if held.min() < SETTINGS.smallest:
            raise ParameterError(
                "drawn rigs leave the limits of stroke or velocity however small the excitation is; "
                "check their parameters against the time step"
            )
        missed[over] = held[over]
        held[over] *= np.clip(0.98 / ratio[over], 0.3, 0.98)  # the response is nearly proportional
        ratio[over] = motion_ratio(ensemble, limits, full[over] * held[over, None, None])
    shrunk = held < missed
    for _ in range(SETTINGS.bisections if exact and shrunk.any() else 0):
        middle = 0.5 * (held[shrunk] + missed[shrunk])
        inside = motion_ratio(ensemble, limits, full[shrunk] * middle[:, None, None]) <= 1.0
        held[shrunk] = np.where(inside, middle, held[shrunk])
        missed[shrunk] = np.where(inside, missed[shrunk], middle)
    return full * held[:, None, None]


def peaks(ensemble: Ensemble, limits: Limits, controls: NDArray[np.float64]) -> Peaks:
    """What commands ``(n, n_actuators)`` reach on the rigs of an ensemble, as fractions of the limits."""
    records = np.max(np.abs(ensemble.record(controls[None])), axis=(0, 1, 2)) if ensemble.channels else []
    reached = dict(zip(ensemble.channels, records, strict=True))
    names = limits.actuators
    return Peaks(
        {name: float(np.max(np.abs(controls[:, i])) / limits.force[name]) for i, name in enumerate(names)},
        {
            name: float(ensemble.timestep * np.sum(controls[:, i] ** 2) / limits.energy[name])
            for i, name in enumerate(names)
            if name in limits.energy
        },
        {name: float(reached[name] / limit) for name, limit in limits.stroke.items()},
        {name: float(reached[name] / limit) for name, limit in limits.velocity.items()},
    )
