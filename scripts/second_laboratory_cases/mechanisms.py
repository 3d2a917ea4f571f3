"""Cases of mechanisms that a motor or a hand drives against a spring, each with an MJCF of its own."""

from __future__ import annotations

import math

from second_laboratory_cases.case import ROTATION, Case, Channel, Record, load_on, oscillator, position_of
from second_laboratory_cases.excitations import (
    BandNoise,
    LogarithmicSweep,
    Multisine,
    Pulses,
    Rest,
    SineBlocks,
    Steps,
)
from second_laboratory_cases.models import sliding, turning
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import LoadCell

MOTOR = load_on("drive")

MECHANISMS = (
    Case(
        number=6,
        name="second_rotor_stand_unbalance",
        rig="rotor.xml",
        setup=LoadCell(),
        rate=500,
        truth=Properties(mass=0.08, stiffness=45.0, damping=0.06),
        effect={"harmonic_force": 0.6, "harmonic_frequency": 6.37},
        background={
            "hidden_mass": 0.001, "hidden_omega": 2.0 * math.pi * 11.0, "hidden_ratio": 0.01,
            "stroke_friction": 0.01, "stroke_period": 0.02,
        },
        background_share=0.035,
        parameters=oscillator(0.02, 0.02, 0.2, body="table", joint="pivot", units=ROTATION),
        records=(
            Record("identification", 20, Multisine(0.5, 8), 0.06, phase=0.4),
            Record("identification_2", 15, LogarithmicSweep(0.8, 9), 0.06, phase=2.1),
            Record("validation", 20, BandNoise(0.7, 8), 0.055, phase=4.4),
        ),
        channels={
            "torque": Channel("load", "N m", 0.006, MOTOR),
            "angle": Channel("displacement", "rad", 0.006, position_of("pivot")),
        },
        model=turning("rotor", "table", "pivot"),
        first_load=0.3,
        right=[["harmonic_force"]],
        also=["carried_mass", "coulomb_friction"],
        why="Rotary table on a torsion spring, tested while a fan with unbalance runs on it at 6.37 Hz (phase differs from "
        "record to record). Small besides: a hidden resonator, bearing friction along the turn.",
    ),
    Case(
        number=7,
        name="second_pneumatic_seals",
        rig="piston.xml",
        setup=LoadCell(),
        rate=200,
        truth=Properties(mass=1.8, stiffness=420.0, damping=14.0),
        effect={"coulomb": 5.0, "stribeck_excess": 0.9, "stribeck_velocity": 0.035},
        background={
            "stroke_friction": 0.3, "stroke_period": 0.017, "swing_stiffness": 6.0, "swing_frequency": 0.03,
        },
        background_share=0.04,
        parameters=oscillator(0.02, 0.03, 0.2, body="piston", joint="return"),
        records=(
            Record("identification", 30, Steps(1.5, 0.08), 0.05),
            Record("identification_2", 30, SineBlocks(((0.3, 0.5), (0.3, 1.0), (1.0, 0.6), (2.0, 0.6))), 0.05),
            Record("validation", 30, Multisine(0.1, 2.5), 0.045),
        ),
        channels={
            "pressure_force": Channel("load", "N", 0.004, MOTOR),
            "stroke": Channel("displacement", "mm", 0.003, position_of("return"), scale=1e3),
        },
        understated=2,
        model=sliding("piston", "piston", "return"),
        right=[["stribeck_friction"]],
        also=["stiffness_drift"],
        honest="unknown; a declared set with another friction; coulomb_friction without certainty",
        why="Pneumatic cylinder with return spring; friction of its seals with break-away (5 N sliding, 9.5 N at rest, 35 mm/s) "
        "is missing. Small besides: friction along the stroke, stiffness swings slowly.",
    ),
    Case(
        number=9,
        name="second_door_closer_two_valves",
        rig="door.xml",
        setup=LoadCell(),
        rate=100,
        truth=Properties(mass=1.25, stiffness=6.2, damping=0.9),
        effect={"damping_asymmetry": 0.62},
        background={
            "stroke_friction": 0.05, "stroke_period": 0.9, "swing_stiffness": 0.1, "swing_frequency": 0.05,
        },
        background_share=0.04,
        parameters=oscillator(0.03, 0.03, 0.12, body="door", joint="closer", units=ROTATION),
        records=(
            Record("identification", 15, Rest(), 0.0, start=1.0),
            Record("identification_2", 40, Pulses(5.0, 1.0), 0.9),
            Record("identification_3", 40, Multisine(0.08, 1.5), 0.7),
            Record("validation", 40, BandNoise(0.1, 1.4), 0.7),
        ),
        channels={
            "push": Channel("load", "N m", 0.003, MOTOR),
            "angle": Channel("displacement", "deg", 0.003, position_of("closer"), scale=180.0 / math.pi),
        },
        understated=None,
        told={"starts_in_motion": ["identification"]},
        model=turning("door", "door", "closer"),
        compressed=True,
        first_load=5.0,
        right=[["asymmetric_damping"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Swing door with a closer whose two valves damp one direction with 1.52, the other with 0.28 N m s/rad; pushed by "
        "hand with a load cell, and one free return. Angle in degrees. Small besides: friction along the turn, stiffness "
        "swings slowly.",
    ),
    Case(
        number=12,
        name="second_linear_motor_cogging",
        rig="forcer.xml",
        setup=LoadCell(),
        rate=500,
        truth=Properties(mass=2.2, stiffness=900.0, damping=7.0),
        effect={"cogging": 1.0, "cogging_pitch": 0.009, "cogging_phase": 0.7},
        background={
            "hidden_mass": 0.02, "hidden_omega": 2.0 * math.pi * 9.7, "hidden_ratio": 0.02,
            "stroke_friction": 0.1, "stroke_period": 0.025,
        },
        parameters=oscillator(0.01, 0.02, 0.15, body="forcer", joint="flexure"),
        records=(
            Record("identification", 20, Multisine(0.2, 6), 0.017),
            Record("identification_2", 20, Steps(0.8, 0.02), 0.016),
            Record("validation", 16, LogarithmicSweep(0.3, 6), 0.016),
        ),
        channels={
            "f": Channel("load", "N", 0.004, MOTOR),
            "pos": Channel("displacement", "m", 0.003, position_of("flexure")),
        },
        model=sliding("forcer", "forcer", "flexure"),
        right=[["cogging"]],
        also=["carried_mass", "coulomb_friction", "force_offset"],
        why="Iron-core linear motor on flexures, force by a load cell; magnets cog with 1 N every 9 mm. Small besides: a hidden "
        "resonator, friction along the stroke.",
    ),
    Case(
        number=15,
        name="second_gearbox_backlash_rotary",
        rig="gear.xml",
        setup=LoadCell(),
        rate=500,
        truth=Properties(mass=0.035, stiffness=8.0, damping=0.05),
        effect={"stop_stiffness": 14.0, "gap_above": 0.028, "gap_below": 0.028, "coulomb": 0.05},
        background={
            "hidden_mass": 0.0004, "hidden_omega": 2.0 * math.pi * 9.1, "hidden_ratio": 0.02,
            "swing_stiffness": 0.1, "swing_frequency": 0.05,
        },
        parameters=oscillator(0.015, 0.03, 0.2, body="wheel", joint="output", units=ROTATION),
        records=(
            Record("identification", 20, Multisine(0.4, 10), 0.08),
            Record("identification_2", 20, LogarithmicSweep(0.5, 9), 0.07),
            Record("validation", 20, BandNoise(0.5, 9), 0.075),
        ),
        channels={
            "torque": Channel("load", "N m", 0.004, MOTOR),
            "angle": Channel("displacement", "rad", 0.003, position_of("output")),
        },
        model=turning("gear", "wheel", "output"),
        first_load=1.0,
        right=[["gap", "coulomb_friction"]],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown; gap with another friction; gap alone, if something is said to be left",
        why="Output of a gearbox with its motor locked, on a centring spring: the teeth carry beyond 28 mrad to both sides (14 "
        "N m/rad), and the seal rubs with 0.05 N m. Small besides: hidden resonator, stiffness swings slowly.",
    ),
)  # fmt: skip
