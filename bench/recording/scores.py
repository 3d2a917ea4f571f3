"""How far a simulated channel is from the measured one: the two figures used throughout.

Both compare with the spread of the measured channel about its mean, so that a model which answers with that mean scores
100 % (NMSE) or 1 (NRMSE). Seconds to be left out are cut by the caller: ``nmse(r["force"][r.scored], …)``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError


def nmse(measured: ArrayLike, simulated: ArrayLike) -> float:
    """Normalised mean-square error in percent, ``100 / (n var(y)) * sum((y - yhat)^2)``.

    Args:
        measured: y, ``(n,)``.
        simulated: yhat, ``(n,)``, in the same unit.

    Returns:
        NMSE [%]; infinity where the simulation is not finite.

    Raises:
        RecordingError: Different shapes, not finite, fewer than two samples, or a measured channel that never changes.

    References:
        Worden, K. and Tomlinson, G. R. (2001), Nonlinearity in Structural Dynamics, Institute of Physics.
    """
    return 100.0 * nrmse(measured, simulated) ** 2


def nrmse(measured: ArrayLike, simulated: ArrayLike) -> float:
    """Root-mean-square error over the standard deviation of the measured channel, as a fraction.

    Args:
        measured: y, ``(n,)``.
        simulated: yhat, ``(n,)``, in the same unit.

    Returns:
        NRMSE [1]; infinity where the simulation is not finite.

    Raises:
        RecordingError: As `nmse`.
    """
    y, yhat = _checked(measured, simulated)
    if not np.all(np.isfinite(yhat)):
        return math.inf
    # relative to the largest value, so that squares of very large or very small numbers neither overflow nor vanish
    scale = float(np.max(np.abs(y)))
    spread = scale * float(np.std(y / scale)) if scale > 0.0 else 0.0
    # a constant does not cancel exactly in its mean: rounding leaves some 1e-16 of its size
    if spread <= 1e-14 * scale:
        raise RecordingError(
            "the measured channel never changes, so that an error relative to its spread has no meaning; "
            "score a part of the record in which it moves"
        )
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(np.square((y - yhat) / spread))))


def _checked(measured: ArrayLike, simulated: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    y, yhat = np.asarray(measured, dtype=float), np.asarray(simulated, dtype=float)
    if y.ndim != 1 or y.shape != yhat.shape or y.size < 2:
        raise RecordingError(
            f"measured has shape {y.shape}, simulated {yhat.shape}; "
            "two channels of the same length (n,) with n >= 2 are expected (resample or cut one of them)"
        )
    if not np.all(np.isfinite(y)):
        raise RecordingError(
            f"the measured channel is not finite at sample {int(np.argmin(np.isfinite(y)))}; cut or repair it"
        )
    return y, yhat
