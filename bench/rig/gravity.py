"""Gravity in the frame of a model whose base leans."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bench.arrays import Array


def level_axes(gravity: Array) -> Array:
    """Two horizontal axes (2, 3) of a model with a vector of gravity (3,): x and y where that points down along z, else likewise.

    The first lies as near to the model's x as can be (to its y where x is steeper than half a right angle); the second completes a
    right-handed frame whose third axis points up.
    """
    up = -gravity / np.linalg.norm(gravity)
    forward = np.eye(3)[0 if abs(up[0]) < np.linalg.norm(up[1:]) else 1]
    first = forward - (forward @ up) * up
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first)])


def tilted(gravity: Array, x: float, y: float) -> Array:
    """Gravity (3,) [m/s^2] in the frame of a base that leans by the rotation vector (x, y) [rad] about its `level_axes`."""
    return np.asarray(Rotation.from_rotvec(np.array([x, y]) @ level_axes(gravity)).inv().apply(gravity))
