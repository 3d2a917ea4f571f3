"""What a record draws from: elements, rigs, excitations and sensors, with distributions over their numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bench.campaign.distribution import Quantity
from bench.campaign.nest import Nested, as_entry, leaves
from bench.errors import ParameterError


@dataclass(frozen=True)
class ElementPlan:
    """An element of a rig, its parameters drawn.

    Attributes:
        law: Name of the law.
        joints: Joints or fixed tendons it acts on.
        name: Name of the element.
        parameters: Quantity by parameter; the others at the law's defaults.
        header: Leading entries of theta that fix sizes.
        inputs: Actuators that the law reads.
        exact: As `bench.rig.Element.exact`.
        withheld: Left out of the public part of the manifest; its parameters stand in the answers.
        probability: Share of the rig's records that have the element.
    """

    law: str
    joints: tuple[str, ...]
    name: str
    parameters: Mapping[str, Quantity]
    header: tuple[float, ...] = ()
    inputs: tuple[str, ...] = ()
    exact: bool = False
    withheld: bool = False
    probability: float = 1.0

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        entry: dict[str, Any] = {"law": self.law, "joints": list(self.joints), "name": self.name}
        entry["parameters"] = {key: as_entry(value) for key, value in self.parameters.items()}
        optional = {
            "header": list(self.header),
            "inputs": list(self.inputs),
            "exact": self.exact,
            "withheld": self.withheld,
        }
        entry |= {key: value for key, value in optional.items() if value}
        return entry | ({"probability": self.probability} if self.probability < 1.0 else {})


@dataclass(frozen=True)
class RigPlan:
    """A rig to choose from.

    Attributes:
        name: Name in the tables.
        rig: Rig of the bench, or path of an MJCF file.
        elements: Its elements.
        structure: (kind, body or joint, quantity), as `bench.rig.Rig.with_structure`.
        structure_withheld: The structure's numbers stand in the answers only.
        weight: Share of the records.
        timestep: Integration step [s]; the rig's own where None.
        integrator: The rig's own where None.
        folder: Folder that an MJCF path is relative to.
        model_sha256: Hash of the MJCF file, so that a campaign is not resumed on another model.
    """

    name: str
    rig: str
    elements: tuple[ElementPlan, ...] = ()
    structure: tuple[tuple[str, str, Quantity], ...] = ()
    structure_withheld: bool = False
    weight: float = 1.0
    timestep: float | None = None
    integrator: str | None = None
    folder: str = "."
    model_sha256: str = ""

    def __post_init__(self) -> None:
        unique(f"elements of rig '{self.name}'", [element.name for element in self.elements])

    @property
    def withheld(self) -> bool:
        """Whether something of the rig is withheld."""
        return self.structure_withheld or any(element.withheld for element in self.elements)

    def quantities(self) -> Iterator[tuple[str, Quantity, bool]]:
        """(column, quantity, withheld) of its structure and elements, as far as the plan names them."""
        for kind, target, quantity in self.structure:
            yield f"structure/{kind}/{target}", quantity, self.structure_withheld
        for element in self.elements:
            for name, quantity in element.parameters.items():
                yield f"{element.name}/{name}", quantity, element.withheld

    def to_dict(self, *, public: bool = False) -> dict[str, Any]:
        """As in a plan; without what is withheld if `public`."""
        entry: dict[str, Any] = {"name": self.name, "rig": self.rig, "weight": self.weight}
        optional = {
            "timestep": self.timestep,
            "integrator": self.integrator,
            "model_sha256": self.model_sha256,
        }
        entry |= {key: value for key, value in optional.items() if value}
        if not (public and self.structure_withheld):
            structure: dict[str, dict[str, Any]] = {}
            for kind, target, quantity in self.structure:
                structure.setdefault(kind, {})[target] = as_entry(quantity)
            entry |= {"structure": structure} if structure else {}
            entry |= {"structure_withheld": True} if self.structure_withheld else {}
        elements = [element.to_dict() for element in self.elements if not (public and element.withheld)]
        return entry | ({"elements": elements} if elements else {})


@dataclass(frozen=True)
class ExcitationPlan:
    """An excitation to choose from.

    Attributes:
        name: Name in the tables.
        signals: A signal's dictionary by actuator, with distributions.
        weight: Share of the records of the rigs it fits.
        rigs: Names of the rigs it fits; all where empty.
        prescribe: Joint that follows the one signal, which is its displacement, as `bench.rig.library.prescribe`.
    """

    name: str
    signals: Mapping[str, Nested]
    weight: float = 1.0
    rigs: tuple[str, ...] = ()
    prescribe: str = ""

    def __post_init__(self) -> None:
        if self.prescribe and tuple(self.signals) != (self.prescribe,):
            raise ParameterError(
                f"excitation '{self.name}' prescribes the motion of '{self.prescribe}' and needs one signal of that name; "
                f"it has {', '.join(self.signals)}"
            )

    def quantities(self) -> Iterator[tuple[str, Quantity]]:
        """(column, quantity) of every number and distribution."""
        for actuator, node in self.signals.items():
            yield from leaves(node, f"excitation/{actuator}")

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        entry: dict[str, Any] = {"name": self.name, "weight": self.weight}
        entry |= {"rigs": list(self.rigs)} if self.rigs else {}
        entry |= {"prescribe": self.prescribe} if self.prescribe else {}
        return entry | {"signals": {key: as_entry(node) for key, node in self.signals.items()}}


@dataclass(frozen=True)
class SensorPlan:
    """A set of sensors to choose from.

    Attributes:
        name: Name in the tables.
        chains: Stages by channel: a stage's dictionary by its type, with distributions.
        weight: Share of the records of the rigs it fits.
        rigs: Names of the rigs it fits; all where empty.
        withheld: The stages stand in the answers only.
    """

    name: str
    chains: Mapping[str, Mapping[str, Nested]]
    weight: float = 1.0
    rigs: tuple[str, ...] = ()
    withheld: bool = False

    def quantities(self) -> Iterator[tuple[str, Quantity, bool]]:
        """(column, quantity, withheld) of every number and distribution."""
        for channel, stages in self.chains.items():
            for stage, node in stages.items():
                for column, quantity in leaves(node, f"sensors/{channel}/{stage}"):
                    yield column, quantity, self.withheld

    def to_dict(self, *, public: bool = False) -> dict[str, Any]:
        """As in a plan; without the stages if `public` and withheld."""
        entry: dict[str, Any] = {"name": self.name, "weight": self.weight}
        entry |= {"rigs": list(self.rigs)} if self.rigs else {}
        entry |= {"withheld": True} if self.withheld and not public else {}
        if public and self.withheld:
            return entry
        stages = {
            channel: [{"type": kind, **as_entry(node)} for kind, node in named.items()]
            for channel, named in self.chains.items()
        }
        return entry | {"chains": stages}


def unique(what: str, names: list[str]) -> None:
    """Refuse names that come more than once."""
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"{what}: the name '{name}' comes more than once; give each its own")
