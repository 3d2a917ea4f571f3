"""What describes a case: its system, its test, what is stated of it, and what is right."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from second_laboratory_cases.excitations import Excitation
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import Setup, System

Changes = Mapping[str, float]
"""Values of some `Properties`, by name."""
SCALED = {"hidden_mass", "stroke_friction", "swing_stiffness", "relaxing_stiffness"}
"""Properties by which a background is scaled."""
NO_NAME = "unknown; a declared set that holds it; no certain name"
"""Which other verdicts are honest, of most cases."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of the nominal model.

    Attributes:
        relative: Stated standard deviation, as a fraction of the true value.
        unit: Its unit.
        of: The property of the system that it is; empty where it is none.
        value: Its true value; that of the property where None.
        beside: What the property holds besides the parameter.
        fitted: Whether a fit of the nominal model may change it.
    """

    relative: float
    unit: str
    of: str = ""
    value: float | None = None
    beside: float = 0.0
    fitted: bool = True

    def true_value(self, truth: Properties) -> float:
        """Its true value in a system of those properties."""
        return getattr(truth, self.of) if self.value is None else self.value


class Record(NamedTuple):
    """A record of a case.

    Attributes:
        stem: Name of its file without the extension; of validation where it starts with that.
        seconds: Its duration.
        excitation: What excites it.
        peak: Largest motion [m] or, where the set-up does not scale, largest excitation.
        start: Displacement [m] from which the system is released at rest.
        phase: Phase [rad] of a harmonic force that nobody measures.
    """

    stem: str
    seconds: int
    excitation: Excitation
    peak: float
    start: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True)
class Channel:
    """A column of the records.

    Attributes:
        signal: Signal of the set-up that it holds.
        unit: Its unit.
        noise: Standard deviation of its noise, as a fraction of that of the signal.
        told: What else `nominal.json` says of it.
        scale: Value in its unit over that in SI units.
    """

    signal: str
    unit: str
    noise: float
    told: Mapping[str, str] = field(default_factory=dict)
    scale: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of the second laboratory.

    Attributes:
        number: Of its stream of random numbers; cases are written in its order.
        name: Of its folder.
        rig: Rig of the bench, or the file of its own MJCF.
        setup: How it is driven and measured.
        rate: Sample rate [Hz].
        truth: True properties of what the nominal model holds.
        effect: What the nominal model misses; empty where nothing of size is missing.
        delay_samples, displacement_gain: Missing as well, see `System`.
        background: Small physics besides.
        background_share: Its wanted size over that of what is missing or, where nothing is, over that of the response.
        parameters: Of the nominal model, by name.
        records: Of identification, then of validation.
        channels: By name.
        understated: True noise over the stated one; None where nothing is stated.
        told: What else `nominal.json` says.
        model: Writes the MJCF from the values of the parameters; None for a rig of the bench.
        compressed: Whether the records are compressed.
        first_load: Amplitude of the load [N, m/s^2] from which its size is sought; that of a static deflection where None.
        right: Groups of names, any one of which is right; empty where no catalogue holds what is missing.
        also: Names that are there in small size and may stand beside.
        limit: Largest error of a corrected model that is accepted, as a fraction of the response; "derived" from sizes of effects.
        honest: Which other verdicts are honest, in words.
        why: What is there.
    """

    number: int
    name: str
    rig: str
    setup: Setup
    rate: int
    truth: Properties
    effect: Changes = field(default_factory=dict)
    delay_samples: int = 0
    displacement_gain: float = 1.0
    background: Changes
    background_share: float = 0.03
    parameters: Mapping[str, Parameter]
    records: Sequence[Record]
    channels: Mapping[str, Channel]
    understated: float | None = 1.0
    told: Mapping[str, Any] = field(default_factory=dict)
    model: Callable[[Mapping[str, float]], str] | None = None
    compressed: bool = False
    first_load: float | None = None
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    limit: float | Literal["derived"] | None = "derived"
    honest: str = NO_NAME
    why: str

    def nominal(self) -> System:
        """The system as the nominal model has it, with true values."""
        return System(self.truth)

    def complete(self, background: float = 0.0) -> System:
        """The system with what is missing, and with its background times a factor."""
        small = {
            key: background * value if key in SCALED else value for key, value in self.background.items()
        }
        properties = self.truth._replace(**self.effect, **small if background else {})
        return System(properties, self.delay_samples, self.displacement_gain)

    def misses_something(self) -> bool:
        """Whether something of size is missing."""
        return bool(self.effect) or self.delay_samples > 0


class Units(NamedTuple):
    """Units of the properties of an oscillator."""

    inertia: str
    """What its inertia is called."""
    mass: str
    stiffness: str
    damping: str


TRANSLATION = Units("mass", "kg", "N/m", "N s/m")
ROTATION = Units("inertia", "kg m^2", "N m/rad", "N m s/rad")


def oscillator(
    mass: float = 0.01,
    stiffness: float = 0.03,
    damping: float = 0.15,
    *,
    body: str = "",
    joint: str = "",
    units: Units = TRANSLATION,
) -> dict[str, Parameter]:
    """Parameters of an oscillator, by their stated standard deviations as fractions of the true values.

    Args:
        mass: Of its mass or its inertia.
        stiffness: Of its stiffness.
        damping: Of its damping.
        body: Its body in an MJCF; none where empty.
        joint: Its joint there.
        units: Their units.
    """
    end = f":{joint}" if joint else ""
    return {
        f"{units.inertia}:{body}" if body else units.inertia: Parameter(mass, units.mass, "mass"),
        f"stiffness{end}": Parameter(stiffness, units.stiffness, "stiffness"),
        f"damping{end}": Parameter(damping, units.damping, "damping"),
    }


def component(**relative: float) -> dict[str, Parameter]:
    """Parameters of a component, by their stated standard deviations as fractions of the true values."""
    units = {"stiffness": "N/m", "damping": "N s/m", "coulomb": "N"}
    return {key: Parameter(share, units[key], key) for key, share in relative.items()}


def position_of(joint: str, **more: str) -> dict[str, str]:
    """What is told of a channel that holds the position of a joint."""
    return {"joint": joint, "quantity": "position", **more}


def load_on(actuator: str) -> dict[str, str]:
    """What is told of a channel that holds the measured load of an actuator."""
    return {"role": "measured", "actuator": actuator}
