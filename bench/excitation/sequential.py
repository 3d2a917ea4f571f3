"""Tests in which the rest of the excitation is decided anew at times, from the records so far: what planners share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.excitation.closed_loop import Runs, finish
from bench.excitation.estimation import Records
from bench.excitation.station import Station
from bench.excitation.stepping import Packed, integrate_cases

Decide = Callable[[Records, NDArray[np.float64], int], None]
"""A decision: given the records so far, writes the commands ``(m, n_samples, n_actuators)`` from a sample on."""


class SequentialPlanner(ABC):
    """A planner of commands for rigs that are tested side by side, each for itself.

    Attributes:
        station: What is measured and allowed.
    """

    station: Station

    @abstractmethod
    def _edges(self) -> list[int]:
        """Samples at which decisions are made, the first 0, and last the end of the test."""

    @abstractmethod
    def _decider(self, m: int, seed: int, told: Callable[[int, Any], None] | None) -> Decide:
        """Decisions of a test of m rigs, called once at each edge but the last."""

    def run(
        self, packed: Packed, disturbance: NDArray[np.float64], *, seed: int = 0,
        told: Callable[[int, Any], None] | None = None,
    ) -> Runs:  # fmt: skip
        """Test rigs from rest, planning for each on its own.

        Args:
            packed: The rigs, one case each; their channels are the station's.
            disturbance: Noise of the sensors, see `bench.excitation.closed_loop.disturbances`.
            seed: Seed of the searches.
            told: Called with the rig's place and each plan.
        """
        station = self.station
        m, n = len(packed.start), station.n_samples
        controls = np.zeros((m, n, len(station.actuators)))
        states = packed.start[:, None].copy()
        noise = disturbance[:, : station.n_windows].reshape(m, n, -1)
        ideal = np.zeros_like(noise)
        decide = self._decider(m, seed, told)
        members, counts = np.arange(m)[:, None], np.ones(m, dtype=np.int64)
        for begin, end in pairwise(self._edges()):
            measured = ideal[:, :begin] + noise[:, :begin]
            decide(Records(controls[:, :begin], measured, np.full(m, begin)), controls, begin)
            ideal[:, begin:end] = integrate_cases(
                packed, controls[:, begin:end], states, members=members, counts=counts,
                timestep=station.timestep, clock=np.full(m, begin * station.timestep),
            )[:, 0]  # fmt: skip
        return finish(station, controls, ideal, disturbance)
