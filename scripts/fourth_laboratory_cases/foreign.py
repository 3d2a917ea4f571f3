"""Cases of what no catalogue holds: an eddy-current brake, and a stiffness that changes with an angle that is not logged."""

from __future__ import annotations

from third_laboratory_cases.units import MEASURED, MILLIMETRE, load_on

from fourth_laboratory_cases.axis import Axis, Background, Missing
from fourth_laboratory_cases.case import Case, Channel, Clock, Freeze, Record
from fourth_laboratory_cases.models import gear_wheel
from fourth_laboratory_cases.signals import added, bursts, sweeps, tones
from fourth_laboratory_cases.specimens import OnAxis
from fourth_laboratory_cases.units import acceleration, oscillator, position, turning

MILLIRADIAN = 1e3
"""Value in that unit over that in rad."""
MESH_STIFFNESS, MESH_LOSS = 480.0, 0.11
"""Of the sound teeth [N m/rad], and what the crack takes of it in the mean, as a fraction."""
EDDY_SLIDER = Case(
    name="fourth_eddy_slider",
    rig="sdof",
    clock=Clock(400, 20),
    specimen=OnAxis(
        properties=Axis(2.6, 900.0, 5.0),
        missing=Missing(brake_force=7.0, brake_velocity=0.10),
        background=Background(
            hidden=0.012,
            hidden_frequency=19.0,
            hidden_ratio=0.02,
            friction=0.2,
            creep=0.02,
            wavelength=0.04,
            drift=-0.012,
            settling=6.0,
        ),
    ),
    records=(
        Record("identification", 15, tones(9.5, 0.8, 6.5, 22, tilt=0.2, swell=0.6)),
        Record(
            "validation",
            14,
            added(sweeps(11, 1.0, 6, 1.5, breath=0.55), tones(3, 0.8, 6, 10, tilt=0.2, swell=0.4)),
        ),
    ),
    parameters=oscillator(0.01, 0.02, 0.15),
    channels={
        "force": Channel("load", "N", 0.004, MEASURED),
        "displacement": Channel("displacement", "mm", 0.007, scale=MILLIMETRE),
        "velocity": Channel("velocity", "m/s", 0.01),
    },
    judged=("displacement", "velocity"),
    right=[],
    also=[],
    why="Foreign: an eddy-current brake, 7 N at 0.10 m/s, falling beyond as 2u/(1+u^2); speeds reach 0.7 to 0.9 m/s. Neither a step at "
    "reversals nor a power of the velocity.",
    acceptable=["unknown, or incomplete with the rest said to follow the velocity"],
    honest=[
        "a damping or friction law that falls with speed (stribeck_friction, power_law_damping) without certainty or called incomplete"
    ],
    wrong="Any name as certain and complete; none.",
)
GEAR_MESH = Case(
    name="fourth_gear_mesh",
    rig="mesh.xml",
    clock=Clock(1000, 10),
    specimen=OnAxis(
        properties=Axis(0.012, MESH_STIFFNESS, 0.11),
        missing=Missing(crack_depth=0.42, crack_rate=2.3, crack_share=0.34, crack_wander=0.06),
        background=Background(
            hidden=0.012,
            hidden_frequency=118.0,
            hidden_ratio=0.015,
            friction=0.02,
            creep=0.1,
            wavelength=0.004,
            drift=0.012,
            settling=4.0,
        ),
        stated={"stiffness": MESH_STIFFNESS * (1 - MESH_LOSS)},
    ),
    records=(
        Record("identification", 7, tones(2.0, 5, 70, 45, tilt=0.1, swell=0.3), phase=0.17),
        Record("validation", 7, bursts(2.6, 6, 65, 110), phase=0.71),
    ),
    parameters=turning("wheel", "mesh", 0.015, 0.05, 0.2),
    channels={
        "torque": Channel("load", "N m", 0.005, load_on("exciter")),
        "twist": position("mesh", "mrad", 0.01, MILLIRADIAN),
        "acc": acceleration("mesh", "rad/s^2", 0.012),
    },
    judged=("displacement", "acceleration"),
    understated=None,
    true_times=True,
    freeze=Freeze("twist", "identification", 0.24, 20),
    model=gear_wheel,
    right=[],
    also=[],
    why="Foreign: a cracked tooth pair takes up to 42 % of the mesh stiffness during a third of each turn (2.3 turns a second, wandering; "
    "the turn is not logged). Stiffness that changes periodically with an unlogged angle; its mean is as stated.",
    acceptable=["unknown, or incomplete with the rest said to be unexplained"],
    honest=[
        "stiffness_error, stiffness_drift, time_varying_friction and the like without certainty or called incomplete"
    ],
    wrong="Any name as certain and complete; none.",
)
FOREIGN = (EDDY_SLIDER, GEAR_MESH)
"""Both of them."""
