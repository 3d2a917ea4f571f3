"""A5: the hysteretic rig under wide-band random excitation, identified on line (Tasbihgoo 2006, Figs 2.14 to 2.17).

The printed estimates cannot themselves be the rig: with a cubic term of -48.61 lbf/in^3 the model softens beyond its
strength and runs away when it is simulated under ±15 lbf. The virtual rig is a spring, a damper and a Bouc-Wen element
side by side, found by searching mass, stiffness, strength, skew and bandwidth for the printed ranges and the signs of the
printed estimates; the seven-parameter model is then identified from its record as the dissertation did.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp

from bench.figures import loops, time_histories
from bench.identification.adaptive import AdaptiveHistory, AdaptiveLeastSquares
from bench.identification.regressors import Reference, sdof_model
from bench.recording import Recording, nmse
from bench.reproduction.estimates import contribution_histories, estimate_histories, fine
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.reproduction.item import Item, Picture, Progress, Row, fact_row, range_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import INCH, POUND_FORCE, sdof_rig
from bench.signals import BandLimitedNoise, Excitation

MASS = 0.082  # [lbf s^2/in]
SPRING, DAMPER = 11.4, 0.27  # [lbf/in], [lbf s/in]
SLOPE, STRENGTH, SKEW = 41.0, 19.0, 0.77  # of the Bouc-Wen element [lbf/in], [lbf], gamma / (beta + gamma)
BAND = (0.5, 13.0)  # [Hz]
PEAK = 15.0  # [lbf]
DURATION = 120.0
RATE = 1000.0
SEED = 7
PRINTED = (48.48, 0.18, -48.61, -0.12, -1.76, -0.00, 0.12)
UNITS = ("lbf/in", "lbf s/in", "lbf/in^3", "1/in", "1/in", "1/(lbf in)", "1/(lbf in)")
FILTER_RATE = 5.0  # about a fifth of the natural frequency [rad/s]


def drive() -> Excitation:
    """The excitation."""
    noise = BandLimitedNoise(low=BAND[0], cutoff=BAND[1], peak=PEAK * POUND_FORCE)
    return Excitation({"shaker": noise}, duration=DURATION, sample_rate=RATE)


def record(seed: int = SEED) -> Recording:
    """The test."""
    softening = SLOPE / STRENGTH / INCH
    rig = sdof_rig(
        Element.of(
            "linear", "carriage", name="spring", stiffness=SPRING * STIFFNESS, damping=DAMPER * STIFFNESS
        ),
        Element.of(
            "bouc_wen",
            "carriage",
            name="slide",
            A=SLOPE * STIFFNESS,
            beta=(1.0 - SKEW) * softening,
            gamma=SKEW * softening,
            n=1.0,
        ),
        mass=MASS * STIFFNESS,
    )
    return sdof_view(simulate(rig, drive(), rng=np.random.default_rng(seed)), MASS)


def identify(test: Recording) -> tuple[AdaptiveLeastSquares, AdaptiveHistory]:
    """The seven parameters on line, P(0) = 1000 on parameters scaled to the rig's ranges."""
    model = sdof_model(2, mass=MASS, filter_rate=FILTER_RATE, reference=Reference(10.0, 0.3, 6.0, 200.0))
    estimator = AdaptiveLeastSquares(model, initial_covariance=1000.0, sample_rate=RATE)
    history = estimator.run(
        test.time,
        force=test["force"],
        displacement=test["displacement"],
        velocity=test["velocity"],
        acceleration=test["acceleration"],
        keep_regressors=True,
    )
    return estimator, history


def printed_model_fate(test: Recording) -> str:
    """What becomes of the printed estimates when they are simulated as a rig, integrated by themselves."""
    k, c, d, *powers = PRINTED
    time, force = test.time, test["force"]

    def slope(t: float, y: Sequence[float]) -> tuple[float, float, float]:
        x, v, w = y
        r = k * x + c * v + d * x**3 + w
        size, speed = abs(r), abs(v)
        terms = (speed * r, v * size, speed * size * r, v * size * size)
        hysteretic = sum(theta * term for theta, term in zip(powers, terms, strict=True))
        return v, (float(np.interp(t, time, force)) - r) / MASS, hysteretic

    def gone(t: float, y: Sequence[float]) -> float:
        return abs(y[0]) - 10.0 * 0.5  # ten times the printed range

    gone.terminal = True  # type: ignore[attr-defined]
    # 10 ms: the force, flat to 13 Hz, must not be stepped over; 1e-6 is far below the margin of the event.
    end = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0, 0.0), events=gone, rtol=1e-6, atol=1e-6, max_step=0.01)
    return f"runs away after {end.t[-1]:.0f} s" if end.status == 1 else "stays bounded"


def _rows(test: Recording, history: AdaptiveHistory, theta: np.ndarray) -> tuple[Row, ...]:
    rows = [
        range_row("excitation", "lbf", 15.0, test["force"]),
        range_row("displacement", "in", 0.5, test["displacement"]),
        range_row("velocity", "in/s", 10.0, test["velocity"]),
        range_row("acceleration", "in/s^2", 300.0, test["acceleration"]),
        range_row("restoring force", "lbf", 20.0, test["restoring_force"]),
    ]
    names = ("k", "c", "d", "-νβa₁/η", "νγa₁/η", "-νβa₂/η", "νγa₂/η")
    for i, (name, unit) in enumerate(zip(names, UNITS, strict=True)):
        rows.append(value_row(f"θ{i + 1} = {name}", unit, PRINTED[i], float(theta[i])))
    signs = [bool(np.sign(theta[i]) == np.sign(PRINTED[i])) for i in range(5)]
    rows.append(
        fact_row(
            "signs of θ1 to θ5",
            "".join("+" if value > 0 else "-" for value in theta[:5]),
            all(signs),
            printed="++---",
            requirement="as printed",
        )
    )
    late = history.time >= 55.0
    error = nmse(history.measured[late], history.predicted[late])
    rows.append(value_row("one-step prediction of z, 55 to 120 s: NMSE", "%", None, error, high=1.0))
    return tuple(rows)


def run(progress: Progress) -> Item:
    """Make the item."""
    progress("simulating", 0.1)
    test = record()
    progress("identifying on line", 0.3)
    estimator, history = identify(test)
    fate = printed_model_fate(test)
    progress("drawing", 0.7)
    window = (20.0, 30.0)
    records = {"rig": test}
    names = tuple(f"θ{i + 1}" for i in range(7))
    phases = [("displacement", "velocity"), ("displacement", "restoring_force")]
    pictures = (
        Picture(
            "histories",
            "Excitation, displacement, velocity and acceleration (Fig 2.14 a to d).",
            fine(
                time_histories(records, ["force", "displacement", "velocity", "acceleration"], window=window)
            ),
        ),
        Picture("phase", "Phase plots (Fig 2.14 e, f).", fine(loops(records, phases, window=window))),
        Picture(
            "estimates",
            "Evolution of the seven estimates, the printed asymptotic values dashed (Fig 2.15).",
            estimate_histories(history, names, reference=PRINTED, units=UNITS),
        ),
        Picture(
            "contributions",
            "z, the contribution of each term, their sum and the error, 55 to 65 s (Fig 2.17).",
            contribution_histories(history, names, window=(55.0, 65.0)),
        ),
    )
    text = (
        f"The virtual rig: {MASS:g} lbf s²/in on a spring of {SPRING:g} lbf/in, a damper of {DAMPER:g} "
        f"lbf s/in and a Bouc-Wen element of slope {SLOPE:g} lbf/in and strength {STRENGTH:g} lbf, under "
        f"noise to {BAND[1]:g} Hz. The seven parameters of the general model (section 2.4.1) are then "
        "identified on line. The printed parameters are those of another law: they agree in sign and "
        "stiffness; the terms that describe softening together (x³, |v| r, v |r|) trade against one "
        "another, so that their single values mean little. Simulated as a rig of its own, the printed "
        f"model {fate}: it predicts the force of a measured motion, and is no model to simulate with."
    )
    return Item(text, _rows(test, history, estimator.theta), pictures)
