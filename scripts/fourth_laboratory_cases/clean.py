"""A case in which nothing of size is missing."""

from __future__ import annotations

from third_laboratory_cases.case import Parameter
from third_laboratory_cases.units import load_on, of_joint

from fourth_laboratory_cases.case import Case, Channel, Clock, Freeze, Record
from fourth_laboratory_cases.grading import FRICTION, SLOW
from fourth_laboratory_cases.models import frame
from fourth_laboratory_cases.signals import bursts, tones
from fourth_laboratory_cases.specimens import Storeys
from fourth_laboratory_cases.storeys import Background, Frame
from fourth_laboratory_cases.units import MICROMETRE

LAP_FRAME = Case(
    name="fourth_lap_frame",
    rig="frame.xml",
    clock=Clock(500, 20),
    specimen=Storeys(
        properties=Frame(
            mass_1=6.3, mass_2=4.1, stiffness_1=3.1e4, stiffness_2=2.2e4, damping_1=19.0, damping_2=14.0
        ),
        background=Background(
            hidden=0.03,
            hidden_frequency=58.0,
            hidden_ratio=0.02,
            friction_1=0.12,
            friction_2=0.1,
            creep=0.01,
            drift=-0.006 / 12,
        ),
    ),
    records=(
        Record("identification", 12, tones(24, 2.5, 28, 40, tilt=0.1, swell=0.4)),
        Record("validation", 11, bursts(40, 3, 26, 80)),
    ),
    parameters={
        "mass:lower": Parameter("mass_1", 0.02, "kg"),
        "mass:upper": Parameter("mass_2", 0.02, "kg"),
        "stiffness:columns": Parameter("stiffness_1", 0.03, "N/m"),
        "stiffness:lap": Parameter("stiffness_2", 0.04, "N/m"),
        "damping:columns": Parameter("damping_1", 0.2, "N s/m"),
        "damping:lap": Parameter("damping_2", 0.2, "N s/m"),
    },
    channels={
        "shaker_force": Channel("load", "N", 0.006, load_on("shaker")),
        "lower_acc": Channel("acceleration_1", "m/s^2", 0.016, {"sensor": "lower_acc"}),
        "upper_acc": Channel("acceleration_2", "m/s^2", 0.016, {"sensor": "upper_acc"}),
        "lap_slip": Channel("slip", "um", 0.014, of_joint("lap", "position"), MICROMETRE),
    },
    judged=("acceleration_1", "acceleration_2", "slip"),
    understated=2.0,
    freeze=Freeze("upper_acc", "validation", 0.72, 16),
    model=frame,
    right=[[], ["coulomb_friction"], ["presliding_friction"], ["stribeck_friction"]],
    also=[*FRICTION, *SLOW],
    limit=0.08,
    why="Nothing of size: the stated frame within its stated uncertainty, noise of twice the stated size. Small friction is truly there "
    "(0.12 N and 0.10 N of 24 to 40 N).",
    acceptable=["no effect", "nothing but small dry friction"],
    honest=["unknown at a gap of a few per cent", "a remark that the stated noise is too small"],
    wrong="Any parameter, sensor, stop or other effect named with certainty.",
)
CLEAN = (LAP_FRAME,)
"""It alone."""
