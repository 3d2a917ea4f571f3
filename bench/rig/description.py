"""The description of a rig: an MJCF model, the elements in it, and the settings it is simulated with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.recording import Channel
from bench.rig.building import INTEGRATORS, Built, build, parse, specify
from bench.rig.channels import rig_channels
from bench.rig.element import Element
from bench.rig.mjcf_files import mjcf_text
from bench.rig.structure import STRUCTURE


@dataclass(frozen=True, eq=False)
class Rig:
    """An MJCF model, the elements in it, and the settings it is simulated with.

    Attributes:
        name: Name, for messages and records.
        mjcf: The model as MJCF text.
        elements: The elements; names must differ.
        timestep: Integration step [s].
        integrator: "RK4" (order 4 for smooth laws; the default), "Euler", "implicit" or "implicitfast".
        structure: Changes of the MJCF's own numbers, made by `with_structure`.
        folder: Folder that meshes and includes of the MJCF are looked for in.
    """

    name: str
    mjcf: str = field(repr=False)
    elements: tuple[Element, ...] = ()
    timestep: float = 1e-3
    integrator: str = "RK4"
    structure: tuple[tuple[str, str, float], ...] = ()
    folder: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "elements", tuple(self.elements))
        names = [element.name for element in self.elements]
        if len(set(names)) != len(names):
            raise ModelError(
                f"rig '{self.name}' has elements of the same name: {names}; give each its own `name`"
            )
        if self.integrator not in INTEGRATORS:
            raise UnknownNameError("integrator", self.integrator, INTEGRATORS)
        if not (np.isfinite(self.timestep) and self.timestep > 0.0):
            raise ParameterError(
                f"timestep of rig '{self.name}' is {self.timestep} s; a positive number is expected"
            )

    @classmethod
    def from_file(cls, path: str | Path, *elements: Element, **settings: Any) -> Rig:
        """A rig from an MJCF file of the user's own.

        Args:
            path: The MJCF file.
            *elements: Elements on its named joints and fixed tendons.
            **settings: Other fields of the rig; the time step is the file's unless given here.

        Raises:
            ModelError: The file cannot be read or compiled.
        """
        file = Path(path)
        text = mjcf_text(file)
        settings.setdefault("folder", str(file.parent))
        if "timestep" not in settings:
            settings["timestep"] = float(parse(text, settings["folder"], str(file)).option.timestep)
        return cls(settings.pop("name", file.stem), text, elements, **settings)

    def with_(self, **changes: Any) -> Rig:
        """A copy with other fields; `elements` swaps the joint."""
        return replace(self, **changes)

    def with_element(self, element: Element) -> Rig:
        """A copy in which `element` stands in for the one of the same name, or is added where there is none."""
        if element.name in {present.name for present in self.elements}:
            return self.with_(
                elements=[element if present.name == element.name else present for present in self.elements]
            )
        return self.with_(elements=(*self.elements, element))

    def with_structure(self, **values: Mapping[str, float]) -> Rig:
        """A copy with other masses, stiffnesses, … in the model itself.

        Args:
            **values: One of mass [kg], inertia [kg m^2] (about the axis of its hinge, through its centre of mass) by body; stiffness,
                damping, frictionloss, armature by joint or (the first three) tendon.

        Example:
            >>> rig = Rig("slide", "<mujoco>…</mujoco>").with_structure(mass={"carriage": 2.0}, damping={"carriage": 1.5})
        """
        for kind in values:
            if kind not in STRUCTURE:
                raise UnknownNameError("structural quantity", kind, STRUCTURE)
        new = tuple(
            (kind, name, float(value)) for kind, named in values.items() for name, value in named.items()
        )
        kept = tuple(entry for entry in self.structure if entry[:2] not in {item[:2] for item in new})
        return replace(self, structure=kept + new)

    @cached_property
    def built(self) -> Built:
        """The compiled model, with its elements in place.

        Raises:
            ModelError: The MJCF does not compile, or an element does not fit it.
            UnknownNameError: An element names a joint, tendon or actuator that the model lacks.
            NativeError: A foreign callback is installed.
        """
        return build(self)

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model that is simulated, without drawings (shared: copy it before changing it)."""
        return self.built.model

    @cached_property
    def shaped(self) -> mujoco.MjModel:
        """The model that is simulated, with all shapes of its bodies, drawn ones as well."""
        return build(self, shapes=True).model

    @cached_property
    def scene(self) -> mujoco.MjModel:
        """The compiled model with everything that is drawn: same joints, actuators and sensors as `model`."""
        return build(self, drawings=True).model

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators that an excitation drives."""
        return self.built.actuators

    def element(self, name: str) -> Element:
        """The element called `name`."""
        for element in self.elements:
            if element.name == name:
                return element
        raise UnknownNameError(
            f"element of rig '{self.name}'", name, [element.name for element in self.elements]
        )

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of this rig's records, in order."""
        return tuple(rig_channels(self.built))

    def to_xml(self) -> str:
        """The model with its elements' numbers as MJCF, to be looked at or loaded elsewhere (then call `native.bind`)."""
        return specify(self, self.built).to_xml()

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key in self.__dataclass_fields__}
