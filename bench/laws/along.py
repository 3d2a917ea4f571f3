"""Forces of a law along a record whose hidden states are known."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.laws.base import ForceLaw
from bench.laws.calling import call_kernel, pointer_at


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _loop(address, time, q, v, z, theta, force, count, n_coordinates, n_states):
    for i in range(count):
        call_kernel(
            address,
            time[i],
            pointer_at(q + 8 * i * n_coordinates),
            pointer_at(v + 8 * i * n_coordinates),
            pointer_at(z + 8 * i * n_states),
            pointer_at(theta),
            pointer_at(force + 8 * i * n_coordinates),
        )


def force_along(
    law: ForceLaw, theta: ArrayLike, time: ArrayLike, q: ArrayLike, v: ArrayLike, z: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Restoring forces ``(n, n_coordinates)`` at given states.

    Args:
        law: The law.
        theta: Header and parameters (n_theta,).
        time: Times [s] (n,).
        q: Displacements (n, n_coordinates), inputs last.
        v: Velocities (n, n_coordinates).
        z: Hidden states (n, n_states); not needed by laws without states.
    """
    clock = np.ascontiguousarray(time, dtype=float)
    states = np.zeros((len(clock), len(law.states))) if z is None else np.ascontiguousarray(z, dtype=float)
    positions = np.ascontiguousarray(q, dtype=float).reshape(len(clock), law.n_coordinates)
    velocities = np.ascontiguousarray(v, dtype=float).reshape(len(clock), law.n_coordinates)
    vector = np.ascontiguousarray(theta, dtype=float)
    force = np.zeros_like(positions)
    _loop(
        law.force.address,
        clock,
        positions.ctypes.data,
        velocities.ctypes.data,
        states.ctypes.data,
        vector.ctypes.data,
        force.ctypes.data,
        len(clock),
        law.n_coordinates,
        len(law.states),
    )
    return force
