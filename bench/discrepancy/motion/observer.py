"""How a channel reads the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ACCELERATION = 2
"""Order of an observer that reads accelerations."""


@dataclass(frozen=True)
class Observer:
    """A response channel as a row of the motion.

    Attributes:
        channel: Channel name.
        order: 0 position, 1 velocity, 2 acceleration.
        row: (n_dof,).
    """

    channel: str
    order: int
    row: NDArray[np.float64]
