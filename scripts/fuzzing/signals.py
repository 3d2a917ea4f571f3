"""The signals of every record that is spoilt."""

from __future__ import annotations

import numpy as np

N = 400
"""Samples."""


def table() -> np.ndarray:
    """Time, force and displacement ``(N, 3)``."""
    time = 0.01 * np.arange(N)
    return np.column_stack([time, np.sin(2.0 * time), 0.002 * np.sin(2.0 * time + 0.3)])
