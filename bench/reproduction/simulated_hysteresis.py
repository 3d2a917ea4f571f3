"""A4: a simulated Bouc-Wen system under wide-band random excitation, identified on line (Tasbihgoo 2006, Figs 2.11 to 2.13).

The rig's record serves Figs 2.11 to 2.13. A change of parameters within a record is no matter of a rig; for it, and as a check
on the rig, the two equations are also integrated here by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.figures import loops, time_histories
from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.adaptive_history import AdaptiveHistory
from bench.identification.regressors import bouc_wen_model
from bench.laws.coupling import INCH, POUND_FORCE
from bench.recording import Recording
from bench.reproduction.estimates import contribution_histories, estimate_histories, fine
from bench.reproduction.imperial import STIFFNESS, sdof_view
from bench.reproduction.item import Item, Picture, Progress
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import (
    VERDICT_SETUP,
    Row,
    axis_row,
    fact_row,
    value_row,
)
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import BandLimitedNoise, Excitation

NAMES = ("θ1", "θ2", "θ3", "θ4", "θ5")
UNITS = ("lbf/in", "1/in", "1/in", "1/(lbf in)", "1/(lbf in)")


@dataclass(frozen=True)
class SimulatedHysteresisSetup:
    """Numbers of `bench.reproduction.simulated_hysteresis`."""

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


SIMULATED_HYSTERESIS_SETUP = SimulatedHysteresisSetup()
CHOSEN = "band of the excitation"


def record(
    seed: int = SIMULATED_HYSTERESIS_SETUP.seed, *, timestep: float = SIMULATED_HYSTERESIS_SETUP.timestep
) -> Recording:
    """The test on the rig, in inches and pounds-force, with a mass of 1 lbf s^2/in."""
    # The dissertation's gamma of -1 is +1 in the sign of the law (see `bench.laws.bouc_wen`).
    unit = 1.0 / (INCH * POUND_FORCE)
    element = Element.of(
        "bouc_wen", "carriage", name="hysteresis", A=5.0 * STIFFNESS, beta=0.1 * unit, gamma=1.0 * unit, n=2.0
    )
    noise = BandLimitedNoise(
        cutoff=SIMULATED_HYSTERESIS_SETUP.cutoff, peak=SIMULATED_HYSTERESIS_SETUP.peak * POUND_FORCE
    )
    drive = Excitation(
        {"shaker": noise}, duration=SIMULATED_HYSTERESIS_SETUP.duration, sample_rate=1.0 / timestep
    )
    rig = sdof_rig(element, mass=STIFFNESS, timestep=timestep)
    return sdof_view(
        simulate(rig, drive, rng=np.random.default_rng(seed), sample_rate=SIMULATED_HYSTERESIS_SETUP.rate),
        1.0,
    )


def integrate(force: NDArray[np.float64], thetas: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Displacement, velocity, acceleration (n, 3) under a force held over each step; theta may change with the sample."""
    step = 1.0 / SIMULATED_HYSTERESIS_SETUP.rate
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
        sample_rate=SIMULATED_HYSTERESIS_SETUP.rate,
        jump_ratio=jump_ratio,
    )


def noise_estimator() -> AdaptiveLeastSquares:
    """The estimator with its measures against noise; it forgets nothing, since the parameters stay."""
    model = bouc_wen_model(2, mass=1.0, filter_rate=1.2, denoise_after=3.0, crossover=50.0)
    return AdaptiveLeastSquares(model, initial_covariance=1e6, sample_rate=SIMULATED_HYSTERESIS_SETUP.rate)


def estimate(
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


def _noisy_error(test: Recording, seeds: Sequence[int]) -> float:
    """Largest relative error of the non-zero estimates at the end under 2 % noise on force and acceleration [%]."""
    worst = 0.0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        force, a = (
            test[name] + 0.02 * test[name].std() * rng.standard_normal(len(test))
            for name in ("force", "acceleration")
        )
        model = noise_estimator()
        estimate(model, test.time, force, test["velocity"], a)
        error = np.abs(model.theta - SIMULATED_HYSTERESIS_SETUP.true)[[0, 3, 4]] / np.abs(
            SIMULATED_HYSTERESIS_SETUP.true[[0, 3, 4]]
        )
        worst = max(worst, 100.0 * float(error.max()))
    return worst


def _tracking(force: NDArray[np.float64]) -> tuple[AdaptiveHistory, float]:
    """Estimates through a change of parameters at 30 s, and how many periods it takes to follow it."""
    n, change = int(45.0 * SIMULATED_HYSTERESIS_SETUP.rate), 30.0
    time = np.arange(n) / SIMULATED_HYSTERESIS_SETUP.rate
    thetas = [
        SIMULATED_HYSTERESIS_SETUP.changed if t >= change else SIMULATED_HYSTERESIS_SETUP.true for t in time
    ]
    motion = integrate(force[:n], thetas)
    history = estimate(plain_estimator(jump_ratio=4.0), time, force[:n], motion[:, 1], motion[:, 2])
    return history, (
        settled_after(history, SIMULATED_HYSTERESIS_SETUP.changed) - change
    ) / SIMULATED_HYSTERESIS_SETUP.period


class _Other(NamedTuple):
    """A record of another seed and what is judged of it."""

    record: Recording
    theta: NDArray[np.float64]  # at 120 s
    late: float  # largest error after 30 s
    settled: float  # [periods]


def _other(seed: int) -> _Other:
    test = record(seed)
    history = estimate(plain_estimator(), test.time, test["force"], test["velocity"], test["acceleration"])
    return _judged(test, history)


def _judged(test: Recording, history: AdaptiveHistory) -> _Other:
    late = float(np.abs(history.theta[history.time >= 30.0] - SIMULATED_HYSTERESIS_SETUP.true).max())
    return _Other(
        test,
        history.theta[-1].copy(),
        late,
        settled_after(history, SIMULATED_HYSTERESIS_SETUP.true) / SIMULATED_HYSTERESIS_SETUP.period,
    )


def _range_rows(test: Recording, others: list[_Other]) -> list[Row]:
    axes = {
        "force": ("excitation", "lbf", 10.0, 8.0, "a", "peak of the excitation"),
        "displacement": ("displacement, first 50 s", "in", 1.5, 1.0, "b", CHOSEN),
        "restoring_force": ("restoring force", "lbf", 2.5, 2.0, "c", ""),
    }
    early = [record.slice_time(0.0, 50.0) for record in (test, *(other.record for other in others))]
    return [
        axis_row(
            quantity,
            unit,
            axis,
            inner,
            early[0][name],
            source=fig(f"2.11 {part}"),
            seeds=[record[name] for record in early[1:]],
            chosen=chosen,
            why="the rig has no elastic spring, so that the displacement wanders with the seed; peaks of noise stay "
            "below the largest value it may take",
        )
        for name, (quantity, unit, axis, inner, part, chosen) in axes.items()
    ]


def _rows(
    test: Recording,
    history: AdaptiveHistory,
    others: list[_Other],
    extra: tuple[float, float, float],
) -> tuple[Row, ...]:
    noisy, tracked, apart = extra
    shown = _judged(test, history)
    # Their own errors are 0, .002, .002, 0 and .001, with half a unit of the last digit on top.
    reach = 0.0025
    rows = _range_rows(test, others)
    for i, name in enumerate(NAMES):
        rows.append(
            value_row(
                f"{name} at 120 s (true {SIMULATED_HYSTERESIS_SETUP.true[i]:g})",
                UNITS[i],
                f"{SIMULATED_HYSTERESIS_SETUP.printed[i]:.3f}",
                float(shown.theta[i]),
                low=SIMULATED_HYSTERESIS_SETUP.true[i] - reach,
                high=SIMULATED_HYSTERESIS_SETUP.true[i] + reach,
                source=f"p. 29, number, and {fig('2.12')}",
                tolerance=f"within {reach:g} of the true value, median of the seeds",
                reason="as near as the printed estimates are: .002 and half of their last digit",
                seeds=[other.theta[i] for other in others],
            )._replace(ours=f"{shown.theta[i]:.4f}")
        )
    rows.append(
        value_row(
            "all estimates within 5 % after",
            "periods",
            "about one system period",
            shown.settled,
            high=1.5,
            source=f"p. 29, sentence, and {fig('2.12')}",
            reason="about one: what rounds to one; the band of 5 % is ours, the text names none",
            seeds=[other.settled for other in others],
            chosen="forgetting, start covariance and filter of the estimator",
        )
    )
    dominant = _dominant(history)
    rows.append(
        fact_row(
            "θ1 φ1 and θ5 φ5 dominate z",
            f"the other three terms hold {dominant:.2g} % of its mean square",
            dominant < 5.0,
            printed="dominant contribution from θ1 φ1 and θ5 φ5",
            source=f"p. 30, sentence, and {fig('2.13')}",
            tolerance="the others below 5 % of the mean square",
            reason="what a good fit leaves out (section 3.4.2)",
        )
    )
    rows += [
        value_row(
            "largest error of an estimate after 30 s",
            "",
            None,
            shown.late,
            high=0.005,
            reason="twice the reach of the printed estimates",
            seeds=[other.late for other in others],
        ),
        value_row(
            "2 % noise on force and acceleration, ten seeds: largest error of θ1, θ4, θ5",
            "%",
            None,
            noisy,
            high=3.0,
            reason="of the order of the noise itself; 120 s average it, the nonlinear terms turn some of it into bias",
            chosen="filter and denoising of the estimator",
        ),
        value_row(
            "parameters changed at 30 s: within 5 % after",
            "periods",
            None,
            tracked,
            high=1.5,
            reason="as fast as from the start",
        ),
        value_row(
            "rig against an independent integration: largest difference over peak displacement",
            "1",
            None,
            apart,
            high=1e-6,
            reason="two Runge-Kutta integrations of one step length: rounding only",
        ),
    ]
    return tuple(rows)


def _dominant(history: AdaptiveHistory) -> float:
    """Share of the mean square of z that terms 2 to 4 hold together after the first 30 s [%]."""
    late = history.time >= 30.0
    parts, z = history.contributions()[late], history.measured[late]
    known = np.isfinite(z)
    return 100.0 * float(np.mean(parts[known][:, 1:4].sum(axis=1) ** 2) / np.mean(z[known] ** 2))


def run(progress: Progress) -> Item:
    """Make the item."""
    progress("simulating", 0.05)
    test = record()
    progress("identifying on line", 0.15)
    history = estimate(plain_estimator(), test.time, test["force"], test["velocity"], test["acceleration"])
    progress("identifying under noise", 0.35)
    noisy = _noisy_error(test, range(1, 11))
    progress("changing a parameter mid-record", 0.5)
    changed, tracked = _tracking(np.array(test["force"]))
    coarse = record(timestep=1.0 / SIMULATED_HYSTERESIS_SETUP.rate).slice_time(0.0, 30.0)
    x = coarse["displacement"]
    alone = integrate(coarse["force"], [SIMULATED_HYSTERESIS_SETUP.true] * len(coarse))[:, 0]
    apart = float(np.max(np.abs(alone - x)) / np.max(np.abs(x)))
    others = []
    for number, seed in enumerate(VERDICT_SETUP.seeds):
        progress(f"seed {seed}", 0.6 + 0.03 * number)
        others.append(_other(seed))
    progress("drawing", 0.9)
    records = {"rig": test}
    pictures = (
        Picture(
            "histories",
            "Excitation, displacement and restoring force (Fig 2.11 a to c).",
            fine(time_histories(records, ["force", "displacement", "restoring_force"], window=(0.0, 50.0))),
            panels("2.11", "abc"),
        ),
        Picture(
            "loop",
            "Restoring force over displacement (Fig 2.11 d).",
            fine(loops(records, [("displacement", "restoring_force")], window=(0.0, 50.0))),
            panels("2.11", "d"),
        ),
        Picture(
            "estimates",
            "Evolution of the estimates, true values dashed (Fig 2.12).",
            estimate_histories(
                history,
                NAMES,
                reference=tuple(SIMULATED_HYSTERESIS_SETUP.true),
                units=UNITS,
                label="true",
                until=30.0,
            ),
            panels("2.12"),
        ),
        Picture(
            "contributions",
            "z, the contribution of each term, their sum and the error (Fig 2.13).",
            contribution_histories(history, NAMES),
            panels("2.13"),
        ),
        Picture(
            "change",
            "Estimates through a change of the parameters at 30 s; the dashed lines are the new values.",
            estimate_histories(
                changed,
                NAMES,
                reference=tuple(SIMULATED_HYSTERESIS_SETUP.changed),
                units=UNITS,
                label="after the change",
            ),
        ),
    )
    text = (
        "Mass 1 lbf s²/in, A = 5, β = 0.1, γ = -1 in the dissertation's sign, n = 2 (2.17), simulated in "
        f"MuJoCo at 5 kHz under noise flat to {SIMULATED_HYSTERESIS_SETUP.cutoff:g} Hz with a peak of "
        f"{SIMULATED_HYSTERESIS_SETUP.peak:g} lbf. The band of the "
        "printed excitation is not given, and the displacement wanders with it: the rig has no elastic "
        "spring. The restoring force cannot "
        f"exceed its strength of √(5/1.1) = 2.13 lbf. One system period is {SIMULATED_HYSTERESIS_SETUP.period:.2f} s."
    )
    searched = (
        f"{CHOSEN}, which is not printed; settings of the estimator; the seed shown, for its displacement"
    )
    return Item(text, _rows(test, history, others, (noisy, tracked, apart)), pictures, searched)
