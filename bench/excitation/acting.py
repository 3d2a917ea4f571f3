"""What acts in an excitation environment or on a shaker: a policy of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
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


def rows_of(
    policy: ActingPolicy, observation: NDArray[np.float32], remembered: int | None
) -> NDArray[np.float32]:
    """Observations of tests that a policy remembers, one a row ``(m, n_observations)``.

    Args:
        policy: The policy.
        observation: ``(…, n_observations)``.
        remembered: Tests that its memory is of; None where no memory came.

    Raises:
        ParameterError: The observations have another length, or the memory is of another number of tests.
    """
    length, before = policy.station.n_observations, observation.shape[:-1]
    if observation.shape[-1] != length:
        raise ParameterError(
            f"policy '{policy.name}' takes observations of length {length}; {observation.shape} came"
        )
    if remembered != np.prod(before, dtype=int):
        came = "none" if remembered is None else f"one of {remembered} tests"
        raise ParameterError(
            f"policy '{policy.name}' remembers the record, and {came} came as its memory; take memory = policy.memory({before}) "
            "at the start of a test and act(observation, memory) in it"
        )
    return observation.reshape(-1, length)


def check_window(policy: ActingPolicy, window: int) -> None:
    """Refuse a window after the last of a test.

    Raises:
        ParameterError: The test is over.
    """
    if window >= policy.station.n_windows:
        raise ParameterError(
            f"policy '{policy.name}' has tests of {policy.station.n_windows} windows, which are over; begin anew with policy.memory()"
        )
