"""Stages in their one documented order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError
from bench.measurement.anti_alias import AntiAlias
from bench.measurement.base import Memory, Stage
from bench.measurement.bias import Bias
from bench.measurement.clipping import Clipping
from bench.measurement.delay import Delay
from bench.measurement.drift import Drift
from bench.measurement.gain import Gain
from bench.measurement.lag import Lag
from bench.measurement.noise import Noise
from bench.measurement.quantisation import Quantisation
from bench.signals.streams import named_streams

ORDER: tuple[type[Stage], ...] = (AntiAlias, Delay, Lag, Gain, Bias, Drift, Noise, Quantisation, Clipping)
"""The stages in the order in which they act."""


@dataclass
class ChainState:
    """A started chain: what each stage remembers of the samples so far. `copy.deepcopy` makes a branch.

    Attributes:
        chain: The chain.
        sample_rate: Sample rate [Hz].
        memories: Memory of each stage.
    """

    chain: Chain
    sample_rate: float
    memories: tuple[Memory, ...]


@dataclass(frozen=True, init=False)
class Chain:
    """What lies between a physical quantity and the numbers in a file, or between a command and the force of an actuator.

    Stages act in one order: anti-alias, delay, lag (dynamics), gain, bias, drift (static errors), noise, quantisation, clipping
    (conversion). Each may be left out, none may come twice. The order is fixed because the parts do not
    commute, and two records are comparable only where it is the same: noise added after the filter has the
    standard deviation stated, whatever the cut-off; clipping comes last, so that no recorded value exceeds
    the range.

    ::

        chain = Chain(AntiAlias(200.0), Delay(0.002), Noise(0.05), Quantisation.from_bits(16, full_scale=10.0))
        measured = chain.apply(x, 1000.0, rng)  # a whole record
        state = chain.start(1000.0, rng)  # the same numbers sample by sample
        y = chain.process(state, x[:1])

    Attributes:
        stages: The stages in order; none: the signal passes unchanged.
    """

    stages: tuple[Stage, ...]

    def __init__(self, *stages: Stage) -> None:
        order = ", ".join(stage.name for stage in ORDER)
        for stage in stages:
            if not isinstance(stage, ORDER):
                raise ParameterError(f"a chain is made of stages ({order}); {stage!r} came")
        ranks = [ORDER.index(type(stage)) for stage in stages]
        if any(later <= earlier for earlier, later in pairwise(ranks)):
            raise ParameterError(
                f"stages {', '.join(stage.name for stage in stages)} came; "
                f"a chain takes each at most once and in the order {order}"
            )
        object.__setattr__(self, "stages", tuple(stages))

    def __repr__(self) -> str:
        return f"Chain({', '.join(map(repr, self.stages))})"

    @property
    def random(self) -> bool:
        """Whether a stage draws from a generator."""
        return any(stage.random for stage in self.stages)

    @property
    def gain(self) -> float:
        """Factor of the gain stage, 1 without one."""
        return next((stage.factor for stage in self.stages if isinstance(stage, Gain)), 1.0)

    @property
    def noise_std(self) -> float:
        """Standard deviation of what the chain adds at random to a sample, in the unit of the channel.

        Noise and rounding (``step / sqrt(12)``, true where the signal crosses many steps); drift is no part of it.
        """
        noise = next((stage.std for stage in self.stages if isinstance(stage, Noise)), 0.0)
        step = next((stage.step for stage in self.stages if isinstance(stage, Quantisation)), 0.0)
        return float(np.hypot(noise, step / np.sqrt(12.0)))

    def start(self, sample_rate: float, rng: np.random.Generator | None = None) -> ChainState:
        """Make the memory of the stages before the first sample.

        Args:
            sample_rate: Sample rate [Hz].
            rng: Source of randomness; may be None where no stage draws. Each stage gets a stream of its own, so that
                one more stage does not change the noise.

        Raises:
            ParameterError: The sample rate is not positive, a stage does not fit it, or `rng` is missing.
        """
        if not (np.isfinite(sample_rate) and sample_rate > 0.0):
            raise ParameterError(f"the sample rate is {sample_rate!r} Hz; a positive number is expected")
        names = [stage.name for stage in self.stages if stage.random]
        streams = named_streams(rng, names) if names and rng is not None else {}
        memories = tuple(stage.start(sample_rate, streams.get(stage.name)) for stage in self.stages)
        return ChainState(self, sample_rate, memories)

    def process(self, state: ChainState, block: ArrayLike) -> NDArray[np.float64]:
        """Measure the next samples.

        Whatever the split into blocks, down to single samples, the outputs joined are the same to the last bit.

        Args:
            state: As from `start`; moves on.
            block: The next samples ``(k,)``, k = 0 included.

        Returns:
            The measured samples ``(k,)``.

        Raises:
            ParameterError: `state` belongs to another chain, or `block` is not one-dimensional.
        """
        if state.chain is not self and state.chain != self:
            raise ParameterError(
                f"this state belongs to {state.chain!r}; start this chain to get one of its own"
            )
        x = np.array(block, dtype=float)
        if x.ndim != 1:
            raise ParameterError(f"a block of shape {x.shape} came; one channel of shape (k,) is expected")
        for memory in state.memories:
            memory.process(x)
        return x

    def apply(
        self, signal: ArrayLike, sample_rate: float, rng: np.random.Generator | None = None
    ) -> NDArray[np.float64]:
        """Measure a whole record.

        Args:
            signal: The record ``(n,)``.
            sample_rate: Sample rate [Hz].
            rng: Source of randomness; may be None where no stage draws.

        Returns:
            The measured record ``(n,)``.

        Raises:
            ParameterError: As `start` and `process`.
        """
        return self.process(self.start(sample_rate, rng), signal)

    def to_dict(self) -> dict[str, Any]:
        """The chain as numbers, strings, lists and dictionaries."""
        return {"stages": [stage.to_dict() for stage in self.stages]}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Chain:
        """The chain that `to_dict` (or a section of a TOML file) stands for.

        Raises:
            DocumentError: An entry, the type of a stage or a field of it is unknown, missing or out of range, or the order is wrong.
        """
        from bench.documents import checked, schema_of  # noqa: PLC0415  (pydantic, for those who read documents)

        return checked(schema_of("bench.measurement").ChainDocument, data).chain()
