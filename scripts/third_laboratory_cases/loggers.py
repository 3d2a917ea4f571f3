"""Cases of loggers that fail, and of units and delays that nobody stated."""

from __future__ import annotations

from third_laboratory_cases.case import Case, Channel, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.logger import Dropouts, Jitter, LostRows, Spikes
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.signals import chirp, noise_band, random_steps
from third_laboratory_cases.units import acceleration, displacement, force, oscillator

LOGGERS = (
    Case(
        name="third_logger_dropouts_spikes",
        rig="sdof",
        rate=500,
        substeps=10,
        specimen=Driven(
            nominal=Oscillator(2.4, 5.5, 1500.0),
            missing={"stop_above": 700.0, "gap_above": 0.003, "stop_below": 700.0, "gap_below": 0.003},
            background=Background(
                swing=0.01, swing_frequency=0.07, stroke_friction=0.5, stroke_period=0.005
            ),
        ),
        records=(
            Record("identification", 22, noise_band(1, 9), 0.012),
            Record("identification_2", 18, chirp(1.5, 8), 0.011),
            Record("validation", 20, noise_band(1, 9), 0.012),
        ),
        parameters=oscillator(),
        channels={
            "force": force(), "displacement": Channel("displacement", "m", 0.004),
            "acceleration": acceleration(),
        },
        faults=(
            Dropouts("displacement", 7),
            Spikes("displacement", 4, 5.0, 11.0),
            Spikes("acceleration", 7, 5.0, 11.0),
        ),
        right=[["gap"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Gap of 700 N/m beyond 3 mm, and a bad logger: in each record seven dropouts to zero (4 to 29 samples) of the "
        "displacement, four spikes there and seven in the acceleration. Small besides: friction along the stroke, stiffness "
        "swings slowly.",
    ),
    Case(
        name="third_logger_jitter_quiet",
        rig="sdof",
        rate=500,
        substeps=10,
        specimen=Driven(
            nominal=Oscillator(11.0, 26.0, 11500.0),
            background=Background(0.03, 13.0, 0.04, swing=0.008, swing_frequency=0.06),
        ),
        background_share=0.02,
        records=(
            Record("identification", 20, noise_band(1, 12), 0.006),
            Record("identification_2", 15, random_steps(0.6), 0.006),
            Record("validation", 20, chirp(1, 12), 0.006),
        ),
        parameters=oscillator(0.012, 0.2, 0.025),
        channels={"force": force(), "displacement": displacement(0.005), "acceleration": acceleration()},
        faults=(Jitter(0.06), LostRows(5)),
        right=[[]],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown with a small share; carried_mass or stiffness_drift (there, small)",
        why="Nothing of size is missing. The clock of the logger jitters (6 % of a sample; the time column holds the true stamps) "
        "and five rows of each record are lost. Small besides: a small mass on a spring (13 Hz), stiffness swings slowly, 2 % "
        "together.",
    ),
    Case(
        name="third_logger_unit_g",
        rig="sdof",
        rate=400,
        substeps=12,
        specimen=Driven(
            nominal=Oscillator(5.0, 14.0, 4200.0),
            background=Background(0.03, 10.0, 0.04, stroke_friction=0.5, stroke_period=0.007),
        ),
        background_share=0.025,
        records=(
            Record("identification", 20, noise_band(1, 10), 0.01),
            Record("identification_2", 15, chirp(1, 10), 0.01),
            Record("validation", 20, noise_band(1, 10), 0.01),
        ),
        parameters=oscillator(stiffness=0.025),
        channels={
            "force": force(), "displacement": displacement(),
            "acceleration": Channel("acceleration", "m/s^2", 0.01, scale=1.0 / 9.80665),
        },
        right=[["acceleration_gain_error"]],
        also=["carried_mass", "coulomb_friction"],
        limit=0.2,
        honest="best: refused before any fit, the message naming the acceleration and its unit; unknown",
        refusal=["'acceleration'", '"unit": "g"'],
        why="Nothing of size is missing in the mechanics; the column of the acceleration is in g, nominal.json says m/s^2 (a "
        "factor 9.81). A refusal that names the unit is right; by --anyway an acceleration_gain_error. Small besides: a small "
        "mass on a spring (10 Hz), friction along the stroke.",
    ),
    Case(
        name="third_logger_late_accelerometer",
        rig="sdof",
        rate=1000,
        substeps=6,
        specimen=Driven(
            nominal=Oscillator(7.5, 12.0, 4700.0),
            missing={"quadratic_damping": 60.0},
            background=Background(0.03, 9.5, 0.04, swing=0.01, swing_frequency=0.06),
        ),
        background_share=0.025,
        records=(
            Record("identification", 20, chirp(1, 9), 0.02),
            Record("identification_2", 16, noise_band(1, 8), 0.02),
            Record("validation", 20, noise_band(1, 8), 0.022),
        ),
        parameters=oscillator(),
        channels={
            "force": force(), "displacement": Channel("displacement", "m", 0.004),
            "acceleration": Channel("acceleration", "m/s^2", 0.01, late=0.009),
        },
        understated=2.0,
        faults=(Spikes("acceleration", 5, 8.0, 8.0),),
        right=[["quadratic_damping", "acceleration_delay"]],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown; one of the two and not complete; a refusal that names the late channel",
        why="Quadratic damping of 60 N s2/m2, and a wireless accelerometer that comes 9 ms late, with five spikes in each record. "
        "Small besides: a small mass on a spring (9.5 Hz), stiffness swings slowly.",
    ),
)  # fmt: skip
