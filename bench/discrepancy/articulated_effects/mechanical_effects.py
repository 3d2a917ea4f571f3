"""Effects at a joint of an articulated model and at the body that it moves: friction, damping, stops, inertia."""

from __future__ import annotations

import math

from bench.discrepancy.articulated_effects.effect import SETTINGS, ArticulatedEffect
from bench.discrepancy.articulated_effects.slot_setters import (
    SlotValues,
    added,
    carried,
    in_gear,
    stop,
    written,
)
from bench.discrepancy.effects.effect import FreeParameter, log_grid
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings

LIMIT = FreeParameter("limit", "force", **SETTINGS.positive)
LIMIT_0 = FreeParameter(
    "limit_0", "force", mean=math.log(0.05), std=1.5, bounds=(-9.0, 4.0), grid=log_grid(0.05)
)
GROWTH = FreeParameter(
    "growth", "1/force", mean=math.log(0.03), std=1.5, bounds=(-9.0, 1.0), grid=log_grid(0.03, 0.2)
)
STRIBECK_VELOCITY = FreeParameter(
    "velocity", "velocity", mean=math.log(0.1), std=1.0, bounds=(-6.0, 0.7), grid=log_grid(0.03, 0.1, 0.3)
)


def _part(name: str, middle: float, *grid: float) -> FreeParameter:
    """Friction as a part of a torque that a gear carries: a middle within a factor of some seven with 95 %; a gear leaves something.

    It goes no further up from there than is believed of a stated number.
    """
    mean, *points = (math.log(part / (1.0 - part)) for part in (middle, *grid))
    return FreeParameter(
        name,
        mean=mean,
        std=1.0,
        bounds=(-7.0, mean + JudgementSettings().strained),
        grid=tuple(points),
        unit="1",
        share=True,
    )


def _of_one_torque(v: SlotValues) -> SlotValues:
    """Friction that grows with one torque as that in a gear."""
    return {"limit_0": v["limit_0"], "mu_drive" if v["of_actuator"] > 0.5 else "mu_weight": v["mu"]}


MECHANICAL_EFFECTS: tuple[ArticulatedEffect, ...] = (
    ArticulatedEffect(
        "coulomb_friction",
        "friction",
        "joint",
        (LIMIT,),
        "f = Fc sgn(v), set-valued at rest",
        written(LIMIT="limit"),
    ),
    ArticulatedEffect(
        "stribeck_friction",
        "friction",
        "joint",
        (
            LIMIT,
            FreeParameter(
                "rise", mean=math.log(0.7), std=0.7, bounds=(-3.0, 2.5), grid=log_grid(0.7), unit="1"
            ),
            STRIBECK_VELOCITY,
        ),
        "f = Fc (1 + rise exp(-(v/vs)^2)) sgn(v)",
        written(LIMIT="limit", RISE="rise", STRIBECK="velocity"),
        contains={"coulomb_friction": lambda v: {"limit": v["limit"]}},
    ),
    ArticulatedEffect(
        "presliding_friction",
        "friction",
        "joint",
        (
            LIMIT,
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(3.0),
                std=1.5,
                bounds=(-4.0, 7.0),
                grid=log_grid(0.3, 1.0, 3.0, 10.0, 30.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.1),
                std=1.5,
                bounds=(-8.0, 3.0),
                grid=log_grid(0.03, 0.3),
            ),
        ),
        "f = s0 z + s1 z', z' = v - s0 |v| z / Fc (LuGre; Dahl for s1 = 0)",
        written(BRISTLE_LIMIT="limit", BRISTLE_STIFFNESS="stiffness", BRISTLE_DAMPING="damping"),
    ),
    ArticulatedEffect(
        "load_dependent_friction",
        "friction",
        "joint",
        (
            LIMIT_0,
            _part("mu", 0.1, 0.1),
            FreeParameter("of_actuator", fixed=True, signed=True, grid=(0.0, 1.0), unit="1"),
        ),
        "f = (F0 + mu |torque carried|) sgn(v), that of the link, or of the actuator",
        carried,
        contains={"coulomb_friction": lambda v: {"limit_0": v["limit"]}},
    ),
    ArticulatedEffect(
        "gear_friction",
        "friction",
        "joint",
        (
            LIMIT_0,
            _part("mu_drive", 0.1, 0.05, 0.3),
            _part("mu_weight", 0.03, 0.03),
            _part("mu_rest", 0.1, 0.1, 0.3),
            STRIBECK_VELOCITY,
            GROWTH,
        ),
        "f = (F0 + |mu_d Td + mu_w Tw| + mu_r |Tw| exp(-(v/vs)^2) + growth Td^2) sgn(v), Td of the drive, Tw what the link weighs",
        in_gear,
        contains={
            "coulomb_friction": lambda v: {"limit_0": v["limit"]},
            "load_dependent_friction": _of_one_torque,
        },
    ),
    ArticulatedEffect(
        "coupled_friction",
        "friction",
        "pair",
        (
            LIMIT,
            FreeParameter("damping", "force/velocity", mean=math.log(0.1), std=1.5, bounds=(-8.0, 3.0)),
            FreeParameter("sense", fixed=True, signed=True, grid=(1.0, -1.0), unit="1"),
        ),
        "f = Fc sgn(w) + c w on both joints, w = v1 + sense v2: one motor or gear turns with both",
        written(PAIR_LIMIT="limit", PAIR_DAMPING="damping", PAIR_SENSE="sense"),
    ),
    ArticulatedEffect(
        "force_offset",
        "offset",
        "joint",
        (FreeParameter("force", "force", **SETTINGS.signed),),
        "a constant torque on the joint",
        added(OFFSET="force"),
    ),
    ArticulatedEffect(
        "damping_error",
        "damping",
        "joint",
        (FreeParameter("added", "force/velocity", signed=True, mean=0.0, std=0.3, bounds=(-30.0, 30.0)),),
        "f = dc v, beyond the stated uncertainty",
        added(DAMPING="added"),
    ),
    ArticulatedEffect(
        "quadratic_damping",
        "damping",
        "joint",
        (FreeParameter("c2", "force/velocity/velocity", **SETTINGS.positive),),
        "f = c2 |v| v",
        written(QUADRATIC="c2"),
    ),
    ArticulatedEffect(
        "one_sided_stop",
        "stop",
        "joint",
        (
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(3.0),
                std=1.5,
                bounds=(-4.0, 7.0),
                grid=log_grid(3.0),
            ),
            FreeParameter(
                "position",
                "position",
                signed=True,
                mean=0.0,
                std=0.7,
                bounds=(-1.2, 1.2),
                grid=(-0.8, -0.5, -0.2, 0.2, 0.5, 0.8),
            ),
            FreeParameter("damping", "force/velocity", mean=math.log(0.05), std=1.5, bounds=(-9.0, 3.0)),
            FreeParameter("side", fixed=True, signed=True, grid=(1.0, -1.0), unit="1"),
        ),
        "f = k d + c d', d = side (q - q0) > 0",
        stop,
        coordinate="position",
    ),
    ArticulatedEffect(
        "surface_contact",
        "stop",
        "end",
        (
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(100.0),
                std=1.5,
                bounds=(0.0, 10.0),
                unit="N/m",
            ),
            FreeParameter(
                "height",
                "position",
                signed=True,
                mean=0.1,
                std=0.2,
                bounds=(-0.1, 1.0),
                grid=(0.02, 0.05, 0.1, 0.2, 0.4),
                unit="m",
            ),
            FreeParameter(
                "damping", "force/velocity", mean=math.log(0.3), std=1.5, bounds=(-9.0, 5.0), unit="N s/m"
            ),
        ),
        "f = k d + c d' upwards on the lowest point of the body, d = h - z > 0: a table, the floor",
        written(SURFACE="stiffness", SURFACE_AT="height", SURFACE_DAMPING="damping"),
        coordinate="height",
    ),
    ArticulatedEffect(
        "armature_error",
        "inertia",
        "joint",
        (FreeParameter("added", "inertia", signed=True, mean=0.0, std=1.0, bounds=(-1.0, 50.0)),),
        "tau = dJ q'', beyond the stated uncertainty",
        added(INERTIA="added"),
    ),
    ArticulatedEffect(
        "mass_error",
        "inertia",
        "body",
        (FreeParameter("payload", "mass", signed=True, mean=0.0, std=0.3, bounds=(-0.9, 10.0), unit="kg"),),
        "a mass at the tip of the body",
    ),
    ArticulatedEffect(
        "com_error",
        "inertia",
        "body",
        tuple(
            FreeParameter(
                f"shift_{axis}", "reach", signed=True, mean=0.0, std=0.1, bounds=(-3.0, 3.0), unit="m"
            )
            for axis in "xyz"
        ),
        "the centre of mass elsewhere in the body",
    ),
    ArticulatedEffect(
        "gravity_compensation",
        "inertia",
        "body",
        (FreeParameter("share", signed=True, mean=0.0, std=0.5, bounds=(-2.0, 2.0), unit="1"),),
        "a part of the body's weight is carried otherwise: by a counterbalance, or by the controller",
    ),
    ArticulatedEffect(
        "base_tilt",
        "inertia",
        "base",
        tuple(
            FreeParameter(f"tilt_{axis}", signed=True, mean=0.0, std=0.1, bounds=(-1.5, 1.5), unit="rad")
            for axis in "xy"
        ),
        "the base leans: gravity turned in its frame",
    ),
)
"""Effects at joints and bodies."""
