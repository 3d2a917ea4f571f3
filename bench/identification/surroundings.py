"""What is assumed of a joint where no record was: points among and around the records, continued passively.

A polynomial is free wherever its records were not: in the corners of their box that separately excited axes never reach, a full
tensor of order 3 is larger than any force by orders, and a closed loop that comes near is driven on by whatever force stands there. So
the fit is shown these places too. At points spread evenly over the box the force is taken as that of the nearest sample, continued
by a spring and a damper on each coordinate, both positive: the ones that explain the records best. It is a weak opinion
(`SurroundingsSettings.weight`), which the records outweigh wherever there are any.

Networks do without: the same points doubled the error of ones of 20 units and more, on the records and in closed loop.

References:
    Abu-Mostafa 1990, J. Complexity 6 (learning from hints); Sjoeberg et al. 1995, Automatica 31 (regularisation where data are missing).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import cKDTree  # pyrefly: ignore[missing-module-attribute]
from scipy.stats.qmc import Halton

from bench.arrays import Array


@dataclass(frozen=True)
class SurroundingsSettings:
    """Numbers of `bench.identification.surroundings`.

    Attributes:
        weight: Weight of what is assumed, all of it over all samples of the records, in a fit: on the joint rig's records, the
            outermost tenth of the samples held out, a tensor of order 3 and a polynomial of total degree 5 are near their least error
            out there from 1e-3 on (180 and 8 % without, 9 and 5 % with it), and lose little within. In the chain of D3, under three
            loads of other seeds than the item's, a decade less doubles the tensor's errors of force at least, two decades more raise
            them by a third.
        samples: Most samples that a nearest one is sought among.
    """

    weight: float = 1e-3
    samples: int = 20_000


SETTINGS = SurroundingsSettings()


class Surroundings(NamedTuple):
    """Points where no record was, and the force assumed there."""

    states: Array  # (n, 2 k)
    forces: Array  # (n, k)


def passive_slopes(states: Array, forces: Array) -> Array:
    """Stiffness and damping of each coordinate that explain the records best, none negative (k, 2 k)."""
    k = forces.shape[1]
    slopes = np.zeros((k, 2 * k))
    for i in range(k):
        own = states[:, [i, k + i]] - states[:, [i, k + i]].mean(axis=0)
        size = np.linalg.norm(own, axis=0)
        size[size == 0.0] = 1.0
        slopes[i, [i, k + i]] = nnls(own / size, forces[:, i] - forces[:, i].mean())[0] / size
    return slopes


def surroundings(states: Array, forces: Array, n: int) -> Surroundings:
    """Points over the box of the records, and the force assumed there.

    Args:
        states: States of the records (n_samples, 2 k).
        forces: Their restoring forces (n_samples, k).
        n: Number of points, of a Halton sequence: even, and always the same.
    """
    low, high = states.min(axis=0), states.max(axis=0)
    half = np.where(high > low, 0.5 * (high - low), 0.0)
    unit = Halton(states.shape[1], scramble=False).random(n + 1)[1:]
    points = 0.5 * (low + high) + (2.0 * unit - 1.0) * half
    stride = max(1, len(states) // SETTINGS.samples)
    scale = np.where(half > 0.0, half, 1.0)
    near = cKDTree(states[::stride] / scale).query(points / scale)[1] * stride
    return Surroundings(points, forces[near] + (points - states[near]) @ passive_slopes(states, forces).T)
