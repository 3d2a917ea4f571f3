"""Documents of excitation design: what a test is asked for, and what a policy says of itself."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, Strict, model_validator

from bench.documents import (
    AS_WHOLE,
    Entry,
    Flag,
    Limit,
    Listed,
    Name,
    NumberPair,
    Positive,
    Table,
    refuse,
)
from bench.rig.schema import ElementDocument, RigDocument

Ranges = Table[NumberPair]
Size = Annotated[int, Strict(), Field(ge=1, le=1_000_000), AS_WHOLE]


class LimitsEntry(Entry):
    """What a test may not exceed."""

    entry_name = "limits"
    force: Annotated[Table[Limit], Field(min_length=1)]
    """Largest command, by actuator [N or N m]."""
    energy: Table[Limit] = Field(default_factory=dict)
    """Largest dt sum(u^2) of the command, by actuator [N^2 s or (N m)^2 s]."""
    stroke: Table[Limit] = Field(default_factory=dict)
    """Largest displacement, by measured channel [m or rad]."""
    velocity: Table[Limit] = Field(default_factory=dict)
    """Largest velocity, by measured channel [m/s or rad/s]."""


def _check_band(band: tuple[float, float]) -> None:
    if not 0.0 < band[0] < band[1]:
        refuse(f"{list(band)} came; 0 < lowest < highest frequency [Hz] is expected", "band")


def _check_ranges(ranges: dict[str, tuple[float, float]]) -> None:
    for name, (low, high) in ranges.items():
        if not low < high:
            refuse(f"[{low:g}, {high:g}] came; [lowest, highest] is expected", "uncertain", name)


class RivalEntry(Entry):
    """Another explanation of the joint; the question is then which of the two holds."""

    entry_name = "a rival"
    elements: Listed[ElementDocument] = Field(min_length=1)
    """The elements in the place of the file's."""
    uncertain: Ranges = Field(default_factory=dict)
    """Ranges of their parameters; those of the structure are shared."""

    @model_validator(mode="after")
    def _ranges_ascend(self) -> RivalEntry:
        _check_ranges(self.uncertain)
        return self


class BackgroundEntry(Entry):
    """A small force that may act besides what is asked for."""

    entry_name = "a term of the background"
    law: Name
    """Name of a law that is linear in its parameter."""
    joint: Name
    """Joint on which it acts."""
    parameter: Name
    """The parameter."""
    deviation: Positive
    """Its standard deviation about zero, in the parameter's unit."""


class ExperimentEntry(LimitsEntry):
    """What a test is to find out, may do and measures."""

    entry_name = "an experiment"
    duration: Positive
    """Duration [s]."""
    band: NumberPair
    """Lowest and highest frequency [Hz]."""
    noise: Annotated[Table[Positive], Field(min_length=1)]
    """Standard deviation of the noise, by measured channel."""
    uncertain: Ranges = Field(default_factory=dict)
    """Ranges of what is unknown, as "gap.clearance" or "stiffness:carriage"; all of the elements' parameters by default."""
    rival: RivalEntry | None = None
    """Another explanation of the joint."""
    background: Listed[BackgroundEntry] = ()
    """Small forces that no hypothesis holds; a planner designs for what identification leaves where they act."""

    @model_validator(mode="after")
    def _numbers_ascend(self) -> ExperimentEntry:
        _check_band(self.band)
        _check_ranges(self.uncertain)
        if self.background and self.rival is not None:
            refuse(
                "it came with a rival; a background where parameters are asked for, or a rival without one, is expected",
                "background",
            )
        return self


class ExcitationRequest(RigDocument):
    """A rig, and the experiment that an excitation is designed for."""

    experiment: ExperimentEntry | None = None  # pyrefly: ignore[bad-override]
    """What the test is to find out, may do and measures."""


class StationEntry(Entry):
    """What a policy was trained for."""

    entry_name = "a station"
    noise: Annotated[Table[Positive], Field(min_length=1)]
    """Standard deviation of the noise, by measured channel."""
    scale: Annotated[Table[Positive], Field(min_length=1)]
    """What 1 stands for in observations, by channel."""
    limits: LimitsEntry
    """Limits."""
    timestep: Positive
    """Interval of commands and measurements [s]."""
    n_steps: Size
    """Steps a window."""
    n_windows: Size
    """Windows of a whole test."""
    band: NumberPair
    """Frequencies excited [Hz]."""
    shaping: Literal["knots", "amplitude_frequency"] = "knots"
    """How actions become commands."""
    n_knots: Size = 1
    """Knots a window."""
    questions: Listed[Name] = ()
    """Questions that may be asked; none where there is one only."""

    @model_validator(mode="after")
    def _numbers_ascend(self) -> StationEntry:
        _check_band(self.band)
        return self


class PolicyHeader(Entry):
    """What the archive of a trained policy says of it."""

    entry_name = "the header of a policy"
    format: Literal[1]
    """Version of the layout."""
    name: Name
    """Name."""
    station: StationEntry
    """What it was trained for."""
    bounded: Flag
    """Whether a last hyperbolic tangent bounds the actions."""
    about: dict[str, Any]
    """Where it comes from."""


class PlanPolicyHeader(Entry):
    """What the archive of a policy of plans says of it."""

    entry_name = "the header of a policy of plans"
    format: Literal[1]
    """Version of the layout."""
    name: Name
    """Name."""
    station: StationEntry
    """What it was trained for."""
    windows: Listed[Size]
    """Windows run before each decision."""
    layers: Listed[Size]
    """Layers of the network of each decision."""
    about: dict[str, Any]
    """Where it comes from."""
