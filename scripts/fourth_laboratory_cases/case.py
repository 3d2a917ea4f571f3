"""What describes a case: what is tested and how, what is stated of it, and what is right."""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from third_laboratory_cases.case import Parameter, Signals

from bench.arrays import Array
from fourth_laboratory_cases.models import Model
from fourth_laboratory_cases.signals import Excitation

PREFIX = "fourth_"
"""What the names of the cases begin with."""
STREAMS = {"identification": 1, "validation": 2, "identification_2": 3}
"""Random numbers of the excitation of each record, by its stem."""
WRITING = 7
"""Random numbers of the nominal values, the clocks and the noise."""


class Record(NamedTuple):
    """A record of a case.

    Attributes:
        stem: Name of its file without the extension.
        seconds: Its duration.
        excitation: Force or torque, or motion that is prescribed or asked for.
        start: Displacement [m, rad] from which a pendulum is released at rest.
        cut: Time [s] between that release and the start of the record.
        phase: Turn of a wheel at the start, as a fraction.
    """

    stem: str
    seconds: int
    excitation: Excitation
    start: float = 0.0
    cut: float = 0.0
    phase: float = 0.0


class Clock(NamedTuple):
    """Clock of the logger and of the integration.

    Attributes:
        rate: Sample rate [Hz].
        substeps: Steps of the integration a sample.
    """

    rate: int
    substeps: int

    def step(self) -> float:
        """Step of the integration [s]."""
        return 1.0 / (self.rate * self.substeps)

    def steps(self, seconds: float) -> int:
        """Steps of the integration in some time [s], of a whole number of samples."""
        return round(seconds * self.rate) * self.substeps

    def times(self, n: int) -> Array:
        """Times [s] of the first steps (n,)."""
        return np.arange(n, dtype=np.float64) * self.step()

    def half_steps(self, seconds: float) -> Array:
        """Times [s] at half steps, both ends included (2 n_steps + 1,)."""
        return np.arange(2 * self.steps(seconds) + 1) * self.step() / 2

    def sampled(self, signals: Signals) -> Signals:
        """Signals as the logger samples them, from those at each step."""
        return {name: values[:: self.substeps] for name, values in signals.items()}


class Excited(NamedTuple):
    """A record as it is excited.

    Attributes:
        record: The record.
        clock: Its clock.
        inputs: What drives the specimen, on the grid that it needs.
    """

    record: Record
    clock: Clock
    inputs: Signals


class Compared(NamedTuple):
    """The same record thrice, at each step: complete, without background, and without background and missing effect."""

    complete: Signals
    effect_alone: Signals
    neither: Signals


@dataclass(frozen=True, kw_only=True)
class Specimen(ABC):
    """What is tested, with what its nominal model misses. Signals at each step hold their times as "t"."""

    @abstractmethod
    def stated_values(self) -> dict[str, float]:
        """True values of what a nominal model may state, by name, in SI units."""

    @abstractmethod
    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """A record as it is excited; the generator draws the excitation."""

    @abstractmethod
    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """Signals at each step (n_steps + 1,), with or without the missing effect and the background."""

    @abstractmethod
    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """Signals of the nominal model at each step (n_steps + 1,).

        Args:
            excited: The record.
            values: As of `stated_values`.
            measured: Signals of the specimen at each step, for a model that starts from them.
        """

    def compared(self, excited: Excited) -> Compared:
        """The record with and without effect and background."""
        return Compared(
            self.simulated(excited, effect=True, background=True),
            self.simulated(excited, effect=True, background=False),
            self.simulated(excited, effect=False, background=False),
        )


@dataclass(frozen=True)
class Channel:
    """A column of the records.

    Attributes:
        signal: Signal of the specimen that it holds.
        unit: Its unit.
        noise: Standard deviation of its noise, as a fraction of that of the signal; in SI units where `absolute`.
        told: What else `nominal.json` says of it.
        scale: Value in its unit over that in SI units.
        absolute: Whether the noise is in SI units.
    """

    signal: str
    unit: str
    noise: float
    told: Mapping[str, str] = field(default_factory=dict)
    scale: float = 1.0
    absolute: bool = False

    def noise_std(self, values: Array) -> float:
        """Standard deviation of its noise in SI units, from samples (n,) of its signal."""
        return self.noise if self.absolute else self.noise * float(np.std(values))


class Freeze(NamedTuple):
    """Samples of a channel that hold the value before them.

    Attributes:
        channel: Its name.
        stem: Name of the record.
        where: Where in it, as a fraction of it.
        samples: How many.
    """

    channel: str
    stem: str
    where: float
    samples: int


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of the fourth laboratory.

    Attributes:
        name: Of its folder; its random numbers follow from it and the seed.
        rig: Rig of the bench, or the file of its own MJCF.
        clock: Of the logger and of the integration.
        specimen: What is tested.
        records: Of identification, then of validation.
        parameters: Of the nominal model, by name.
        channels: By name.
        judged: Signals that are responses.
        understated: True noise over the stated one; None where nothing is stated.
        jitter: Standard deviation of the times of the samples, as a fraction of a sample.
        true_times: Whether the time column holds the true times; else even ones.
        freeze: Samples that the logger holds, if any.
        told: What else `nominal.json` says.
        model: Writes the MJCF from the values of the parameters; None for a rig of the bench.
        right: Groups of names, any one of which is right; empty where no catalogue holds what is missing.
        also: Names that are there in small size and may stand beside.
        limit: Largest NRMSE of a corrected model that is accepted; "derived" from the sizes.
        why: What is there.
        usual_background: Whether the background is the one that most cases have.
        acceptable: Verdicts that are right, in words.
        honest: Which other verdicts are honest, in words.
        wrong: Which are wrong, in words.
    """

    name: str
    rig: str
    clock: Clock
    specimen: Specimen
    records: Sequence[Record]
    parameters: Mapping[str, Parameter]
    channels: Mapping[str, Channel]
    judged: Sequence[str]
    understated: float | None = 1.0
    jitter: float = 0.015
    true_times: bool = False
    freeze: Freeze | None = None
    told: Mapping[str, Any] = field(default_factory=dict)
    model: Model | None = None
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    limit: float | Literal["derived"] = "derived"
    why: str
    usual_background: bool = True
    acceptable: Sequence[str]
    honest: Sequence[str]
    wrong: str

    def generator(self, stream: int, seed: int) -> np.random.Generator:
        """The generator of one stream of its random numbers, which follow from its name as it was before the prefix."""
        drawn_by = self.name.removeprefix(PREFIX)
        return np.random.default_rng([seed, zlib.crc32(drawn_by.encode()), stream, 0])

    def excited(self, seed: int) -> list[Excited]:
        """Its records as they are excited."""
        return [
            self.specimen.excited(record, self.clock, self.generator(STREAMS[record.stem], seed))
            for record in self.records
        ]
