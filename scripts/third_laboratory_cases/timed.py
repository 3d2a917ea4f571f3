"""Cases of forces that act at certain times and that no channel tells."""

from __future__ import annotations

from third_laboratory_cases.case import Case, Channel, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.models import turning
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.signals import blower, chirp, noise_band, pusher, random_steps
from third_laboratory_cases.units import (
    DEGREE,
    acceleration,
    displacement,
    force,
    load_on,
    of_joint,
    oscillator,
    rotor,
)

TIMED = (
    Case(
        name="third_timed_pusher",
        rig="sdof",
        rate=250,
        substeps=16,
        specimen=Driven(
            nominal=Oscillator(15.0, 33.0, 8800.0),
            hidden=pusher,
            background=Background(0.03, 9.0, 0.04, swing=0.01, swing_frequency=0.05),
        ),
        records=(
            Record("identification", 40, noise_band(0.5, 7), 0.007),
            Record("identification_2", 30, chirp(0.8, 7), 0.006),
            Record("validation", 35, noise_band(0.5, 7), 0.007),
        ),
        parameters=oscillator(),
        channels={"force": force(), "displacement": displacement(0.005), "acceleration": acceleration()},
        understated=None,
        right=[["timed_force"]],
        also=["carried_mass", "stiffness_drift"],
        why="A pneumatic pusher that nobody told the model of presses with 28 N for 0.9 s every 5 s. Small besides: a small mass "
        "on a spring (9 Hz), stiffness swings slowly.",
    ),
    Case(
        name="third_timed_blower",
        rig="mast.xml",
        rate=200,
        substeps=20,
        specimen=Driven(
            nominal=Oscillator(0.85, 1.1, 260.0),
            hidden=blower(
                {
                    "identification": (7.4, 6.1),
                    "identification_2": (4.9, 4.2),
                    "identification_3": (11.8, 5.0),
                    "validation": (9.3, 5.6),
                }
            ),
            background=Background(0.03, 6.5, 0.04, stroke_friction=0.3, stroke_period=0.03),
        ),
        records=(
            Record("identification", 25, noise_band(0.5, 5), 0.06),
            Record("identification_2", 15, chirp(0.8, 5), 0.055),
            Record("identification_3", 20, random_steps(0.9), 0.06),
            Record("validation", 25, noise_band(0.5, 5), 0.06),
        ),
        parameters=rotor("mast", "pivot", inertia=0.01, damping=0.15, stiffness=0.02),
        channels={
            "motor_torque": Channel("load", "N m", 0.004, load_on("motor")),
            "angle": Channel("displacement", "deg", 0.005, of_joint("pivot", "position"), DEGREE),
        },
        understated=2.0,
        model=turning("mast", "pivot", "motor"),
        right=[["timed_force"]],
        also=["carried_mass", "coulomb_friction"],
        why="Mast on a pivot; in each record a blower pushes it once with 6.5 N m for 4 to 6 s, which no channel tells. Small "
        "besides: a little inertia on a spring (6.5 Hz), friction along the turn.",
    ),
)
