"""Data of a fit: states, forces and accelerations that fit together, their scaling, and what a fit misses of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import IdentificationError


def centre_and_scale(columns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre and half-range of each column ``(n_columns,)`` each; a half-range of 1 where a column does not vary."""
    low, high = columns.min(axis=0), columns.max(axis=0)
    return 0.5 * (low + high), np.where(high > low, 0.5 * (high - low), 1.0)


def checked_data(
    states: ArrayLike, forces: ArrayLike, accelerations: ArrayLike | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """States (n, 2 k), forces (n, k) and accelerations (n, k or 0) as arrays that fit together.

    Raises:
        IdentificationError: Shapes do not fit, or a value is NaN or inf.
    """
    s = np.asarray(states, dtype=float)
    f = np.asarray(forces, dtype=float)
    f = f[:, None] if f.ndim == 1 else f
    a = np.zeros((len(s), 0)) if accelerations is None else np.asarray(accelerations, dtype=float)
    a = a[:, None] if a.ndim == 1 else a
    if s.ndim != 2 or f.ndim != 2 or s.shape != (len(f), 2 * f.shape[1]):
        raise IdentificationError(
            f"states of shape {s.shape} came with forces of shape {f.shape}; (n, 2 k) and (n, k) are expected, "
            "the displacements of the k joints before their velocities"
        )
    if accelerations is not None and a.shape != f.shape:
        raise IdentificationError(
            f"accelerations of shape {a.shape} came; the shape of the forces {f.shape} is expected"
        )
    for name, array in (("states", s), ("forces", f), ("accelerations", a)):
        if not np.all(np.isfinite(array)):
            row, column = np.argwhere(~np.isfinite(array))[0]
            raise IdentificationError(
                f"{name} hold a value that is not finite at sample {row}, column {column}; cut the gap out of the record first"
            )
    return s, f, a


def nmse_percent(measured: NDArray[np.float64], estimated: NDArray[np.float64]) -> tuple[float, ...]:
    """``100 / (N var(y)) sum((y - yhat)²)`` of each column [%]; inf for a column that does not vary but is missed."""
    error = np.mean((measured - estimated) ** 2, axis=0)
    variance = np.var(measured, axis=0)
    return tuple(
        float(100.0 * e / v) if v > 0.0 else (0.0 if e == 0.0 else float("inf"))
        for e, v in zip(error, variance, strict=True)
    )


def read_only(values: ArrayLike) -> NDArray[np.float64]:
    """A read-only float copy of `values`."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
