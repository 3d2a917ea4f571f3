"""Cases of an element that is missing: a stop on either side, a stop on one side, a drag."""

from __future__ import annotations

import math

from third_laboratory_cases.case import Parameter
from third_laboratory_cases.units import DEGREE, MILLIMETRE, PRESCRIBED, load_on

from fourth_laboratory_cases.axis import Axis, Background, Missing
from fourth_laboratory_cases.case import Case, Channel, Clock, Freeze, Record
from fourth_laboratory_cases.grading import FRICTION, SETS, SLOW, UNKNOWN
from fourth_laboratory_cases.models import ARM, pendulum, seat, torsion_bar
from fourth_laboratory_cases.signals import added, bursts, still, sweeps, tones
from fourth_laboratory_cases.specimens import OnAxis, Pendulum
from fourth_laboratory_cases.units import acceleration, position, sliding, turning, velocity

SHAFT_JAW = Case(
    name="fourth_shaft_jaw",
    rig="shaft.xml",
    clock=Clock(500, 20),
    specimen=OnAxis(
        properties=Axis(0.045, 38.0, 0.075),
        missing=Missing(
            jaw_stiffness=42.0, jaw_clearance=0.0115, jaw_centre=0.0008, jaw_ratio=1.04, jaw_damping=0.012
        ),
        background=Background(
            hidden=0.012,
            hidden_frequency=41.0,
            hidden_ratio=0.012,
            friction=0.008,
            creep=0.02,
            wavelength=0.02,
            drift=0.013,
            settling=5.0,
        ),
    ),
    records=(
        Record("identification", 11, tones(0.42, 0.6, 13, 26, tilt=0.3, swell=0.5)),
        Record(
            "validation",
            10,
            added(sweeps(0.5, 1.0, 10, 2, breath=0.45), tones(0.12, 0.6, 13, 12, tilt=0.2, swell=0.2)),
        ),
    ),
    parameters=turning("disc", "torsion_bar", 0.015, 0.02, 0.2),
    channels={
        "drive_torque": Channel("load", "N m", 0.004, load_on("drive")),
        "twist": position("torsion_bar", "deg", 0.006, DEGREE),
        "disc_acc": acceleration("torsion_bar", "rad/s^2", 0.012),
    },
    judged=("displacement", "acceleration"),
    freeze=Freeze("disc_acc", "identification", 0.57, 14),
    model=torsion_bar,
    right=[["gap"], ["asymmetric_gap"]],
    also=[*FRICTION, *SLOW],
    why="A jaw coupling to a clamped brake, in parallel to the torsion bar, touches beyond 0.66 degrees either way (the sides differ by "
    "4 % and the middle lies 0.05 degrees off).",
    acceptable=["gap", "asymmetric_gap", SETS],
    honest=[UNKNOWN, "gap with stiffness_error or cubic_stiffness beside it, in a set"],
    wrong="cubic_stiffness, one_sided_stop, friction or a sensor as the complete explanation; none.",
)
SEAT_SHAKER = Case(
    name="fourth_seat_shaker",
    rig="seat.xml",
    clock=Clock(250, 40),
    specimen=OnAxis(
        properties=Axis(68.0, 5400.0, 330.0),
        missing=Missing(
            block_stiffness=11500.0,
            block_clearance=0.015,
            block_progression=4.0,
            block_damping=45.0,
            block_onset=0.002,
        ),
        background=Background(
            hidden=0.02,
            hidden_frequency=11.5,
            hidden_ratio=0.06,
            friction=3.0,
            creep=0.01,
            wavelength=0.05,
            drift=-0.015,
            settling=6.0,
        ),
        shaken=True,
    ),
    records=(
        Record("identification", 15, tones(0.024, 0.6, 4.0, 22, tilt=1.0, swell=0.5)),
        Record("identification_2", 15, bursts(0.036, 0.7, 3.0, 14)),
        Record("validation", 15, tones(0.022, 0.6, 4.2, 28, tilt=0.9, swell=0.5)),
    ),
    parameters=sliding("seat", "suspension", 0.015, 0.03, 0.1),
    channels={
        "platform_acc": Channel("base", "m/s^2", 0.003, {**PRESCRIBED, "sensor": "platform_acc"}),
        "seat_acc": Channel("absolute_acceleration", "m/s^2", 0.01, {"sensor": "seat_acc"}),
        "travel": position("suspension", "mm", 0.007, MILLIMETRE),
    },
    judged=("displacement", "absolute_acceleration"),
    true_times=True,
    freeze=Freeze("travel", "identification_2", 0.3, 7),
    model=seat,
    right=[["one_sided_stop"]],
    also=[*FRICTION, *SLOW, "asymmetric_gap"],
    why="A rubber block under the suspension is met 15 mm below the height of ride (11.5 N/mm, a little progressive and lossy, never "
    "pulls).",
    acceptable=["one_sided_stop", f"{SETS} (with asymmetric_gap)"],
    honest=["asymmetric_gap alone", UNKNOWN],
    wrong="gap (symmetric), quadratic_stiffness, cubic_stiffness or a sensor as the complete explanation; none.",
)
PADDLE_PENDULUM = Case(
    name="fourth_paddle_pendulum",
    rig="pendulum.xml",
    clock=Clock(250, 20),
    specimen=Pendulum(
        mass=0.62,
        arm=ARM,
        inertia=0.0016,
        damping=0.0009,
        missing=Missing(drag=0.00125),
        background=Background(
            hidden=0.008,
            hidden_frequency=9.0,
            hidden_ratio=0.02,
            friction=0.0011,
            creep=0.05,
            wavelength=0.5,
            drift=0.006,
            settling=8.0,
        ),
    ),
    records=(
        Record("identification", 15, still, math.radians(58), 0.6),
        Record("identification_2", 12, still, math.radians(27), 0.43),
        Record("validation", 15, still, math.radians(-47), 0.772),
    ),
    parameters={
        "mass:pendulum": Parameter("mass", 0.005, "kg"),
        "inertia:pendulum": Parameter("inertia", 0.06, "kg m^2"),
        "damping:pivot": Parameter("damping", 0.25, "N m s/rad"),
    },
    channels={
        "torque": Channel("load", "N m", 0.0, load_on("pivot_motor")),
        "angle": position("pivot", "deg", 0.005, DEGREE),
        "rate": velocity("pivot", "deg/s", 0.008, DEGREE),
    },
    judged=("displacement", "velocity"),
    understated=None,
    told={"starts_in_motion": True},
    model=pendulum,
    right=[["quadratic_damping"], ["power_law_damping"]],
    also=[*FRICTION, *SLOW],
    why="Drag of a paddle in air, 1.25 mN m s^2/rad^2, on a pendulum let go at 27 to 58 degrees; a power law with an exponent near two "
    "is the same law.",
    acceptable=["quadratic_damping", "power_law_damping with an exponent near 2", SETS],
    honest=["damping_error in a set", UNKNOWN],
    wrong="Friction, damping_error or inertia as the complete explanation; none.",
)
ELEMENTS = (SHAFT_JAW, SEAT_SHAKER, PADDLE_PENDULUM)
"""All of them."""
