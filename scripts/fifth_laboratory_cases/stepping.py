"""Time stepping of a rig by the classical Runge-Kutta method of fourth order, and the force of a small second mass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from third_laboratory_cases.oscillator import inlined

from bench.arrays import Array

compiled: Any = numba.njit(error_model="numpy", nogil=True)
"""Compiled anew by every process: a cache would not see that a function of another file has changed."""
WHEN = (0.0, 0.5, 0.5, 1.0, 0.0)
"""Part of a step after which each of its four stages is; after the last one comes the next step."""
WEIGHT = (1.0, 2.0, 2.0, 1.0)
"""Weights of their derivatives, six in all."""


class Loads(NamedTuple):
    """Loads on a rig at the start, in the middle and at the end of each step, each (n_steps, n_loads)."""

    start: Array
    middle: Array
    end: Array


class Motion(NamedTuple):
    """Motion of a rig at each step, both ends included."""

    state: Array
    """Its state (n_steps + 1, n_states)."""
    rate: Array
    """Time derivative of that, shaped alike."""


def at_half_steps(values: Array) -> Loads:
    """Loads that are given at each half step, both ends included: (2 n_steps + 1,) or (2 n_steps + 1, n_loads)."""
    columns = values.reshape(len(values), -1)
    start, middle, end = columns[:-1:2], columns[1::2], columns[2::2]
    return Loads(*(np.ascontiguousarray(part) for part in (start, middle, end)))


def held(values: Array, substeps: int) -> Loads:
    """Loads (n,) that are held for so many steps each."""
    each = np.repeat(values, substeps)[:, None]
    return Loads(each, each, each)


def stepper(derivative: Callable[..., tuple[float, ...]]) -> Callable[[Any, Array, Loads, float], Motion]:
    """Time stepping of a rig.

    Args:
        derivative: Compiled time derivative of the state (n_states,), from the properties of the rig, its state, the loads (n_loads,) and
            the time [s].

    Returns:
        Function of the properties, the state at the start (n_states,), the loads and the step [s].
    """

    @compiled
    def march(p: Any, start: Array, loads: Loads, h: float) -> Motion:
        n, m = len(loads.start), len(start)
        state, rate = np.empty((n + 1, m)), np.empty((n + 1, m))
        s, at, total = start.copy(), start.copy(), np.empty(m)
        for i in range(n + 1):
            t, first = i * h, loads.start[i] if i < n else loads.end[n - 1]
            for stage in range(4):  # one call of the derivative, which is compiled in place
                load = first if stage == 0 else loads.middle[i] if stage < 3 else loads.end[i]
                d = derivative(p, at, load, t + h * WHEN[stage])
                for j in range(m):
                    if stage == 0:
                        state[i, j], rate[i, j], total[j] = s[j], d[j], 0.0
                    total[j] += WEIGHT[stage] * d[j]
                    at[j] = s[j] + h * WHEN[stage + 1] * d[j]
                if i == n:
                    break
            for j in range(m):
                s[j] = s[j] + h / 6 * total[j]
                at[j] = s[j]
        return Motion(state, rate)

    return march


@inlined
def pull(mass: float, frequency: float, ratio: float, apart: float, parting: float) -> float:
    """Force [N] of a small second mass on the first one.

    Args:
        mass: The small mass [kg].
        frequency: Its natural frequency on the blocked first mass [Hz].
        ratio: Its damping ratio.
        apart: Its displacement relative to the first mass [m].
        parting: Its velocity relative to the first mass [m/s].
    """
    stiffness = mass * (2 * np.pi * frequency) ** 2
    damping = 2 * ratio * np.sqrt(stiffness * mass)
    return stiffness * apart + damping * parting
