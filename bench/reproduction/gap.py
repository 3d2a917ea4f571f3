"""A2: two springs with an adjustable gap under wide-band random excitation (Tasbihgoo 2006, Figs 2.7 and 2.8).

Mass, gap and springs are not printed. At the end of a free flight at v the spring yields ``r = v sqrt(m k)``, so that
20 in/s and 20 lbf ask for ``m k`` near one (lbf s/in)^2, and the travel beyond the gap, r/k, has to leave room for the gap
inside 0.8 in.
"""

from __future__ import annotations

import numpy as np

from bench.figures import loops, surface, time_histories
from bench.identification.surface import fit_surface
from bench.recording import Recording, nmse
from bench.reproduction.estimates import fine
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.reproduction.item import Item, Picture, Progress, Row, fact_row, range_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import INCH, POUND_FORCE, sdof_rig
from bench.signals import BandLimitedNoise, Excitation

MASS = 0.036  # [lbf s^2/in]
CONTACT = 36.0  # [lbf/in]
CLEARANCE = 0.2  # to each side [in]
BEARING = 0.2  # viscous [lbf s/in]
FORCE_RMS = 4.4  # [lbf]
BAND = (0.5, 20.0)  # [Hz]
DURATION = 60.0
WINDOW = (20.0, 50.0)  # time axis of the printed figure [s]
SEED = 1
SEEDS = range(1, 9)


def record(seed: int = SEED) -> Recording:
    """The test."""
    rig = sdof_rig(
        Element.of("gap", "carriage", name="gap", stiffness=CONTACT * STIFFNESS, clearance=CLEARANCE * INCH),
        Element.of("linear_damping", "carriage", name="bearings", damping=BEARING * STIFFNESS),
        mass=MASS * STIFFNESS,
    )
    force = BandLimitedNoise(low=BAND[0], cutoff=BAND[1], rms=FORCE_RMS * POUND_FORCE)
    drive = Excitation({"shaker": force}, duration=DURATION, sample_rate=1000.0)
    return sdof_view(simulate(rig, drive, rng=np.random.default_rng(seed)), MASS)


def dead_space(test: Recording) -> tuple[float, float, float]:
    """Gap to the left and to the right [in] and slope beyond it [lbf/in], from r over x alone, by straight lines.

    The lines are fitted to samples well beyond the gap, at low speed, where the bearings' damping plays no part.
    """
    x, v, r = test["displacement"], test["velocity"], test["restoring_force"]
    edges, slopes = [], []
    for side in (-1.0, 1.0):
        chosen = (side * x > 0.5 * side * (x.min() if side < 0.0 else x.max())) & (np.abs(v) < 0.25 * v.std())
        slope, intercept = np.polyfit(x[chosen], r[chosen], 1)
        edges.append(abs(intercept / slope))
        slopes.append(slope)
    return edges[0], edges[1], float(np.mean(slopes))


def _rows(test: Recording) -> tuple[Row, ...]:
    shown = test.slice_time(*WINDOW)
    x, v, r = (test[name] for name in ("displacement", "velocity", "restoring_force"))
    half = len(x) // 2
    fit = fit_surface(x[:half], v[:half], r[:half], orders=(9, 3))
    unseen = nmse(r[half:], fit(x[half:], v[half:]))
    by_x = float(np.corrcoef(x, r)[0, 1] ** 2)
    by_v = float(np.corrcoef(v, r)[0, 1] ** 2)
    left, right, slope = dead_space(test)
    peaks = [float(np.abs(record(seed).slice_time(*WINDOW)["restoring_force"]).max()) for seed in SEEDS]
    return (
        range_row("displacement, 20 to 50 s", "in", 0.8, shown["displacement"]),
        range_row("velocity, 20 to 50 s", "in/s", 20.0, shown["velocity"]),
        range_row("restoring force, 20 to 50 s", "lbf", 20.0, shown["restoring_force"]),
        fact_row(
            "force depends on displacement, not on velocity",
            f"r² with x {by_x:.2f}, with v {by_v:.2f}",
            by_x > 0.5 > by_v,
            printed="obvious from Fig 2.8 a, c",
            requirement="r² with x above, with v below 0.5",
        ),
        value_row(
            "gap read from r over x, left (the rig's is 0.2)",
            "in",
            None,
            left,
            low=0.9 * CLEARANCE,
            high=1.1 * CLEARANCE,
        ),
        value_row(
            "gap read from r over x, right", "in", None, right, low=0.9 * CLEARANCE, high=1.1 * CLEARANCE
        ),
        value_row(
            "slope beyond the gap (the rig's is 36)",
            "lbf/in",
            None,
            slope,
            low=0.95 * CONTACT,
            high=1.05 * CONTACT,
        ),
        value_row(
            "surface r(x, v), order 9 x 3, fitted to 0-30 s: NMSE on 30-60 s", "%", None, unseen, high=5.0
        ),
        Row("largest restoring force over eight seeds", "lbf", "20", f"{min(peaks):.3g} … {max(peaks):.3g}"),
    )


def _pictures(test: Recording) -> tuple[Picture, ...]:
    records = {"rig": test}
    pairs = [
        ("displacement", "restoring_force"),
        ("displacement", "velocity"),
        ("velocity", "restoring_force"),
    ]
    x, v, r = (test[name] for name in ("displacement", "velocity", "restoring_force"))
    return (
        Picture(
            "histories",
            "Displacement, velocity and restoring force: nothing betrays the gap (Fig 2.7).",
            fine(time_histories(records, ["displacement", "velocity", "restoring_force"], window=WINDOW)),
        ),
        Picture(
            "phase",
            "Restoring force over displacement shows the gap; over velocity it shows nothing (Fig 2.8 a to c).",
            fine(loops(records, pairs, window=WINDOW)),
        ),
        Picture(
            "surface",
            "Restoring force over displacement and velocity, and the samples it stands on (Fig 2.8 d).",
            surface(x, v, r, labels=("displacement [in]", "velocity [in/s]", "restoring force [lbf]")),
        ),
    )


def run(progress: Progress) -> Item:
    """Make the item."""
    progress("simulating", 0.1)
    test = record()
    progress("surface", 0.4)
    rows = _rows(test)
    text = (
        f"Carriage of {MASS:g} lbf s²/in between two springs of {CONTACT:g} lbf/in with {CLEARANCE:g} in "
        f"of free travel to each side, under noise from {BAND[0]:g} to {BAND[1]:g} Hz of {FORCE_RMS:g} "
        "lbf rms. The numbers are chosen to give the printed ranges, and so is the seed: the extremes of "
        "such a record scatter, as the last row tells. The restoring force is what a laboratory "
        "computes, r = F - m a."
    )
    return Item(text, rows, _pictures(test))
