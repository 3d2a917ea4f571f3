"""The catalogue of effects: everything that the diagnosis knows may be missing from a nominal model.

The names and families of the first part are those of the blind trials; the rest are the usual suspects of a test
laboratory. Priors are broad and the same for all rigs; `log_prior` makes the latter a little less likely beforehand.
"""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.effects.effect import Effect, FreeParameter, log_grid
from bench.discrepancy.effects.force_priors import FORCE_PRIORS, FRICTION
from bench.discrepancy.effects.friction_and_hysteresis import FRICTION_AND_HYSTERESIS
from bench.discrepancy.effects.rare_forces import RARER
from bench.discrepancy.effects.read_off import read_off
from bench.discrepancy.effects.sensor_actuator import CHANNELS
from bench.discrepancy.effects.sensor_filters import SENSOR_FILTERS
from bench.errors import UnknownNameError
from bench.laws.constant_force import CONSTANT_FORCE
from bench.laws.coupling import CROSS_STIFFNESS, GAP_COUPLING
from bench.laws.damping import POWER_LAW_DAMPING, QUADRATIC_DAMPING
from bench.laws.gap import GAP, ONE_SIDED_STOP
from bench.laws.maxwell import MAXWELL
from bench.laws.normal_force_friction import LOAD_DEPENDENT_FRICTION, TIME_VARYING_FRICTION
from bench.laws.stiffness import CUBIC_STIFFNESS, QUADRATIC_STIFFNESS, STIFFNESS_DRIFT

FORCES: tuple[Effect, ...] = (
    *FRICTION_AND_HYSTERESIS,
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
        (FreeParameter("k3", "stiffness/position/position", **FORCE_PRIORS.signed),),
        "f = k3 q^3",
        law=CUBIC_STIFFNESS,
    ),
    Effect(
        "quadratic_stiffness",
        "stiffness",
        "joint",
        (FreeParameter("k2", "stiffness/position", **FORCE_PRIORS.signed),),
        "f = k2 q^2",
        law=QUADRATIC_STIFFNESS,
    ),
    Effect(
        "quadratic_damping",
        "damping",
        "joint",
        (FreeParameter("c2", "force/velocity/velocity", **FORCE_PRIORS.amplitude),),
        "f = c2 v |v|",
        law=QUADRATIC_DAMPING,
    ),
    Effect(
        "power_law_damping",
        "damping",
        "joint",
        (
            FreeParameter("C", "force", **FORCE_PRIORS.amplitude),
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
            [values[0] * scales.velocity ** -values[1], values[1], 1e-3 * FORCE_PRIORS.slow * scales.velocity]
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
                unit="s",
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
        (FreeParameter("friction_per_displacement", "force/position", **FORCE_PRIORS.amplitude),),
        "f = mu |q| sgn(v), set-valued at rest",
        law=LOAD_DEPENDENT_FRICTION,
        limit=limits.load_dependent_limit,
        theta=lambda values, scales: np.array([values[0], 0.0, FORCE_PRIORS.slow * scales.velocity]),
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
        contains=("coulomb_friction",),
        modulated=True,
        theta=lambda values, scales: np.append(values, FORCE_PRIORS.slow * scales.velocity),
    ),
    Effect(
        "stiffness_drift",
        "stiffness",
        "joint",
        (FreeParameter("stiffness_change", "stiffness", **FORCE_PRIORS.signed),),
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
            FreeParameter("axial_damping", "force/velocity/position2", **FORCE_PRIORS.amplitude),
            FreeParameter("torsional_damping", "force2/velocity2/position", **FORCE_PRIORS.amplitude),
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
        "f1 = c1 x' max(|theta| - d_theta, 0), f2 = c2 theta' max(|x| - d_x, 0)",
        law=GAP_COUPLING,
        n_coordinates=2,
    ),
    Effect(
        "cross_stiffness",
        "coupling",
        "joint",
        (FreeParameter("k_cross", "force/position2", **FORCE_PRIORS.signed),),
        "f1 = k theta, f2 = k x",
        law=CROSS_STIFFNESS,
        n_coordinates=2,
    ),
)

CATALOGUE: tuple[Effect, ...] = FORCES + RARER + CHANNELS + SENSOR_FILTERS + read_off(FORCES + RARER)
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
