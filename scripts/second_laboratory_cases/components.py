"""Cases of components on a testing machine that prescribes their motion."""

from __future__ import annotations

from second_laboratory_cases.case import Case, Channel, Record, component
from second_laboratory_cases.excitations import BandNoise, LinearSweep, Multisine, SineBlocks
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import TestingMachine

PRESCRIBED = {"role": "prescribed"}


def transducers(displacement: float, force: float = 0.006) -> dict[str, Channel]:
    """Channels of a machine, by their noise as fractions of the signals."""
    return {
        "displacement": Channel("displacement", "m", displacement, PRESCRIBED),
        "force": Channel("force", "N", force),
    }


COMPONENTS = (
    Case(
        number=4,
        name="second_mr_damper_machine",
        rig="damper",
        setup=TestingMachine(),
        rate=1000,
        truth=Properties(stiffness=1500.0, damping=900.0),
        effect={
            "bouc_wen_stiffness": 4.0e5, "bouc_wen_beta": 1.4, "bouc_wen_gamma": 0.87, "bouc_wen_exponent": 2.0,
        },
        background={"stroke_friction": 10.0, "stroke_period": 0.019},
        parameters=component(stiffness=0.08, damping=0.1),
        records=(
            Record("identification", 12, SineBlocks(((1.0, 0.4), (1.0, 1.0), (2.5, 0.6), (4.0, 0.35))), 0.014),
            Record("identification_2", 10, Multisine(0.4, 4), 0.015),
            Record("validation", 10, BandNoise(0.5, 4), 0.013),
        ),
        channels={
            "displacement": Channel("displacement", "mm", 0.00005, PRESCRIBED, scale=1e3),
            "force": Channel("force", "N", 0.006),
        },
        understated=2,
        right=[["bouc_wen_hysteresis"]],
        also=["coulomb_friction"],
        honest="unknown; presliding_friction or backlash_friction in a declared set with it",
        why="Magnetorheological damper at constant current on a testing machine; the nominal model has gas spring and oil only. "
        "Bouc-Wen with n = 2, limit 420 N. Small besides: friction along the stroke.",
    ),
    Case(
        number=5,
        name="second_hydraulic_orifice_machine",
        rig="damper",
        setup=TestingMachine(),
        rate=500,
        truth=Properties(damping=1800.0, coulomb=60.0),
        effect={"quadratic_damping": 9000.0},
        background={
            "stroke_friction": 25.0, "stroke_period": 0.03, "relaxing_stiffness": 2000.0, "relaxation_time": 0.02,
        },
        parameters=component(damping=0.1, coulomb=0.2),
        records=(
            Record("identification", 15, SineBlocks(((1.0, 0.5), (1.0, 1.0), (2.5, 0.5), (2.5, 1.0))), 0.022),
            Record("identification_2", 12, Multisine(0.3, 3.5), 0.03),
            Record("validation", 12, LinearSweep(0.5, 3.5), 0.02),
        ),
        channels=transducers(0.00005),
        understated=None,
        right=[["quadratic_damping"]],
        also=["coulomb_friction", "viscoelastic_relaxation"],
        why="Hydraulic damper on a machine; turbulent orifice (c2 = 9000 N s2/m2) missing beside laminar damping and seal "
        "friction. Small besides: seal friction along the stroke, oil compressibility.",
    ),
    Case(
        number=11,
        name="second_wedge_snubber_machine",
        rig="damper",
        setup=TestingMachine(),
        rate=256,
        truth=Properties(stiffness=80000.0, damping=500.0, coulomb=150.0),
        effect={"friction_per_deflection": 26000.0},
        background={
            "stroke_friction": 40.0, "stroke_period": 0.008, "swing_stiffness": 1200.0, "swing_frequency": 0.08,
        },
        background_share=0.045,
        parameters=component(stiffness=0.03, damping=0.2, coulomb=0.15),
        records=(
            Record("identification", 20, SineBlocks(((0.5, 0.4), (0.5, 1.0), (2.0, 0.5), (2.0, 1.0))), 0.02),
            Record("identification_2", 20, BandNoise(0.2, 3), 0.024),
            Record("validation", 20, Multisine(0.2, 3), 0.022),
        ),
        channels=transducers(0.00004),
        understated=4,
        right=[["load_dependent_friction"]],
        also=["stiffness_drift"],
        honest="unknown; a declared set that holds it",
        why="Spring with a friction wedge (railway snubber) on a machine: its friction grows with the deflection, 26 kN/m, "
        "beside 150 N that are known. Small besides: friction along the stroke, stiffness swings slowly.",
    ),
    Case(
        number=19,
        name="second_bushing_machine_quiet",
        rig="damper",
        setup=TestingMachine(),
        rate=500,
        truth=Properties(stiffness=250000.0, damping=1500.0, coulomb=40.0),
        background={
            "stroke_friction": 12.0, "stroke_period": 0.0013, "relaxing_stiffness": 4000.0, "relaxation_time": 0.05,
            "swing_stiffness": 2500.0, "swing_frequency": 0.07,
        },
        background_share=0.015,
        parameters=component(stiffness=0.03, damping=0.15, coulomb=0.2),
        records=(
            Record("identification", 15, SineBlocks(((1.0, 0.5), (1.0, 1.0), (5.0, 0.5), (5.0, 0.9))), 0.004),
            Record("identification_2", 12, Multisine(0.5, 6), 0.004),
            Record("validation", 12, BandNoise(0.5, 6), 0.004),
        ),
        channels=transducers(0.0001, 0.005),
        understated=2,
        right=[[]],
        also=["coulomb_friction", "viscoelastic_relaxation", "stiffness_drift"],
        honest="unknown with a small share; viscoelastic_relaxation, coulomb_friction, stiffness_drift (all there, small)",
        why="Nothing of size is missing: bushing on a machine with a little relaxation, friction along the stroke and a "
        "stiffness that swings slowly, 1.5 % of the force together.",
    ),
    Case(
        number=22,
        name="second_seat_damper_metering_pin",
        rig="damper",
        setup=TestingMachine(),
        rate=500,
        truth=Properties(stiffness=5000.0, damping=800.0, coulomb=40.0),
        effect={"metered_damping": 4.5e6},
        background={
            "stroke_friction": 15.0, "stroke_period": 0.009, "relaxing_stiffness": 1000.0, "relaxation_time": 0.03,
        },
        parameters=component(stiffness=0.05, damping=0.1, coulomb=0.2),
        records=(
            Record("identification", 15, SineBlocks(((1.0, 0.5), (1.0, 1.0), (3.0, 0.5), (3.0, 1.0))), 0.025),
            Record("identification_2", 12, Multisine(0.4, 3.5), 0.027),
            Record("validation", 12, BandNoise(0.5, 3.5), 0.026),
        ),
        channels=transducers(0.00005),
        understated=2,
        right=[],
        also=["coulomb_friction", "viscoelastic_relaxation"],
        honest="unknown is what is right; no certain name besides the small ones",
        why="Seat damper with a metering pin: damping grows with the square of the displacement (4.5e6 x^2 v). In no catalogue. "
        "Small besides: friction along the stroke, oil compressibility.",
    ),
)  # fmt: skip
