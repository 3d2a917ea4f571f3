"""What the comparisons with `mujoco.sysid` share."""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from bench.arrays import Array


class LateError(Exception):
    """The time of a fit is over."""


def optimised(
    parameters: Any, residual: Callable[[Array, Any], Any], *, iterations: int, deadline: float
) -> tuple[float, Array]:
    """Cost and vector of a fit by `mujoco.sysid`; at a deadline the best so far, else what it says, of a cost that it does not tell."""
    best = (np.inf, parameters.as_vector())

    def heard(x: Array, p: Any) -> Any:
        nonlocal best
        if time.perf_counter() > deadline:
            raise LateError
        found = residual(x, p)
        if x.ndim == 1 or x.shape[1] == 1:
            cost = float(np.sum(np.concatenate(found[0]) ** 2))
            best = min(best, (cost, x.ravel().copy()), key=lambda b: b[0])
        return found

    # its table cannot be turned off from here
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(LateError):
        _, result = sysid.optimize(parameters, heard, verbose=False, max_iters=iterations, x_scale="jac")
        best = (np.inf, np.asarray(result.x).ravel())
    return best


class Compiled:
    """Stands in for an MjSpec where only its compiled model is wanted."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model

    def compile(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.model
