"""What acts in an excitation environment or on a shaker: a policy of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.excitation.station import Station


class ActingPolicy(Protocol):
    """A policy: actions for observations, window by window; `Policy` and `PlanPolicy` are of this kind."""

    @property
    def name(self) -> str:
        """Name."""
        ...

    @property
    def station(self) -> Station:
        """What it was trained for."""
        ...

    @property
    def about(self) -> Mapping[str, Any]:
        """Where it comes from, in JSON values."""
        ...

    def memory(self, shape: int | tuple[int, ...] = ()) -> Any:
        """What is remembered at the start of tests; made anew for each."""
        ...

    def act(self, observation: NDArray[np.float32], memory: Any = None) -> NDArray[np.float32]:
        """Actions ``(…, width)`` in −1 … 1 for observations ``(…, n_observations)``; the memory is brought up to date."""
        ...
