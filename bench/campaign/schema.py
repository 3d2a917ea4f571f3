"""Document of a campaign: the plan."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, Strict, WrapValidator, model_validator

from bench.campaign.alternatives import ElementPlan, ExcitationPlan, RigPlan, SensorPlan
from bench.campaign.distribution import Distribution
from bench.campaign.nest import Nested
from bench.campaign.plan import Compression, Plan, Precision, Sampling
from bench.campaign.quantities import AnyQuantity, NumberQuantity, is_quantity_table, read_quantity, spread
from bench.documents import (
    AS_NUMBER,
    AS_WHOLE,
    Count,
    Document,
    Entry,
    Flag,
    Label,
    Listed,
    Name,
    NotNegative,
    Positive,
    Table,
    Text,
    refuse,
    telling,
)
from bench.errors import FileFormatError, shortened, unknown_name
from bench.laws.schema import PlacedLaw
from bench.measurement import Stage
from bench.mjcf import IntegratorName, StructureName
from bench.signals import Signal
from bench.signals.schema import varied_type


def _nest(node: Any) -> Nested:
    """A signal's or stage's table with its distributions read."""
    if is_quantity_table(node):
        return read_quantity(node, "")
    if isinstance(node, Mapping):
        return {key: _nest(value) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [_nest(value) for value in node]
    return node


def _nested(entry: Any, handler: Any) -> Nested:
    handler(
        entry
    )  # says whether the table is valid; the plan keeps the numbers in the order in which they came
    return _nest(entry)


def _distribution(quantity: Any) -> Any:
    if not isinstance(quantity, Distribution):
        refuse(f"{shortened(quantity)} came; a distribution is expected")
    return quantity


SignalNode = Annotated[varied_type(Signal, spread), WrapValidator(_nested)]
StageNode = Annotated[varied_type(Stage, spread), WrapValidator(_nested)]
if TYPE_CHECKING:
    SharedQuantity = Distribution
else:
    SharedQuantity = Annotated[AnyQuantity, AfterValidator(_distribution)]
Weight = NotNegative


class ElementPlanEntry(PlacedLaw):
    """An element of a rig, its parameters drawn."""

    entry_name = "an element of a plan"
    parameters: Table[NumberQuantity] = Field(default_factory=dict)
    """Number or distribution by parameter; the others at the law's defaults."""
    withheld: Flag = False
    """Left out of the public part of the manifest; its parameters stand in the answers."""
    probability: Annotated[float, Strict(), Field(gt=0.0, le=1.0), AS_NUMBER] = 1.0
    """Share of the rig's records that have the element."""

    @model_validator(mode="after")
    def _fits_its_law(self) -> ElementPlanEntry:
        with telling():
            law = self.found
        for key in self.parameters:
            if key not in law.parameter_names:
                refuse(
                    unknown_name(f"parameter of law '{law.name}'", key, law.parameter_names),
                    "parameters",
                    unknown=True,
                )
        return self

    def plan(self) -> ElementPlan:
        """The element of the plan, all parameters written out: a reader of the records can then rebuild it."""
        law = self.found
        parameters = {p.name: self.parameters.get(p.name, p.default) for p in law.parameters}
        return ElementPlan(
            self.law,
            self.joints,
            self.label,
            parameters,
            header=self.header,
            inputs=self.inputs,
            exact=self.exact,
            withheld=self.withheld,
            probability=self.probability,
        )


class RigPlanEntry(Entry):
    """A rig to choose from."""

    entry_name = "a rig of a plan"
    rig: Name
    """A rig of the bench, or the path of an MJCF file."""
    name: Label = ""
    """Name in the tables."""
    weight: Weight = 1.0
    """Share of the records."""
    timestep: Positive | None = None
    """Integration step [s]; the rig's own by default."""
    integrator: IntegratorName | None = None
    """Integrator; the rig's own by default."""
    structure: dict[StructureName, Table[NumberQuantity]] = Field(default_factory=dict)
    """Masses, stiffnesses, … by kind and body or joint."""
    structure_withheld: Flag = False
    """The structure's numbers stand in the answers only."""
    elements: Listed[ElementPlanEntry] = ()
    """Its elements."""
    model_sha256: Text = ""
    """Hash of the MJCF file; the campaign notes it."""

    def plan(self, folder: Path) -> RigPlan:
        """The rig of the plan.

        Raises:
            FileFormatError: The MJCF file cannot be read.
        """
        digest = self.model_sha256
        if self.rig.endswith(".xml"):
            try:
                digest = hashlib.sha256((folder / self.rig).read_bytes()).hexdigest()
            except OSError as error:
                raise FileFormatError(
                    f"cannot read the model {folder / self.rig}: {error.strerror}"
                ) from error
        return RigPlan(
            name=self.name or Path(self.rig).stem,
            rig=self.rig,
            elements=tuple(element.plan() for element in self.elements),
            structure=tuple(
                (kind, target, quantity)
                for kind, named in self.structure.items()
                for target, quantity in named.items()
            ),
            structure_withheld=self.structure_withheld,
            weight=self.weight,
            timestep=self.timestep,
            integrator=self.integrator,
            folder=str(folder.resolve()),
            model_sha256=digest,
        )


class ExcitationPlanEntry(Entry):
    """An excitation to choose from."""

    entry_name = "an excitation of a plan"
    name: Label = ""
    """Name in the tables."""
    weight: Weight = 1.0
    """Share of the records of the rigs it fits."""
    rigs: Listed[Name] = ()
    """Rigs it fits; all without."""
    prescribe: Label = ""
    """Joint that follows the one signal, which is its displacement."""
    signals: Annotated[Table[SignalNode], Field(min_length=1)]
    """Signal by actuator, with distributions."""


class SensorPlanEntry(Entry):
    """A set of sensors to choose from."""

    entry_name = "a set of sensors of a plan"
    name: Label = ""
    """Name in the tables."""
    weight: Weight = 1.0
    """Share of the records of the rigs it fits."""
    rigs: Listed[Name] = ()
    """Rigs it fits; all without."""
    withheld: Flag = False
    """The stages stand in the answers only."""
    chains: Table[Listed[StageNode]] = Field(default_factory=dict)
    """Stages by channel, with distributions."""

    @model_validator(mode="after")
    def _stages_come_once(self) -> SensorPlanEntry:
        for channel, stages in self.chains.items():
            types = [stage["type"] for stage in stages]
            if len(set(types)) < len(types):
                refuse(f"a stage comes twice in {', '.join(types)}; each may come once", "chains", channel)
        return self


class PlanDocument(Document):
    """A campaign: rigs, excitations and sensors to choose from, with distributions over their numbers."""

    entry_name = "a plan"
    name: Label = ""
    """Name."""
    records: Annotated[int, Strict(), Field(ge=1), AS_WHOLE]
    """Number of records."""
    duration: Positive
    """Length of a record [s]."""
    sample_rate: Positive
    """Rate of the records [Hz]; must divide the rigs' step rates."""
    drive_rate: Positive | None = None
    """Rate of the excitation [Hz], held between its samples; the sample rate by default."""
    seed: Count = 0
    """Entropy of all draws."""
    sampling: Sampling = "random"
    """How the records cover the distributions."""
    precision: Precision = "float32"
    """Type of the channels in the data set."""
    compression: Compression = "zstd"
    """Compression of the data set."""
    records_per_part: Count = 0
    """Records of one file; chosen by their size where 0."""
    channels: Listed[Name] = ()
    """Channels kept; all commands driven and all sensors where there are none."""
    shared: Table[SharedQuantity] = Field(default_factory=dict)
    """Quantities that others refer to."""
    rigs: Listed[RigPlanEntry] = Field(min_length=1)
    """Rigs to choose from."""
    excitations: Listed[ExcitationPlanEntry] = Field(min_length=1)
    """Excitations to choose from."""
    sensors: Listed[SensorPlanEntry] = ()
    """Sets of sensors to choose from; true values without."""

    def plan(self, folder: str | Path = ".") -> Plan:
        """The plan.

        Args:
            folder: Folder that MJCF paths are relative to.

        Raises:
            FileFormatError: An MJCF file cannot be read.
            BenchError: Its parts do not fit one another.
        """
        excitations = tuple(
            ExcitationPlan(e.name or f"excitation_{i}", e.signals, e.weight, e.rigs, e.prescribe)
            for i, e in enumerate(self.excitations)
        )
        sensors = tuple(
            SensorPlan(s.name or f"sensors_{i}", _by_type(s.chains), s.weight, s.rigs, s.withheld)
            for i, s in enumerate(self.sensors)
        )
        return Plan(
            name=self.name or "campaign",
            records=self.records,
            duration=self.duration,
            sample_rate=self.sample_rate,
            drive_rate=self.drive_rate,
            seed=self.seed,
            sampling=self.sampling,
            precision=self.precision,
            compression=self.compression,
            records_per_part=self.records_per_part,
            channels=self.channels,
            shared=self.shared,
            rigs=tuple(rig.plan(Path(folder)) for rig in self.rigs),
            excitations=excitations,
            sensors=sensors,
        )


def _by_type(chains: Mapping[str, tuple[Any, ...]]) -> dict[str, dict[str, Nested]]:
    return {
        channel: {
            stage["type"]: {key: value for key, value in stage.items() if key != "type"} for stage in stages
        }
        for channel, stages in chains.items()
    }
