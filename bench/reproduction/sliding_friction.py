"""A3: a bar sliding between two edges whose grip a stepper motor changes (Tasbihgoo 2006, Figs 2.9 and 2.10).

The printed force gauge reads *more* when the grip is strong, and the motion is then small: the shaker is no ideal source
of force. Its coil moves with the carriage, and the back-EMF of an amplifier of constant voltage takes force in proportion
to the velocity: what passes the load cell is ``F = F_coil - c_emf v``. Here the coil's force drives the rig, the back-EMF is
an element on the carriage, and the gauge is computed from both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bench.figures import loops, time_histories
from bench.laws.coupling import INCH, POUND_FORCE
from bench.progress import ShowProgress
from bench.recording import Recording
from bench.reproduction.estimates import fine
from bench.reproduction.imperial import STIFFNESS, imperial
from bench.reproduction.item import Item, Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import Row, axis_row, fact_row, told_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import Constant, Excitation, Harmonic, Signal, Tapered


@dataclass(frozen=True)
class SlidingFrictionSetup:
    """Numbers of `bench.reproduction.sliding_friction`."""

    mass: float = 0.04
    spring: float = 16.0
    back_emf: float = 0.8
    coil: float = 15.8
    frequency: float = 3.2
    friction_coefficient: float = 0.2
    grip: tuple[float, float] = (7.5, 70.0)
    steady_grip: float = 25.0
    modulation: float = 2.0 / 30.0
    creep: float = 0.3
    duration: float = 30.0


SETUP = SlidingFrictionSetup()
CHOSEN = "mass, spring, friction, grip, force and frequency of the coil, back-EMF"


def record(normal_force: Signal) -> Recording:
    """The test under a course of the normal force [N]."""
    rig = sdof_rig(
        Element.of(
            "linear", "carriage", name="spring", stiffness=SETUP.spring * STIFFNESS, damping=0.02 * STIFFNESS
        ),
        Element.of(
            "controlled_friction",
            "carriage",
            name="slide",
            inputs=("normal_force",),
            mu=SETUP.friction_coefficient,
            regularisation_velocity=SETUP.creep * INCH,
        ),
        Element.of("linear_damping", "carriage", name="back_emf", damping=SETUP.back_emf * STIFFNESS),
        mass=SETUP.mass * STIFFNESS,
    )
    # Faded in over a second: the start of a sine would leave a transient above the steady motion.
    coil = Tapered(Harmonic(SETUP.frequency, SETUP.coil * POUND_FORCE), fade_in=1.0)
    drive = Excitation(
        {"shaker": coil, "normal_force": normal_force}, duration=SETUP.duration, sample_rate=1000.0
    )
    test = imperial(simulate(rig, drive)).renamed({"acceleration_x": "acceleration"})
    gauge = test["load_cell"] - test["back_emf/force"]
    arrays = {"force_gauge": gauge, "restoring_force": gauge - SETUP.mass * test["acceleration"]}
    return test.with_channels(
        arrays, units=dict.fromkeys(arrays, "lbf"), quantities=dict.fromkeys(arrays, "force")
    )


def modulated() -> Signal:
    """The grip over two periods, from its smallest value to its largest [N]."""
    mean, swing = 0.5 * (SETUP.grip[1] + SETUP.grip[0]), 0.5 * (SETUP.grip[1] - SETUP.grip[0])
    return Constant(mean * POUND_FORCE) + Harmonic(
        SETUP.modulation, swing * POUND_FORCE, phase=-0.5 * math.pi
    )


def envelope(values: np.ndarray, time: np.ndarray, at: float) -> float:
    """Largest magnitude over one period of the excitation about a time."""
    return float(np.max(np.abs(values[np.abs(time - at) <= 0.5 / SETUP.frequency])))


def _loops_apart(constant: Recording) -> float:
    """Largest difference of the displacement between steady cycles five seconds apart, over the stroke [%]."""
    # 3.2 Hz: five seconds are sixteen cycles exactly
    first, later = (constant.slice_time(start, start + 5.0)["displacement"] for start in (20.0, 25.0))
    n = min(first.size, later.size)
    return 100.0 * float(np.max(np.abs(first[:n] - later[:n])) / np.ptp(first))


def _range_rows(test: Recording) -> list[Row]:
    axes = {
        "displacement": ("in", 1.0, 0.5, "a"),
        "velocity": ("in/s", 20.0, 10.0, "b"),
        "acceleration": ("in/s^2", 400.0, 200.0, "c"),
        "force_gauge": ("lbf", 15.0, 7.5, "d"),
    }
    return [
        axis_row(
            name.replace("_", " "),
            unit,
            axis,
            inner,
            test[name],
            source=fig(f"2.9 {part}"),
            chosen=CHOSEN,
            why="force, friction and back-EMF that give all other axes leave it a little beyond its own",
        )
        for name, (unit, axis, inner, part) in axes.items()
    ]


def _grip_rows(test: Recording) -> list[Row]:
    """What a strong grip does to the gauge and to the motion."""
    loose, tight = 1.0 / SETUP.modulation, 1.5 / SETUP.modulation
    swing = {
        name: (envelope(test[name], test.time, loose), envelope(test[name], test.time, tight))
        for name in ("displacement", "velocity", "force_gauge")
    }
    return [
        fact_row(
            "strong grip: the gauge reads more",
            f"{swing['force_gauge'][0]:.3g} → {swing['force_gauge'][1]:.3g} lbf",
            swing["force_gauge"][1] > 2.0 * swing["force_gauge"][0],
            printed="increases dramatically",
            source=f"{fig('2.9 d')}, sentence on p. 21",
            tolerance="at least to the double",
            reason="no number is printed; less than the double is not dramatic",
            chosen="the back-EMF, without which it does not hold",
        ),
        fact_row(
            "strong grip: the motion falls",
            f"{swing['displacement'][0]:.3g} → {swing['displacement'][1]:.3g} in",
            swing["displacement"][1] < 0.5 * swing["displacement"][0],
            printed="significant reduction",
            source=f"{fig('2.9 a')}, sentence on p. 21",
            tolerance="to less than half",
            reason="no number is printed; the amplitude halved is significant",
        ),
    ]


def _loop_rows(constant: Recording) -> list[Row]:
    """Loops under a constant grip: whether they repeat, and their area."""
    last = constant.slice_time(20.0, 20.0 + 1.0 / SETUP.frequency)
    area = float(np.sum(last["slide/force"] * last["velocity"]) / constant.sample_rate)
    stroke = 2.0 * float(np.ptp(last["displacement"]))
    omega = 2.0 * math.pi * SETUP.frequency
    loops_apart = _loops_apart(constant)
    return [
        fact_row(
            "constant grip, steady: successive loops do not fall on top of each other",
            f"they differ by {loops_apart:.2g} % of the stroke",
            loops_apart > 1.0,
            printed="do not fall exactly on top of each other: variability of the physical parameters",
            source=f"{fig('2.10 a')}, sentence on p. 22",
            tolerance="at least 1 % of the stroke",
            reason="about the width of a line in the printed figure: less cannot be seen",
            why="the virtual rig is the same in every cycle: nothing in it wears, warms or drifts",
        ),
        value_row(
            "constant grip: area of the slide's loop over friction limit times path",
            "1",
            None,
            area / (SETUP.friction_coefficient * SETUP.steady_grip * stroke),
            low=1.0 - SETUP.creep / (omega * 0.25 * stroke),
            high=1.0,
            reason="the loop of dry friction is a rectangle; the creep velocity over the peak velocity is cut from its corners",
        ),
    ]


def _rows(test: Recording, constant: Recording) -> tuple[Row, ...]:
    return (
        *_range_rows(test),
        told_row(
            "periods of the normal force in 30 s",
            "1",
            f"{SETUP.modulation * SETUP.duration:g}",
            "put in; the axis of Fig 2.9 e is the stepper motor's relative position, not a force",
            printed="about two",
            source=f"{fig('2.9 e')}, sentence on p. 21",
        ),
        *_grip_rows(test),
        *_loop_rows(constant),
    )


def _pictures(test: Recording, constant: Recording) -> tuple[Picture, ...]:
    return (
        Picture(
            "histories",
            "Modulated friction: motion, force gauge and normal force; the motion dies where the grip is strong (Fig 2.9).",
            fine(
                time_histories(
                    {"rig": test}, ["displacement", "velocity", "acceleration", "force_gauge", "normal_force"]
                )
            ),
            panels("2.9", "abcde"),
        ),
        Picture(
            "loop_constant",
            "Restoring force over displacement under a constant grip, steady state: one parallelogram (Fig 2.10 a).",
            fine(
                loops({"rig": constant}, [("displacement", "restoring_force")], window=(10.0, SETUP.duration))
            ),
            panels("2.10", "a"),
        ),
        Picture(
            "loop_modulated",
            "The same while the grip falls from its largest to its smallest value: from short loops to long ones (Fig 2.10 b).",
            fine(loops({"rig": test}, [("displacement", "restoring_force")], window=(7.5, 15.0))),
            panels("2.10", "b"),
        ),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    progress("simulating", 0.1)
    test = record(modulated())
    constant = record(Constant(SETUP.steady_grip * POUND_FORCE))
    text = (
        f"Carriage of {SETUP.mass:g} lbf s²/in, spring of {SETUP.spring:g} lbf/in, friction coefficient "
        f"{SETUP.friction_coefficient:g}, normal force between {SETUP.grip[0]:g} and {SETUP.grip[1]:g} lbf, coil force of "
        f"{SETUP.coil:g} lbf at {SETUP.frequency:g} Hz, chosen to give the printed ranges. An ideal source of force "
        "would make the gauge read the same throughout; the printed gauge reads more when the grip is "
        "strong, which the back-EMF of a shaker on a voltage amplifier explains."
    )
    searched = f"{CHOSEN}, by hand, for the axes of Fig 2.9; no seed"
    return Item(text, _rows(test, constant), _pictures(test, constant), searched)
