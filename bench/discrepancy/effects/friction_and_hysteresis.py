"""Friction and hysteresis of the catalogue."""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values, log_grid
from bench.discrepancy.effects.force_priors import FORCE_PRIORS, FRICTION
from bench.discrepancy.effects.rare_forces import bouc_wen_theta, hysteretic_rate
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.coulomb import COULOMB
from bench.laws.jenkins_backlash import JENKINS_BACKLASH
from bench.laws.lugre import LUGRE
from bench.laws.stribeck import STRIBECK


def _lugre_theta(values: Values, scales: Scales) -> Values:
    level, preslide, ratio = values
    return np.array([level, level / preslide, level * ratio, 0.0, scales.velocity, 0.0])


def _backlash_theta(values: Values, scales: Scales) -> Values:
    level, slip, clearance, soft, sharpness, asymmetry, offset = values
    k = level / slip
    return np.array(
        [k, soft * k, clearance, level * (1 + asymmetry), level * (1 - asymmetry), sharpness, offset * level]
    )


FRICTION_AND_HYSTERESIS: tuple[Effect, ...] = (
    Effect(
        "coulomb_friction",
        "friction",
        "joint",
        (FRICTION,),
        "f = Fc sgn(v), set-valued at rest",
        law=COULOMB,
        limit=limits.coulomb_limit,
        theta=lambda values, scales: np.array([values[0], FORCE_PRIORS.slow * scales.velocity]),
    ),
    Effect(
        "stribeck_friction",
        "friction",
        "joint",
        (
            FRICTION,
            FreeParameter(
                "static_excess", mean=math.log(0.7), std=0.7, bounds=(-3.0, 2.5), grid=log_grid(0.7)
            ),
            FreeParameter(
                "stribeck_velocity",
                "velocity",
                mean=math.log(0.15),
                std=1.0,
                bounds=(-6.0, 0.5),
                grid=log_grid(0.03, 0.1, 0.3),
            ),
        ),
        "f = Fc (1 + s exp(-(v/vs)^2)) sgn(v)",
        law=STRIBECK,
        affine=True,
        limit=limits.stribeck_limit,
        contains=("coulomb_friction",),
        theta=lambda values, scales: np.append(values, FORCE_PRIORS.slow * scales.velocity),
    ),
    Effect(
        "presliding_friction",
        "hysteresis",
        "joint",
        (
            FRICTION,
            FreeParameter(
                "presliding_displacement",
                "position",
                mean=math.log(0.07),
                std=1.2,
                bounds=(-7.0, 1.5),
                grid=log_grid(0.01, 0.03, 0.1, 0.3),
            ),
            FreeParameter(
                "bristle_damping_per_force",
                "1/velocity",
                mean=math.log(0.3),
                std=1.5,
                bounds=(-7.0, 3.0),
                grid=log_grid(0.1),
            ),
        ),
        "f = s0 z + s1 z', z' = v - s0 |v| z / Fc (LuGre; Dahl for s1 = 0)",
        law=LUGRE,
        theta=_lugre_theta,
        contains=("coulomb_friction",),
        rate_bound=lambda values, scales: scales.velocity / values[1],
    ),
    Effect(
        "bouc_wen_hysteresis",
        "hysteresis",
        "joint",
        (
            FreeParameter("A", "stiffness", mean=math.log(0.2), std=1.5, bounds=(-7.0, 4.0)),
            FreeParameter(
                "beta",
                "1/position",
                mean=math.log(3.0),
                std=1.2,
                bounds=(-5.0, 6.0),
                grid=log_grid(0.5, 2.0, 6.0, 20.0),
            ),
            FreeParameter(
                "gamma_over_beta", signed=True, mean=0.0, std=1.0, bounds=(-3.0, 5.0), grid=(-0.5, 0.6)
            ),
            FreeParameter("n", std=0.5, mean=0.35, bounds=(0.0, 1.6), grid=log_grid(1.0, 2.0)),
        ),
        "f = z, z' = A v - beta |v| |z|^(n-1) z - gamma v |z|^n",
        law=BOUC_WEN,
        theta=lambda values, scales: np.array(bouc_wen_theta(values, scales)),
        rate_bound=hysteretic_rate,
    ),
    Effect(
        "backlash_friction",
        "hysteresis",
        "joint",
        (
            FreeParameter("friction_force", "force", **FORCE_PRIORS.amplitude),
            FreeParameter(
                "slip_displacement",
                "position",
                mean=math.log(0.1),
                std=1.0,
                bounds=(-6.0, 1.0),
                grid=log_grid(0.05, 0.2),
            ),
            FreeParameter(
                "clearance",
                "position",
                mean=math.log(0.1),
                std=1.0,
                bounds=(-6.0, 0.0),
                grid=log_grid(0.03, 0.1, 0.3),
            ),
            FreeParameter("soft_ratio", mean=math.log(0.1), std=1.0, bounds=(-5.0, 0.0)),
            FreeParameter("sharpness", mean=math.log(3.0), std=0.7, bounds=(-0.6, 3.5)),
            FreeParameter("asymmetry", signed=True, std=0.2, bounds=(-0.8, 0.8)),
            FreeParameter("offset_ratio", signed=True, std=0.2, bounds=(-2.0, 2.0)),
        ),
        "slider of limit Fc behind a spring with a dead-space that travels with it",
        law=JENKINS_BACKLASH,
        theta=_backlash_theta,
        rate_bound=lambda values, scales: scales.velocity / values[1],
        log_prior=-1.0,
    ),
)
"""Their order is that of the catalogue."""
