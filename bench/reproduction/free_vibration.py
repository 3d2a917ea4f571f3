"""A1: the rig with a linear spring and damper, struck by impulses (Tasbihgoo 2006, Fig 2.6).

Mass, frequency, damping and impulses are not printed. About 3 Hz follows from the ranges (15 in/s over 0.8 in, 280 in/s^2
over 15 in/s); the mass only scales the force. Impulses are soft pushes of 0.12 s: short blows that give the printed
velocity would exceed the printed acceleration while they act.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from bench.figures import phase_plot, time_histories
from bench.recording import Recording
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.reproduction.item import Item, Picture, Progress, Row, range_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import POUND_FORCE, sdof_rig
from bench.signals import Excitation, ImpulseTrain

MASS = 0.04  # [lbf s^2/in]
FREQUENCY = 3.0  # undamped [Hz]
DAMPING_RATIO = 0.05
PUSH = 10.5  # peak of an impulse [lbf]
WINDOW = (12.0, 16.0)  # time axis of the printed figure [s]


def record() -> Recording:
    """The test: a push each way every two seconds."""
    omega = 2.0 * math.pi * FREQUENCY
    spring = Element.of(
        "linear",
        "carriage",
        name="spring",
        stiffness=MASS * omega**2 * STIFFNESS,
        damping=2.0 * DAMPING_RATIO * omega * MASS * STIFFNESS,
    )
    push = ImpulseTrain(amplitude=PUSH * POUND_FORCE, width=0.12, interval=2.0, alternate=True)
    rig = sdof_rig(spring, mass=MASS * STIFFNESS)
    return sdof_view(
        simulate(rig, Excitation({"shaker": push}, duration=WINDOW[1], sample_rate=1000.0)), MASS
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


def run(progress: Progress) -> Item:
    """Make the item."""
    progress("simulating", 0.1)
    test = record()
    shown = test.slice_time(*WINDOW)
    decay = test.slice_time(WINDOW[0] + 0.2, WINDOW[0] + 2.0)
    frequency, ratio = frequency_and_damping(decay["displacement"], decay.time)
    rows: list[Row] = [
        range_row("displacement, 12 to 16 s", "in", 0.8, shown["displacement"]),
        range_row("velocity, 12 to 16 s", "in/s", 15.0, shown["velocity"]),
        range_row("acceleration, 12 to 16 s", "in/s^2", 280.0, shown["acceleration"]),
        value_row(
            "undamped frequency from the decay",
            "Hz",
            3.0,
            frequency,
            low=0.95 * FREQUENCY,
            high=1.05 * FREQUENCY,
        ),
        value_row(
            "damping ratio from the decay (the rig's is 0.05)",
            "1",
            None,
            ratio,
            low=0.95 * DAMPING_RATIO,
            high=1.05 * DAMPING_RATIO,
        ),
    ]
    records = {"rig": test}
    pictures = (
        Picture(
            "histories",
            "Displacement, velocity and acceleration after successive impulses (Fig 2.6 a to c).",
            time_histories(records, ["displacement", "velocity", "acceleration"], window=WINDOW),
        ),
        Picture(
            "phase",
            "Velocity over displacement: spirals of the linear decay (Fig 2.6 d).",
            phase_plot(records, "displacement", "velocity", window=WINDOW),
        ),
    )
    text = (
        f"Carriage of {MASS:g} lbf s²/in on a linear spring and damper, {FREQUENCY:g} Hz, "
        f"{100 * DAMPING_RATIO:g} % of critical, pushed alternately both ways for 0.12 s every two "
        "seconds. The dissertation prints neither mass nor stiffness nor the impulses: these are chosen "
        "so that the ranges come out."
    )
    return Item(text, tuple(rows), pictures)
