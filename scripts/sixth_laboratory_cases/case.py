"""What describes a case: what is tested and how, what is stated of it, and what is right."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bench.arrays import Array
from sixth_laboratory_cases.signals import Clock, Generator

AUTHOR = 6
"""First number of every seed."""
FARTHEST = 1.5
"""Stated standard deviations by which a true value is off the stated one at most."""

Signals = Mapping[str, Array]
"""Signals of a rig in SI units, by name, each at all steps of the integration (n_steps + 1,)."""


class Session(NamedTuple):
    """What a laboratory has at hand when it plays the loads of its records.

    Attributes:
        clock: Steps of the integration, both ends included.
        rng: Source of what is random in the loads.
        substeps: Steps a sample.
        values: Of the true rig, by name.
    """

    clock: Clock
    rng: Generator
    substeps: int
    values: Mapping[str, float]


Excitation = Callable[[Session], Sequence[Array]]
"""Loads of each record in SI units, (n_steps + 1,), or (n_steps + 1, n_loads) where there are several."""


class Parameter(NamedTuple):
    """A parameter of the nominal model.

    Attributes:
        name: Its name in `nominal.json`.
        value: Its stated value.
        std: Its stated standard deviation.
        unit: The unit of both.
        factor: Value in SI units over that in its unit.
    """

    name: str
    value: float
    std: float
    unit: str
    factor: float = 1.0


class Run(NamedTuple):
    """What a rig is to run.

    Attributes:
        values: What it is made of, in SI units, by the names of its properties.
        loads: At each step, (n_steps + 1, n_loads).
        step: Step of the integration [s].
        start: Angle [deg] from which a pendulum is let go.
    """

    values: Mapping[str, float]
    loads: Array
    step: float
    start: float


@dataclass(frozen=True)
class Channel:
    """A column of the records; all but the scale is in its unit.

    Attributes:
        signal: Signal of the rig that it holds.
        unit: Its unit.
        noise: Standard deviation of its noise.
        scale: Value in its unit over that in SI units.
        stated: Stated standard deviation over the true one; nothing is stated where None.
        slow: Part of the variance of the noise that is slow.
        resolution: Step of its values; none where zero.
        told: What else `nominal.json` says of it.
    """

    signal: str
    unit: str
    noise: float = 0.0
    scale: float = 1.0
    stated: float | None = 1.0
    slow: float = 0.0
    resolution: float = 0.0
    told: Mapping[str, str] = field(default_factory=dict)

    def commanded(self) -> bool:
        """Whether it holds what was asked for, which no sensor measures."""
        return self.told.get("role") == "command"


class Left(NamedTuple):
    """What models leave of a response, as NRMSE on the validation record in percent; from runs of the author.

    Attributes:
        nominal: The nominal model.
        plain: The same of a rig that has everything but the missing effect.
        alone: The nominal model with its parameters fitted.
        explained: The same with the true law of the effect besides.
        noise: The true rig.
    """

    nominal: float
    plain: float
    alone: float
    explained: float
    noise: float


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of the sixth laboratory.

    Attributes:
        name: Of its folder.
        number: Of its place in the set, part of every seed.
        rig: Rig of the bench, or the file of its own MJCF.
        model: That MJCF; None for a rig of the bench.
        rate: Sample rate [Hz].
        seconds: Duration of each record.
        substeps: Steps of the integration a sample.
        simulate: Runs the rig.
        excitation: Plays the loads of its records; the last record is that of validation.
        starts: Angle [deg] from which a pendulum is let go in each record; empty where nothing is.
        parameters: Of the nominal model, by the names that they have among the properties of the rig.
        missing: Values of the properties that make up what the nominal model misses.
        besides: Of the small physics besides.
        channels: By name.
        responses: Channels that are judged.
        told: What else `nominal.json` says.
        right: Groups of names, any one of which is right; empty where no catalogue holds what is missing.
        also: Names that are there in small size, or may stand beside for another reason.
        why: What is missing.
        tested: What was tested, and what was logged.
        size: How large the missing effect is.
        background: What the small physics besides is.
        noise_stated: How the noise is stated.
        left: What models leave of each response.
        farthest: Where the parameters go without the effect, in stated standard deviations; the one that goes farthest.
        found: Where they go with it, and what is found of the effect.
    """

    name: str
    number: int
    rig: str
    model: str | None = None
    rate: int
    seconds: float
    substeps: int
    simulate: Callable[[Run], Signals]
    excitation: Excitation
    starts: Sequence[float] = ()
    parameters: Mapping[str, Parameter]
    missing: Mapping[str, float]
    besides: Mapping[str, float]
    channels: Mapping[str, Channel]
    responses: Sequence[str]
    told: Mapping[str, Any] = field(default_factory=dict)
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    why: str
    tested: str
    size: str
    background: str
    noise_stated: str
    left: Mapping[str, Left]
    farthest: str
    found: str

    def step(self) -> float:
        """Step of the integration [s]."""
        return 1.0 / (self.rate * self.substeps)

    def drawn(self) -> dict[str, float]:
        """True values of the parameters in SI units: off the stated ones by their stated uncertainty."""
        rng = np.random.default_rng([AUTHOR, self.number, 99])
        return {
            name: p.factor * p.value
            + p.factor * p.std * float(np.clip(rng.standard_normal(), -FARTHEST, FARTHEST))
            for name, p in self.parameters.items()
        }

    def truth(self, *, effect: bool = True, background: bool = True) -> dict[str, float]:
        """Properties of the rig, with or without the missing effect and the background."""
        besides, missing = self.besides if background else {}, self.missing if effect else {}
        return {**self.drawn(), **besides, **missing}

    @cached_property
    def loads(self) -> tuple[Array, ...]:
        """Loads of each record at each step, (n_steps + 1, n_loads) each."""
        rate = float(self.rate * self.substeps)
        clock = Clock(int(self.seconds * rate) + 1, rate)
        rng = np.random.default_rng([AUTHOR, self.number, 7])
        played = self.excitation(Session(clock, rng, self.substeps, self.truth()))
        return tuple(load.reshape(clock.n, -1) for load in played)

    def stems(self) -> list[str]:
        """Names of the files of the records without the extension."""
        more = [f"identification_{number}" for number in range(2, len(self.loads))]
        return ["identification", *more, "validation"]

    def simulated(self, number: int, *, effect: bool = True, background: bool = True) -> Signals:
        """Signals of one of its records, with or without the missing effect and the background."""
        start = self.starts[number] if self.starts else 0.0
        values = self.truth(effect=effect, background=background)
        return self.simulate(Run(values, self.loads[number], self.step(), start))
