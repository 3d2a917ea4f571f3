"""Cases of components on a machine, and of a payload on a turntable."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from bench.arrays import Array
from third_laboratory_cases.case import Case, Channel, Parameter, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.models import turntable
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.prescribed import Component, SmallForces, Stroke
from third_laboratory_cases.signals import chirp, noise_band, stepped_sine
from third_laboratory_cases.units import DEGREE, PRESCRIBED, component, of_joint, rotor, stroke


def relaxing(s: Stroke) -> Array:
    """Force [N] of a spring of 110 kN/m in series with a dashpot, whose relaxation time is 55 ms."""
    kept = math.exp(-s.t[1] / 0.055)
    share = 110e3 * (1.0 + kept) / 2.0
    return np.asarray(lfilter([share, -share], [1.0, -kept], s.x - s.x[0]))


def shear_thinning(s: Stroke) -> Array:
    """Torque [N m] of silicone fluid: 3.4 sgn(w) |w|^0.45."""
    return 3.4 * np.sign(s.v) * np.abs(s.v) ** 0.45


MACHINES = (
    Case(
        name="third_machine_rubber_mount",
        rig="damper",
        rate=400,
        substeps=10,
        specimen=Component(
            stiffness=250e3,
            damping=900.0,
            coulomb=25.0,
            missing=relaxing,
            background=SmallForces(period=0.0017),
        ),
        background_share=0.025,
        records=(
            Record(
                "identification", 24, stepped_sine([0.4, 1, 3, 6, 10, 2], [1, 1, 0.8, 0.6, 0.4, 1]), 0.004
            ),
            Record("identification_2", 15, noise_band(0.3, 9), 0.004),
            Record("validation", 15, noise_band(0.3, 9), 0.004),
        ),
        parameters=component({"stiffness": 0.03, "damping": 0.15, "coulomb": 0.2}, ("kN/m", 1e-3)),
        channels={"displacement": stroke(0.00008), "force": Channel("force", "kN", 0.005, scale=1e-3)},
        right=[["viscoelastic_relaxation"]],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown; force_delay or displacement_delay in a declared set with it",
        why="Rubber mount on a machine: a Maxwell branch (110 kN/m, 55 ms) missing beside stiffness and damping. Small besides: "
        "friction along the stroke, stiffness swings slowly.",
    ),
    Case(
        name="third_machine_rotary_coupling",
        rig="damper",
        rate=250,
        substeps=20,
        specimen=Component(
            stiffness=14.0,
            damping=0.8,
            coulomb=0.35,
            missing=shear_thinning,
            background=SmallForces(period=2.0 * math.pi / 5.0, swing_frequency=0.06),
        ),
        records=(
            Record("identification", 20, stepped_sine([0.5, 1, 2, 3], [1, 1, 0.8, 0.5]), 0.5),
            Record("identification_2", 20, noise_band(0.2, 2.5), 0.55),
            Record("validation", 20, noise_band(0.2, 2.5), 0.5),
        ),
        parameters={
            "stiffness": Parameter("stiffness", 0.04, "N m/rad"),
            "damping": Parameter("damping", 0.12, "N m s/rad"),
            "coulomb": Parameter("coulomb", 0.15, "N m"),
        },
        channels={
            "angle": Channel("displacement", "deg", 0.00006, PRESCRIBED, DEGREE),
            "torque": Channel("force", "N m", 0.005),
        },
        understated=None,
        right=[["power_law_damping"]],
        also=["coulomb_friction", "stiffness_drift", "cogging"],
        why="Silicone coupling on a rotary machine, shear thinning: 3.4 sgn(w) abs(w)^0.45 N m missing beside spring, oil and "
        "seal friction. Small besides: friction that depends on the angle, stiffness swings slowly.",
    ),
    Case(
        name="third_turntable_cable",
        rig="turntable.xml",
        rate=500,
        substeps=10,
        specimen=Driven(
            nominal=Oscillator(0.062, 0.09, 34.0),
            missing={"stop_below": 20.0, "gap_below": 0.035},
            background=Background(
                swing=0.01, swing_frequency=0.08, stroke_friction=0.03, stroke_period=0.06
            ),
        ),
        records=(
            Record("identification", 20, noise_band(1, 8), 0.14),
            Record("identification_2", 15, chirp(1.2, 8), 0.12),
            Record("validation", 18, noise_band(1, 8), 0.14),
        ),
        parameters=rotor("payload", "flexure", inertia=0.012, damping=0.15, stiffness=0.02),
        channels={
            "table_acc": Channel("base", "rad/s^2", 0.004, {**PRESCRIBED, **of_joint("spindle", "acceleration")}),
            "twist": Channel("displacement", "deg", 0.004, of_joint("flexure", "position"), DEGREE),
            "rate": Channel("velocity", "rad/s", 0.006, of_joint("flexure", "velocity")),
        },
        understated=2.0,
        model=turntable,
        right=[["one_sided_stop"]],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown; asymmetric_gap or quadratic_stiffness in a declared set with it",
        why="Payload on a flexure on a turntable whose acceleration is measured: the payload's cable tightens beyond -2.0 deg "
        "(20.0 N m/rad), one side. Small besides: friction along the turn, stiffness swings slowly.",
    ),
)  # fmt: skip
