"""Effects that no grid can hold: what they are is read off the records before they are fitted, so that each record has one of its own.

They stand in the catalogue by name, family and equation, so that they can be asked for, left out and scored like any other; what a fit
is made of comes from `unscreened.timed_force`, `unscreened.harmonic_force` and `unscreened.scheduled`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
)
from bench.laws.linear import LINEAR

TIMED = "timed_force"
HARMONIC = "harmonic_force"
HUM = "hum"
"""What the name of hum in the reading of a sensor ends with."""
FOLLOWED = "scheduled_"
"""What the name of an effect whose force follows a channel begins with."""
DIFFERS = "record_dependent_"
"""What the name of an effect whose force differs from record to record begins with."""
PICKED_UP = (
    ("displacement", "position"),
    ("velocity", "velocity"),
    ("acceleration", "acceleration"),
    ("force", "force"),
)
"""Channels that may pick up hum, and the scale of each."""
SENSITIVITY = FreeParameter("sensitivity", signed=True, mean=1.0, std=0.5, bounds=(-4.0, 6.0))
AMPLITUDE = FreeParameter("force", "force", mean=math.log(0.2), std=1.5, bounds=(-9.0, 5.0))
FORCE = FreeParameter("force", "force", signed=True, std=2.0, bounds=(-50.0, 50.0))


def schedulable(effect: Effect) -> bool:
    """Whether the force of an effect may follow a channel; an inertia that is carried does not."""
    return (
        effect.site == "joint"
        and effect.n_coordinates == 1
        and not effect.modulated
        and effect.carried is None
    )


CHANGES: tuple[Effect, ...] = tuple(
    Effect(
        name, name, "joint", (FreeParameter(f"{name}_change", scale, signed=True, std=0.3, bounds=(-10.0, 10.0)),), equation,
        law=LINEAR, theta=theta,
    )
    for name, scale, equation, theta in (
        ("stiffness", "stiffness", "f = dk q", lambda values, scales: np.array([values[0], 0.0])),
        ("damping", "force/velocity", "f = dc v", lambda values, scales: np.array([0.0, values[0]])),
    )
)  # fmt: skip
"""Changes of a spring and of a damper, which are errors of the nominal model if they are the same in all records."""


def differs(effect: Effect) -> bool:
    """Whether the force of an effect may differ from record to record: a spring or a damper, with the temperature, say; and what
    dissipates otherwise, with its normal force or its current."""
    dissipates = effect.family in ("friction", "hysteresis", "damping") and not effect.parameters[0].signed
    return effect in CHANGES or (schedulable(effect) and dissipates)


def differing_name(effect: Effect) -> str:
    """Name of an effect whose force differs from record to record; Coulomb friction is called friction there, of whatever limit."""
    return DIFFERS + ("friction" if effect.name == "coulomb_friction" else effect.name)


def read_off(forces: Iterable[Effect]) -> tuple[Effect, ...]:
    """The effects that are read off the records.

    Args:
        forces: Those of the catalogue, of which some may follow a channel.
    """
    forces = tuple(forces)
    scheduled = (
        replace(
            effect, name=FOLLOWED + effect.name, varies=effect.name, site="read off", parameters=(*effect.parameters, SENSITIVITY),
            equation=f"(1 - kappa + kappa s/s0) f, s a channel; {effect.equation}", log_prior=effect.log_prior + 0.5 * EFFECT_SETTINGS.rare,
            law=None, limit=None, theta=None, rate_bound=None,
        )
        for effect in forces if schedulable(effect)
    )  # fmt: skip
    following = (
        replace(
            effect, name=FOLLOWED + effect.name, varies=effect.name, site="read off",
            equation=f"(s - s_mean)/s_std f, s a channel; {effect.equation}", log_prior=0.5 * EFFECT_SETTINGS.rare, law=None, theta=None,
        )
        for effect in CHANGES
    )  # fmt: skip
    differing = (
        replace(
            effect, name=differing_name(effect), varies=effect.name, site="read off", equation=f"c_i f in record i; {effect.equation}",
            log_prior=effect.log_prior + EFFECT_SETTINGS.rare, law=None, limit=None, theta=None, rate_bound=None,
        )
        for effect in (*forces, *CHANGES) if differs(effect)
    )  # fmt: skip
    return (
        Effect(
            TIMED,
            "external",
            "read off",
            (FORCE,),
            "f = -F in windows of time",
            log_prior=EFFECT_SETTINGS.rare,
        ),
        Effect(
            HARMONIC,
            "external",
            "read off",
            (AMPLITUDE,),
            "f = -F cos(2 pi nu t + phi), nu of its own",
            log_prior=EFFECT_SETTINGS.rare,
        ),
        *(
            Effect(
                f"{channel}_{HUM}",
                "sensor",
                "read off",
                (FreeParameter("amplitude", scale, mean=math.log(0.02), std=1.5, bounds=(-12.0, 2.0)),),
                "A cos(2 pi nu t + phi) on the reading, nu that of the mains most often",
                exact=True,
                quantity=scale,
                log_prior=EFFECT_SETTINGS.rare,
            )
            for channel, scale in PICKED_UP
        ),
        *differing,
        *scheduled,
        *following,
    )
