"""Adaptive least squares against padasip's recursive least squares, on the same samples.

padasip is given ready regressors. Ours is measured twice: on the same ready regressors, and from raw samples, filters,
regressors, persistence monitor and checks of the input included. Both forget over 50 s.

    python scripts/benchmark.py stream
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.adaptive_history import AdaptiveHistory
from bench.identification.regressors import (
    Reference,
    RegressorModel,
    given_model,
    polynomial_model,
    sdof_model,
)
from benchmarks.timing import Row, interleave, ratio_row

N_WHOLE = 60_000  # a minute: start-up of a run and cold memory then count as they do in use
N_SINGLE = 10_000
SAMPLE_RATE = 1000.0
FORGETTING = 0.02  # 1/s, and exp(-0.02 / 1000) a sample for padasip
RAW: dict[int, Callable[[], RegressorModel]] = {
    7: lambda: sdof_model(2, filter_rate=1.0, reference=Reference(3.0, 1.0, 2.0, 3.0)),
    37: lambda: polynomial_model(5, 5, reference=Reference(3.0, 1.0, 2.0, 3.0)),
}
WHOLE_LIMIT = {7: "≥ 30", 37: "≥ 10"}
SAMPLE_LIMIT = "≥ 2"


def rows(repeats: int = 15) -> list[Row]:
    """Whole records and single samples, at 7 and 37 parameters."""
    result = []
    for n_parameters in RAW:
        result += _whole(n_parameters, repeats)
        result += _single(n_parameters, repeats)
    return result


def _whole(n_parameters: int, repeats: int) -> list[Row]:
    time, channels = _record(N_WHOLE)
    z, phi = _regressors(n_parameters, time, channels)
    names = [f"p{i}" for i in range(n_parameters)]
    seconds = interleave(
        {
            "given": lambda: _estimator(given_model(names)).run_regressors(time, z, phi),
            "raw": lambda: _whole_record(RAW[n_parameters](), time, channels),
            "padasip": lambda: _peer(n_parameters).run(z, phi),
        },
        repeats,
    )
    return [
        ratio_row(
            f"whole record, {n_parameters} parameters, {what}",
            seconds[name],
            seconds["padasip"],
            limit=WHOLE_LIMIT[n_parameters],
            meaning="padasip FilterRLS.run on ready regressors, seconds over ours",
            detail=_rates(seconds, name, time.size),
        )
        for name, what in (("given", "ready regressors"), ("raw", "from raw samples"))
    ]


def _single(n_parameters: int, repeats: int) -> list[Row]:
    time, channels = _record(N_SINGLE)
    z, phi = _regressors(n_parameters, time, channels)
    samples = list(zip(time.tolist(), *(channel.tolist() for channel in channels.values()), strict=True))
    stamps, measured, vectors = time.tolist(), z.tolist(), list(phi)

    def raw() -> None:
        update = _estimator(RAW[n_parameters]()).update
        for sample in samples:
            update(sample)

    def given() -> None:
        update = _estimator(given_model([f"p{i}" for i in range(n_parameters)])).update_regressor
        for stamp, value, vector in zip(stamps, measured, vectors, strict=True):
            update(stamp, value, vector)

    def peer() -> None:
        adapt = _peer(n_parameters).adapt
        for value, vector in zip(measured, vectors, strict=True):
            adapt(value, vector)

    seconds = interleave({"given": given, "raw": raw, "padasip": peer}, repeats)
    return [
        ratio_row(
            f"one sample at a time, {n_parameters} parameters, {what}",
            seconds[name],
            seconds["padasip"],
            limit=SAMPLE_LIMIT,
            meaning="padasip FilterRLS.adapt on a ready regressor, seconds over ours",
            detail=_rates(seconds, name, time.size),
        )
        for name, what in (("given", "ready regressor"), ("raw", "raw sample"))
    ]


def _rates(seconds: dict[str, NDArray[np.float64]], name: str, n: int) -> dict[str, Any]:
    return {
        "samples_per_s": float(n / np.median(seconds[name])),
        "padasip_samples_per_s": float(n / np.median(seconds["padasip"])),
    }


def _estimator(model: RegressorModel) -> AdaptiveLeastSquares:
    return AdaptiveLeastSquares(model, sample_rate=SAMPLE_RATE, forgetting=FORGETTING)


def _whole_record(
    model: RegressorModel,
    time: NDArray[np.float64],
    channels: dict[str, NDArray[np.float64]],
    *,
    keep_regressors: bool = False,
) -> AdaptiveHistory:
    force, x, v, a = channels.values()
    return _estimator(model).run(
        time, force=force, displacement=x, velocity=v, acceleration=a, keep_regressors=keep_regressors
    )


def _peer(n_parameters: int) -> Any:
    from padasip.filters import FilterRLS

    return FilterRLS(n_parameters, mu=float(np.exp(-FORGETTING / SAMPLE_RATE)))


def _record(n: int) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """A random motion and a hardening spring with damper along it; which does not matter for the time it takes."""
    rng = np.random.default_rng(2006)
    time = np.arange(n) / SAMPLE_RATE
    phases = rng.uniform(0.0, 2.0 * np.pi, 12)
    omega = 2.0 * np.pi * np.linspace(0.1, 2.0, 12)
    angle = omega * time[:, None] + phases
    x = 0.3 * np.sin(angle).sum(axis=1)
    v = 0.3 * (omega * np.cos(angle)).sum(axis=1)
    a = -0.3 * (omega**2 * np.sin(angle)).sum(axis=1)
    force = a + 5.0 * x + 0.5 * v + x**3 + 0.01 * rng.standard_normal(n)
    return time, {"force": force, "displacement": x, "velocity": v, "acceleration": a}


def _regressors(
    n_parameters: int, time: NDArray[np.float64], channels: dict[str, NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """z and phi of the raw model, scaled to the order of one."""
    model = RAW[n_parameters]()
    history = _whole_record(model, time, channels, keep_regressors=True)
    z = np.nan_to_num(history.measured)
    return z / model.force_scale, np.ascontiguousarray(history.regressors / np.array(model.scale))
