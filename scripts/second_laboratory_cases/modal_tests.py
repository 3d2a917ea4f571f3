"""Cases of oscillators in a modal test: a shaker with a load cell drives them, no MJCF describes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from second_laboratory_cases.case import Case, Channel, Record, oscillator
from second_laboratory_cases.excitations import (
    BandNoise,
    Bursts,
    LinearSweep,
    LogarithmicSweep,
    Multisine,
    SineBlocks,
    Steps,
)
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import LoadCell

FORCE = Channel("load", "N", 0.005, {"role": "measured"})
HERTZ = 2.0 * np.pi
"""Angular frequency of one hertz [rad/s]."""


def transducers(displacement: float, acceleration: float) -> dict[str, Channel]:
    """Channels of a modal test, by their noise as fractions of the signals."""
    return {
        "force": FORCE,
        "displacement": Channel("displacement", "m", displacement),
        "acceleration": Channel("acceleration", "m/s^2", acceleration),
    }


def resonator(mass: float, hertz: float, ratio: float) -> dict[str, float]:
    """A hidden resonator of a mass [kg], a frequency [Hz] and a damping ratio."""
    return {"hidden_mass": mass, "hidden_omega": HERTZ * hertz, "hidden_ratio": ratio}


MODAL_TESTS = (
    Case(
        number=1,
        name="second_modal_mass_buffers",
        rig="sdof",
        setup=LoadCell(),
        rate=400,
        truth=Properties(mass=3.2, stiffness=2900.0, damping=5.0),
        effect={"stop_stiffness": 1500.0, "gap_above": 0.004, "gap_below": 0.004},
        background={**resonator(0.03, 13.5, 0.01), "stroke_friction": 0.05, "stroke_period": 0.011},
        background_share=0.035,
        parameters=oscillator(),
        records=(
            Record("identification", 25, Multisine(1, 12), 0.0085),
            Record("identification_2", 20, LinearSweep(2, 9), 0.007),
            Record("validation", 20, BandNoise(1.5, 10), 0.008),
        ),
        channels=transducers(0.005, 0.008),
        right=[["gap"]],
        also=["carried_mass", "coulomb_friction"],
        why="Modal test of a mass on leaf springs between two rubber buffers at 4 mm on both sides. Small besides: a cable that "
        "resonates at 13.5 Hz, friction along the stroke.",
    ),
    Case(
        number=3,
        name="second_beam_touching_support",
        rig="sdof",
        setup=LoadCell(response="acceleration"),
        rate=1000,
        truth=Properties(mass=0.85, stiffness=6577.0, damping=1.3),
        effect={"stop_stiffness": 4000.0, "gap_above": 0.0011, "gap_below": 9.0, "stop_damping": 2.0},
        background={**resonator(0.006, 61, 0.008), "swing_stiffness": 60.0, "swing_frequency": 0.05},
        background_share=0.035,
        parameters=oscillator(0.015, 0.02, 0.25),
        records=(
            Record("identification", 12, BandNoise(5, 45), 0.003),
            Record("identification_2", 10, Bursts(2.0, 13, 0.4), 0.0028),
            Record("validation", 12, Multisine(6, 40), 0.0027),
        ),
        channels={"force": FORCE, "acceleration": Channel("acceleration", "m/s^2", 0.006)},
        right=[["one_sided_stop"]],
        also=["carried_mass", "stiffness_drift"],
        why="First mode of a clamped beam (modal mass) that touches a support on one side from 1.1 mm on; accelerometer only. "
        "Small besides: the second mode's rest at 61 Hz, stiffness swings slowly.",
    ),
    Case(
        number=8,
        name="second_guide_cable_chain",
        rig="sdof",
        setup=LoadCell(),
        rate=250,
        truth=Properties(mass=12.0, stiffness=3000.0, damping=25.0),
        effect={"dahl_stiffness": 5000.0, "dahl_force": 6.5},
        background={**resonator(0.15, 7.4, 0.02), "swing_stiffness": 30.0, "swing_frequency": 0.06},
        parameters=oscillator(0.01, 0.02, 0.2),
        records=(
            Record("identification", 30, BandNoise(0.3, 7), 0.014),
            Record("identification_2", 24, SineBlocks(((1.0, 0.5), (1.0, 1.0), (3.5, 0.5), (3.5, 1.0))), 0.012),
            Record("validation", 25, Multisine(0.3, 6), 0.013),
        ),
        channels=transducers(0.004, 0.01),
        right=[["presliding_friction"], ["bouc_wen_hysteresis"]],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown; a declared set with backlash_friction or another friction",
        why="Linear guide that drags a cable chain: Dahl friction, 6.5 N, 5000 N/m before it slides (identical with Bouc-Wen of "
        "n = 1, gamma = 0). Small besides: a hidden resonator, stiffness swings slowly.",
    ),
    Case(
        number=13,
        name="second_hoist_trolley_payload",
        rig="sdof",
        setup=LoadCell(),
        rate=250,
        truth=Properties(mass=60.0, stiffness=24000.0, damping=110.0),
        effect={"carried_mass": 14.0, "carried_omega": HERTZ * 2.15, "carried_ratio": 0.012},
        background={
            "stroke_friction": 1.5, "stroke_period": 0.03, "swing_stiffness": 250.0, "swing_frequency": 0.05,
        },
        background_share=0.035,
        parameters=oscillator(0.01, 0.03, 0.2),
        records=(
            Record("identification", 30, LogarithmicSweep(0.8, 8), 0.012),
            Record("identification_2", 30, BandNoise(0.8, 8), 0.012),
            Record("validation", 30, Multisine(0.8, 7), 0.011),
        ),
        channels=transducers(0.005, 0.008),
        understated=3,
        right=[["carried_mass"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Trolley of a hoist held by its belt, weighed with its payload (60 kg), of which 14 kg swing at 2.15 Hz. Small "
        "besides: friction along the rail, belt stiffness swings slowly.",
    ),
    Case(
        number=16,
        name="second_rubber_mount_hard_creep",
        rig="sdof",
        setup=LoadCell(),
        rate=400,
        truth=Properties(mass=18.0, stiffness=16000.0, damping=60.0),
        effect={"relaxing_stiffness": 8000.0, "relaxation_time": 0.06, "cubic_stiffness": 1.5e8},
        background={**resonator(0.1, 12, 0.02), "stroke_friction": 1.0, "stroke_period": 0.006},
        parameters=oscillator(),
        records=(
            Record("identification", 20, Multisine(0.5, 12), 0.006),
            Record("identification_2", 20, Steps(1.0, 0.01), 0.006),
            Record("identification_3", 15, BandNoise(1, 12), 0.003),
            Record("validation", 20, LogarithmicSweep(0.8, 12), 0.0055),
        ),
        channels=transducers(0.004, 0.008),
        understated=None,
        right=[["cubic_stiffness", "viscoelastic_relaxation"]],
        also=["carried_mass", "coulomb_friction"],
        honest="unknown; either with the other in a declared set",
        why="Mass on a rubber mount that hardens (k3 = 1.5e8) and relaxes (8 kN/m in 60 ms). Small besides: hidden resonator, "
        "friction along the stroke.",
    ),
    Case(
        number=17,
        name="second_flexure_in_oil_gauge",
        rig="sdof",
        setup=LoadCell(),
        rate=400,
        truth=Properties(mass=4.0, stiffness=3600.0, damping=6.0),
        effect={"quadratic_damping": 55.0},
        displacement_gain=1.11,
        background={**resonator(0.03, 11.5, 0.02), "stroke_friction": 0.15, "stroke_period": 0.012},
        parameters=oscillator(0.008, 0.02, 0.2),
        records=(
            Record("identification", 20, Multisine(1, 12), 0.011),
            Record("identification_2", 20, LinearSweep(1.5, 9), 0.01),
            Record("validation", 20, BandNoise(1, 10), 0.01),
        ),
        channels=transducers(0.004, 0.006),
        right=[["quadratic_damping", "displacement_gain_error"]],
        also=["carried_mass", "coulomb_friction"],
        honest="unknown; quadratic_damping in a declared set",
        why="Mass on flexures with a vane in oil (c2 = 55), whose displacement gauge was calibrated 11 % too high; the "
        "accelerometer is right. Small besides: hidden resonator, friction along the stroke.",
    ),
    Case(
        number=18,
        name="second_modal_mass_quiet",
        rig="sdof",
        setup=LoadCell(),
        rate=500,
        truth=Properties(mass=2.6, stiffness=4100.0, damping=7.0),
        background={
            **resonator(0.03, 10.2, 0.015), "stroke_friction": 0.08, "stroke_period": 0.01,
            "swing_stiffness": 40.0, "swing_frequency": 0.05,
        },
        background_share=0.025,
        parameters=oscillator(),
        records=(
            Record("identification", 20, Multisine(1, 15), 0.006),
            Record("identification_2", 15, LogarithmicSweep(1, 15), 0.006),
            Record("validation", 15, BandNoise(1, 14), 0.006),
        ),
        channels=transducers(0.008, 0.01),
        right=[[]],
        also=["carried_mass", "coulomb_friction", "stiffness_drift"],
        honest="unknown with a small share; carried_mass, coulomb_friction or stiffness_drift (all there, small)",
        why="Nothing of size is missing: modal test of a mass on springs with a small hidden resonator at 10.2 Hz, weak "
        "friction along the stroke and a stiffness that swings slowly, 2 to 3 % of the response together.",
    ),
    Case(
        number=21,
        name="second_shaft_unequal_stiffness",
        rig="sdof",
        setup=LoadCell(),
        rate=400,
        truth=Properties(mass=7.0, stiffness=5000.0, damping=9.0),
        effect={"parametric_stiffness": 1300.0, "parametric_frequency": 1.73, "parametric_phase": 0.6},
        background={**resonator(0.06, 10, 0.02), "stroke_friction": 0.2, "stroke_period": 0.01},
        parameters=oscillator(0.01, 0.02, 0.2),
        records=(
            Record("identification", 20, Multisine(1, 9), 0.009),
            Record("identification_2", 20, LogarithmicSweep(1.5, 8), 0.009),
            Record("validation", 20, BandNoise(1.5, 8), 0.009),
        ),
        channels=transducers(0.005, 0.008),
        right=[],
        also=["carried_mass", "coulomb_friction"],
        honest="unknown is what is right; no certain name besides the small ones",
        why="Mass on a slowly turning shaft of unequal stiffness: k swings by 26 % at 1.73 Hz. In no catalogue. Small besides: "
        "hidden resonator, friction along the stroke.",
    ),
    Case(
        number=23,
        name="second_particle_impact_damper",
        rig="sdof",
        setup=LoadCell(),
        rate=500,
        truth=Properties(mass=5.0, stiffness=4000.0, damping=5.0),
        effect={"ball_mass": 0.45, "ball_gap": 0.004, "ball_restitution": 0.5},
        background={
            "stroke_friction": 0.15, "stroke_period": 0.01, "swing_stiffness": 40.0, "swing_frequency": 0.05,
        },
        parameters={
            **oscillator(0.01, 0.02, 0.2),
            "mass": replace(oscillator()["mass"], value=5.45),  # weighed with the ball
        },
        records=(
            Record("identification", 20, Multisine(1, 10), 0.012),
            Record("identification_2", 20, LogarithmicSweep(1.5, 9), 0.012),
            Record("validation", 20, BandNoise(1.5, 8), 0.012),
        ),
        channels=transducers(0.005, 0.008),
        right=[],
        also=["carried_mass", "coulomb_friction", "stiffness_drift"],
        honest="unknown is what is right; carried_mass is the nearest, if something is said to be left",
        why="Impact damper: a ball of 0.45 kg flies in a cavity of +-4 mm of the mass (restitution 0.5); weighed together, 5.45 "
        "kg. In no catalogue. Small besides: friction along the stroke, stiffness swings slowly.",
    ),
)  # fmt: skip
