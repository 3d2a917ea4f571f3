"""Cases that miss what no catalogue holds."""

from __future__ import annotations

from bench.arrays import Array
from third_laboratory_cases.case import Case, Channel, Record
from third_laboratory_cases.driven import Driven
from third_laboratory_cases.hysteresis import Flag, flag_shaped
from third_laboratory_cases.oscillator import Background, Oscillator
from third_laboratory_cases.prescribed import Component, SmallForces, Stroke
from third_laboratory_cases.signals import noise_band, stepped_sine
from third_laboratory_cases.units import acceleration, component, displacement, force, oscillator, stroke


def superelastic(s: Stroke) -> Array:
    """Force of superelastic wires [N]."""
    return flag_shaped(Flag(230e3, 360.0, 150.0, 0.05), s.x)


FOREIGN = (
    Case(
        name="third_foreign_eddy_brake",
        rig="sdof",
        rate=500,
        substeps=10,
        specimen=Driven(
            nominal=Oscillator(5.5, 10.0, 3900.0),
            missing={"eddy_drag": 2.6, "eddy_velocity": 0.09},
            background=Background(0.03, 10.0, 0.04, swing=0.01, swing_frequency=0.05),
        ),
        records=(
            Record("identification", 22, noise_band(1, 8), 0.016),
            Record("identification_2", 18, stepped_sine([3, 4.2, 4.2, 6], [0.6, 0.3, 1, 1]), 0.016),
            Record("validation", 20, noise_band(1, 8), 0.016),
        ),
        parameters=oscillator(),
        channels={"force": force(), "displacement": displacement(), "acceleration": acceleration()},
        right=[],
        also=["carried_mass", "stiffness_drift"],
        honest="unknown is what is right; or a name and not complete (grade by hand)",
        why="Eddy-current brake: drag 2 F (v/vc) / (1 + (v/vc)^2), F = 2.6 N at vc = 0.09 m/s, falls beyond. In no catalogue. "
        "Small besides: a small mass on a spring (10 Hz), stiffness swings slowly.",
    ),
    Case(
        name="third_foreign_superelastic",
        rig="damper",
        rate=500,
        substeps=8,
        specimen=Component(
            stiffness=60e3,
            damping=700.0,
            coulomb=30.0,
            missing=superelastic,
            background=SmallForces(period=0.0031),
        ),
        records=(
            Record("identification", 18, stepped_sine([0.5, 0.5, 1.5, 3], [0.5, 1, 0.8, 0.6]), 0.007),
            Record("identification_2", 15, noise_band(0.3, 3), 0.007),
            Record("validation", 15, noise_band(0.3, 3), 0.007),
        ),
        parameters=component({"stiffness": 0.03, "damping": 0.15, "coulomb": 0.2}, ("N/mm", 1e-3)),
        channels={"displacement": stroke(0.00006), "force": Channel("force", "kN", 0.005, scale=1e-3)},
        right=[],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown is what is right; or names and not complete (grade by hand)",
        why="Superelastic wires: flag-shaped, re-centring loop (230 N/mm to 360 N, plateau, back along 150 N) beside a known "
        "spring. In no catalogue. Small besides: friction along the stroke, stiffness swings slowly.",
    ),
)
