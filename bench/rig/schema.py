"""Documents of rigs: a rig, its structure, its elements and what drives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from bench.documents import Count, Document, Label, Listed, Name, Number, Positive, Table, refuse, telling
from bench.errors import unknown_name
from bench.laws.schema import PlacedLaw
from bench.mjcf import IntegratorName, StructureName
from bench.rig.description import Rig
from bench.rig.element import Element
from bench.rig.library import chain_rig, damper_rig, joint_rig, laboratory_joint_rig, sdof_rig, six_dof_rig
from bench.signals import Excitation
from bench.signals.schema import ExcitationDocument

RIGS: Mapping[str, Callable[..., Rig]] = {
    "sdof": sdof_rig,
    "damper": damper_rig,
    "joint": joint_rig,
    "joint_laboratory": laboratory_joint_rig,
    "chain": chain_rig,
    "joint_6dof": six_dof_rig,
}
"""The rigs of the bench by name."""


def _known_rig(name: Any) -> Any:
    if isinstance(name, str) and name not in RIGS and not name.endswith(".xml"):
        refuse(unknown_name("rig (or path ending in .xml)", name, RIGS), unknown=True)
    return name


RigName = Annotated[
    Name,
    BeforeValidator(_known_rig),
    Field(json_schema_extra={"anyOf": [{"enum": list(RIGS)}, {"pattern": r"\.xml$"}]}),
]


class ElementDocument(PlacedLaw):
    """An element of a rig."""

    parameters: Table[Number] = Field(default_factory=dict)
    """Parameters of the law by name; the others at the law's defaults."""
    theta: Listed[Number] | None = None
    """All parameters in the order of the law, in the place of `parameters`."""

    @model_validator(mode="after")
    def _makes_an_element(self) -> ElementDocument:
        with telling():
            self.element()
        return self

    def element(self) -> Element:
        """The element."""
        law = self.found
        theta = law.theta(self.theta, **self.parameters)
        return Element(law, self.joints, theta, inputs=self.inputs, name=self.name, exact=self.exact)


class RigDocument(Document):
    """A rig: its structure, the elements in it, and what drives it."""

    entry_name = "a rig configuration"
    rig: RigName
    """A rig of the bench (sdof, damper, joint, joint_laboratory, chain, joint_6dof), or the path of an MJCF file."""
    name: Label = ""
    """Name, for messages and records."""
    timestep: Positive | None = None
    """Integration step [s]; the rig's own by default."""
    integrator: IntegratorName | None = None
    """Integrator; RK4 by default."""
    structure: dict[StructureName, Table[Number]] = Field(default_factory=dict)
    """Masses, stiffnesses, … of the model's bodies, joints and tendons, by kind and name."""
    elements: Listed[ElementDocument] = ()
    """The elements."""
    excitation: ExcitationDocument | None = None
    """What drives the rig."""
    experiment: dict[str, Any] | None = None
    """What a test is to find out, may do and measures; for `jointbench excite`, which checks it."""
    seed: Count | None = None
    """Seed of a random excitation."""

    def build(self, folder: str | Path = ".") -> Rig:
        """The rig.

        Args:
            folder: Folder that the path of an MJCF file is relative to.

        Raises:
            ModelError: The MJCF cannot be read.
            BenchError: The rig refuses its structure or elements.
        """
        elements = [entry.element() for entry in self.elements]
        settings = {key: value for key, value in self.given.items() if key in {"timestep", "integrator"}}
        settings = {key: value for key, value in settings.items() if value is not None}
        known = RIGS.get(self.rig)
        rig = (
            known(*elements, **settings)
            if known
            else Rig.from_file(Path(folder) / self.rig, *elements, **settings)
        )
        if self.structure:
            rig = rig.with_structure(**self.structure)
        return rig.with_(name=self.name) if self.name else rig

    @property
    def drive(self) -> Excitation | None:
        """The excitation; None where there is none."""
        return self.excitation.excitation() if self.excitation is not None else None
