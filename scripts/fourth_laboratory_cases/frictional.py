"""Cases of friction: of wipers and seals on a guide, and of strands that slip on each other."""

from __future__ import annotations

import math

from third_laboratory_cases.case import Parameter
from third_laboratory_cases.units import MILLIMETRE, PRESCRIBED, load_on, of_joint

from fourth_laboratory_cases import carriage, testing_machine
from fourth_laboratory_cases.case import Case, Channel, Clock, Freeze, Record
from fourth_laboratory_cases.grading import SETS, UNKNOWN
from fourth_laboratory_cases.models import linear_guide
from fourth_laboratory_cases.signals import added, sine, sweeps, tones
from fourth_laboratory_cases.specimens import InMachine, OnGuide
from fourth_laboratory_cases.units import KILONEWTON

POSITIONS = (tones(0.045, 0.12, 0.9, 9, tilt=0.8, swell=0.5), tones(0.006, 1.0, 2.4, 6, swell=0.4))
"""What is asked of the carriage in either record."""
STIFFNESS = 62e3
"""Of the isolator [N/m]."""
GUIDE_AXIS = Case(
    name="fourth_guide_axis",
    rig="guide.xml",
    clock=Clock(500, 40),
    specimen=OnGuide(
        properties=carriage.Carriage(mass=7.4, damping=14.0, friction=8.5, excess=0.7, fading=0.035),
        background=carriage.Background(
            hidden=0.1,
            hidden_frequency=33.0,
            hidden_ratio=0.02,
            variation=0.04,
            wavelength=0.037,
            drift=0.02 / 14,
            cogging=0.3,
            pitch=0.024,
        ),
        loop=carriage.PositionLoop(every=10, stiffness=9000.0, damping=260.0, lag=1 / (2 * math.pi * 180)),
    ),
    records=(
        Record("identification", 14, added(*POSITIONS, rise=1.6)),
        Record("validation", 13, added(*POSITIONS, sine(0.05, 0.21, rise=1.0), rise=1.6)),
    ),
    parameters={
        "mass:carriage": Parameter("mass", 0.01, "kg"),
        "damping:rail": Parameter("damping", 0.12, "N s/m"),
    },
    channels={
        "motor_force": Channel("force", "N", 0.12, load_on("linear_motor"), absolute=True),
        "position": Channel("displacement", "mm", 4e-6, of_joint("rail", "position"), MILLIMETRE, True),
        "speed": Channel("velocity", "mm/s", 6e-4, of_joint("rail", "velocity"), MILLIMETRE, True),
    },
    judged=("displacement", "velocity"),
    freeze=Freeze("speed", "validation", 0.41, 12),
    told={"places": ["rail"]},
    model=linear_guide,
    right=[["stribeck_friction"]],
    also=["coulomb_friction", "presliding_friction", "cogging", "carried_mass", "damping_error"],
    why="Wipers and seals: 8.5 N of dry friction, 70 % more at rest, falling off over 35 mm/s (4 % variation along the rail, cogging of "
    "0.3 N, a cable chain as a hidden mass). The carriage ran in its position loop; nothing holds it.",
    acceptable=["stribeck_friction", SETS],
    honest=["coulomb_friction or presliding_friction alone", UNKNOWN],
    wrong="mass_error, damping_error, cogging or a sensor as the complete explanation; none.",
)
WIRE_ROPE = Case(
    name="fourth_wire_rope",
    rig="damper",
    clock=Clock(400, 25),
    specimen=InMachine(
        properties=testing_machine.Isolator(
            stiffness=STIFFNESS,
            damping=380.0,
            friction=6.0,
            slip_stiffness=88e3,
            slip_limit=105.0,
            slip_exponent=1.35,
            slip_skew=0.35,
        ),
        background=testing_machine.Background(
            compliance=1 / (80 * STIFFNESS),
            drift=-0.015 / 14,
            variation=0.25,
            wavelength=0.0021,
            fixture=0.5,
            cell_frequency=62.0,
            cell_ratio=0.12,
            friction_share=2.0,
        ),
    ),
    records=(
        Record("identification", 15, tones(2.2e-3, 0.3, 3.2, 14, tilt=0.7, swell=0.55)),
        Record("identification_2", 8, sine(4.2e-3, 0.8, rise=0.8, decay=3.5)),
        Record(
            "validation",
            14,
            added(sweeps(3.2e-3, 0.35, 3.0, 1.5, breath=0.6), tones(0.7e-3, 0.3, 2, 6, tilt=0.5, swell=0.2)),
        ),
    ),
    parameters={
        "stiffness": Parameter("stiffness", 0.04, "N/mm", 1e-3),
        "damping": Parameter("damping", 0.15, "N s/mm", 1e-3),
        "coulomb": Parameter("coulomb", 0.25, "N"),
    },
    channels={
        "displacement": Channel("displacement", "mm", 0.0015, PRESCRIBED, MILLIMETRE),
        "force": Channel("force", "kN", 0.007, scale=KILONEWTON),
    },
    judged=("force",),
    understated=None,
    jitter=0.012,
    freeze=Freeze("force", "identification", 0.63, 9),
    right=[["bouc_wen_hysteresis"]],
    also=[
        "coulomb_friction",
        "stribeck_friction",
        "presliding_friction",
        "backlash_friction",
        "stiffness_drift",
        "stiffness_error",
    ],
    why="Strands of a wire-rope isolator that slip on each other: Bouc-Wen, 88 N/mm at first, a limit of 105 N, n 1.35. Besides a "
    "compliant frame (1/80), softening of 1.5 %, friction along the stroke twice the stated one, a load cell with a resonance at 62 Hz, "
    "0.5 kg of fixture.",
    usual_background=False,
    acceptable=["bouc_wen_hysteresis", SETS],
    honest=["presliding_friction or backlash_friction alone", UNKNOWN],
    wrong="viscoelastic_relaxation, coulomb_friction alone, damping_error or a delay as the complete explanation; none.",
)
FRICTIONAL = (GUIDE_AXIS, WIRE_ROPE)
"""Both of them."""
