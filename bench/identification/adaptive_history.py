"""What goes into an estimate on line, and what comes out of it over time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import IdentificationError
from bench.identification.persistence import Event, PersistenceHistory


class Sample(NamedTuple):
    """One instant of a test; channels the model does not read may be NaN or left out.

    Attributes:
        time: Time stamp [s].
        force: Applied force F.
        displacement: x.
        velocity: x'.
        acceleration: x''.
    """

    time: float
    force: float
    displacement: float = math.nan
    velocity: float = math.nan
    acceleration: float = math.nan


class AdaptiveHistory(NamedTuple):
    """Course of an estimation.

    Attributes:
        time: Time of the rows kept (m,) [s].
        theta: Estimates after each of these samples (m, n), in physical units.
        measured: z (m,); NaN where a sample was not learnt from.
        predicted: ``theta^T phi`` with the estimate before the sample (m,).
        regressors: phi (m, n), physical; (0, n) unless asked for.
        flags: What each sample raised (n_samples,), bits of `bench.identification.layout`.
        persistence: Reports of the monitor.
        events: Events of the record.
    """

    time: NDArray[np.float64]
    theta: NDArray[np.float64]
    measured: NDArray[np.float64]
    predicted: NDArray[np.float64]
    regressors: NDArray[np.float64]
    flags: NDArray[np.int16]
    persistence: PersistenceHistory
    events: tuple[Event, ...]

    def contributions(self, theta: ArrayLike | None = None) -> NDArray[np.float64]:
        """Contribution of each term, ``theta_i phi_i`` (m, n), in the unit of z.

        Args:
            theta: Estimates to use (n,); those of each instant where None.

        Raises:
            IdentificationError: The regressors were not kept.
        """
        if self.regressors.shape[0] == 0:
            raise IdentificationError(
                "the history holds no regressors; run the estimator with keep_regressors=True"
            )
        return self.regressors * (self.theta if theta is None else np.asarray(theta, dtype=float))
