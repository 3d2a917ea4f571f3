"""What the adaptive estimator begins with: its settings, checked, where the compiled step finds them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.identification import layout
from bench.identification.regressors import KINDS, RegressorModel


def _setting(name: str, value: float, low: float, expected: str, *, strict: bool = False) -> float:
    if not (math.isfinite(value) and (value > low if strict else value >= low)):
        raise ParameterError(f"{name} = {value} came; {expected} is expected")
    return float(value)


def _model_settings(model: RegressorModel) -> dict[int, float]:
    """Header entries that the model fixes."""
    return {
        layout.N: model.n_parameters,
        layout.N_FILTERS: model.n_filters,
        layout.KIND: KINDS.index(model.kind),
        layout.ORDER_1: model.orders[0],
        layout.ORDER_2: model.orders[1],
        layout.MASS: model.mass,
        layout.RATE: model.filter_rate,
        layout.Z_INVERSE: 1.0 / model.force_scale,
        layout.V_FLOOR: model.floors[0],
        layout.F_FLOOR: model.floors[1],
        layout.CROSSOVER: model.crossover,
        layout.DENOISE_AFTER: model.denoise_after,
    }


def initial_state(
    model: RegressorModel,
    *,
    sample_rate: float | None,
    forgetting: float,
    initial_covariance: float,
    bound: float | None,
    normalise: bool,
    window: float,
    level_floor: float,
    min_eigenvalue: float,
    max_pull: float,
    jump_ratio: float,
    jump_time: float,
    stuck_after: int,
    gap: float,
) -> NDArray[np.float64]:
    """The flat state of `bench.identification.layout` before the first sample; the arguments are those of `AdaptiveLeastSquares`.

    Raises:
        ParameterError: A setting lies outside its range.
    """
    n = model.n_parameters
    state = np.zeros(layout.size(n, model.n_filters))
    p0 = _setting("initial_covariance", initial_covariance, 0.0, "a positive number", strict=True)
    limit = 10.0 * p0 * n if bound is None else bound
    if not limit >= p0 * n:
        raise ParameterError(
            f"bound = {limit:g} came; at least n times the initial covariance, {p0 * n:g}, is expected, for P starts there"
        )
    step = 0.0
    if sample_rate is not None:
        step = 1.0 / _setting("sample_rate", sample_rate, 0.0, "a positive rate", strict=True)
    settings = _model_settings(model) | {
        layout.BETA: _setting("forgetting", forgetting, 0.0, "a rate of at least 0 1/s"),
        layout.P0: p0,
        layout.BOUND: limit,
        layout.STEP: step,
        layout.GAP: _setting("gap", gap, 1.0, "a factor above 1", strict=True),
        layout.STUCK: _setting("stuck_after", stuck_after, 1.0, "a count of at least 1"),
        layout.HALF_WINDOW: 0.5 * _setting("window", window, 0.0, "a positive time", strict=True),
        layout.LEVEL_FLOOR: _setting("level_floor", level_floor, 0.0, "a fraction of at least 0"),
        layout.MIN_EIGENVALUE: _setting("min_eigenvalue", min_eigenvalue, 0.0, "a number of at least 0"),
        layout.JUMP: _setting("jump_ratio", jump_ratio, 0.0, "a ratio of at least 0"),
        layout.JUMP_TIME: _setting("jump_time", jump_time, 0.0, "a positive time", strict=True),
        layout.NORMALISE: float(normalise),
        layout.T_REJECTED: math.inf,
        layout.T_RESET: -math.inf,
        layout.EXCITED: -1.0,
        layout.MAX_PULL: _setting("max_pull", max_pull, 0.0, "a positive fraction", strict=True),
        layout.SMALLEST: math.nan,
        layout.CONDITION: math.nan,
    }  # fmt: skip
    state[list(settings)] = list(settings.values())
    state[layout.USES_F : layout.USES_A + 1] = model.uses
    state[layout.LAST_VALUE : layout.LAST_VALUE + 4] = math.nan
    return state
