"""The simulated Bouc-Wen system of A4: its test on the rig, its equations integrated by themselves, and the estimators."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.adaptive_history import AdaptiveHistory
from bench.identification.regressors import bouc_wen_model
from bench.laws.coupling import INCH, POUND_FORCE
from bench.recording import Recording
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import BandLimitedNoise, Excitation


@dataclass(frozen=True)
class BoucWenRigSetup:
    """Numbers of `bench.reproduction.bouc_wen_rig`."""

    true: NDArray[np.float64] = field(default_factory=lambda: np.array([5.0, 0.0, 0.0, -0.1, -1.0]))
    """A/eta, -nu beta a1/eta, nu gamma a1/eta, and the latter two for a2, in lbf, in, s."""
    changed: NDArray[np.float64] = field(default_factory=lambda: np.array([4.0, 0.0, 0.0, -0.2, -1.2]))
    printed: tuple[float, ...] = (5.000, 0.002, 0.002, -0.100, -1.001)
    period: float = 2.0 * math.pi / math.sqrt(5.0)
    peak: float = 10.0
    cutoff: float = 9.0
    duration: float = 120.0
    rate: float = 1000.0
    timestep: float = 2e-4
    """A command is held over a step and thus lags by half of one [s]; at 1 ms the estimates would feel it."""
    seed: int = 6


SETUP = BoucWenRigSetup()


def record(seed: int = SETUP.seed, *, timestep: float = SETUP.timestep) -> Recording:
    """The test on the rig, in inches and pounds-force, with a mass of 1 lbf s^2/in."""
    # The dissertation's gamma of -1 is +1 in the sign of the law (see `bench.laws.bouc_wen`).
    unit = 1.0 / (INCH * POUND_FORCE)
    element = Element.of(
        "bouc_wen", "carriage", name="hysteresis", A=5.0 * STIFFNESS, beta=0.1 * unit, gamma=1.0 * unit, n=2.0
    )
    noise = BandLimitedNoise(cutoff=SETUP.cutoff, peak=SETUP.peak * POUND_FORCE)
    drive = Excitation({"shaker": noise}, duration=SETUP.duration, sample_rate=1.0 / timestep)
    rig = sdof_rig(element, mass=STIFFNESS, timestep=timestep)
    return sdof_view(
        simulate(rig, drive, rng=np.random.default_rng(seed), sample_rate=SETUP.rate),
        1.0,
    )


def integrate_alone(force: NDArray[np.float64], thetas: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Displacement, velocity, acceleration (n, 3) under a force held over each step; theta may change with the sample."""
    step = 1.0 / SETUP.rate
    x = v = r = 0.0
    rows = np.empty((len(force), 3))
    for k, (load, theta) in enumerate(zip(force.tolist(), thetas, strict=True)):
        rows[k] = x, v, load - r
        a, b, c, d, e = theta.tolist()

        def slope(x: float, v: float, r: float) -> tuple[float, float, float]:
            size, speed = abs(r), abs(v)
            return v, load - r, a * v + b * speed * r + c * v * size + d * speed * size * r + e * v * r * r  # noqa: B023

        k1 = slope(x, v, r)
        k2 = slope(*(y + 0.5 * step * s for y, s in zip((x, v, r), k1, strict=True)))
        k3 = slope(*(y + 0.5 * step * s for y, s in zip((x, v, r), k2, strict=True)))
        k4 = slope(*(y + step * s for y, s in zip((x, v, r), k3, strict=True)))
        x, v, r = (
            y + step / 6.0 * (p + 2.0 * (q + s) + t)
            for y, p, q, s, t in zip((x, v, r), k1, k2, k3, k4, strict=True)
        )
    return rows


def plain_estimator(*, jump_ratio: float = 0.0) -> AdaptiveLeastSquares:
    """The estimator in the dissertation's own form; lambda is a third of the natural frequency."""
    model = bouc_wen_model(2, mass=1.0, filter_rate=0.7)
    return AdaptiveLeastSquares(
        model,
        forgetting=0.02,
        initial_covariance=1e6,
        sample_rate=SETUP.rate,
        jump_ratio=jump_ratio,
    )


def noise_estimator() -> AdaptiveLeastSquares:
    """The estimator with its measures against noise; it forgets nothing, since the parameters stay."""
    model = bouc_wen_model(2, mass=1.0, filter_rate=1.2, denoise_after=3.0, crossover=50.0)
    return AdaptiveLeastSquares(model, initial_covariance=1e6, sample_rate=SETUP.rate)


def run_estimator(
    estimator: AdaptiveLeastSquares, time: NDArray, force: NDArray, velocity: NDArray, acceleration: NDArray
) -> AdaptiveHistory:
    """Run the estimator over a record, keeping the regressors."""
    return estimator.run(
        time, force=force, velocity=velocity, acceleration=acceleration, keep_regressors=True
    )


def settled_after(history: AdaptiveHistory, theta: NDArray[np.float64], share: float = 0.05) -> float:
    """Time from which on each estimate stays within a share of theta (of 1 for the zeros) [s]."""
    size = np.where(theta == 0.0, 1.0, np.abs(theta))
    away = np.any(np.abs(history.theta - theta) > share * size, axis=1)
    return float(history.time[away][-1]) if away.any() else float(history.time[0])
