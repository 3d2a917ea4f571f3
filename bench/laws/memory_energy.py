"""Energy that a joint with memory holds, from which its passivity follows: it never rises by more than the work done on the joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.laws.memory_layout import MemoryLayout


def stored_energy(
    layout: MemoryLayout, parameters: ArrayLike, q: ArrayLike, z: ArrayLike
) -> NDArray[np.float64]:
    """Energy of the potentials, slip springs and Maxwell springs (n,) [J], none at ``q = 0, z = 0``.

    Args:
        layout: What the joint consists of.
        parameters: Parameters of its law (n_parameters,), without the header.
        q: Displacements (n, n_joints) [m, rad].
        z: Hidden states (n, n_states).
    """
    theta, places = np.asarray(parameters, dtype=float), np.atleast_2d(np.asarray(q, dtype=float))
    hidden = np.asarray(z, dtype=float).reshape(len(places), -1)
    total = np.zeros(len(places))
    for number, i in enumerate(layout.potentials):
        direction = layout.directions[i]
        edges = np.linspace(direction.low, direction.high, layout.cells + 1)
        edges[0], edges[-1] = -np.inf, np.inf
        k = theta[number * layout.cells : (number + 1) * layout.cells]
        total += _from_zero(places @ np.array(direction.vector), edges, k)
    for m in range(len(layout.slips)):
        at = layout.slip_start + m * layout.slip_size
        r, phi, k = theta[at], theta[at + 1], theta[at + 2 : at + 2 + layout.parts]
        edges = np.linspace(-r, r, layout.parts + 1)
        e = np.clip(hidden[:, m], -r, r)
        at_zero = (
            np.sum(k * (np.clip(0.0, edges[:-1], edges[1:]) - edges[:-1]))
            - phi * np.sum(k) * 2.0 * r / layout.parts
        )
        total += _from_zero(e, edges, k) + at_zero * e
    for m in range(len(layout.maxwells)):
        at = layout.slip_start + len(layout.slips) * layout.slip_size + 2 * m
        total += 0.5 * theta[at] * hidden[:, len(layout.slips) + m] ** 2
    return total


def _from_zero(
    s: NDArray[np.float64], edges: NDArray[np.float64], k: NDArray[np.float64]
) -> NDArray[np.float64]:
    """``int_0^s int_0^x k`` for a stiffness that is constant between edges (n,)."""
    low, high = np.minimum(s, 0.0)[:, None], np.maximum(s, 0.0)[:, None]
    ends = np.clip(edges[None, :], low, high)
    halves = 0.5 * (s[:, None] - ends) ** 2
    return np.abs(np.diff(halves, axis=1)) @ k
