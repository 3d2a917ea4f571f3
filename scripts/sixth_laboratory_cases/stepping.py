"""Loads of a rig between the steps of its integration, which is that of the fifth laboratory, of classical Runge-Kutta."""

from __future__ import annotations

import numpy as np
from fifth_laboratory_cases.stepping import Loads

from bench.arrays import Array


def straight(loads: Array) -> Loads:
    """Loads that are given at each step (n_steps + 1, n_loads) and run along straight lines between."""
    start, end = np.ascontiguousarray(loads[:-1]), np.ascontiguousarray(loads[1:])
    return Loads(start, 0.5 * (start + end), end)


def held(loads: Array) -> Loads:
    """Loads that are given at each step (n_steps + 1, n_loads) and held until the next one."""
    each = np.ascontiguousarray(loads[:-1])
    return Loads(each, each, each)
