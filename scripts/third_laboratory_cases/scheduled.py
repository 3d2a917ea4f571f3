"""Cases of laws that follow a channel, and of a channel that no law follows."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.case import Case, Channel, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.hysteresis import Loop, bouc_wen
from third_laboratory_cases.models import sliding
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.prescribed import Component, SmallForces, Stroke
from third_laboratory_cases.signals import (
    chirp,
    hall_temperature,
    noise_band,
    random_steps,
    shuffled_levels,
    smooth_walk,
    stepped_sine,
    warming,
)
from third_laboratory_cases.units import (
    MILLIMETRE,
    acceleration,
    component,
    displacement,
    force,
    load_on,
    of_joint,
    oscillator,
    schedule,
    stroke,
)


def voltage(rng: np.random.Generator, t: Array, stem: str) -> Array:
    """Voltage of the magnetorheological damper [V]: in steps, and on validation smooth."""
    steps = shuffled_levels([0.0, 0.6, 1.2, 1.8, 2.4], 1.7, 0.06)
    return (smooth_walk(0.0, 2.3, 5.0) if stem == "validation" else steps)(rng, t, stem)


def magnetorheological(s: Stroke) -> Array:
    """Bouc-Wen force [N] whose yield force rises with the voltage."""
    return (40.0 + 95.0 * s.schedule) * bouc_wen(Loop(0.0013, 0.55, 1.6), s.x)


def orifice(s: Stroke) -> Array:
    """Quadratic damping [N] that falls with the temperature of the oil."""
    return 5600.0 * (1.0 - 0.0125 * (s.schedule - 22.0)) * s.v * np.abs(s.v)


SCHEDULED = (
    Case(
        name="third_sched_brake_normal_force",
        rig="sdof",
        rate=500,
        substeps=10,
        specimen=Driven(
            nominal=Oscillator(6.2, 9.0, 5200.0),
            missing={"scheduled_friction": 0.07},
            background=Background(0.04, 11.5, 0.03, swing=0.01, swing_frequency=0.06),
            schedule=smooth_walk(8.0, 62.0, 9.0),
        ),
        records=(
            Record("identification", 25, noise_band(1, 9), 0.012),
            Record("identification_2", 20, chirp(1.5, 9), 0.012),
            Record("validation", 20, noise_band(1, 9), 0.013),
        ),
        parameters=oscillator(),
        channels={
            "force": force(), "displacement": displacement(), "acceleration": acceleration(),
            "normal_force": schedule("N", 0.01),
        },
        right=[["scheduled_coulomb_friction"]],
        also=["carried_mass", "stiffness_drift"],
        why="Brake pad on a slide: friction 0.07 times the normal force (8 to 62 N), which is a channel. Small besides: a small "
        "mass on a spring (11.5 Hz), stiffness swings slowly.",
    ),
    Case(
        name="third_sched_mr_voltage",
        rig="damper",
        rate=1000,
        substeps=5,
        specimen=Component(
            stiffness=4500.0,
            damping=1100.0,
            coulomb=0.0,
            missing=magnetorheological,
            background=SmallForces(period=0.017, swing=0.0, ageing=0.004),
            schedule=voltage,
        ),
        records=(
            Record("identification", 17, stepped_sine([0.7, 1.5, 1.5, 3], [1, 1, 0.4, 0.5]), 0.016),
            Record("identification_2", 15, noise_band(0.4, 3), 0.016),
            Record("validation", 15, noise_band(0.4, 3), 0.015),
        ),
        parameters=component({"stiffness": 0.06, "damping": 0.1}),
        channels={
            "displacement": stroke(0.00005), "force": Channel("force", "kN", 0.006, scale=1e-3),
            "voltage": schedule("V", 0.001),
        },
        understated=2.0,
        right=[["scheduled_bouc_wen_hysteresis"]],
        also=["coulomb_friction"],
        honest="unknown; scheduled_presliding_friction or another scheduled hysteresis in a declared set with it",
        why="Magnetorheological damper on a machine; Bouc-Wen (n = 1.6, yield 1.3 mm) of limit 40.0 N + 95.0 N/V times the "
        "voltage, 0 to 2.4 V, which is a channel. The nominal model has gas spring and oil. Small besides: friction along the "
        "stroke.",
    ),
    Case(
        name="third_sched_oil_warms",
        rig="damper",
        rate=200,
        substeps=10,
        specimen=Component(
            stiffness=2500.0,
            damping=900.0,
            coulomb=45.0,
            missing=orifice,
            background=SmallForces(period=0.021, swing=0.5, swing_frequency=0.05),
            schedule=warming(
                {
                    "identification": (21.0, 66.0, 18.0),
                    "identification_2": (38.0, 58.0, 15.0),
                    "validation": (28.0, 62.0, 22.0),
                }
            ),
        ),
        records=(
            Record(
                "identification", 60, stepped_sine([1, 2, 1.5, 3, 1, 2.5], [1, 0.8, 0.6, 0.5, 1, 0.7]), 0.03
            ),
            Record("identification_2", 45, noise_band(0.3, 3), 0.035),
            Record("validation", 50, noise_band(0.3, 3), 0.035),
        ),
        parameters=component({"stiffness": 0.05, "damping": 0.12, "coulomb": 0.2}),
        channels={
            "displacement": stroke(0.00006), "force": Channel("force", "N", 0.006),
            "oil_temperature": schedule("degC", 0.004),
        },
        right=[["scheduled_quadratic_damping"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Damper whose oil warms: orifice damping 5600 N s2/m2 at 22 degC, 1.25 % less per degree, missing; oil temperature "
        "(21 to 66 degC) is a channel. Small besides: seal friction along the stroke, spring swings slowly.",
    ),
    Case(
        name="third_sched_air_bumper_pressure",
        rig="carriage.xml",
        rate=1000,
        substeps=6,
        specimen=Driven(
            nominal=Oscillator(4.0, 11.0, 2600.0),
            missing={"scheduled_stop": 900.0, "gap_above": 0.004},
            background=Background(
                swing=0.012, swing_frequency=0.05, stroke_friction=1.0, stroke_period=0.006
            ),
            schedule=shuffled_levels([1.5, 3.0, 4.5, 6.0], 2.5, 0.3),
        ),
        background_share=0.025,
        records=(
            Record("identification", 20, noise_band(1, 9), 0.014),
            Record("identification_2", 18, chirp(1.5, 9), 0.013),
            Record("validation", 18, noise_band(1, 9), 0.014),
        ),
        parameters=oscillator(body="carriage", joint="guide"),
        channels={
            "drive": Channel("load", "N", 0.004, load_on("shaker")),
            "position": Channel("displacement", "mm", 0.004, of_joint("guide", "position"), MILLIMETRE),
            "top_acc": Channel("acceleration", "m/s^2", 0.01, of_joint("guide", "acceleration")),
            "bumper_pressure": schedule("bar", 0.005),
        },
        understated=None,
        model=sliding("carriage", "guide", "shaker"),
        right=[["scheduled_one_sided_stop"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Carriage that runs into an air bumper at 4 mm; its stiffness is 900 N/m per bar, pressure (1.5 to 6 bar, set in "
        "steps) is a channel. Small besides: friction along the stroke, stiffness swings slowly.",
    ),
    Case(
        name="third_sched_decoy_temperature",
        rig="sdof",
        rate=250,
        substeps=16,
        specimen=Driven(
            nominal=Oscillator(3.1, 5.0, 1900.0),
            missing={"friction": 4.2},
            background=Background(0.04, 9.0, 0.03, swing=0.01, swing_frequency=0.07),
            schedule=hall_temperature,
        ),
        records=(
            Record("identification", 30, noise_band(1, 8), 0.014),
            Record("identification_2", 25, chirp(1, 8), 0.012),
            Record("validation", 25, random_steps(0.7), 0.014),
        ),
        parameters=oscillator(stiffness=0.025),
        channels={
            "force": force(), "displacement": displacement(), "hall_temperature": schedule("degC", 0.005),
        },
        understated=3.0,
        right=[["coulomb_friction"]],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown; a declared set that holds it; wrong is any scheduled_ name alone",
        why="Decoy: Coulomb friction of 4.2 N, constant; a temperature is recorded as a scheduling channel and has no influence "
        "at all. Small besides: a small mass on a spring (9 Hz), stiffness swings slowly.",
    ),
)  # fmt: skip
