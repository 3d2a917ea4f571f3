"""What describes a case: what is tested and how, what is stated of it, and what is right."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from bench.arrays import Array
from fifth_laboratory_cases.motion import Oscillator, Signals
from fifth_laboratory_cases.signals import Excitation, still

FARTHEST = 1.5
"""Stated standard deviations by which a true value is off the stated one at most."""
MAINS = 50.0
"""Frequency of the mains [Hz]."""


class Record(NamedTuple):
    """A record of a case.

    Attributes:
        stem: Name of its file without the extension.
        excitation: Force or torque, acceleration of a floor, or motion that is prescribed or asked for.
        start: Angle [deg] and angular velocity [deg/s] of a pendulum at the first sample.
        speed: Speed of a shaft that turns [rpm].
    """

    stem: str
    excitation: Excitation = still
    start: tuple[float, float] = (0.0, 0.0)
    speed: float = 0.0


class Parameter(NamedTuple):
    """A parameter of the nominal model.

    Attributes:
        value: Its stated value.
        std: Its stated standard deviation.
        unit: The unit of both.
        factor: Value in SI units over that in its unit.
    """

    value: float
    std: float
    unit: str
    factor: float = 1.0


class Run(NamedTuple):
    """What a rig is to run.

    Attributes:
        record: The record.
        seed: Of what is random in the rig itself.
        seconds: Duration of the record.
        rate: Sample rate [Hz].
        substeps: Steps of the integration a sample.
        values: True values of the parameters in SI units, by name.
        effect: Whether it has what its nominal model misses.
        background: Whether it has the small physics besides.
    """

    record: Record
    seed: Sequence[int]
    seconds: float
    rate: int
    substeps: int
    values: Mapping[str, float]
    effect: bool
    background: bool

    def step(self) -> float:
        """Step of the integration [s]."""
        return 1 / self.rate / self.substeps

    def missing(self, size: float) -> float:
        """A size of what the nominal model misses; zero where the rig is run without."""
        return size if self.effect else 0.0

    def besides(self, size: float) -> float:
        """A size in the background; zero where the rig is run without."""
        return size if self.background else 0.0

    def oscillator(self, body: str = "", joint: str = "") -> Oscillator:
        """The oscillator that it is, from the ends of the names of its parameters where it is an MJCF."""
        names = f"mass{body}", f"stiffness{joint}", f"damping{joint}"
        return Oscillator(*(self.values[name] for name in names))

    def half_steps(self) -> Array:
        """Times [s] at each half step, both ends included (2 n_steps + 1,)."""
        n = 2 * round(self.seconds / self.step()) + 1
        return np.arange(n, dtype=np.float64) * (self.step() / 2)

    def load(self) -> Array:
        """The excitation at each half step (2 n_steps + 1,)."""
        return self.record.excitation(self.half_steps(), self.seconds)


class Hum(NamedTuple):
    """A sine in the reading of a sensor.

    Attributes:
        amplitude: In the unit of the channel.
        frequency: Its frequency [Hz].
        phase: Its phase at time zero [rad].
    """

    amplitude: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Channel:
    """A column of the records; all but the factors is in its unit.

    Attributes:
        signal: Signal of the rig that it holds.
        unit: Its unit.
        noise: Standard deviation of its white noise; none is drawn for zero.
        stated: The stated one; nothing is stated where None.
        told: What else `nominal.json` says of it.
        scale: Value in its unit over that in SI units.
        coloured: Standard deviation of its coloured noise, which counts as background.
        pole: Of the filter of first order that colours it.
        hum: A sine in its reading, which is background, too.
        gain: Reading over what is there, likewise.
    """

    signal: str
    unit: str
    noise: float = 0.0
    stated: float | None = None
    told: Mapping[str, str] = field(default_factory=dict)
    scale: float = 1.0
    coloured: float = 0.0
    pole: float = 0.98
    hum: Hum | None = None
    gain: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of the fifth laboratory.

    Attributes:
        name: Of its folder.
        seed: Of its true values, its clocks and its noise.
        rig: Rig of the bench, or the file of its own MJCF.
        model: That MJCF; None for a rig of the bench.
        rate: Sample rate [Hz].
        seconds: Duration of each record.
        substeps: Steps of the integration a sample.
        simulate: Runs the rig.
        records: Of identification, then of validation.
        parameters: Of the nominal model, by name.
        channels: By name.
        responses: Channels that are judged.
        sized: Channels of which sizes are told, where a control loop hides what is missing in the responses; else those.
        jitter: Standard deviation of the times of the samples, as a fraction of a sample.
        told: What else `nominal.json` says.
        right: Groups of names, any one of which is right; empty where no catalogue holds what is missing.
        also: Names that are there in small size and may stand beside.
        limit: Largest NRMSE of a corrected model that is accepted.
        why: What is there.
        doubtful: What of the judgement is doubtful.
        alone: What the nominal model leaves at best with its parameters moved freely, in words.
        explained: What it leaves with the law of the missing effect besides, in words.
    """

    name: str
    seed: int
    rig: str
    model: str | None = None
    rate: int
    seconds: float
    substeps: int = 10
    simulate: Callable[[Run], Signals]
    records: Sequence[Record]
    parameters: Mapping[str, Parameter]
    channels: Mapping[str, Channel]
    responses: Sequence[str]
    sized: Sequence[str] = ()
    jitter: float
    told: Mapping[str, Any] = field(default_factory=dict)
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    limit: float
    why: str
    doubtful: str
    alone: str
    explained: str

    def truth(self) -> dict[str, float]:
        """True values of the parameters in SI units, by name: off the stated ones by their stated uncertainty."""
        rng = np.random.default_rng(self.seed)
        return {
            name: p.factor * (p.value + p.std * float(np.clip(rng.normal(), -FARTHEST, FARTHEST)))
            for name, p in self.parameters.items()
        }

    def simulated(self, number: int, *, effect: bool, background: bool) -> Signals:
        """Signals of one of its records, with or without the missing effect and the background."""
        record, seed = self.records[number], (self.seed, number, 3)
        timing = self.seconds, self.rate, self.substeps
        return self.simulate(Run(record, seed, *timing, self.truth(), effect, background))
