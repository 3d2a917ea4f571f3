"""Free runs of the structure alone: one matrix product a sample, exact for loads that are piecewise linear or held.

The screening makes one of these for every grid point of the catalogue; an integrator would spend five times as long on it.

References:
    G. F. Franklin, J. D. Powell, M. L. Workman, Digital Control of Dynamic Systems, 1998 (section 6.3.2, triangle hold).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from bench.discrepancy.simulation.equations_of_motion import STICK_SLIP_LIMITS
from bench.discrepancy.simulation.stick_slip import Motion, StructureMatrices


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _march(transition, driven, states):
    """``x[k + 1] = transition x[k] + driven[k]`` over `states` (n_rows, n), its first row being the start."""
    n_rows, n = states.shape
    if n == 2:
        a, b, c, d = transition[0, 0], transition[0, 1], transition[1, 0], transition[1, 1]
        x, y = states[0]
        for k in range(n_rows - 1):
            x, y = a * x + b * y + driven[k, 0], c * x + d * y + driven[k, 1]
            states[k + 1, 0] = x
            states[k + 1, 1] = y
        return
    for k in range(n_rows - 1):
        for i in range(n):
            total = driven[k, i]
            for j in range(n):
                total += transition[i, j] * states[k, j]
            states[k + 1, i] = total


@lru_cache(maxsize=16)
def _discrete(rate: bytes, shape: tuple[int, int], step: float) -> tuple[NDArray, NDArray, NDArray]:
    """State transition over a step, and the responses to a load held at one and to one that rises to one."""
    n_dof, n = shape[0], 2 * shape[0]
    n_inputs = shape[1] - n
    # expm([[A, B, 0], [0, 0, I], [0, 0, 0]] h); SciPy spends milliseconds on it, as long as the run itself takes
    system = np.zeros((n + 2 * n_inputs, n + 2 * n_inputs))
    system[:n_dof, n_dof:n] = np.eye(n_dof)
    system[n_dof:n, : n + n_inputs] = np.frombuffer(rate).reshape(shape)
    system[:n] *= step
    system[n : n + n_inputs, n + n_inputs :] = np.eye(n_inputs)
    exponential = expm(system)
    return (
        np.ascontiguousarray(exponential[:n, :n]),
        exponential[:n, n : n + n_inputs],
        exponential[:n, n + n_inputs :],
    )


def linear_run(
    structure: StructureMatrices,
    *,
    loads: NDArray[np.float64],
    step: float,
    load_factor: int = 1,
    start: NDArray[np.float64] | None = None,
    restarts: NDArray[np.int64] | None = None,
) -> Motion:
    """Return the motion of a structure without elements; arguments as those of `free_run`, anew from rest at `restarts`."""
    n_dof = structure.mass.shape[0]
    inverse = np.linalg.inv(structure.mass)
    rate = np.hstack(
        [-inverse @ structure.stiffness, -inverse @ structure.damping, inverse @ structure.inputs]
    )
    n = 2 * n_dof
    transition, held, rising = _discrete(rate.tobytes(), rate.shape, step / max(load_factor, 1))
    if load_factor == 0:
        rising = np.zeros_like(rising)
    driven = loads[:-1] @ (held - rising).T + loads[1:] @ rising.T
    states = np.zeros((len(loads), n))
    if start is not None:
        states[0] = start[:n]
    firsts = [0, *(() if restarts is None else restarts), len(loads)]
    for first, last in pairwise(firsts):
        _march(transition, driven[first:last], states[first:last])
    sampled = states[:: max(load_factor, 1)]
    if not np.abs(sampled[-1]).max() < STICK_SLIP_LIMITS.diverged:
        sampled = np.full_like(sampled, np.nan)
    acceleration = sampled @ rate[:, :n].T + loads[:: max(load_factor, 1)] @ rate[:, n:].T
    return Motion(sampled[:, :n_dof], sampled[:, n_dof:], acceleration)
