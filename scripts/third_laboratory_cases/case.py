"""What describes a case: what is tested and how, what is stated of it, and what is right."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.logger import Fault, late
from third_laboratory_cases.models import Model
from third_laboratory_cases.signals import Excitation, rest

Signals = dict[str, Array]
"""Samples (n_samples,) of each signal of a record, in SI units, without noise."""
NO_NAME = "unknown; a declared set that holds it; no certain name"
"""Which other verdicts are honest, of most cases."""


class Record(NamedTuple):
    """A record of a case.

    Attributes:
        stem: Name of its file without the extension; of validation where it starts with that.
        seconds: Its duration.
        excitation: Force, torque of an oscillator that turns, or prescribed motion.
        peak: Largest motion [m, rad] under it.
        start: Displacement [m] from which an oscillator is released at rest.
        torque: Torque on a joint rig.
        torque_peak: Largest rotation of its first body [rad] under that.
    """

    stem: str
    seconds: int
    excitation: Excitation
    peak: float
    start: float = 0.0
    torque: Excitation = rest
    torque_peak: float = 0.0

    def validates(self) -> bool:
        """Whether it is of validation."""
        return self.stem.startswith("validation")

    def times(self, rate: float) -> Array:
        """Times [s] at a rate [Hz], both ends included."""
        return np.arange(round(self.seconds * rate) + 1) / rate


@dataclass(frozen=True)
class Parameter:
    """A parameter of the nominal model.

    Attributes:
        of: Which of the values of the specimen it states.
        relative: Its stated standard deviation, as a fraction of the true value.
        unit: Its unit.
        scale: Value in its unit over that in SI units.
    """

    of: str
    relative: float
    unit: str
    scale: float = 1.0


@dataclass(frozen=True)
class Channel:
    """A column of the records.

    Attributes:
        signal: Signal of the specimen that it holds.
        unit: Its unit.
        noise: Standard deviation of its noise, as a fraction of that of the signal.
        told: What else `nominal.json` says of it.
        scale: Value in its unit over that in SI units.
        late: Time [s] by which it comes too late.
    """

    signal: str
    unit: str
    noise: float
    told: Mapping[str, str] = field(default_factory=dict)
    scale: float = 1.0
    late: float = 0.0


class Sizes(NamedTuple):
    """Sizes of what a case holds, as NRMSE of the response on the validation record.

    Attributes:
        effect: What the missing effect makes of it.
        background: What the small physics besides makes of it.
        left: What the nominal model leaves after a fit within its stated uncertainties; None where it was not fitted.
    """

    effect: float
    background: float
    left: float | None


class Simulated(NamedTuple):
    """What came out of a simulation.

    Attributes:
        signals: Of each record, by its stem.
        sizes: Of what it holds.
    """

    signals: Mapping[str, Signals]
    sizes: Sizes


@dataclass(frozen=True, kw_only=True)
class Specimen(ABC):
    """What is tested, with what its nominal model misses."""

    @abstractmethod
    def stated_values(self) -> dict[str, float]:
        """True values of what a nominal model may state, by name, in SI units."""

    @abstractmethod
    def simulated(self, case: Case, rng: np.random.Generator) -> Simulated:
        """The records of a case, excited so that they have the wanted size; the generator draws the excitations."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of the third laboratory.

    Attributes:
        name: Of its folder; its random numbers follow from it and the seed.
        rig: Rig of the bench, or the file of its own MJCF.
        rate: Sample rate [Hz].
        substeps: Steps of the integration a sample.
        specimen: What is tested.
        background_share: Wanted size of the small physics, as NRMSE of the response on the validation record.
        records: Of identification, then of validation.
        parameters: Of the nominal model, by name.
        channels: By name.
        understated: True noise over the stated one; None where nothing is stated.
        faults: Of the logger, in the order in which they act.
        told: What else `nominal.json` says.
        model: Writes the MJCF from the values of the parameters; None for a rig of the bench.
        right: Groups of names, any one of which is right; empty where no catalogue holds what is missing.
        also: Names that are there in small size and may stand beside.
        limit: Largest NRMSE of a corrected model that is accepted; "derived" from the sizes.
        honest: Which other verdicts are honest, in words.
        refusal: Words that a refusal has to hold, where refusing the case is right.
        why: What is there.
    """

    name: str
    rig: str
    rate: int
    substeps: int
    specimen: Specimen
    background_share: float = 0.03
    records: Sequence[Record]
    parameters: Mapping[str, Parameter]
    channels: Mapping[str, Channel]
    understated: float | None = 1.0
    faults: Sequence[Fault] = ()
    told: Mapping[str, Any] = field(default_factory=dict)
    model: Model | None = None
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    limit: float | Literal["derived"] = "derived"
    honest: str = NO_NAME
    refusal: Sequence[str] = ()
    why: str

    def generator(self, seed: int) -> np.random.Generator:
        """The generator of its random numbers."""
        return np.random.default_rng([seed, sum(map(ord, self.name))])

    def transmitted(self, signals: Signals) -> Signals:
        """Signals of a record, those of late channels as late as these."""
        slow = {channel.signal: channel.late for channel in self.channels.values() if channel.late > 0.0}
        return {**signals, **{name: late(signals[name], self.rate, by) for name, by in slow.items()}}


def of_validation(case: Case, signals: Mapping[str, Signals], name: str) -> Array:
    """One signal of the validation records, one after another."""
    return np.concatenate([signals[record.stem][name] for record in case.records if record.validates()])
