"""What a stage of a measurement chain is.

A stage is a frozen description; `Stage.start` makes the memory it needs at one sample rate, and the memory then works on
blocks of samples in place. Loops over samples with memory are compiled (`bench.measurement.kernels`); stages without memory
are single numpy operations, which treat each sample alike whatever the block.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals.description import Described


class Memory(Protocol):
    """The memory of a started stage."""

    def process(self, x: NDArray[np.float64]) -> None:
        """Replace the next samples ``(k,)`` by the output of the stage."""
        ...


@dataclass(frozen=True)
class Stage(Described, ABC, kind="stage"):
    """One effect of a sensor, an actuator or a data acquisition on the signal of one channel.

    Attributes:
        random: Whether the stage draws from a generator.
    """

    random: ClassVar[bool] = False

    @abstractmethod
    def start(self, sample_rate: float, rng: np.random.Generator | None) -> Memory:
        """The memory of the stage before the first sample.

        Args:
            sample_rate: Sample rate [Hz].
            rng: A generator of the stage's own; only a stage with `random` uses it.

        Raises:
            ParameterError: The stage does not fit the sample rate.
        """


def generator(stage: Stage, rng: np.random.Generator | None) -> np.random.Generator:
    """The generator of a random stage, or a `ParameterError` where there is none."""
    if not isinstance(rng, np.random.Generator):
        raise ParameterError(
            f"stage '{stage.name}' is random: pass rng=np.random.default_rng(seed); {rng!r} came"
        )
    return rng


@cache
def kernels() -> ModuleType:
    """The module of compiled loops, imported on first use: numba takes half a second."""
    import bench.measurement.kernels as module  # noqa: PLC0415

    return module
