"""Columns of a record: arrays by name put side by side, and what is refused of them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import RecordingError
from bench.recording.channel import Channel


def refuse_twins(names: Sequence[str]) -> None:
    """Refuse two channels of one name."""
    for i, name in enumerate(names):
        if name in names[:i]:
            raise RecordingError(f"two channels are named '{name}'; give each its own name")


def as_columns(values: ArrayLike, n: int, n_channels: int) -> NDArray[np.float64]:
    """A read-only copy of values ``(n, n_channels)``, each column contiguous in memory.

    Raises:
        RecordingError: No numbers, or another shape.
    """
    try:
        columns = np.array(values, dtype=float, order="F")
    except (TypeError, ValueError):
        raise RecordingError("the values are no numbers; an array (n, n_channels) is expected") from None
    if columns.shape != (n, n_channels):
        raise RecordingError(
            f"values have shape {columns.shape}; (n, n_channels) = {(n, n_channels)} is expected from the time "
            "and the channels"
        )
    columns.flags.writeable = False
    return columns


def stacked(arrays: Mapping[str, ArrayLike], n: int | None) -> NDArray[np.float64]:
    """Values ``(n, n_channels)`` from arrays by name, with the name in the message where one does not fit."""
    columns = []
    for name, array in arrays.items():
        try:
            column = np.asarray(array, dtype=float)
        except (TypeError, ValueError):
            raise RecordingError(
                f"the values of channel '{name}' are no numbers; an array (n,) is expected"
            ) from None
        n = column.size if n is None else n
        if column.shape != (n,):
            raise RecordingError(
                f"channel '{name}' has shape {column.shape}; ({n},) is expected, as long as the clock"
            )
        columns.append(column)
    return np.stack(columns, axis=1) if columns else np.empty((n or 0, 0))


def refuse_not_finite(
    time: NDArray[np.float64], values: NDArray[np.float64], channels: Sequence[Channel]
) -> None:
    """Refuse values that are not finite, and say where the first is."""
    good = np.isfinite(values)
    if good.all():
        return
    column = int(np.argmin(good.all(axis=0)))
    bad = np.flatnonzero(~good[:, column])
    others = f", as at {bad.size - 1} more of its {len(time)} samples" if bad.size > 1 else ""
    raise RecordingError(
        f"channel '{channels[column].name}' is {values[bad[0], column]} at t = {time[bad[0]]:.9g} s (sample {bad[0]}){others}; "
        "cut the record there, or bridge short dropouts with Recording.from_arrays(…, gaps='interpolate')"
    )


def digest(
    time: NDArray[np.float64],
    sample_rate: float,
    settle: float,
    values: NDArray[np.float64],
    channels: Sequence[Channel],
) -> str:
    """SHA-256 of a record, in hexadecimal, the same on every machine."""
    head = {
        "channels": [asdict(channel) for channel in channels],
        "clock": [float(time[0]).hex(), sample_rate.hex(), len(time)],
        "settle": settle.hex(),
    }
    content = hashlib.sha256(json.dumps(head, sort_keys=True).encode())
    # adding zero turns -0.0 into 0.0: equal recordings must have equal hashes
    content.update((values + 0.0).astype("<f8", copy=False).tobytes(order="F"))
    return content.hexdigest()
