"""Cases of sensors that are late or wrongly calibrated."""

from __future__ import annotations

from third_laboratory_cases.units import MEASURED, MILLIMETRE

from fourth_laboratory_cases.axis import Axis, Background, Missing
from fourth_laboratory_cases.case import Case, Channel, Clock, Record
from fourth_laboratory_cases.grading import FRICTION, SETS, SLOW, UNKNOWN
from fourth_laboratory_cases.signals import bursts, sweeps, tones
from fourth_laboratory_cases.specimens import OnAxis
from fourth_laboratory_cases.units import GRAVITIES, MICROMETRE, oscillator

FLEXURE_STAGE = Case(
    name="fourth_flexure_stage",
    rig="sdof",
    clock=Clock(1000, 10),
    specimen=OnAxis(
        properties=Axis(1.15, 5200.0, 9.2),
        background=Background(
            hidden=0.010,
            hidden_frequency=81.0,
            hidden_ratio=0.015,
            friction=0.035,
            creep=0.006,
            wavelength=0.0007,
            drift=-0.010,
            settling=4.0,
        ),
        late=0.0058,
    ),
    records=(
        Record("identification", 7, bursts(2.6, 2, 45, 70)),
        Record("validation", 6, tones(1.7, 2, 40, 34, tilt=0.2, swell=0.35)),
    ),
    parameters=oscillator(0.01, 0.02, 0.12, "N/mm", 1e-3),
    channels={
        "force": Channel("load", "N", 0.003, MEASURED),
        "displacement": Channel("displacement", "um", 0.009, scale=MICROMETRE),
        "acceleration": Channel("acceleration", "m/s^2", 0.012),
    },
    judged=("displacement", "acceleration"),
    understated=1.6,
    jitter=0.02,
    true_times=True,
    right=[["displacement_delay"]],
    also=[*FRICTION, *SLOW, "displacement_filter", "displacement_lag"],
    why="The laser sensor of the displacement averages and transmits 5.8 ms late; accelerometer and force are on time.",
    acceptable=["displacement_delay", f"{SETS} (with displacement_filter or displacement_lag)"],
    honest=["displacement_filter or displacement_lag alone", UNKNOWN],
    wrong="acceleration_delay, actuator or force errors, friction or damping as the complete explanation; none.",
)
MOUNTED_PLATE = Case(
    name="fourth_mounted_plate",
    rig="sdof",
    clock=Clock(1000, 10),
    specimen=OnAxis(
        properties=Axis(14.2, 1.35e5, 175.0),
        missing=Missing(cubic_stiffness=9.0e9),
        background=Background(
            hidden=0.010,
            hidden_frequency=70.0,
            hidden_ratio=0.02,
            friction=0.9,
            creep=0.02,
            wavelength=0.0015,
            drift=-0.010,
            settling=3.0,
        ),
        gain=1.24,
    ),
    records=(
        Record("identification", 7, sweeps(72, 6, 34, 2.5, breath=0.5)),
        Record("validation", 6, tones(62, 5, 36, 30, tilt=0.3, swell=0.45)),
    ),
    parameters=oscillator(0.01, 0.025, 0.12, "kN/m", 1e-3),
    channels={
        "force": Channel("load", "N", 0.004, MEASURED),
        "displacement": Channel("displacement", "mm", 0.006, scale=MILLIMETRE),
        "acceleration": Channel("acceleration", "g", 0.008, scale=GRAVITIES),
    },
    judged=("displacement", "acceleration"),
    understated=2.0,
    right=[["cubic_stiffness", "acceleration_gain_error"]],
    also=[*FRICTION, *SLOW],
    why="Two effects: rubber mounts that stiffen (9e9 N/m^3), and an accelerometer whose sensitivity was entered wrongly, so that it "
    "reads 24 % too much.",
    acceptable=["both", "each in a set that holds it"],
    honest=["one of the two, called incomplete", "unknown"],
    wrong="One as the complete explanation; mass_error for the gain as complete; none.",
)
SENSORS = (FLEXURE_STAGE, MOUNTED_PLATE)
"""All of them."""
