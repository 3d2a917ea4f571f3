"""Windows of records without a stiffness that holds the motion.

Without a stiffness a free run drifts: the smallest force error grows with the square of time, and residuals of a whole record say
nothing but that. The record is then cut into windows, each restarted from the smoothed measured state (multiple shooting).

References:
    H. G. Bock, Recent advances in parameter identification techniques for ODE, Birkhaeuser 1983 (multiple shooting).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.settings import DEFAULT, LikelihoodSettings
from bench.discrepancy.simulation.stick_slip import Motion, StructureMatrices


def drifts(structure: Structure, linear: StructureMatrices, duration: float) -> bool:
    """Whether a measured motion is without a stiffness that would bring it back within the record.

    Args:
        structure: For its observers.
        linear: Matrices of the nominal model.
        duration: Length of the longest record [s].
    """
    free = np.ix_(structure.free, structure.free)
    squares, modes = np.linalg.eig(np.linalg.solve(linear.mass[free], linear.stiffness[free]))
    slow = np.abs(squares) < (2.0 * np.pi / duration) ** 2
    return bool(
        any(np.any(np.abs(o.row[structure.free] @ modes[:, slow]) > 1e-9) for o in structure.observers)
    )


def cut(
    case: Case, record: CaseRecord, n_channels: int, *, settings: LikelihoodSettings = DEFAULT.likelihood
) -> tuple[NDArray[np.int64], int]:
    """First samples and length of the windows of a record; `window_s` in nominal.json overrides the length."""
    n = len(record)
    asked = case.options.get("window_s")
    wanted = n / settings.windows if asked is None else float(str(asked)) / record.step
    length = int(
        np.clip(
            wanted,
            settings.window_shortest,
            min(n, max(settings.window_largest // n_channels, settings.window_shortest)),
        )
    )
    count = max(n // length, 1)
    length = n // count
    return np.arange(count, dtype=np.int64) * length, length


def channels_of(structure: Structure, motion: Motion) -> Array:
    """Channels (n, n_channels) of a motion; not finite where it diverged."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.column_stack([motion[o.order] @ o.row for o in structure.observers])
