"""Forces of the catalogue that are rarer, or relatives of a common one with something added.

They cost log odds of about six beforehand: a record has to ask for them. Their grids are coarse, because a fit finds its
way from the neighbourhood that a common relative points at.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    Scales,
    Values,
    log_grid,
)
from bench.laws.base_flexibility import BASE_FLEXIBILITY
from bench.laws.bouc_wen_variants import BOUC_WEN_DEGRADING, BOUC_WEN_PINCHING
from bench.laws.carried_mass import CARRIED_MASS
from bench.laws.damping import ASYMMETRIC_DAMPING
from bench.laws.gap import ASYMMETRIC_GAP
from bench.laws.stiffness import COGGING


def bouc_wen_theta(values: Values, scales: Scales) -> tuple[float, float, float, float]:
    """A, beta, gamma and n of a Bouc-Wen law from parameters that do not depend on the size of its force."""
    stiffness, beta, ratio, n = values[:4]
    b = beta * scales.position ** (1.0 - n) * stiffness ** (1.0 - n)
    return stiffness, b, ratio * b, n


def _degrading_theta(values: Values, scales: Scales) -> Values:
    return np.array([*bouc_wen_theta(values, scales), 0.0, values[4], values[5]])


def _pinching_theta(values: Values, scales: Scales) -> Values:
    # p is large: the slack is there from the first motion, however small, as in a joint that has been used
    onset = 1e9 / (scales.force * scales.position)
    spread = [onset, SETTINGS.pinch_spread, 0.0, 0.5]
    return np.array([*bouc_wen_theta(values, scales), 0.0, 0.0, values[5], values[4], *spread])


def _cogging_theta(values: Values, scales: Scales) -> Values:
    sine, cosine, period = values
    return np.array([math.hypot(sine, cosine), period, math.atan2(cosine, sine)])


def _base_theta(values: Values, scales: Scales) -> Values:
    lead = scales.damping / scales.stiffness if scales.stiffness > 0.0 else 0.0
    return np.append(values, lead)


def _carried_mass(values: Values, scales: Scales) -> float:
    """The mass on the spring: its share of what the nominal model moves along the coordinate, of one where its motion is prescribed."""
    return float(values[0] / (scales.mobility or 1.0))


def _carried_theta(values: Values, scales: Scales) -> Values:
    return np.array([_carried_mass(values, scales), *values[1:]])


def hysteretic_rate(values: Values, scales: Scales) -> float:
    """Fastest rate of the hidden state [1/s]: n |v| (beta + |gamma|) |y|^(n-1), y = z/A at yield or over the whole stroke."""
    _, beta, ratio, n = values[:4]
    b = beta * scales.position ** (1.0 - n)
    stroke = 2.0 * scales.position
    level = min((b * (1.0 + ratio)) ** (-1.0 / n), stroke) if ratio > -1.0 else stroke
    return n * scales.velocity * b * (1.0 + abs(ratio)) * level ** (n - 1.0)


RESONANT_DAMPING = FreeParameter("damping_ratio", mean=math.log(0.03), std=0.8, bounds=(math.log(1e-3), 0.0))
"""Damping ratio of a hidden resonance: that of metal structures with joints."""


def _resonant_frequency(
    usual: float, std: float, bounds: tuple[float, float], first: float, last: float
) -> FreeParameter:
    """Frequency of a hidden resonance, screened from `first` to `last` as finely as a resonance of the usual damping is wide; all but the
    spread over the largest velocity by the largest displacement, of which the frequency of a harmonic motion is 1 / (2 pi)."""
    low, high = bounds
    width = 2.0 * math.exp(RESONANT_DAMPING.mean)
    grid = np.geomspace(first, last, 1 + math.ceil(math.log(last / first) / width))
    return FreeParameter(
        "frequency",
        "velocity/position",
        mean=math.log(usual),
        std=std,
        bounds=(math.log(low), math.log(high)),
        grid=log_grid(*grid),
        unit="Hz",
    )


HYSTERESIS = (
    FreeParameter("A", "stiffness", mean=math.log(0.2), std=1.5, bounds=(-7.0, 4.0)),
    FreeParameter(
        "beta", "1/position", mean=math.log(3.0), std=1.2, bounds=(-5.0, 6.0), grid=log_grid(2.0, 8.0)
    ),
    FreeParameter("gamma_over_beta", signed=True, mean=0.0, std=1.0, bounds=(-3.0, 5.0), grid=(0.5,)),
    FreeParameter("n", std=0.5, mean=0.35, bounds=(0.0, 1.6), grid=log_grid(1.1)),
)


@dataclass(frozen=True)
class RareForcesSettings:
    """Numbers of `bench.discrepancy.effects.rare_forces`."""

    pinch_spread: float = 0.25
    """psi_0: spread of the pinched part of a loop as a share of the ultimate strength; a record hardly tells it from the severity."""
    clearance: Mapping[str, Any] = field(
        default_factory=lambda: {
            "mean": math.log(0.4),
            "std": 0.8,
            "bounds": (-5.0, 0.1),
            "grid": log_grid(0.25, 0.6),
        }
    )


SETTINGS = RareForcesSettings()

RARER: tuple[Effect, ...] = (
    Effect(
        "asymmetric_gap",
        "stiffness",
        "joint",
        (
            FreeParameter("stiffness_positive", "stiffness", mean=math.log(0.3), std=1.5, bounds=(-6.0, 6.0)),
            FreeParameter("stiffness_negative", "stiffness", mean=math.log(0.3), std=1.5, bounds=(-6.0, 6.0)),
            FreeParameter("clearance_positive", "position", **SETTINGS.clearance),
            FreeParameter("clearance_negative", "position", **SETTINGS.clearance),
        ),
        "f = k+ (q - d+) beyond d+, k- (q + d-) below -d-",
        law=ASYMMETRIC_GAP,
        n_linear=2,
        theta=lambda values, scales: np.append(values, 0.0),
        contains=("gap", "one_sided_stop"),
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "asymmetric_damping",
        "damping",
        "joint",
        (FreeParameter("damping_difference", "force/velocity", signed=True, std=0.3, bounds=(-10.0, 10.0)),),
        "f = dc |v|, half the difference of the damping in the two directions",
        law=ASYMMETRIC_DAMPING,
        theta=lambda values, scales: np.array([values[0], -values[0]]),
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "cogging",
        "stiffness",
        "joint",
        (
            FreeParameter("sine", "force", signed=True, std=0.4, bounds=(-10.0, 10.0)),
            FreeParameter("cosine", "force", signed=True, std=0.4, bounds=(-10.0, 10.0)),
            FreeParameter(
                "period",
                "position",
                mean=math.log(0.5),
                std=0.7,
                bounds=(math.log(0.005), math.log(1.5)),
                grid=log_grid(0.2, 0.3, 0.45, 0.8),
            ),
        ),
        "f = a sin(2 pi q / p) + b cos(2 pi q / p)",
        law=COGGING,
        n_linear=2,
        theta=_cogging_theta,
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "base_flexibility",
        "stiffness",
        "joint",
        (
            FreeParameter(
                "stiffness_loss", "stiffness", mean=math.log(0.1), std=1.2, bounds=(-8.0, math.log(0.95))
            ),
            _resonant_frequency(0.4, 0.7, (0.03, 3.0), 0.2, 0.6),
            RESONANT_DAMPING,
        ),
        BASE_FLEXIBILITY.equation,
        law=BASE_FLEXIBILITY,
        theta=_base_theta,
        rate_bound=lambda values, scales: 2.0 * math.pi * values[1],
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "carried_mass",
        "stiffness",
        "joint",
        (
            FreeParameter("share", mean=math.log(0.2), std=1.5, bounds=(math.log(0.0005), math.log(0.9))),
            # from liquids and ropes far below the joint's own resonance to modes of parts far above it
            _resonant_frequency(0.3, 1.2, (0.01, 10.0), 0.05, 1.6),
            RESONANT_DAMPING,
        ),
        "f = m_c (y'' - q''), y'' = omega^2 (q - y) + 2 zeta omega (v - y'), m_c = share m",
        law=CARRIED_MASS,
        theta=_carried_theta,
        rate_bound=lambda values, scales: 2.0 * math.pi * values[1],
        carried=_carried_mass,
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "degrading_hysteresis",
        "hysteresis",
        "joint",
        (
            *HYSTERESIS,
            FreeParameter(
                "strength_loss", "1/force/position", mean=math.log(0.05), std=1.2, bounds=(-9.0, 2.0)
            ),
            FreeParameter(
                "stiffness_loss", "1/force/position", mean=math.log(0.05), std=1.2, bounds=(-9.0, 2.0)
            ),
        ),
        "f = z, eta z' = A v - nu (beta |v| |z|^(n-1) z + gamma v |z|^n), nu and eta grow with the work done",
        law=BOUC_WEN_DEGRADING,
        theta=_degrading_theta,
        rate_bound=hysteretic_rate,
        contains=("bouc_wen_hysteresis",),
        log_prior=EFFECT_SETTINGS.rare,
    ),
    Effect(
        "pinching_hysteresis",
        "hysteresis",
        "joint",
        (
            *HYSTERESIS,
            FreeParameter("severity", mean=math.log(0.7), std=0.3, bounds=(-3.0, math.log(0.98))),
            FreeParameter("level", signed=True, mean=0.1, std=0.15, bounds=(-0.5, 0.6)),
        ),
        "f = z, z' = h (A v - beta |v| |z|^(n-1) z - gamma v |z|^n), h small near a force of level times the strength",
        law=BOUC_WEN_PINCHING,
        theta=_pinching_theta,
        rate_bound=hysteretic_rate,
        contains=("bouc_wen_hysteresis",),
        log_prior=EFFECT_SETTINGS.rare,
    ),
)
"""Rarer forces."""
