"""The catalogue of effects: everything that the diagnosis knows may be missing from a nominal model.

The names and families of the first part are those of the blind trials; the rest are the usual suspects of a test
laboratory. Priors are broad and the same for all rigs; `log_prior` makes the latter a little less likely beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values, log_grid
from bench.discrepancy.effects.rare_forces import RARER, bouc_wen_theta, hysteretic_rate
from bench.discrepancy.effects.read_off import read_off
from bench.discrepancy.effects.sensor_actuator import CHANNELS
from bench.errors import UnknownNameError
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.constant_force import CONSTANT_FORCE
from bench.laws.coulomb import COULOMB
from bench.laws.coupling import CROSS_STIFFNESS, GAP_COUPLING
from bench.laws.damping import POWER_LAW_DAMPING, QUADRATIC_DAMPING
from bench.laws.gap import GAP, ONE_SIDED_STOP
from bench.laws.jenkins_backlash import JENKINS_BACKLASH
from bench.laws.lugre import LUGRE
from bench.laws.maxwell import MAXWELL
from bench.laws.normal_force_friction import LOAD_DEPENDENT_FRICTION, TIME_VARYING_FRICTION
from bench.laws.stiffness import CUBIC_STIFFNESS, QUADRATIC_STIFFNESS, STIFFNESS_DRIFT
from bench.laws.stribeck import STRIBECK


@dataclass(frozen=True)
class CatalogueSettings:
    """Numbers of `bench.discrepancy.effects.catalogue`."""

    amplitude: Mapping[str, Any] = field(
        default_factory=lambda: {"mean": math.log(0.2), "std": 1.5, "bounds": (-9.0, 5.0)}
    )
    signed: Mapping[str, Any] = field(
        default_factory=lambda: {"signed": True, "mean": 0.0, "std": 0.6, "bounds": (-30.0, 30.0)}
    )
    slow: float = 1e-3
    """Regularising velocity of friction that goes back into a rig, as a part of the largest velocity of the records."""


SETTINGS = CatalogueSettings()


def _lugre_theta(values: Values, scales: Scales) -> Values:
    level, preslide, ratio = values
    return np.array([level, level / preslide, level * ratio, 0.0, scales.velocity, 0.0])


def _backlash_theta(values: Values, scales: Scales) -> Values:
    level, slip, clearance, soft, sharpness, asymmetry, offset = values
    k = level / slip
    return np.array(
        [k, soft * k, clearance, level * (1 + asymmetry), level * (1 - asymmetry), sharpness, offset * level]
    )


FRICTION = FreeParameter("friction_force", "force", **SETTINGS.amplitude)

FORCES: tuple[Effect, ...] = (
    Effect(
        "coulomb_friction",
        "friction",
        "joint",
        (FRICTION,),
        "f = Fc sgn(v), set-valued at rest",
        law=COULOMB,
        limit=limits.coulomb_limit,
        theta=lambda values, scales: np.array([values[0], SETTINGS.slow * scales.velocity]),
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
        theta=lambda values, scales: np.append(values, SETTINGS.slow * scales.velocity),
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
            FreeParameter("friction_force", "force", **SETTINGS.amplitude),
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
    Effect(
        "gap",
        "stiffness",
        "joint",
        (
            FreeParameter("stiffness", "stiffness", mean=math.log(0.3), std=1.5, bounds=(-6.0, 6.0)),
            FreeParameter(
                "clearance",
                "position",
                mean=math.log(0.4),
                std=0.8,
                bounds=(-5.0, 0.1),
                grid=log_grid(0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9),
            ),
        ),
        "f = k (q - d) beyond d, k (q + d) below -d",
        law=GAP,
        theta=lambda values, scales: np.append(values, [0.0, 0.0]),
    ),
    Effect(
        "one_sided_stop",
        "stiffness",
        "joint",
        (
            FreeParameter("stiffness", "stiffness", mean=math.log(0.3), std=1.5, bounds=(-6.0, 6.0)),
            FreeParameter(
                "position",
                "position",
                signed=True,
                mean=0.0,
                std=0.6,
                bounds=(-1.0, 1.0),
                grid=(-0.8, -0.6, -0.4, -0.2, -0.05, 0.05, 0.2, 0.4, 0.6, 0.8),
            ),
            FreeParameter("side", signed=True, grid=(-1.0, 1.0), fixed=True),
        ),
        "f = k (q - p) beyond p on one side",
        law=ONE_SIDED_STOP,
        theta=lambda values, scales: np.array([values[0], values[1], 0.0, values[2]]),
    ),
    Effect(
        "cubic_stiffness",
        "stiffness",
        "joint",
        (FreeParameter("k3", "stiffness/position/position", **SETTINGS.signed),),
        "f = k3 q^3",
        law=CUBIC_STIFFNESS,
    ),
    Effect(
        "quadratic_stiffness",
        "stiffness",
        "joint",
        (FreeParameter("k2", "stiffness/position", **SETTINGS.signed),),
        "f = k2 q^2",
        law=QUADRATIC_STIFFNESS,
    ),
    Effect(
        "quadratic_damping",
        "damping",
        "joint",
        (FreeParameter("c2", "force/velocity/velocity", **SETTINGS.amplitude),),
        "f = c2 v |v|",
        law=QUADRATIC_DAMPING,
    ),
    Effect(
        "power_law_damping",
        "damping",
        "joint",
        (
            FreeParameter("C", "force", **SETTINGS.amplitude),
            FreeParameter(
                "n",
                mean=math.log(0.45),
                std=0.5,
                bounds=(math.log(0.05), math.log(0.98)),
                grid=log_grid(0.3, 0.6),
            ),
        ),
        "f = C sgn(v) |v|^n",
        law=POWER_LAW_DAMPING,
        theta=lambda values, scales: np.array(
            [values[0] * scales.velocity ** -values[1], values[1], 1e-3 * SETTINGS.slow * scales.velocity]
        ),
    ),
    Effect(
        "viscoelastic_relaxation",
        "stiffness",
        "joint",
        (
            FreeParameter("stiffness", "stiffness", mean=math.log(0.1), std=1.5, bounds=(-7.0, 4.0)),
            FreeParameter(
                "relaxation_time",
                mean=math.log(0.05),
                std=1.3,
                bounds=(math.log(1e-3), math.log(20.0)),
                grid=log_grid(0.01, 0.03, 0.1, 0.3, 1.0),
            ),
        ),
        "f = k z, z' = v - z / tau",
        law=MAXWELL,
        rate_bound=lambda values, scales: 1.0 / values[1],
    ),
    Effect(
        "load_dependent_friction",
        "friction",
        "joint",
        (FreeParameter("friction_per_displacement", "force/position", **SETTINGS.amplitude),),
        "f = mu |q| sgn(v), set-valued at rest",
        law=LOAD_DEPENDENT_FRICTION,
        limit=limits.load_dependent_limit,
        theta=lambda values, scales: np.array([values[0], 0.0, SETTINGS.slow * scales.velocity]),
    ),
    Effect(
        "time_varying_friction",
        "friction",
        "joint",
        (
            FRICTION,
            FreeParameter(
                "depth",
                mean=math.log(0.4),
                std=0.8,
                bounds=(math.log(0.02), math.log(1.5)),
                grid=log_grid(0.6),
            ),
            FreeParameter(
                "frequency",
                "1/duration",
                mean=math.log(2.5),
                std=0.8,
                bounds=(-1.5, 4.0),
                grid=log_grid(*np.arange(0.5, 9.1, 0.5)),
            ),
            FreeParameter("phase", signed=True, mean=0.0, std=1.8, bounds=(-7.0, 7.0), grid=(0.0,)),
        ),
        "f = Fc (1 + a sin(2 pi f t + phi)) sgn(v), set-valued at rest",
        law=TIME_VARYING_FRICTION,
        limit=limits.time_varying_limit,
        modulated=True,
        theta=lambda values, scales: np.append(values, SETTINGS.slow * scales.velocity),
    ),
    Effect(
        "stiffness_drift",
        "stiffness",
        "joint",
        (FreeParameter("stiffness_change", "stiffness", **SETTINGS.signed),),
        "f = dk (t / T) q",
        law=STIFFNESS_DRIFT,
        theta=lambda values, scales: np.array([values[0] / scales.duration, 0.0]),
    ),
    Effect(
        "force_offset",
        "actuator",
        "joint",
        (FreeParameter("offset", "force", signed=True, mean=0.0, std=2.0, bounds=(-50.0, 50.0)),),
        "f = F0",
        law=CONSTANT_FORCE,
        log_prior=-1.0,
    ),
    Effect(
        "gap_coupling",
        "coupling",
        "joint",
        (
            FreeParameter("axial_damping", "force/velocity/position2", **SETTINGS.amplitude),
            FreeParameter("torsional_damping", "force2/velocity2/position", **SETTINGS.amplitude),
            FreeParameter(
                "torsional_clearance",
                "position2",
                mean=math.log(0.4),
                std=0.8,
                bounds=(-5.0, 0.1),
                grid=log_grid(0.1, 0.3, 0.5, 0.7),
            ),
            FreeParameter(
                "axial_clearance",
                "position",
                mean=math.log(0.4),
                std=0.8,
                bounds=(-5.0, 0.1),
                grid=log_grid(0.1, 0.3, 0.5, 0.7),
            ),
        ),
        "f1 = c1 x' max(|th| - dth, 0), f2 = c2 th' max(|x| - dx, 0)",
        law=GAP_COUPLING,
        n_coordinates=2,
    ),
    Effect(
        "cross_stiffness",
        "coupling",
        "joint",
        (FreeParameter("k_cross", "force/position2", **SETTINGS.signed),),
        "f1 = k th, f2 = k x",
        law=CROSS_STIFFNESS,
        n_coordinates=2,
    ),
)

CATALOGUE: tuple[Effect, ...] = FORCES + RARER + CHANNELS + read_off(FORCES + RARER)
"""Every effect: forces first, then parameters, actuators and sensors, and those that are read off the records."""


def effect_named(name: str) -> Effect:
    """Return the effect called `name`.

    Raises:
        UnknownNameError: No such effect.
    """
    for effect in CATALOGUE:
        if effect.name == name:
            return effect
    raise UnknownNameError("effect", name, (effect.name for effect in CATALOGUE))
