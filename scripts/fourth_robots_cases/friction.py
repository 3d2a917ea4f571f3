"""Dry friction as impulses within limits, so that joints stick.

The impulses p of a step bring the velocities of the coordinates to v + W p, W being the inverse of the inertia, with |p_m| <= top_m, and
with p_m at its limit against the velocity unless that is zero. Projected Gauss-Seidel sweeps find them from those of the step before.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.arrays import Array
from fourth_robots_cases.machine import Friction

SWEEPS = 40
"""Most sweeps over the friction of a step."""
CONVERGED = 1e-9
"""Largest change of an impulse, over its limit, at which the sweeps end."""


@njit(cache=True)
def largest_impulses(friction: Friction, v: Array, motor: NDArray[np.int64], step: float) -> Array:
    """Largest impulses [N m s or N s] on the coordinates (n_coordinates) in a step [s], at its first velocities (n_coordinates)."""
    top = np.zeros(len(v))
    for j in range(len(motor)):
        m = motor[j]
        fallen = np.exp(-((v[m] / friction.velocity[j]) ** 2))
        top[m] = step * (friction.coulomb[j] + (friction.static[j] - friction.coulomb[j]) * fallen)
    return top


@njit(cache=True)
def stick(
    v: Array, impulse: Array, top: Array, inverse: NDArray[np.floating],
    sweeps: int = SWEEPS, converged: float = CONVERGED,
) -> Array:  # fmt: skip
    """Velocities at the end of a step with friction (n_coordinates).

    Args:
        v: Velocities without friction (n_coordinates).
        impulse: Impulses of the step before; those of this one afterwards (n_coordinates).
        top: Their limits (n_coordinates).
        inverse: Inverse of the inertia (n_coordinates, n_coordinates).
        sweeps: Most sweeps.
        converged: Largest change of an impulse, over its limit, at which they end.
    """
    v = v + inverse @ impulse
    for m in range(len(v)):
        within = min(max(impulse[m], -top[m]), top[m])
        if within != impulse[m]:
            v = v + inverse[:, m] * (within - impulse[m])
            impulse[m] = within
    for _ in range(sweeps):
        settled = True
        for m in range(len(v)):
            if top[m] <= 0:
                continue
            within = min(max(impulse[m] - v[m] / inverse[m, m], -top[m]), top[m])
            change = within - impulse[m]
            if change != 0.0:
                for k in range(len(v)):
                    v[k] += inverse[k, m] * change
                impulse[m] = within
                if abs(change) > converged * top[m]:
                    settled = False
        if settled:
            break
    return v
