"""Where the discrepancy of an articulated model lies: joint by joint, in which band and interval, and what each effect closes there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_judgement.predicted_errors import PredictedErrors, runs_of
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.settings import ArticulatedSettings
from bench.discrepancy.verdict import Gap, Location


def gaps_of(
    problem: ArticulatedProblem,
    rungs: Sequence[ArticulatedFit],
    untouched: PredictedErrors,
    predictions: Sequence[PredictedErrors],
    rng: np.random.Generator,
) -> tuple[Gap, ...]:
    """NRMSE of every joint, as stated, then rung by rung; arguments as of `verdict_of`."""
    out, told = [], runs_of(problem)
    for j, joint in enumerate(problem.joints):
        first, after = untouched, predictions[-1]
        floor = float(after.floor[j])
        share, interval = _closed_of_nrmse(first.power[:, j], after.power[:, j], floor, rng)
        steps = [
            ("nominal", float(first.discrepancy[j])),
            ("parameters only", float(predictions[0].discrepancy[j])),
        ]
        steps += [
            (" + ".join(str(p) for p in rung.hypothesis), float(p.discrepancy[j]))
            for rung, p in zip(rungs[1:], predictions[1:], strict=True)
        ]
        out.append(
            Gap(
                told.metric(j), float(first.discrepancy[j]),
                float(predictions[0].discrepancy[j]), float(after.discrepancy[j]), floor, share, interval, tuple(steps),
                joint.name,
            )
        )  # fmt: skip
    return tuple(out)


def _closed_of_nrmse(
    first: Array, after: Array, floor: float, rng: np.random.Generator
) -> tuple[float, tuple[float, float]]:
    """Part of an NRMSE beyond that of the noise that is closed, see `Gap`, and its block-bootstrap interval; from powers (n_blocks,)."""
    drawn = rng.integers(len(first), size=(1000, len(first)))
    rows = np.vstack([np.arange(len(first)), drawn])
    before, left = (np.sqrt(power[rows].mean(axis=1)) for power in (first, after))
    shares = np.minimum((before - left) / np.maximum(before - floor, 1e-12), 1.0)
    low, high = np.percentile(shares[1:], [2.5, 97.5])
    return float(shares[0]), (float(low), float(high))


def locations_of(problem: ArticulatedProblem, base: ArticulatedFit) -> tuple[Location, ...]:
    """Joints by their share of what the nominal model leaves beyond the noise, its parameters re-estimated."""
    excess = np.maximum((base.chi2 - base.octaves.count).sum(axis=1), 0.0)
    total = float(excess.sum())
    out = []
    for j in np.argsort(-excess):
        share = float(excess[j] / total) if total > 0.0 else 0.0
        if share < problem.settings.articulated.shown:
            continue
        joint = problem.joints[int(j)]
        prepared = problem.records[0]
        channel = next(
            c.name
            for c in problem.case.channels
            if c.target == f"joint:{joint.name}" and c.quantity == "position"
        )
        innovation, _ = problem.innovations(int(j), (), base.vector, prepared)
        band, span = _gathered(
            innovation[:, 0],
            prepared.record.step,
            prepared.record.start,
            settings=problem.settings.articulated,
        )
        q, v = prepared.motion.position[:, j], prepared.motion.velocity[:, j]
        region = {
            "displacement": (float(q.min()), float(q.max())),
            "velocity": (float(v.min()), float(v.max())),
        }
        out.append(Location(channel, joint.name, share, band, span, region, kind="undetermined"))
    return tuple(out)


def _gathered(
    residual: Array, step: float, start: float, *, settings: ArticulatedSettings
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Band [Hz] and interval [s] that hold nine tenths of the power of a residual."""
    residual = np.nan_to_num(residual)
    power = np.abs(np.fft.rfft(residual)) ** 2
    frequency = np.asarray(np.fft.rfftfreq(len(residual), step), dtype=np.float64)
    time = np.asarray(start + step * np.arange(len(residual)), dtype=np.float64)

    def between(weights: Array, axis: Array) -> tuple[float, float]:
        total = np.cumsum(weights)
        low, high = np.searchsorted(total, np.array(settings.holds) * total[-1])
        return float(axis[min(low, len(axis) - 1)]), float(axis[min(high, len(axis) - 1)])

    return between(power, frequency), between(residual**2, time)


def remainder_of(
    problem: ArticulatedProblem, final: ArticulatedFit, left: PredictedErrors, untouched: PredictedErrors
) -> dict[str, object]:
    """What remains at the joint that keeps most over its noise, with its band and interval."""
    j = int(np.argmax(final.reduced))
    innovation, _ = problem.innovations(
        j, final.hypothesis, final.vector, problem.motions(final.hypothesis, final.vector)[0]
    )
    band, span = _gathered(
        innovation[:, 0],
        problem.records[0].record.step,
        problem.records[0].record.start,
        settings=problem.settings.articulated,
    )
    return {
        "nrmse": float(left.discrepancy[j]),
        "over_noise": float(np.sqrt(final.reduced[j])),
        "of_before": float(left.discrepancy[j] / max(float(untouched.discrepancy[j]), 1e-12)),
        "channel": problem.joints[j].name,
        "band_hz": band,
        "time_s": span,
    }


def matrix_of(problem: ArticulatedProblem, fits: Sequence[ArticulatedFit]) -> dict[str, dict[str, float]]:
    """Joint to effect to the part of that joint's discrepancy that the effect alone closes, where it was fitted."""
    base = next(f for f in fits if not f.hypothesis)
    out: dict[str, dict[str, float]] = {joint.name: {} for joint in problem.joints}
    for f in fits:
        if len(f.hypothesis) == 1:
            placed = f.hypothesis[0]
            before = max(float((base.chi2 - base.octaves.count)[placed.joint].sum()), 1e-9)
            after = float((f.chi2 - f.octaves.count)[placed.joint].sum())
            share = float(np.clip(1.0 - after / before, 0.0, 1.0))
            mine = out[problem.joints[placed.joint].name]
            mine[placed.effect.name] = max(share, mine.get(placed.effect.name, 0.0))
    return out
