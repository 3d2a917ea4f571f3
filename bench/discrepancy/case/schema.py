"""The document ``nominal.json``: what the nominal model claims, how sure it is, and what the records hold.

The models say which entries there are, and what each may be; `check_units` says whether the units of a case fit their quantities and
one another, with the remedy, before one that does not can become a diagnosis that makes no sense.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from bench.discrepancy.case.acquisition import Antialias, Interpolation
from bench.discrepancy.case.parameters import ParameterEntry, Unit, check_types
from bench.discrepancy.case.single_axis import LOADS as LOAD_NAMES
from bench.discrepancy.case.single_axis import MOTIONS
from bench.documents import (
    Document,
    Entry,
    Flag,
    Listed,
    Name,
    NotNegative,
    Number,
    Positive,
    Table,
    refuse,
    telling,
)
from bench.documents.derived import entry_of
from bench.errors import UnitError, unknown_name
from bench.recording.units import conversion

if TYPE_CHECKING:
    from bench.discrepancy.case.case import Case

_MOUNTS = tuple(
    f"mount_{kind}_{axis}_{body}"
    for axis in ("axial", "torsional")
    for kind in ("stiffness", "damping")
    for body in (1, 2)
)
PARAMETERS: dict[str, tuple[str, ...]] = {
    "sdof": ("mass", "stiffness", "damping", "coulomb", "slip_stiffness", "force_offset"),
    "damper": ("stiffness", "damping", "coulomb", "slip_stiffness", "force_offset"),
    "joint": (
        "mass_1", "mass_2", "inertia_1", "inertia_2", *_MOUNTS,
        "joint_stiffness_axial", "joint_damping_axial", "joint_stiffness_torsional", "joint_damping_torsional",
    ),
}  # fmt: skip
"""Nominal parameters of the bench's rigs. An MJCF of the user's own says itself which it has (`mjcf_structure`)."""
RIGS = tuple(PARAMETERS)
"""The bench's rigs that a nominal model may be."""
RESPONSES: dict[str, tuple[str, ...]] = {
    "sdof": tuple(name for names in MOTIONS for name in names),
    "damper": (*LOAD_NAMES, *(name for names in MOTIONS for name in names)),
    "joint": tuple(
        f"{quantity}_{body}"
        for quantity in ("displacement", "velocity", "acceleration", "rotation", "angular_velocity", "angular_acceleration")
        for body in (1, 2)
    ),
}  # fmt: skip
"""Responses of the bench's rigs."""
MEASURED = ("force", "torque")
"""Channels of the bench's rigs that are measured loads unless they say otherwise."""

Role = Literal["measured", "command", "prescribed", "response", "scheduling"]
"""A measured load, a commanded load, a prescribed motion, a response, and what laws may depend on besides."""


def _known_rig(name: Any) -> Any:
    if isinstance(name, str) and name not in PARAMETERS and not name.endswith(".xml"):
        refuse(unknown_name("rig (or path ending in .xml)", name, PARAMETERS), unknown=True)
    return name


CaseRigName = Annotated[
    Name,
    BeforeValidator(_known_rig),
    Field(json_schema_extra={"anyOf": [{"enum": list(PARAMETERS)}, {"pattern": r"\.xml$"}]}),
]


AntialiasEntry = entry_of(Antialias, lambda hint: None, kind="an antialias filter", name="AntialiasEntry")


class ChannelEntry(Entry):
    """A channel of the records."""

    entry_name = "a channel"
    entry_misnomers = {"noise": "noise_std", "std": "noise_std", "sigma": "noise_std"}  # noqa: RUF012

    unit: Unit = ""
    """Unit."""
    role: Role | None = None
    """What it is; by default the loads of a rig are measured, and everything else is a response."""
    noise_std: NotNegative | None = None
    """One-sigma noise of the channel at rest; left out where it is not known."""
    antialias: AntialiasEntry | None = None
    """Filter that a response passed before it was sampled."""
    sensor: Name | None = None
    """Sensor of your own MJCF that it stands for."""
    joint: Name | None = None
    """Joint of your own MJCF that it stands for; give the quantity too."""
    actuator: Name | None = None
    """Actuator of your own MJCF that it stands for."""
    quantity: Literal["position", "velocity", "acceleration"] | None = None
    """What of a joint."""
    side: Literal["motor", "link"] | None = None
    """Where the encoder of a geared joint sits; both are tried where it is not said."""
    resolution: NotNegative = 0.0
    """Step of an encoder."""

    @model_validator(mode="after")
    def _refers_to_one_thing(self) -> ChannelEntry:
        targets = [
            f"{kind} '{getattr(self, kind)}'"
            for kind in ("sensor", "joint", "actuator")
            if getattr(self, kind)
        ]
        if len(targets) > 1:
            refuse(f"a channel refers to {' and '.join(targets)}; one of them is expected")
        if self.joint and self.quantity is None:
            refuse(
                f"a channel of joint '{self.joint}' needs its quantity: position, velocity or acceleration"
            )
        if self.antialias is not None:
            with telling("antialias"):
                self.filter()
        return self

    @property
    def target(self) -> str:
        """Entry of the MJCF that it stands for, as "sensor:NAME"; empty where it says none."""
        for kind in ("sensor", "joint", "actuator"):
            if getattr(self, kind):
                return f"{kind}:{getattr(self, kind)}"
        return ""

    def filter(self) -> Antialias | None:
        """The filter that it passed; None where there was none."""
        return None if self.antialias is None else Antialias(**self.antialias.given)


class NominalDocument(Document):
    """The nominal model of a case, and its channels."""

    entry_name = "a nominal model"
    rig: CaseRigName
    """A rig of the bench (sdof, damper, joint), or the path of an MJCF file in the same folder."""
    parameters: Table[ParameterEntry]
    """Nominal parameters by name; of an MJCF as "stiffness:JOINT", "mass:BODY", …"""
    channels: Table[ChannelEntry]
    """Channels by the heading of their column."""
    sample_rate_hz: Positive | None = None
    """Sample rate of records without a column for the time [Hz]."""
    load_interpolation: Interpolation | None = None
    """How the loads ran between their samples; found out where nothing is said."""
    starts_in_motion: Flag | Listed[Name] | None = None
    """Records that do not start at rest, or whether all do not; found out where nothing is said."""
    periodic: Listed[Name] = ()
    """Records that are whole periods of a steady state."""
    places: Annotated[Listed[Name], Field(min_length=1)] | None = None
    """Joints and fixed tendons of an MJCF where effects may sit; all that move by default."""
    elements: Listed[dict[str, Any]] = ()
    """Laws of the bench that the model holds besides, see `case.elements`."""
    limits: Table[Positive] = Field(default_factory=dict)
    """Largest magnitude of a channel that the next test may reach; those of the records by default."""
    joints: Table[Literal["hold", "follow"] | Number] = Field(default_factory=dict)
    """Joints of an MJCF that were held: "hold" where its own zero was, or the coordinate at which they were. One that is measured and
    has no drive that was recorded: "follow", and it moves as it was measured."""
    window_s: Positive | None = None
    """Length of the windows that records of a rig that nothing holds are cut into [s]."""

    @model_validator(mode="after")
    def _names_are_known(self) -> NominalDocument:
        if not [name for name in self.channels if name != "time"]:
            refuse("no channel besides time; name the loads and the responses", "channels")
        for name, channel in self.channels.items():
            role = self.role_of(name)
            if channel.antialias is not None and role != "response":
                refuse(
                    f"an antialias filter of a channel whose role is {role}; a filter that loads and responses passed alike cancels "
                    "and need not be stated, and one that only a load passed cannot be undone: state it on responses only",
                    "channels", name, "antialias",
                )  # fmt: skip
        for name in self.limits:
            if name not in self.channels:
                refuse(unknown_name("channel", name, self.channels), "limits", unknown=True)
        check_types(self.parameters, own=self.rig not in PARAMETERS)
        if self.rig in PARAMETERS:
            self._fit_the_rig(PARAMETERS[self.rig], RESPONSES[self.rig])
        return self

    def _fit_the_rig(self, parameters: tuple[str, ...], responses: tuple[str, ...]) -> None:
        """Refuse what a rig of the bench does not have, and numbers that none of its parameters can have."""
        for name, entry in self.parameters.items():
            if name not in parameters:
                refuse(
                    unknown_name(f"parameter of rig '{self.rig}'", name, parameters),
                    "parameters",
                    unknown=True,
                )
            inertial = name.startswith(("mass", "inertia"))
            signed = name == "force_offset"
            if (entry.value < 0.0 and not signed) or (inertial and entry.value == 0.0):
                expected = "a positive number" if inertial else "zero or more"
                refuse(
                    f"{entry.value:g} came; {expected} is expected: check its sign",
                    "parameters",
                    name,
                    "value",
                )
        for name in self.channels:
            if self.role_of(name) == "response" and name not in {*responses, "time"}:
                refuse(
                    unknown_name(f"response of rig '{self.rig}'", name, responses), "channels", unknown=True
                )

    def role_of(self, name: str) -> Role:
        """Role of a channel."""
        return self.channels[name].role or ("measured" if name in MEASURED else "response")

    @property
    def options(self) -> dict[str, Any]:
        """What is stated besides rig, parameters and channels."""
        apart = {"rig", "parameters", "channels", "schema_"}
        return {name: value for name, value in self.given.items() if name not in apart and value is not None}


MOTION = {
    "displacement": ("axial", "m"), "velocity": ("axial", "m/s"), "acceleration": ("axial", "m/s^2"),
    "rotation": ("torsional", "rad"), "angle": ("torsional", "rad"), "angular_velocity": ("torsional", "rad/s"),
    "angular_acceleration": ("torsional", "rad/s^2"),
}  # fmt: skip
LOADS = {"force": ("axial", "N"), "torque": ("torsional", "N m")}
CONSTANTS = {
    ("mass", "axial"): ("kg",), ("inertia", "torsional"): ("kg m^2", "kg m^2/rad^2", "kg m^2/rad"),
    ("stiffness", "axial"): ("N/m",), ("stiffness", "torsional"): ("N m/rad", "N m"),
    ("damping", "axial"): ("N s/m",), ("damping", "torsional"): ("N m s/rad", "N m s"),
}  # fmt: skip
"""Kind of a nominal parameter and its axis, to the SI units it may have."""


@dataclass(frozen=True)
class SchemaSettings:
    """Numbers of `bench.discrepancy.case.schema`."""

    mismatch: float = 1e-3
    """Relative difference of two conversion factors beyond which units do not belong together."""


SETTINGS = SchemaSettings()


def check_units(case: Case) -> None:
    """Check that the units of a case fit their quantities, and one another.

    A model in N, mm and s has its stiffness in N/mm and its mass in tonnes. With position and load in given units, all
    constants of an axis have one and the same factor to SI, and so have position, velocity and acceleration.

    Args:
        case: The case. Rigs of the user's own are not checked: only they know what their parameters are.

    Raises:
        UnitError: A unit does not fit its quantity, or two do not belong together.
    """
    if case.rig not in PARAMETERS:
        return
    motion: dict[str, tuple[str, str, float]] = {}
    loads: dict[str, tuple[str, str, float]] = {}
    for channel in case.channels:
        base = channel.name.rstrip("0123456789").rstrip("_")
        for table, seen in ((MOTION, motion), (LOADS, loads)):
            if base not in table or not channel.unit:
                continue
            axis, expected = table[base]
            factor = _factor(f"channel '{channel.name}'", channel.unit, (expected,))
            first = seen.setdefault(axis, (channel.name, channel.unit, factor))
            if abs(factor / first[2] - 1.0) > SETTINGS.mismatch:
                raise UnitError(
                    f"'{channel.name}' is in {channel.unit} and '{first[0]}' in {first[1]}, which do not belong together "
                    f"(a factor of {factor / first[2]:.6g}); convert one of the columns"
                )
    for parameter in case.parameters:
        if not parameter.unit:
            continue
        rotary = "torsional" in parameter.name or "inertia" in parameter.name or "axial" not in motion | loads
        axis = "torsional" if rotary and "torsional" in motion | loads else "axial"
        kind = next((k for k, a in CONSTANTS if a == axis and k in parameter.name), None)
        if kind is None:
            continue
        factor = _factor(f"parameter '{parameter.name}'", parameter.unit, CONSTANTS[kind, axis])
        if axis not in motion or axis not in loads:
            continue
        wanted = loads[axis][2] / motion[axis][2]
        if abs(factor / wanted - 1.0) > SETTINGS.mismatch:
            raise UnitError(
                f"'{parameter.name}' is in {parameter.unit}, but '{loads[axis][0]}' in {loads[axis][1]} and "
                f"'{motion[axis][0]}' in {motion[axis][1]} ask for {wanted:.6g} times {CONSTANTS[kind, axis][0]}: "
                f"multiply its value and std by {factor / wanted:.6g}, or convert the columns"
            )


def _factor(what: str, unit: str, expected: tuple[str, ...]) -> float:
    """Factor of a unit to the first of the SI units that it fits."""
    for si in expected:
        with contextlib.suppress(UnitError):
            return conversion(unit, si)[0]
    raise UnitError(f"{what} is in {unit}; a unit such as {expected[0]} is expected")
