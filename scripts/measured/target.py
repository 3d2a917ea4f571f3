"""What a diagnosis of a measured record is to reach."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Target(NamedTuple):
    """Largest error on every judging record.

    Attributes:
        channel: Judged channel.
        metric: "rms", in the channel's unit, or "nrmse", rms over standard deviation.
        limit: The largest.
        unit: Unit of `limit`.
    """

    channel: str
    metric: Literal["rms", "nrmse"]
    limit: float
    unit: str

    def error(self, measured: NDArray[np.float64], simulated: NDArray[np.float64]) -> float:
        """Error of a simulation (n,) of a measured channel (n,)."""
        rms = float(np.sqrt(np.mean((simulated - measured) ** 2)))
        return rms if self.metric == "rms" else rms / float(np.std(measured))
