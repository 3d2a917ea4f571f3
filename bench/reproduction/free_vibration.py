"""A1: the rig with a linear spring and damper, struck by impulses (Tasbihgoo 2006, Fig 2.6).

Mass, frequency, damping and impulses are not printed. Of the acceleration the labels -250 to -50
in/s^2 can be read; 280 in/s^2 and 3 Hz are derived, from 15 in/s over 0.8 in as in harmonic motion. The mass only scales the
force. Impulses are soft pushes of 0.12 s: short blows that give the printed velocity would exceed the printed acceleration
while they act.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bench.figures import phase_plot, time_histories
from bench.laws.coupling import POUND_FORCE
from bench.progress import ShowProgress
from bench.recording import Recording
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.reproduction.item import Item, Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import Row, axis_row, told_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import Excitation, ImpulseTrain


@dataclass(frozen=True)
class FreeVibrationSetup:
    """Numbers of `bench.reproduction.free_vibration`."""

    mass: float = 0.04
    frequency: float = 3.0
    damping_ratio: float = 0.05
    push: float = 10.5
    window: tuple[float, float] = (12.0, 16.0)


SETUP = FreeVibrationSetup()
CHOSEN = "mass, stiffness, damping and impulses"


def record() -> Recording:
    """The test: a push each way every two seconds."""
    omega = 2.0 * math.pi * SETUP.frequency
    spring = Element.of(
        "linear",
        "carriage",
        name="spring",
        stiffness=SETUP.mass * omega**2 * STIFFNESS,
        damping=2.0 * SETUP.damping_ratio * omega * SETUP.mass * STIFFNESS,
    )
    push = ImpulseTrain(amplitude=SETUP.push * POUND_FORCE, width=0.12, interval=2.0, alternate=True)
    rig = sdof_rig(spring, mass=SETUP.mass * STIFFNESS)
    return sdof_view(
        simulate(rig, Excitation({"shaker": push}, duration=SETUP.window[1], sample_rate=1000.0)), SETUP.mass
    )


def frequency_and_damping(displacement: np.ndarray, time: np.ndarray) -> tuple[float, float]:
    """Undamped frequency [Hz] and damping ratio of a free decay, from its upward crossings and its peaks."""
    rising = np.flatnonzero((displacement[:-1] < 0.0) & (displacement[1:] >= 0.0))
    share = -displacement[rising] / (displacement[rising + 1] - displacement[rising])
    crossings = time[rising] + share * (time[rising + 1] - time[rising])
    peaks = np.array([displacement[a:b].max() for a, b in pairwise(rising)])
    decrement = math.log(peaks[0] / peaks[-1]) / (len(peaks) - 1)
    ratio = decrement / math.hypot(decrement, 2.0 * math.pi)
    return float((len(crossings) - 1) / (crossings[-1] - crossings[0])) / math.sqrt(1.0 - ratio**2), ratio


def _rows(shown: Recording, frequency: float, ratio: float) -> tuple[Row, ...]:
    peak = {name: float(np.abs(shown[name]).max()) for name in ("displacement", "velocity", "acceleration")}
    derived = 15.0**2 / 0.8
    return (
        axis_row(
            "displacement, 12 to 16 s",
            "in",
            0.8,
            0.4,
            shown["displacement"],
            source=fig("2.6 a"),
            chosen=CHOSEN,
        ),
        axis_row(
            "velocity, 12 to 16 s", "in/s", 15.0, 7.5, shown["velocity"], source=fig("2.6 b"), chosen=CHOSEN
        ),
        value_row(
            "acceleration, 12 to 16 s, lowest",
            "in/s^2",
            "labels to -250 every 50; the others are not legible",
            float(shown["acceleration"].min()),
            high=-200.0,
            source=f"{fig('2.6 c')}, axis labels",
            tolerance="beyond the last legible label but one, -200",
            reason="the axis reaches -250 at least; how far beyond cannot be read",
            chosen=CHOSEN,
        ),
        told_row(
            "largest acceleration",
            "in/s^2",
            f"{peak['acceleration']:.0f}",
            f"the {derived:.0f} that others and we have called printed are derived: v²/x of the axes, as in harmonic motion",
        ),
        told_row(
            "undamped frequency from the decay",
            "Hz",
            f"{frequency:.3f}",
            "not printed: v/x of the axes over 2π gives 2.98 Hz, and the rig was given 3 Hz",
        ),
        value_row(
            "damping ratio from the decay (the rig's is 0.05)",
            "1",
            None,
            ratio,
            low=0.99 * SETUP.damping_ratio,
            high=1.01 * SETUP.damping_ratio,
            reason="peaks read off 1 ms samples are low by up to (ωh/2)²/2 = 4e-5, over decrements of 0.3: far below 1 %",
        ),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    progress("simulating", 0.1)
    test = record()
    shown = test.slice_time(*SETUP.window)
    decay = test.slice_time(SETUP.window[0] + 0.2, SETUP.window[0] + 2.0)
    frequency, ratio = frequency_and_damping(decay["displacement"], decay.time)
    rows = _rows(shown, frequency, ratio)
    records = {"rig": test}
    pictures = (
        Picture(
            "histories",
            "Displacement, velocity and acceleration after successive impulses (Fig 2.6 a to c).",
            time_histories(records, ["displacement", "velocity", "acceleration"], window=SETUP.window),
            panels("2.6", "abc"),
        ),
        Picture(
            "phase",
            "Velocity over displacement: spirals of the linear decay (Fig 2.6 d).",
            phase_plot(records, "displacement", "velocity", window=SETUP.window),
            panels("2.6", "d"),
        ),
    )
    text = (
        f"Carriage of {SETUP.mass:g} lbf s²/in on a linear spring and damper, {SETUP.frequency:g} Hz, "
        f"{100 * SETUP.damping_ratio:g} % of critical, pushed alternately both ways for 0.12 s every two "
        "seconds. The dissertation prints neither mass nor stiffness nor the impulses: these are chosen "
        "so that the ranges come out."
    )
    return Item(text, rows, pictures, f"{CHOSEN}, by hand, for the axes of Fig 2.6; no seed")
