"""The virtual rig of A5, its record, and what is identified from it.

The printed estimates cannot themselves be the rig: with a cubic term of -48.61 lbf/in^3 the model softens beyond its
strength and runs away when it is simulated under ±15 lbf. The virtual rig is a spring, a damper and a Bouc-Wen element
side by side, found by searching mass, stiffness, strength, skew and bandwidth for the printed ranges and the signs of the
printed estimates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.adaptive_history import AdaptiveHistory
from bench.identification.regressors import Reference, sdof_model
from bench.laws.coupling import INCH, POUND_FORCE
from bench.recording import Recording
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import BandLimitedNoise, Excitation


@dataclass(frozen=True)
class HystereticRecordSetup:
    """Numbers of `bench.reproduction.hysteretic_record`."""

    mass: float = 0.082
    spring: float = 11.4
    damper: float = 0.27
    slope: float = 41.0
    strength: float = 19.0
    skew: float = 0.77
    band: tuple[float, float] = (0.5, 13.0)
    peak: float = 15.0
    duration: float = 120.0
    rate: float = 1000.0
    seed: int = 7
    printed: tuple[float, ...] = (48.48, 0.18, -48.61, -0.12, -1.76, -0.00, 0.12)
    filter_rate: float = 5.0


SETUP = HystereticRecordSetup()


def drive() -> Excitation:
    """The excitation."""
    noise = BandLimitedNoise(low=SETUP.band[0], cutoff=SETUP.band[1], peak=SETUP.peak * POUND_FORCE)
    return Excitation({"shaker": noise}, duration=SETUP.duration, sample_rate=SETUP.rate)


def record(seed: int = SETUP.seed) -> Recording:
    """The test."""
    softening = SETUP.slope / SETUP.strength / INCH
    rig = sdof_rig(
        Element.of(
            "linear",
            "carriage",
            name="spring",
            stiffness=SETUP.spring * STIFFNESS,
            damping=SETUP.damper * STIFFNESS,
        ),
        Element.of(
            "bouc_wen",
            "carriage",
            name="slide",
            A=SETUP.slope * STIFFNESS,
            beta=(1.0 - SETUP.skew) * softening,
            gamma=SETUP.skew * softening,
            n=1.0,
        ),
        mass=SETUP.mass * STIFFNESS,
    )
    return sdof_view(simulate(rig, drive(), rng=np.random.default_rng(seed)), SETUP.mass)


def identify_general_model(test: Recording) -> tuple[AdaptiveLeastSquares, AdaptiveHistory]:
    """The seven parameters on line, P(0) = 1000 on parameters scaled to the rig's ranges."""
    model = sdof_model(
        2, mass=SETUP.mass, filter_rate=SETUP.filter_rate, reference=Reference(10.0, 0.3, 6.0, 200.0)
    )
    estimator = AdaptiveLeastSquares(model, initial_covariance=1000.0, sample_rate=SETUP.rate)
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
    k, c, d, *powers = SETUP.printed
    time, force = test.time, test["force"]

    def slope(t: float, y: Sequence[float]) -> tuple[float, float, float]:
        x, v, w = y
        r = k * x + c * v + d * x**3 + w
        size, speed = abs(r), abs(v)
        terms = (speed * r, v * size, speed * size * r, v * size * size)
        hysteretic = sum(theta * term for theta, term in zip(powers, terms, strict=True))
        return v, (float(np.interp(t, time, force)) - r) / SETUP.mass, hysteretic

    def gone(t: float, y: Sequence[float]) -> float:
        return abs(y[0]) - 10.0 * 0.5  # ten times the printed range

    gone.terminal = True  # type: ignore[attr-defined]
    # 10 ms: the force, flat to 13 Hz, must not be stepped over; 1e-6 is far below the margin of the event.
    end = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0, 0.0), events=gone, rtol=1e-6, atol=1e-6, max_step=0.01)
    return f"runs away after {end.t[-1]:.0f} s" if end.status == 1 else "stays bounded"
