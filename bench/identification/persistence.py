"""What the adaptive estimator reports about its input: events, and whether the excitation suffices to trust the estimates.

The monitor works on the Gramian of the regressor over a sliding window, scaled to a correlation matrix so that units play no
role. Its smallest eigenvalue falls to zero when columns depend on each other (a constant signal, a single harmonic and too
many terms); a column whose level falls far below the highest level it has had is unexcited, even if its noise keeps the
eigenvalue up. Either way the estimates of before stand, and are not to be trusted as estimates of now.

References:
    Ioannou, P. A. and Sun, J. 1996, Robust Adaptive Control, definition 4.3.1 (persistence of excitation).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Event(NamedTuple):
    """Something the estimator met in its input; like ones that follow each other are one event.

    Attributes:
        time: Time stamp of the first sample concerned [s]; NaN where the stamp itself was.
        kind: Short name, one of `EVENT_KINDS`.
        reason: What happened and what was done, for people.
        count: How many samples in a row.
    """

    time: float
    kind: str
    reason: str
    count: int = 1


EVENT_KINDS: dict[str, str] = {
    "not finite": "sample left out: a channel the model reads, or a term formed from it, is NaN or infinite",
    "backwards": "sample left out: its time is not later than that of the sample before",
    "clock reset": "two samples in a row lie before the last one: clock taken over, filters begun anew, estimate kept",
    "dropped": "samples are missing before this one: filters begun anew, estimate kept",
    "constant": "a channel does not move: estimate held",
    "moving": "all channels move again: estimation resumed",
    "excitation lost": "regressor no longer persistently exciting: estimates not to be trusted",
    "excitation back": "regressor persistently exciting again",
    "reset": "prediction error far above its usual size: covariance reset",
}
"""Kinds of events, in the order of the flag bits of `bench.identification.layout`, and what they mean."""


class PersistenceReport(NamedTuple):
    """Excitation over one window.

    Attributes:
        time: End of the window [s]; NaN before the first.
        smallest_eigenvalue: Of the correlation matrix of the regressor, 0 … 1.
        condition: Largest eigenvalue over smallest.
        level: Root mean square of each column of the scaled regressor (n,).
        unexcited: Names of the parameters whose column has fallen silent.
        trusted: Whether estimates may be trusted.
        ruled_by_start: Names of the parameters that the start values still pull too far; all of them before the first report.
    """

    time: float
    smallest_eigenvalue: float
    condition: float
    level: NDArray[np.float64]
    unexcited: tuple[str, ...]
    trusted: bool
    ruled_by_start: tuple[str, ...] = ()


class PersistenceHistory(NamedTuple):
    """The reports of a whole record.

    Attributes:
        time: Ends of the windows (m,) [s].
        smallest_eigenvalue: (m,).
        condition: (m,).
        level: (m, n).
        n_unexcited: Number of silent columns (m,).
        trusted: (m,) bool.
    """

    time: NDArray[np.float64]
    smallest_eigenvalue: NDArray[np.float64]
    condition: NDArray[np.float64]
    level: NDArray[np.float64]
    n_unexcited: NDArray[np.int64]
    trusted: NDArray[np.bool_]

    @classmethod
    def of_rows(cls, rows: NDArray[np.float64]) -> PersistenceHistory:
        """The reports as the compiled loop writes them ``(m, 5 + n)``: time, eigenvalue, condition, silent, trusted, levels."""
        return cls(
            time=rows[:, 0].copy(),
            smallest_eigenvalue=rows[:, 1].copy(),
            condition=rows[:, 2].copy(),
            level=rows[:, 5:].copy(),
            n_unexcited=rows[:, 3].astype(np.int64),
            trusted=rows[:, 4] == 1.0,
        )
