"""A request for an excitation: a rig and, in its file, what is unknown, measured and allowed.

```toml
rig = "sdof"
[[elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = 800.0, clearance = 0.012 }

[experiment]
duration = 8.0                                   # [s]
band = [0.5, 5.0]                                # [Hz]
force = { shaker = 2.0 }                         # largest command, by actuator
energy = { shaker = 10.0 }                       # optional: largest dt sum(u^2)
stroke = { displacement = 0.04 }                 # optional
velocity = { velocity = 0.6 }                    # optional
noise = { displacement = 5e-4, velocity = 0.01 } # standard deviations of the measured channels
[experiment.uncertain]                           # optional: ranges; by default all of the elements' parameters, a factor two
"gap.clearance" = [0.005, 0.03]
"stiffness:carriage" = [200.0, 400.0]
[[experiment.background]]                        # optional, not beside a rival: small forces that no element holds
law = "cubic_stiffness"
joint = "carriage"
parameter = "k3"
deviation = 3e3                                  # standard deviation about zero, in the parameter's unit
[experiment.rival]                               # optional: another explanation; the question is then which of the two holds
elements = [{ law = "cubic_stiffness", joints = ["carriage"], name = "cubic", parameters = { k3 = 3e5 } }]
uncertain = { "cubic.k3" = [5e4, 2e6] } # as above; ranges of the structure are shared
```
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.documents import checked
from bench.errors import ParameterError, UnknownNameError
from bench.excitation.background import BackgroundTerm, with_background
from bench.excitation.experiment import Experiment
from bench.excitation.limits import Limits
from bench.excitation.methods import paired_experiment
from bench.excitation.prior import RigHypothesis, RigPrior, Uncertain
from bench.excitation.rivals import Rivals
from bench.excitation.schema import ExperimentEntry, RivalEntry
from bench.rig import Rig
from bench.signals.base import (
    BASE_SETTINGS,
)


@dataclass(frozen=True)
class RequestSettings:
    """Numbers of `bench.excitation.request`."""

    reference_share: float = 0.375
    """Of the duration: the test under which rivals imitate each other."""
    factor: float = 2.0
    """Range of a parameter about its value in the file, both ways, where no range is given."""


SETTINGS = RequestSettings()


@dataclass(frozen=True)
class Request:
    """What an excitation is asked for.

    Attributes:
        rig: The rig as its file describes it.
        experiment: What is asked, measured and allowed, on draws about that rig.
        duration: Duration [s].
        band: Frequencies [Hz].
        background: Small forces that no hypothesis holds.
    """

    rig: Rig
    experiment: Experiment
    duration: float
    band: tuple[float, float]
    background: tuple[BackgroundTerm, ...] = ()


def request(
    rig: Rig, table: ExperimentEntry | Mapping[str, Any], *, draws: int = 8, rng: np.random.Generator
) -> Request:
    """Read the table `experiment` of a rig's file.

    Args:
        rig: The rig.
        table: Entries as in the module's example.
        draws: Prior draws that the excitation is weighed on, and on all of which it keeps the limits; of rivals half as many pairs.
        rng: Source of the draws.

    Raises:
        DocumentError: An entry is not known, missing, of the wrong kind or out of range.
        UnknownNameError: The rig has no such actuator, channel, parameter or joint, or the bench no such law.
        ParameterError: The rig has nothing that is uncertain, or the test has too many steps.
    """
    asked = table if isinstance(table, ExperimentEntry) else checked(ExperimentEntry, table)
    if not asked.duration <= BASE_SETTINGS.max_samples * rig.timestep:
        raise ParameterError(
            f"{asked.duration:g} s are more than {BASE_SETTINGS.max_samples} steps of rig '{rig.name}'; "
            "shorten the test or lengthen the timestep"
        )
    limits = Limits(asked.force, asked.energy, asked.stroke, asked.velocity)
    for name in limits.actuators:
        if name not in rig.actuators:
            raise UnknownNameError(f"actuator of rig '{rig.name}'", name, rig.actuators)
    measured = tuple(channel.name for channel in rig.channels if channel.role == "measured")
    for name in (*asked.noise, *limits.watched):
        if name not in measured:
            raise UnknownNameError(f"measured channel of rig '{rig.name}'", name, measured)
    described = RigHypothesis(rig.name, rig, _uncertain(rig, asked.uncertain))
    if asked.rival is not None:
        rivals = Rivals(rig.name, described, _rival(rig, asked.rival, asked.uncertain))
        experiment = paired_experiment(
            rivals,
            asked.noise,
            limits,
            pairs=max(1, draws // 2),
            duration=SETTINGS.reference_share * asked.duration,
            band=asked.band,
            rng=rng,
        )
    else:
        prior = RigPrior((described,))
        experiment = Experiment(prior, asked.noise, limits, prior.draws(draws, rng))
    background = tuple(BackgroundTerm(**term.model_dump()) for term in asked.background)
    if background:  # a law, parameter or joint that there is not is told here
        _ = with_background(described, background).rig.built
    return Request(rig, experiment, asked.duration, asked.band, background)


def _rival(rig: Rig, entry: RivalEntry, ranges: Mapping[str, tuple[float, float]]) -> RigHypothesis:
    """The rig with other elements, and its own ranges beside those of the structure."""
    other = rig.with_(elements=tuple(item.element() for item in entry.elements))
    shared = {name: bounds for name, bounds in ranges.items() if "." not in name}
    structure = _uncertain(other, shared) if shared else ()
    return RigHypothesis("rival", other, (*structure, *_uncertain(other, entry.uncertain)))


def _uncertain(rig: Rig, ranges: Mapping[str, tuple[float, float]]) -> tuple[Uncertain, ...]:
    if ranges:
        return tuple(
            Uncertain(name, low, high, "logarithmic" if low > 0.0 else "linear")
            for name, (low, high) in ranges.items()
        )
    found = []
    for element in rig.elements:
        for parameter in element.law.parameters:
            value = element.parameters[parameter.name]
            low, high = sorted((value / SETTINGS.factor, value * SETTINGS.factor))
            low, high = max(low, parameter.bounds[0]), min(high, parameter.bounds[1])
            if value != 0.0 and low < high:
                scale = "logarithmic" if low > 0.0 else "linear"
                found.append(Uncertain(f"{element.name}.{parameter.name}", low, high, scale))
    if not found:
        raise ParameterError(
            "nothing is uncertain: the rig has no element with parameters; name ranges in [experiment.uncertain], "
            'as "stiffness:carriage" = [200.0, 400.0]'
        )
    return tuple(found)
