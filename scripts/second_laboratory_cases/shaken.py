"""Cases of oscillators on a table that shakes them, most of which are measured by accelerometers only."""

from __future__ import annotations

from dataclasses import replace

from second_laboratory_cases.case import Case, Channel, Parameter, Record, oscillator, position_of
from second_laboratory_cases.excitations import BandNoise, LogarithmicSweep, Multisine
from second_laboratory_cases.models import on_table
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import ShakenBase

TABLE = {"role": "prescribed", "joint": "rail", "quantity": "acceleration"}
TOP = {"sensor": "top_accelerometer"}
ACCELEROMETERS = {
    "table_acc": Channel("base", "m/s^2", 0.004, TABLE),
    "top_acc": Channel("acceleration", "m/s^2", 0.008, TOP),
}


def weighed(body: str, joint: str, mass: float, stiffness: float, damping: float) -> dict[str, Parameter]:
    """Parameters of an oscillator whose mass is known too well to be fitted: under a motion of its base, only ratios to it tell."""
    parameters = oscillator(mass, stiffness, damping, body=body, joint=joint)
    key = f"mass:{body}"
    return {**parameters, key: replace(parameters[key], fitted=False)}


SHAKEN = (
    Case(
        number=2,
        name="second_shaker_isolator_hardening",
        rig="stage.xml",
        setup=ShakenBase(),
        rate=512,
        truth=Properties(mass=5.5, stiffness=7816.0, damping=16.6),
        effect={"cubic_stiffness": 7.0e7},
        background={
            "stroke_friction": 0.2, "stroke_period": 0.004, "swing_stiffness": 120.0, "swing_frequency": 0.04,
        },
        background_share=0.04,
        parameters=weighed("top", "isolator", 0.005, 0.03, 0.15),
        records=(
            Record("identification", 20, LogarithmicSweep(2, 22), 0.006),
            Record("identification_2", 20, BandNoise(2, 20), 0.006),
            Record("validation", 20, Multisine(2, 18), 0.0055),
        ),
        channels=ACCELEROMETERS,
        understated=3,
        model=on_table("stage", "top", "isolator"),
        first_load=3.0,
        right=[["cubic_stiffness"]],
        also=["coulomb_friction", "stiffness_drift"],
        why="Equipment on a hardening wire isolator on a shaker table, accelerometers only. Small besides: friction along the "
        "stroke, stiffness swings slowly.",
    ),
    Case(
        number=10,
        name="second_quarter_car_degressive",
        rig="car.xml",
        setup=ShakenBase(),
        rate=200,
        truth=Properties(mass=260.0, stiffness=19000.0, damping=450.0),
        effect={"power_damping": 420.0, "power_exponent": 0.42},
        background={
            "stroke_friction": 8.0, "stroke_period": 0.02, "swing_stiffness": 250.0, "swing_frequency": 0.05,
        },
        parameters=weighed("body", "strut", 0.01, 0.03, 0.12),
        records=(
            Record("identification", 30, BandNoise(0.5, 12), 0.05),
            Record("identification_2", 25, LogarithmicSweep(0.5, 10), 0.05),
            Record("validation", 30, Multisine(0.5, 10), 0.045),
        ),
        channels={
            "pan_acc": Channel("base", "m/s^2", 0.004, TABLE),
            "body_acc": Channel("acceleration", "m/s^2", 0.006, TOP),
            "strut": Channel("displacement", "m", 0.005, position_of("strut")),
        },
        model=on_table("car", "body", "strut"),
        first_load=1.5,
        right=[["power_law_damping"]],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown; a set with coulomb_friction or stribeck_friction",
        why="Quarter of a vehicle on a four-post machine; the degressive valve of its damper, 420 v^0.42, is missing. Small "
        "besides: friction along the stroke, stiffness swings slowly.",
    ),
    Case(
        number=20,
        name="second_shaker_stage_quiet",
        rig="stage.xml",
        setup=ShakenBase(),
        rate=400,
        truth=Properties(mass=3.4, stiffness=4800.0, damping=9.0),
        background={
            "stroke_friction": 0.08, "stroke_period": 0.005, "swing_stiffness": 50.0, "swing_frequency": 0.05,
        },
        background_share=0.025,
        parameters=weighed("top", "isolator", 0.005, 0.03, 0.2),
        records=(
            Record("identification", 20, BandNoise(1.5, 20), 0.005),
            Record("identification_2", 20, LogarithmicSweep(2, 18), 0.005),
            Record("validation", 20, Multisine(2, 18), 0.005),
        ),
        channels=ACCELEROMETERS,
        understated=None,
        model=on_table("stage", "top", "isolator"),
        first_load=1.0,
        right=[[]],
        also=["coulomb_friction", "stiffness_drift"],
        honest="unknown with a small share; coulomb_friction or stiffness_drift (both there, small)",
        why="Nothing of size is missing: stage on springs on a shaker table with weak friction along the stroke and a stiffness "
        "that swings slowly, 2.5 % of the response.",
    ),
)  # fmt: skip
