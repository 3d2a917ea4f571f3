"""Effects that no grid can hold: what they are is read off the records before they are fitted, so that each record has one of its own.

They stand in the catalogue by name, family and equation, so that they can be asked for, left out and scored like any other; what a fit
is made of comes from `search.timed_force` and `search.scheduled`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
)

TIMED = "timed_force"
DIFFERS = "record_dependent_friction"
FOLLOWED = "scheduled_"
"""What the name of an effect whose force follows a channel begins with."""
SENSITIVITY = FreeParameter("sensitivity", signed=True, mean=1.0, std=0.5, bounds=(-4.0, 6.0))
FORCE = FreeParameter("force", "force", signed=True, std=2.0, bounds=(-50.0, 50.0))
LIMIT = FreeParameter("friction_force", "force", mean=math.log(0.2), std=1.5, bounds=(-9.0, 5.0))


def schedulable(effect: Effect) -> bool:
    """Whether the force of an effect may follow a channel."""
    return effect.site == "joint" and effect.n_coordinates == 1 and not effect.modulated


def read_off(forces: Iterable[Effect]) -> tuple[Effect, ...]:
    """The effects that are read off the records.

    Args:
        forces: Those of the catalogue, of which some may follow a channel.
    """
    scheduled = (
        replace(
            effect, name=FOLLOWED + effect.name, site="read off", parameters=(*effect.parameters, SENSITIVITY),
            equation=f"(1 - kappa + kappa s/s0) f, s a channel; {effect.equation}", log_prior=effect.log_prior + 0.5 * EFFECT_SETTINGS.rare,
            law=None, limit=None, theta=None, rate_bound=None,
        )
        for effect in forces if schedulable(effect)
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
            DIFFERS,
            "friction",
            "read off",
            (LIMIT,),
            "f = Fc_i sgn(v) in record i",
            log_prior=EFFECT_SETTINGS.rare,
        ),
        *scheduled,
    )
