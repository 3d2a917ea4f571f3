"""Cases in which nothing of size is missing."""

from __future__ import annotations

import math

from third_laboratory_cases.case import Case, Channel, Parameter, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.joined import RELATIVE, JointRig, SmallPhysics, tuned
from third_laboratory_cases.joint_rig import Axis
from third_laboratory_cases.models import frame
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.signals import chirp, noise_band, rest
from third_laboratory_cases.units import (
    MILLIMETRE,
    acceleration,
    displacement,
    force,
    load_on,
    of_joint,
    oscillator,
)


def storeys() -> Axis:
    """A frame of two floors of 420 and 360 kg, on storeys that shear: 5 and 4.4 Hz alone, 2 % of critical damping."""
    lower, upper = 420.0 * (2.0 * math.pi * 5.0) ** 2, 360.0 * (2.0 * math.pi * 4.4) ** 2
    damping, upper_damping = (0.04 * math.sqrt(k * m) for k, m in ((lower, 420.0), (upper, 360.0)))
    return Axis(420.0, 360.0, lower, 0.0, damping, 0.0, upper, upper_damping)


def stated(of: str, unit: str, scale: float = 1.0) -> Parameter:
    """A parameter of the frame."""
    return Parameter(f"axial {of}", RELATIVE[of], unit, scale)


CLEAN = (
    Case(
        name="third_clean_frame",
        rig="frame.xml",
        rate=200,
        substeps=18,
        specimen=JointRig(
            axial=storeys(),
            torsional=tuned(1.0, 1.0, 5.0, 5.0, 0.5),
            background=SmallPhysics(
                carried_mass=0.02, carried_frequency=11.0, swing=0.008, swing_frequency=0.04, friction=2.0
            ),
        ),
        background_share=0.025,
        records=(
            Record("identification", 40, noise_band(0.5, 10), 0.004),
            Record("identification_2", 30, chirp(0.8, 10), 0.004),
            Record("validation", 40, noise_band(0.5, 10), 0.004),
        ),
        parameters={
            "mass:floor_1": stated("mass_1", "kg"),
            "mass:floor_2": stated("mass_2", "kg"),
            "stiffness:storey_1": stated("mount_stiffness_1", "kN/m", 1e-3),
            "stiffness:storey_2": stated("joint_stiffness", "kN/m", 1e-3),
            "damping:storey_1": stated("mount_damping_1", "N s/m"),
            "damping:storey_2": stated("joint_damping", "N s/m"),
        },
        channels={
            "exciter_force": Channel("force", "kN", 0.004, load_on("exciter"), 1e-3),
            "floor_1": Channel("displacement_1", "mm", 0.005, of_joint("storey_1", "position"), MILLIMETRE),
            "drift_2": Channel("drift_2", "mm", 0.005, of_joint("storey_2", "position"), MILLIMETRE),
        },
        model=frame,
        right=[[]],
        also=["carried_mass", "stiffness_drift", "coulomb_friction"],
        honest="unknown with a small share; carried_mass, stiffness_drift, coulomb_friction (all there, small)",
        why="Nothing of size is missing: two-storey frame, noise stated. Small: a small mass on a spring on floor 2 (11 Hz), "
        "storey 1 swings slowly, weak friction in storey 2, 2.5 % together.",
    ),
    Case(
        name="third_clean_free_decay",
        rig="sdof",
        rate=200,
        substeps=20,
        specimen=Driven(
            nominal=Oscillator(38.0, 34.0, 9800.0),
            background=Background(
                swing=0.01, swing_frequency=0.05, stroke_friction=0.5, stroke_period=0.008
            ),
        ),
        background_share=0.025,
        records=(
            Record("identification", 12, rest, 0.0, 0.011),
            Record("identification_2", 12, rest, 0.0, -0.016),
            Record("identification_3", 25, chirp(0.6, 6), 0.01),
            Record("validation", 25, noise_band(0.6, 6), 0.011),
        ),
        parameters=oscillator(0.01, 0.2, 0.03),
        channels={
            "force": force(0.005), "displacement": displacement(0.006), "acceleration": acceleration(0.012),
        },
        understated=None,
        told={"starts_in_motion": ["identification", "identification_2"]},
        right=[[]],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown with a small share; coulomb_friction or stiffness_drift (there, small)",
        why="Nothing of size is missing: oscillator, two free decays (held at 11 and -16 mm, let go), a chirp, judged by noise; "
        "no noise stated. Small: friction along the stroke, stiffness swings slowly, 2.5 % together.",
    ),
)  # fmt: skip
