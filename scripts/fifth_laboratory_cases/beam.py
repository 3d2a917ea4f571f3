"""The case of a clamped beam that a laser vibrometer looks at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from fourth_laboratory_cases.units import GRAVITIES
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import MILLIMETRE

from bench.arrays import Array
from fifth_laboratory_cases.case import MAINS, Case, Channel, Hum, Parameter, Record, Run
from fifth_laboratory_cases.motion import Oscillator, Signals, of_oscillator
from fifth_laboratory_cases.signals import band, multisine, sweep
from fifth_laboratory_cases.stepping import at_half_steps, pull, stepper


class Beam(NamedTuple):
    """One mode of a beam in a loose clamp, with a cable that swings on it."""

    own: Oscillator
    """What its nominal model has: cable and clamp included."""
    slipping: float
    """Part of the stiffness that the clamp carries by friction, after Dahl."""
    cable: float
    """Mass of the cable [kg]."""
    hum: float
    """Amplitude of a force [N] of the frequency of the mains."""


SLIP = 2e-4
"""Displacement [m] that the clamp nears where it slips."""


@inlined
def derivative(p: Beam, s: Array, load: Array, t: float) -> tuple[float, float, float, float, float]:
    """Time derivative of displacement and velocity of beam and cable, and of the displacement that the clamp holds, under a force [N]."""
    x, v, y, w, z = s[0], s[1], s[2], s[3], s[4]
    swinging = pull(p.cable, 61.0, 0.03, y - x, w - v)
    force = load[0] + p.hum * np.sin(2 * np.pi * MAINS * t) - p.own.damping * v
    force = force - p.own.stiffness * (1 - p.slipping) * x - p.slipping * p.own.stiffness * z + swinging
    cable = -swinging / p.cable if p.cable > 0 else 0.0
    return v, force / (p.own.mass - p.cable), w, cable, v * (1 - z / SLIP * np.sign(v))


march = stepper(derivative)


def beam(run: Run) -> Signals:
    """A beam that a force shakes, whose vibrometer is late."""
    load = run.load()
    p = Beam(
        own=run.oscillator(),
        slipping=run.besides(0.003),
        cable=run.besides(0.004),
        hum=run.besides(0.02),
    )
    signals = of_oscillator(load, march(p, np.zeros(5), at_half_steps(load), run.step()))
    return {**signals, "velocity": signals["velocity"]._replace(late=run.missing(1.3e-3))}


BEAM = Case(
    name="fifth_beam",
    seed=510,
    rig="sdof",
    rate=2000,
    seconds=10.0,
    simulate=beam,
    records=(
        Record("identification", multisine(510, 8, 75, 2.2)),
        Record("identification_2", sweep(10, 80, 2.2)),
        Record("validation", band(512, 8, 85, 2.4)),
    ),
    parameters={
        "mass": Parameter(0.85, 0.008, "kg"),
        "stiffness": Parameter(38.8, 0.35, "kN/m", 1e3),
        "damping": Parameter(5.0, 1.0, "N s/m"),
    },
    channels={
        "force": Channel("load", "N", 0.01),
        "velocity": Channel("velocity", "mm/s", 0.6, scale=MILLIMETRE, coloured=0.3, pole=0.9),
        "acceleration": Channel("acceleration", "g", 0.008, scale=GRAVITIES, hum=Hum(0.004, MAINS, 2.0)),
    },
    responses=("velocity", "acceleration"),
    jitter=0.03,
    right=[["velocity_delay"]],
    also=["presliding_friction", "carried_mass", "acceleration_hum", "harmonic_force"],
    limit=0.06,
    why="A clamped beam whose laser vibrometer is 1.3 ms late, by its digital decoder. Besides: a loose clamp (Dahl, 0.3 % of the "
    "stiffness, 0.2 mm), a cable of 4 g at 61 Hz, a hum of 0.02 N and one in the accelerometer, coloured noise. Nearly all of the "
    "background goes once the parameters are moved.",
    doubtful="A low-pass of second order of 170 Hz is alike up to 70 Hz (velocity_filter); velocity_lag differs by 15 % in amplitude at "
    "70 Hz.",
    alone="0.200 / 0.112",
    explained="0.012",
)
