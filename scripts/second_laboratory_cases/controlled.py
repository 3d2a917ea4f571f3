"""Cases of machines under control: a servo axis and a leg of a robot, known by their commands."""

from __future__ import annotations

import math

from second_laboratory_cases.case import Case, Channel, Parameter, Record, position_of
from second_laboratory_cases.excitations import Multisine, PointToPoint, Steps
from second_laboratory_cases.models import servo, sliding
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import CascadeController, PositionServo

HELD = {"load_interpolation": "zero_order_hold"}

SERVO_AXIS = Case(
    number=0,
    name="second_axis_ballscrew_friction",
    rig="axis.xml",
    setup=CascadeController(velocity_gain=2600.0, position_gain=22.0),
    rate=500,
    truth=Properties(mass=42.0, damping=110.0),
    effect={"coulomb": 24.0},
    background={"stroke_friction": 1.5, "stroke_period": 0.063, "cogging": 0.4, "cogging_pitch": 0.02},
    background_share=0.04,
    parameters={
        "mass:carriage": Parameter(0.02, "kg", "mass"),
        "damping:slide": Parameter(0.08, "N s/m", "damping"),
    },
    records=(
        Record("identification", 16, PointToPoint(1.2), 0.22),
        Record("identification_2", 16, PointToPoint(0.8), 0.12),
        Record("validation", 14, PointToPoint(1.0), 0.2),
    ),
    channels={
        "u": Channel("load", "N", 0.0, {"role": "command", "actuator": "drive"}),
        "y": Channel("displacement", "m", 0.0001, position_of("slide")),
    },
    understated=None,
    told=HELD,
    model=sliding("axis", "carriage", "slide", spring=False),
    right=[["coulomb_friction"]],
    also=["force_offset", "cogging"],
    limit=None,
    why="Servo axis with ball screw under a cascade controller (held force command); sliding friction of 24 N is missing. Small "
    "besides: friction along the stroke, ripple of the screw.",
)

SHIN = 0.9
"""Mass of the shin [kg]."""
LENGTH = 0.12
"""From the knee to its centre of mass [m]."""
INERTIA = 0.02
"""Its moment of inertia about the centre of mass [kg m^2]."""
ARMATURE = 0.028
"""Inertia of the rotor behind its gear [kg m^2]."""
GAIN, DAMPING_GAIN = 60.0, 2.4
"""Gains of the servo [N m/rad, N m s/rad]."""
OWN_DAMPING = 0.3
"""Damping of the knee [N m s/rad]."""

LEG = Case(
    number=14,
    name="second_hexapod_leg_servo",
    rig="leg.xml",
    setup=PositionServo(gain=GAIN),
    rate=200,
    truth=Properties(
        mass=INERTIA + SHIN * LENGTH**2 + ARMATURE,
        stiffness=GAIN,
        damping=OWN_DAMPING + DAMPING_GAIN,
        gravity_torque=SHIN * 9.81 * LENGTH,
    ),
    effect={"coulomb": 1.5},
    delay_samples=3,
    background={
        "stroke_friction": 0.08,
        "stroke_period": 0.3,
        "hidden_mass": 0.0006,
        "hidden_omega": 2.0 * math.pi * 13.0,
        "hidden_ratio": 0.02,
    },
    parameters={
        "mass:tibia": Parameter(0.02, "kg", value=SHIN),
        "armature:knee": Parameter(0.1, "kg m^2", value=ARMATURE),
        "damping:knee": Parameter(0.25, "N m s/rad", "damping", OWN_DAMPING, DAMPING_GAIN),
        "kp:servo": Parameter(0.04, "N m/rad", value=GAIN),
    },
    records=(
        Record("identification", 20, PointToPoint(0.5), 0.5),
        Record("identification_2", 20, Multisine(0.1, 2.0), 0.45),
        Record("validation", 20, Steps(0.9, 0.06), 0.45),
    ),
    channels={
        "goal": Channel("load", "rad", 0.0, {"role": "command", "actuator": "servo"}),
        "angle": Channel("displacement", "rad", 0.002, position_of("knee", side="link")),
    },
    understated=None,
    told=HELD,
    model=servo("leg", "tibia", "knee", length=LENGTH, inertia=INERTIA, damping=DAMPING_GAIN),
    right=[["coulomb_friction", "actuator_delay"]],
    also=["cogging"],
    limit=0.06,
    honest="unknown; one of the two with the other in a declared set (target_lag, stribeck_friction, gear_friction beside)",
    why="Knee of a hexapod leg, position servo with held targets: friction of the gear (1.5 N m) and 15 ms of bus delay are "
    "missing. Small besides: friction along the turn, hidden resonator.",
)

CONTROLLED = (SERVO_AXIS, LEG)
