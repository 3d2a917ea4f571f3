"""Numbers that sum up a sampled signal."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError


def rms(x: ArrayLike) -> float:
    """Root of the mean square of a signal ``(n,)``, in the unit of the signal.

    Raises:
        ParameterError: `x` is empty, not one-dimensional or not finite.
    """
    values = _signal(x)
    return float(np.sqrt(np.mean(values**2)))


def crest_factor(x: ArrayLike) -> float:
    """Peak over root mean square of a signal ``(n,)``: 1 for a square wave, sqrt(2) for a sine.

    Raises:
        ParameterError: `x` is empty, not one-dimensional, not finite or zero throughout.
    """
    values = _signal(x)
    peak = float(np.max(np.abs(values)))
    if peak == 0.0:
        raise ParameterError("a signal of zeros has no crest factor")
    return 1.0 / rms(values / peak)  # scaled first, lest tiny or huge signals underflow in the square


def energy(x: ArrayLike, dt: float) -> float:
    """Signal energy ``dt sum(x^2)`` of a signal ``(n,)`` sampled every `dt` [s], in its unit squared times s.

    Raises:
        ParameterError: `x` is empty, not one-dimensional or not finite, or `dt` is not positive.
    """
    if not (np.isfinite(dt) and dt > 0.0):
        raise ParameterError(f"dt is {dt!r} s; a positive number is expected")
    return float(dt * np.sum(_signal(x) ** 2))


def _signal(x: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(x, dtype=float)
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise ParameterError(
            f"a finite signal of shape (n,) with n >= 1 is expected; one of shape {values.shape} came"
        )
    return values
